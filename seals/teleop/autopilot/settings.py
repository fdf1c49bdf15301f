"""Typed settings of ``seals autopilot``."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from seals.run.settings import RunSettings
from seals.schema import param

OWN = ("protocol", "host", "port", "timeout", "speed")
"""Keys of a session that a run does not have."""


class Protocol(enum.Enum):
    """Protocol of the autopilot: JSON of ArduPilot's SITL."""

    ardupilot = "ardupilot"


@dataclass(kw_only=True)
class AutopilotSettings(RunSettings):
    """Settings of a run that an external autopilot flies.

    Args:
        protocol: of the autopilot.
        host: address to listen on; the default is open to this machine alone.
        port: to listen on, 0 for any that is free; absent for the protocol's own.
        timeout: silence of the autopilot that ends the run [s].
        speed: simulated seconds in one second of the clock, at most; 0 for no limit.
    """

    protocol: Protocol = Protocol.ardupilot
    host: str = "127.0.0.1"
    port: int | None = None
    timeout: float = param(
        30.0, "s", bounds=(0.1, 1e5), tolerance=0.0, source="chosen: three repeats", fit=False
    )
    speed: float = param(1.0, "1", bounds=(0.0, 1e3), tolerance=0.0, source="chosen", fit=False)
