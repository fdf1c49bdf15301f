"""Typed settings of ``seals diagnose``."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from seals.field_roles import roles
from seals.robot.settings import LogRobotSettings
from seals.schema import count


@roles(data="name reader plan report without", read="log", write="out")
@dataclass(kw_only=True)
class DiagnoseSettings(LogRobotSettings):
    """Settings of a diagnosis: logs of one vehicle, and the output folder.

    Args:
        name: of the diagnosis, part of the run folder's name.
        log: log folder or file, or a list of them: of one vehicle, fitted together.
        reader: plug-in that reads the log.
        out: folder of the answer, or None for the run's folder.
        processes: that share the work; 0 for one per core.
        plan: whether to look for the flight that would settle what stays open.
        report: whether to write the page.
        without: effects to leave out of the nominal model that the log states: names of instances
            or of effects, ``waves`` for the waves.
    """

    name: str = "diagnose"
    log: Any = None
    reader: Any = None
    out: str | None = None
    processes: int = count(0, bounds=(0, 256))
    plan: bool = True
    report: bool = True
    without: list[str] = field(default_factory=list)
