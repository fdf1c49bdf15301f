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
    urdf = path if path.is_file() and path.suffix in _DRAWN else None
    if path.is_dir():
        urdf = next(iter(sorted([*path.glob("*.urdf"), *path.glob("*/*.urdf")])), None)
    close = nearest(given, _folders(path.parent if "/" in given else Path()))
    if path.is_file() and (path.parent / "robot.yaml").is_file():
        what, advice = "is a file", f"Give its folder: robot={path.parent.as_posix()}"
    elif urdf is not None:
        name = urdf.stem.lower().replace("-", "_").replace(".", "_")
        what = "holds no robot.yaml"
        advice = f"Make a robot of the URDF first: seals new robot my_{name} urdf="
        advice += quote(str(urdf))
    elif given and path.exists():
        what = "is here, but holds no robot.yaml"
        advice = "Make one of a URDF: seals new robot NAME urdf=FILE, or see: seals list robot"
    elif path.suffix in _DRAWN:
        what = "is neither installed nor a file here"
        advice = "A robot is a folder. Make one of such a file: seals new robot NAME urdf=FILE"
    elif close is not None:
        what = "is neither installed nor a folder with robot.yaml"
        advice = f"Did you mean '{close}'?  Installed: {', '.join(installed)}"
    elif "/" in given:
        advice = suggestion(given, installed, label="Give such a folder, or one installed")
        return UnknownPlugin(
            f"robot={given}: there is no folder '{given}' that holds robot.yaml.\n{advice}"
        )
    else:
        what, advice = "is not installed", suggestion(given, installed, label="Installed")
        if given and nearest(given, installed) is None:
            what = "is neither installed nor a folder here"
            advice = f"Make your own: seals new robot NAME urdf=FILE.  {advice}"
    return UnknownPlugin(f"robot '{given}' {what}.\n{advice}")


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
        f"robot={given} is not one of your robot folders.\n"
        f"{hint}Make one: seals new robot NAME urdf=FILE"
    )


def _folders(place: Path) -> list[str]:
    """Robot folders in a place."""
    try:
        neighbours = list(place.iterdir())[:_MOST]
    except OSError:
        return []
    return [p.as_posix() for p in neighbours if (p / "robot.yaml").is_file()]
