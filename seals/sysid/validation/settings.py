"""Typed settings of ``seals add`` and ``seals verify``."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from seals.field_roles import roles
from seals.sysid.report.settings import GivenLogsSettings


@roles(
    data="name choose accept",
    read="diagnosis base",
    write="folder",
    permission="replace",
)
@dataclass(kw_only=True)
class AddSettings(GivenLogsSettings):
    """Settings of ``seals add``: the diagnosis to read and the model to write.

    Logs and what was left out of the stated model are those of the diagnosis, unless given.

    Args:
        diagnosis: folder written by ``seals diagnose``, or its ``diagnosis.json``.
        name: of the new model.
        folder: folder of the models.
        base: model whose effects are included, as a name or a file, or None.
        choose: which effect of an ambiguous answer to add, or None.
        accept: ``formula`` to add the formula that was fitted to an unexplained force, or None.
        replace: whether a model of this name may be overwritten.
    """

    diagnosis: str | None = None
    name: str = ""
    folder: str = "models"
    base: str | None = None
    choose: str | None = None
    accept: str | None = None
    replace: bool = False


@roles(data="name model force", read="older", write="out")
@dataclass(kw_only=True)
class VerifySettings(GivenLogsSettings):
    """Settings of ``seals verify``: model, held-out log, and logs it must not make worse.

    Args:
        name: of the verification, part of the run folder's name.
        model: name or file of the model.
        older: further log folders of the same vehicle.
        out: folder of the results, or None for the run's folder.
        force: whether to use a model that was withdrawn.
    """

    name: str = "verify"
    model: Any = None
    older: list[str] = field(default_factory=list)
    out: str | None = None
    force: bool = False
