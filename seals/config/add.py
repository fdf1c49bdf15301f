"""Typed settings of adding a diagnosed effect to a model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(kw_only=True)
class AddSettings:
    """A diagnosis, and the model that its effects become.

    Args:
        diagnosis: folder that ``seals diagnose`` wrote, or the file in it.
        name: of the new model.
        folder: in which models lie.
        base: model whose effects the new one keeps; a name or a file, or None.
        choose: which effect of an ambiguous answer to add, or None.
        accept: ``formula`` to add the formula found for a force that no effect explains, or None.
        log: log that was diagnosed, when the diagnosis does not name it or it has moved.
        reader: plug-in that reads the log.
        replace: whether a model of this name may be overwritten.
    """

    diagnosis: str | None = None
    name: str = ""
    folder: str = "models"
    base: str | None = None
    choose: str | None = None
    accept: str | None = None
    log: str | None = None
    reader: Any = None
    replace: bool = False
