"""`seals doctor` and the start of `seals` say when another package wrote over this one's files."""

from __future__ import annotations

import base64
import hashlib
import sys
from pathlib import Path

import pytest

from seals.cli import doctor as doctor_module
from seals.cli import installed_files
from seals.cli.installed_files import overwritten, overwritten_by_other
from seals.cli.main import main

pytestmark = pytest.mark.usefixtures("elsewhere")


def installed(name: str, files: dict[str, str], home: Path) -> None:
    """Install a distribution of text files, with its record, as pip would."""
    lines = []
    for path, text in files.items():
        (home / path).parent.mkdir(parents=True, exist_ok=True)
        (home / path).write_text(text)
        code = base64.urlsafe_b64encode(hashlib.sha256(text.encode()).digest()).decode()
        lines.append(f"{path},sha256={code.rstrip('=')},{len(text)}")
    info = home / f"{name.replace('-', '_')}-9.9.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 9.9\n")
    (info / "RECORD").write_text("\n".join([*lines, f"{info.name}/RECORD,,"]) + "\n")


@pytest.fixture
def home(monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of installed packages that comes before all others."""
    place = Path("site").absolute()
    place.mkdir()
    monkeypatch.setattr(sys, "path", [str(place), *sys.path])
    return place


OURS = {"seals/__init__.py": "ours = 1\n", "seals/own.py": "ours = 2\n"}
THEIRS = {"seals/__init__.py": "theirs = 1\n", "seals/util.py": "theirs = 2\n"}


def test_a_package_as_installed_has_nothing_to_say(home: Path) -> None:
    """Both orders are told apart: what this package wrote last is its own."""
    installed("seals", THEIRS, home)
    installed("aam-seals", OURS, home)
    assert overwritten().words == ""
    assert overwritten_by_other() == ""


@pytest.mark.thorough
def test_what_overwrote_the_files_is_named(
    home: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The other package, installed afterwards, is named with a file and the way out."""
    installed("aam-seals", OURS, home)
    installed("seals", THEIRS, home)
    for words in (overwritten().words, overwritten_by_other()):
        assert "files of this package overwritten" in words
        assert "by seals 9.9: 1, such as seals/__init__.py" in words
        assert "environment of its own" in words
    assert main(["list", "wave"]) == 0
    assert "note: files of this package" in capsys.readouterr().err
    monkeypatch.setattr(doctor_module, "LOOKS", (doctor_module.files,))
    assert main(["doctor"]) == 1
    assert "FAULT" in capsys.readouterr().out


def test_files_that_are_gone_or_edited_are_named(home: Path) -> None:
    """The doctor looks at every file, also without another package."""
    installed("aam-seals", OURS, home)
    (home / "seals/own.py").unlink()
    assert overwritten().missing == ("seals/own.py",)
    (home / "seals/own.py").write_text("ours = 3\n")
    assert overwritten().changed == ("seals/own.py",)
    assert overwritten_by_other() == ""


def test_without_the_other_package_nothing_is_compared(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The start of every command stays quick."""
    installed("aam-seals", OURS, home)
    monkeypatch.setattr(installed_files, "_compared", lambda *_: pytest.fail("compared"))
    assert overwritten_by_other() == ""
