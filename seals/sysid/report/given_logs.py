"""Input logs of a command: paths, content, expected run time."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from seals.errors import ConfigError, LogError
from seals.logs import refuse_if_bad
from seals.logs.log import Log

_MOST = 12
"""Logs that a refusal names."""
MOST_ROWS = 1_000_000
"""Most rows of a log that is diagnosed."""
_LONG = 20_000
_PACE = 0.03
"""Time for each row of a diagnosis, measured on the shipped flight of 1,800 rows [s]."""


def places_of(given: Any, *, key: str) -> list[Path]:
    """Return the paths of one log or of several.

    Args:
        given: one path or a list of them.
        key: under which they were given.

    Raises:
        ConfigError: there is none, one of them is not there, or one is given twice.
    """
    every = [given] if isinstance(given, str) else list(given)
    places = [Path(str(one)) for one in every]
    if not places:
        raise ConfigError(f"{key}=[] holds no log.\nGive a log folder, or several: {key}=[A,B]")
    seen: set[Path] = set()
    for place in places:
        if place.resolve() in seen:
            raise ConfigError(
                f"{key} holds {place} twice: its readings would count twice.\nGive every log once."
            )
        seen.add(place.resolve())
        if not place.exists():
            raise ConfigError(
                f"{key}={place}: there is no such file or folder.\nGive a log folder."
            )
    return places


def read_log(config: Any, place: Path) -> Log:
    """Read one log with the reader of a composed configuration.

    What the log does not say, the data sheet in the robot's folder may.

    Raises:
        ConfigError: there are several.
        LogError: there is none, or it cannot be used.
    """
    from seals.config.build import build
    from seals.run.equipment_metadata import datasheet_of

    logs = build(config.reader, where="reader").read(str(place))
    if not logs:
        raise LogError(f"log={place} holds no run.\nGive a log with a run.")
    if len(logs) > 1:
        raise ConfigError(
            f"log={place} holds {len(logs)} logs.\n"
            f"Give one of them: {', '.join(one.name for one in logs[:_MOST])}"
        )
    log: Log = logs[0]
    _tell_time(log)
    refuse_if_bad(log)
    if config.robot.folder:
        log = replace(log, meta={**datasheet_of(config.robot.folder), **log.meta})
    _tell_stated(log)
    return log


def _tell_stated(log: Log) -> None:
    """Print that numbers without a stated tolerance count as exact."""
    if log.meta.get("tolerance"):
        return
    print(
        f"log '{log.name}' states no tolerances: every number of the vehicle counts as exact, and "
        "what misses it as an effect.\nLet the flight write them: "
        f"seals new datasheet log={log.name} robot=FOLDER",
        file=sys.stderr,
    )


def _tell_time(log: Log) -> None:
    """Print the expected time of a long diagnosis; refuse one that takes far too long.

    Raises:
        LogError: it has more rows than allowed.
    """
    if log.rows > MOST_ROWS:
        raise LogError(
            f"log '{log.name}' has {log.rows:,} rows; its diagnosis would take about "
            f"{log.rows * _PACE / 3600.0:.0f} h.\n"
            f"Allowed: up to {MOST_ROWS:,} rows. Cut out the part that matters."
        )
    if log.rows > _LONG:
        words = f"about {log.rows * _PACE / 60.0:.0f} minutes"
        print(f"log '{log.name}': {log.rows:,} rows; {words} or more.", file=sys.stderr, flush=True)


def sources(places: Sequence[Path]) -> dict[str, Any]:
    """Path and checksum of the log; a list of them for several logs."""
    if len(places) == 1:
        return _source(places[0])
    return {"logs": [_source(place) for place in places]}


def _source(place: Path) -> dict[str, str]:
    from seals.sysid.validation.answer import log_digest

    try:
        return {"path": str(place.resolve()), "sha256": log_digest(place)}
    except LogError:
        # a foreign format has no table of its own
        return {"path": str(place.resolve())}


def make_folder(out: Path) -> None:
    """Create the output folder of a command.

    Raises:
        ConfigError: it cannot be made.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"out={out} is not a folder: {error}.\nGive another folder.") from error
