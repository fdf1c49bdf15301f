"""Typed settings of one verification of a model on a log that no fit saw."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass(kw_only=True)
class VerifySettings:
    """A model, a log that it never saw, and logs that it must not make worse.

    Args:
        name: of the verification, part of the run folder's name.
        log: log folder.
        model: the model, chosen by name or file.
        older: further log folders of the same vehicle.
        reader: plug-in that reads the logs.
        out: folder of the answer, or None for the run's folder.
        force: whether to take a model that was withdrawn.
    """

    name: str = "verify"
    log: str | None = None
    model: Any = None
    older: list[str] = field(default_factory=list)
    reader: Any = None
    out: str | None = None
    force: bool = False
