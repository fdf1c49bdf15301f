"""Input of every command on logs: paths, robot, content, and the words that give them again."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from seals.config.overrides import typed
from seals.errors import ConfigError, LogError
from seals.file_names import short_path
from seals.logs import refuse_if_bad
from seals.logs.log import Log
from seals.logs.native import TABLES
from seals.logs.reader import logs_by
from seals.logs.shipped import find_log, log_name
from seals.run.hidden import hide, holds
from seals.sysid.data.join import join_logs
from seals.sysid.data.robot_description import RobotDescription, describe_run, described
from seals.sysid.data.vehicle import acting
from seals.sysid.decision.verdict import Verdict

_MOST = 12
"""Logs that a refusal names."""
MOST_ROWS = 1_000_000
"""Most rows of a log that is diagnosed."""
_LONG = 20_000
_PACE = 0.03
"""Time for each row of a diagnosis, measured on the shipped flight of 1,800 rows [s]."""


def place_logs(config: Any) -> None:
    """Replace the short name of a shipped log by its path; refuse a path that does not exist."""
    from omegaconf import OmegaConf, open_dict

    with open_dict(config):
        if config.get("log") is not None:
            many = OmegaConf.is_list(config.log)
            found = [str(find_log(str(place))) for place in (config.log if many else [config.log])]
            if str((config.get("reader") or {}).get("_target_", "")).endswith(".ReaderNative"):
                for place in found:
                    home = Path(place)
                    marks = (*TABLES, "meta.yaml", "run.json")
                    folders = [home, *(home.iterdir() if home.is_dir() else ())]
                    if home.name not in TABLES and not any(
                        (f / name).exists() for f in folders for name in marks
                    ):
                        raise ConfigError(
                            f"log={home} is not a log folder: it contains neither {TABLES[0]} "
                            f"nor {TABLES[1]}.\nGive a log folder, or convert a recording: "
                            "seals convert log=FILE out=FOLDER"
                        )
            config.log = found if many else found[0]
        if config.get("healthy"):
            config.healthy = _shipped(config.healthy)
        if config.get("older"):
            config.older = [str(find_log(str(place), key="older")) for place in config.older]


def _shipped(healthy: Any) -> Any:
    """Return the paths of healthy logs, in lists of sessions as they were given."""
    from omegaconf import OmegaConf

    if OmegaConf.is_list(healthy):
        return [_shipped(part) for part in healthy]
    return str(find_log(str(healthy), key="healthy"))


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


@dataclass(frozen=True, kw_only=True)
class GivenLogs:
    """Logs of one vehicle as a command was given them.

    Args:
        config: composed configuration, of the fields of `GivenLogsSettings`.
        places: of the logs.
        robot: of ``robot=``, else of the run that wrote the first log; None for the vehicle of the
            metadata.
        without: effects that are left out of the stated model.
        strict: whether each of them must be there; those that an earlier command noted need not.
    """

    config: Any
    places: tuple[Path, ...]
    robot: RobotDescription | None
    without: tuple[str, ...] = ()
    strict: bool = True

    def read(self) -> tuple[Log, RobotDescription | None]:
        """Return all logs joined to one, and the robot, both without what is left out.

        Raises:
            ConfigError: the stated model does not hold what is to be left out of it.
            LogError: a log cannot be used, or they do not belong together.
        """
        logs, robot = self.each()
        return join_logs(logs), robot

    def each(self, *, sheet: bool = True) -> tuple[list[Log], RobotDescription | None]:
        """Return all logs by themselves, and the robot, both without what is left out.

        Args:
            sheet: whether to tell which logs state no tolerances.

        Raises:
            ConfigError: the stated model does not hold what is to be left out of it.
            LogError: a log cannot be used.
        """
        logs, robot = [], self.robot
        for place in self.places:
            log, robot = self._reduced(_read_log(self.config, place, sheet=sheet), robot)
            logs.append(log)
        return logs, robot

    def _reduced(
        self, log: Log, robot: RobotDescription | None
    ) -> tuple[Log, RobotDescription | None]:
        """Return a log and the robot without the effects that are left out."""
        from seals.config.plugin_lookup import plugin_name

        if not self.without:
            return log, robot
        entries, around = log.meta.get("baseline") or [], dict(log.meta.get("environment") or {})
        own = {} if self.robot is None else acting(self.robot, log.meta)
        acts = [{"name": plugin_name("effect", type(e)), "instance": k} for k, e in own.items()]
        known, wave = [*entries, *acts], around.get("wave")
        names = [n for n in self.without if self.strict or holds(n, known, wave)]
        gone, change = hide(names, known, wave, key="without")
        kept = [e for e in entries if str(e.get("instance", e["name"])) not in gone]
        meta = {**log.meta, "baseline": kept, "environment": around | change}
        if robot is not None:
            effects = {k: e for k, e in robot.effects.items() if k not in gone}
            robot = replace(robot, effects=effects)
        return replace(log, meta=meta), robot

    @property
    def log_words(self) -> str:
        """Word of the command line that gives the logs."""
        paths = [log_name(place) for place in self.places]
        return typed("log", paths[0] if len(paths) == 1 else paths)

    @property
    def robot_words(self) -> str:
        """Words that give the robot and what is left out, each behind a blank; empty for none."""
        words = [typed("robot", robot_name(self.config))] if self.config.robot.folder else []
        words += [typed("without", self.without)] if self.without else []
        return "".join(f" {word}" for word in words)


def given_logs(
    config: Any, given: Any = None, *, key: str = "log", noted: Sequence[str] = ()
) -> GivenLogs:
    """Return the input of a command on logs.

    Args:
        config: composed configuration, of the fields of `GivenLogsSettings`.
        given: one path or a list of them; those of the configuration when left out.
        key: under which they were given.
        noted: what an earlier command left out; the configuration rules over it.

    Raises:
        SealsError: a log is not there or given twice, or the robot cannot be used.
    """
    places = places_of(config.log if given is None else given, key=key)
    own = tuple(str(name) for name in config.without)
    return GivenLogs(
        config=config,
        places=tuple(places),
        robot=described(config) or describe_run(places[0]),
        without=own or tuple(noted),
        strict=bool(own),
    )


def robot_name(config: Any) -> str:
    """Return the value of ``robot=`` of a composed configuration."""
    return robot_word(str(config.robot.name), Path(config.robot.folder))


def robot_word(name: str, folder: Path) -> str:
    """Return the value of ``robot=``: an installed robot's name, or the folder of another one."""
    from seals.config.source import find_robot, robot_names

    if name in robot_names() and Path(find_robot(name).settings.folder) == folder:
        return name
    return str(short_path(folder))


