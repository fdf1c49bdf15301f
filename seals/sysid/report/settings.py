"""Typed settings of the input of all commands on logs, and of ``seals diagnose``."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from seals.field_roles import roles
from seals.robot.settings import LogRobotSettings
from seals.schema import count


@roles(data="reader without", read="log")
@dataclass(kw_only=True)
class GivenLogsSettings(LogRobotSettings):
    """Settings of the input that every command on logs reads in the same way.

    Args:
        log: log folder or file, or a list of logs of one vehicle to fit together.
        reader: plug-in that reads the logs.
        without: effects to leave out of the stated model: names of instances or of effects,
            ``waves`` for the waves.
    """

    log: Any = None
    reader: Any = None
    without: list[str] = field(default_factory=list)


@roles(data="name plan report", read="healthy", write="out")
@dataclass(kw_only=True)
class DiagnoseSettings(GivenLogsSettings):
    """Settings of a diagnosis: logs of one vehicle, and the output folder.

    Args:
        name: of the diagnosis, part of the run folder's name.
        healthy: logs of healthy flights of the vehicle, with which the log is compared instead of
            with its model: a list of them, or a list of such lists, one for each session.
        out: folder of ``diagnosis.json``, ``report.html`` and ``report.json``; None for the run's
            folder.
        processes: number of parallel processes; 0 for one per core.
        plan: whether to search for a manoeuvre that would distinguish the remaining effects.
        report: whether to write ``report.html`` beside ``diagnosis.json``.
    """

    name: str = "diagnose"
    healthy: Any = None
    out: str | None = None
    processes: int = count(0, bounds=(0, 256))
    plan: bool = True
    report: bool = True
