"""Typed settings of ``seals plan``."""

from __future__ import annotations

from dataclasses import dataclass, field

from seals.field_roles import roles
from seals.sysid.report.settings import GivenLogsSettings


@roles(data="name between", read="diagnosis", write="out")
@dataclass(kw_only=True)
class PlanSettings(GivenLogsSettings):
    """Settings of a plan: effects to tell apart, and the log or diagnosis they come from.

    Logs and what was left out of the stated model are those of the diagnosis, unless given.

    Args:
        name: of the plan, part of the run folder's name.
        between: effects to distinguish, ``effects=[NAME,NAME]`` on the command line; by default
            those of the diagnosis.
        diagnosis: folder of an earlier diagnosis, or its file.
        out: folder of the plan, or None for the run's folder.
        seed: seed of gusts and noise in the simulated flights.
    """

    name: str = "plan"
    between: list[str] = field(default_factory=list)
    diagnosis: str | None = None
    out: str | None = None
    seed: int = 0