def _read_log(config: Any, place: Path, *, sheet: bool = True) -> Log:
    """Read one log with the reader of a composed configuration.

    What the log does not say, the data sheet in the robot's folder may.

    Raises:
        ConfigError: there are several.
        LogError: there is none, or it cannot be used.
    """
    from seals.config.build import build
    from seals.run.equipment_metadata import datasheet_of

    logs = logs_by(build(config.reader, where="reader"), str(place))
    if not logs:
        raise LogError(f"log={place} holds no run.\nGive a log with a run.")
    if len(logs) > 1:
        raise ConfigError(
            f"log={place} holds {len(logs)} logs.\n"
            f"Give one of them: {', '.join(one.name for one in logs[:_MOST])}"
        )
    log = logs[0]
    _tell_time(log)
    refuse_if_bad(log)
    if config.robot.folder:
        log = replace(log, meta={**datasheet_of(config.robot.folder), **log.meta})
        if sheet and "environment" not in log.meta:
            raise ConfigError(
                f"robot={robot_name(config)} has no data sheet, and log '{log.name}' does not say "
                "in what environment it was recorded.\nWrite one into a robot folder of yours "
                f"(seals new robot NAME urdf=FILE): seals new datasheet log={log_name(place)} "
                "robot=FOLDER"
            )
    if sheet and not log.meta.get("tolerance"):
        robot = robot_name(config) if config.robot.folder else "FOLDER"
        words = shlex.join([f"log={log_name(place)}", f"robot={robot}"])
        print(
            f"log '{log.name}' states no tolerances: every number of the vehicle is assumed "
            "exact, and deviations are attributed to effects.\n"
            f"Estimate them from the flight: seals new datasheet {words}",
            file=sys.stderr,
        )
    return log


def _tell_time(log: Log) -> None:
    """Print the expected time of a long diagnosis; refuse one that takes far too long.

    Raises:
        LogError: it has more rows than allowed.
    """
    if log.rows > MOST_ROWS:
        raise LogError(
            f"log '{log.name}' has {log.rows:,} rows; its diagnosis would take about "
            f"{log.rows * _PACE / 3600.0:.0f} h.\n"
            f"Allowed: up to {MOST_ROWS:,} rows. Cut out the relevant part."
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


def without_start(log: Log) -> str:
    """Return what a log lacks for a diagnosis: where its motion begins; empty where it says that.

    Args:
        log: as it was converted.
    """
    posed = log.has("position") and log.has("orientation")
    if posed or log.meta.get("initial_state"):
        return ""
    lacking = " and ".join(n for n in ("position", "orientation") if not log.has(n))
    return (
        f"no diagnosis yet: the log has no {lacking}. Add them, or state initial_state of every "
        "run (docs/formats.md): seals convert ... meta=FILE"
    )


def bad_data(words: str) -> dict[str, Any]:
    """Return the answer about a log that cannot be used."""
    return {
        "verdict": Verdict.bad_data.value,
        "effects": [],
        "ambiguous_with": [],
        "next_experiment": None,
        "held_out_error": None,
        "reasons": [words],
    }


def make_folder(out: Path) -> None:
    """Create the output folder of a command.

    Raises:
        ConfigError: it cannot be made.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"out={out} is not a folder: {error}.\nGive another folder.") from error
