"""Typed settings of ``seals view``."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from seals.field_roles import roles
from seals.run.settings import RunSettings

OWN = ("run", "show", "sliders", "host", "port")
"""Keys of a session that a run does not have."""


@roles(data="show sliders", read="run", address="host port")
@dataclass(kw_only=True)
class ViewSettings(RunSettings):
    """Settings of a viewed run.

    Args:
        run: folder of a finished run to replay; absent starts a new run.
        show: viewer that shows it.
        sliders: parameters with a slider on the page, ``KEY`` or ``KEY:LOW:HIGH``; empty
            chooses coefficients of the effects.
        host: address to listen on; the default serves only this machine.
        port: port to listen on, 0 for any free port.
    """

    run: str | None = None
    show: Any = None
    sliders: list[str] = field(default_factory=list)
    host: str = "127.0.0.1"
    port: int = 8080
