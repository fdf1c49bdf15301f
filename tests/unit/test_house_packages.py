"""Every mapped folder is a package, or the wheel silently leaves it out."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDERS = ("seals", "plugins", "robots", "animals", "conf", "experiments")
ENDINGS = {".py", ".yaml", ".urdf", ".obj", ".stl", ".jinja", ".parquet"}


def left_out(root: Path) -> list[str]:
    """Find folders with code or data and no ``__init__.py``, which the build passes by."""
    found = set()
    for top in FOLDERS:
        for path in (root / top).rglob("*"):
            if path.suffix in ENDINGS and not (path.parent / "__init__.py").is_file():
                found.add(str(path.parent.relative_to(root)))
    return sorted(found)


def test_every_folder_is_installed() -> None:
    """No folder with code or data lacks its ``__init__.py``."""
    assert left_out(ROOT) == []


def test_the_package_rule_bites(tmp_path: Path) -> None:
    """A folder of modules and one of configuration are found without their ``__init__.py``."""
    for name in ("seals/compare/case.py", "conf/wave/still.yaml", "seals/logs/__init__.py"):
        (tmp_path / name).parent.mkdir(parents=True)
        (tmp_path / name).touch()
    assert left_out(tmp_path) == ["conf/wave", "seals/compare"]
