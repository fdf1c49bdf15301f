"""Unique run folders, named by date and time."""

from __future__ import annotations

from itertools import count
from pathlib import Path
from typing import Any

from omegaconf import OmegaConf, read_write


def fresh_folder(path: Path) -> Path:
    """Create a new folder and return it; a number is appended when the path exists.

    Example:
        >>> import tempfile
        >>> folder = Path(tempfile.mkdtemp()) / "12-00-00_ball"
        >>> fresh_folder(folder).name, fresh_folder(folder).name
        ('12-00-00_ball', '12-00-00_ball_2')
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    for number in count(1):
        folder = path if number == 1 else path.with_name(f"{path.name}_{number}")
        try:
            folder.mkdir()
        except FileExistsError:
            continue
        break
    return folder


def place(config: Any, kind: str) -> None:
    """Create the folder of a run or sweep; add a number when it exists.

    A folder that a word names is the user's own business.

    Args:
        config: composed by Hydra, before it makes a folder.
        kind: ``run`` or ``sweep``.

    Raises:
        ConfigError: the run's name cannot be part of a folder's name.
        OSError: it cannot be made.
    """
    hydra, key = config.hydra, f"hydra.{kind}.dir"
    named = any(word.partition("=")[0].lstrip("+") == key for word in hydra.overrides.hydra)
    raw = OmegaConf.to_container(hydra[kind], resolve=False)
    assert isinstance(raw, dict)
    if named or "${now:" not in str(raw["dir"]):
        return
    folder = str(fresh_folder(Path(hydra[kind].dir)))
    with read_write(hydra):
        hydra[kind].dir = folder
        # jobs of a sweep are composed anew, from these words
        quoted = folder.replace("'", "\\'")
        hydra.overrides.hydra.append(f"{key}='{quoted}'")


def same_place(given: Any, folder: Path) -> bool:
    """Return whether a setting names a folder; False where it is not set.

    Example:
        >>> same_place("runs/a/", Path("runs/a")), same_place(None, Path("."))
        (True, False)
    """
    return given is not None and Path(str(given)).resolve() == folder.resolve()
