"""Resolution of ``robot=`` to a folder, with suggestions for a mistyped name."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from shlex import quote

from seals.errors import ConfigError, UnknownPlugin, nearest, suggestion

_DRAWN = (".urdf", ".xacro", ".sdf", ".xml")
"""Endings of files that a robot can be made of."""
_MOST = 200
"""Neighbours that are looked at."""


def unknown_robot(given: str, installed: Sequence[str]) -> UnknownPlugin:
    """Return the error for a robot that is neither installed nor a folder."""
    path = Path(given)
    if path.is_file() and (path.parent / "robot.yaml").is_file():
        return _refusal(given, "is a file", f"Give its folder: robot={path.parent.as_posix()}")
    urdf = _urdf(path)
    if urdf is not None:
        name = urdf.stem.lower().replace("-", "_").replace(".", "_")
        place = quote(str(urdf))
        advice = f"Make a robot of the URDF first: seals new robot my_{name} --urdf {place}"
        return _refusal(given, "holds no robot.yaml", advice)
    if given and path.exists():
        advice = "Make one of a URDF: seals new robot NAME --urdf FILE, or see: seals list robot"
        return _refusal(given, "is here, but holds no robot.yaml", advice)
    if path.suffix in _DRAWN:
        advice = "A robot is a folder. Make one of such a file: seals new robot NAME --urdf FILE"
        return _refusal(given, "is neither installed nor a file here", advice)
    folders = _folders(path.parent if "/" in given else Path())
    close = nearest(given, folders)
    if close is not None:
        return _refusal(
            given,
            "is neither installed nor a folder with robot.yaml",
            f"Did you mean '{close}'?  Installed: {', '.join(installed)}",
        )
    label = "Give such a folder, or one installed" if "/" in given else "Installed"
    return _refusal(
        given,
        f"there is no folder '{given}' that holds robot.yaml"
        if "/" in given
        else "is not installed",
        suggestion(given, installed, label=label),
    )


def own_robot(given: str) -> Path:
    """Return a robot folder that can be written to.

    Raises:
        ConfigError: it is no robot folder; the nearest one beside it is named.
    """
    folder = Path(given)
    if (folder / "robot.yaml").is_file():
        return folder
    close = nearest(given, _folders(folder.parent))
    hint = f"Did you mean '{close}'?  " if close else ""
    raise ConfigError(
        f"robot={given} is not a robot folder of yours.\n"
        f"{hint}Make one: seals new robot NAME --urdf FILE"
    )


def _refusal(given: str, what: str, advice: str) -> UnknownPlugin:
    if what.startswith("there is"):
        return UnknownPlugin(f"robot={given}: {what}.\n{advice}")
    return UnknownPlugin(f"robot '{given}' {what}.\n{advice}")


def _urdf(path: Path) -> Path | None:
    """Return the URDF at a path, or inside it."""
    if path.is_file():
        return path if path.suffix in _DRAWN else None
    if not path.is_dir():
        return None
    found = [*path.glob("*.urdf"), *path.glob("*/*.urdf")]
    return sorted(found)[0] if found else None


def _folders(place: Path) -> list[str]:
    """Robot folders in a place."""
    try:
        neighbours = list(place.iterdir())[:_MOST]
    except OSError:
        return []
    return [p.as_posix() for p in neighbours if (p / "robot.yaml").is_file()]
