"""Typed settings of ``seals plan``."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from seals.field_roles import roles


@roles(data="name effects reader", read="log diagnosis", write="out")
@dataclass(kw_only=True)
class PlanSettings:
    """Settings of a plan: effects to tell apart, and the log or diagnosis they come from.

    Args:
        name: of the plan, part of the run folder's name.
        effects: names of effects in the catalogue; those of the diagnosis when left out.
        log: log folder or file; that of the diagnosis when left out.
        diagnosis: folder of an earlier diagnosis, or its file.
        reader: plug-in that reads the log.
        out: folder of the plan, or None for the run's folder.
        seed: of gusts and noise in the rehearsals.
    """

    name: str = "plan"
    effects: list[str] = field(default_factory=list)
    log: Any = None
    diagnosis: str | None = None
    reader: Any = None
    out: str | None = None
    seed: int = 0
