"""Resolution of a log's path, or of the short name of a log shipped with the package."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from seals.errors import ConfigError, nearest
from seals.file_names import short_path
from seals.logs.native import TABLES

_HOME = "seals.experiments"
_RECORDINGS = (".ulg.gz", ".mcap", ".bin.gz")
_MOST = 2000
"""Neighbours of a mistyped path that are looked at for the nearest name."""


def shipped_logs() -> dict[str, Path]:
    """Return the logs that come with the package, folders and recordings, by short name.

    Example:
        >>> sorted(shipped_logs())[:2]
        ['hidden_effect/flight_a', 'hidden_effect/flight_b']
    """
    home = Path(str(resources.files(_HOME)))
    found = [table.parent for name in TABLES for table in home.glob(f"*/*/{name}")]
    found += [file for suffix in _RECORDINGS for file in home.glob(f"*/*{suffix}")]
    return {str(place.relative_to(home)): place for place in sorted(found)}


def find_log(given: str | Path, *, key: str = "log") -> Path:
    """Return the path of a log: an existing path, else the shipped log of that short name.

    Args:
        given: path, or short name such as ``hidden_effect/flight_a``.
        key: what the value was given for, named in the refusal.

    Raises:
        ConfigError: there is neither; it names what comes nearest.
    """
    if not str(given).strip():
        raise ConfigError(f"{key}= has no value.\nGive a log folder.")
    place = Path(given)
    try:
        there = place.exists()
    except (OSError, ValueError) as error:
        raise ConfigError(
            f"{key}={given!s:.80}: not a path ({error}).\nGive a log folder."
        ) from error
    if there:
        return place
    shipped = shipped_logs()
    name = str(given).strip("/")
    if name in shipped:
        return shipped[name]
    raise ConfigError(f"{key}={given}: there is no such file or folder.\n{_hint(place, shipped)}")


def log_name(place: Path) -> str:
    """Return what `find_log` takes for a log: its shipped short name, else its short path.

    Args:
        place: path of a log.

    Example:
        >>> log_name(find_log("hidden_effect/flight_a"))
        'hidden_effect/flight_a'
    """
    names = {path: name for name, path in shipped_logs().items() if not Path(name).exists()}
    return names.get(place, str(short_path(place)))


def _hint(place: Path, shipped: dict[str, Path]) -> str:
    """Return the nearest path or shipped log, and the list of shipped logs."""
    close = nearest(str(place), shipped)
    if close is None:
        found = nearest(place.name, _neighbours(place.parent))
        close = None if found is None else str(place.parent / found)
    hint = f"Did you mean '{close}'?  " if close else "Give a log folder.  "
    return f"{hint}Shipped: {', '.join(shipped)}"


def _neighbours(folder: Path) -> list[str]:
    try:
        # a log is a folder, or a table
        found = [p.name for p in folder.iterdir() if p.is_dir() or p.suffix in (".parquet", ".csv")]
    except OSError:
        return []
    return [name for name in found[:_MOST] if not name.startswith(".")]
