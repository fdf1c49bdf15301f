"""Typed settings of ``seals autopilot``."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import ClassVar

from seals.field_roles import roles
from seals.run.settings import RunSettings
from seals.schema import param, vector

OWN = ("protocol", "host", "port", "peer", "timeout", "speed", "hil")
"""Keys of a session that a run does not have."""


class Protocol(enum.Enum):
    """Protocol of the autopilot: JSON of ArduPilot's SITL, or MAVLink HIL of PX4."""

    ardupilot = "ardupilot"
    px4 = "px4"


@dataclass(kw_only=True)
class HilSettings:
    """Sensors and origin for PX4, with the white noise that its estimator requires.

    Args:
        origin: latitude [deg], longitude [deg] and altitude [m] of the world's origin.
        field: magnetic field of the place: north, east, down [T].
        accelerometer_noise: standard deviation of a reading [m/s^2].
        gyroscope_noise: likewise [rad/s].
        magnetometer_noise: likewise [T].
        pressure_noise: of the barometer [Pa].
        gps_rate: satellite fixes a second [Hz].
        gps_noise: of the horizontal position [m].
        gps_velocity_noise: of each component [m/s].
    """

    origin: list[float] = vector(
        (47.397742, 8.545594, 488.0), "deg, deg, m", bounds=(-1e4, 1e5), source="PX4's usual home"
    )
    field: list[float] = vector(
        (2.0e-5, 1.2e-6, 4.5e-5), "T", bounds=(-1e-3, 1e-3), source="IGRF-13, as magnetometer"
    )
    accelerometer_noise: float = param(
        0.02, "m/s^2", bounds=(0.0, 10.0), tolerance=0.0, source="chosen", fit=False
    )
    gyroscope_noise: float = param(
        1e-3, "rad/s", bounds=(0.0, 1.0), tolerance=0.0, source="chosen", fit=False
    )
    magnetometer_noise: float = param(
        3.5e-7, "T", bounds=(0.0, 1e-3), tolerance=0.0, source="chosen: as magnetometer", fit=False
    )
    pressure_noise: float = param(
        2.0, "Pa", bounds=(0.0, 1e4), tolerance=0.0, source="chosen: 0.2 m", fit=False
    )
    gps_rate: float = param(
        10.0, "Hz", bounds=(0.1, 100.0), tolerance=0.0, source="u-blox M8", fit=False
    )
    gps_noise: float = param(
        0.1, "m", bounds=(0.0, 100.0), tolerance=0.0, source="chosen", fit=False
    )
    gps_velocity_noise: float = param(
        0.05, "m/s", bounds=(0.0, 10.0), tolerance=0.0, source="u-blox M8 data sheet", fit=False
    )


@roles(address="host port peer")
@dataclass(kw_only=True)
class AutopilotSettings(RunSettings):
    """Settings of a run that an external autopilot flies.

    Args:
        protocol: protocol of the autopilot.
        host: address to listen on; the default is open to this machine alone.
        port: port to listen on, 0 for any free port; by default that of the protocol.
        peer: address of the autopilot; absent for any of this machine or of a private network.
        timeout: time without a packet from the autopilot that ends the run [s].
        speed: simulated seconds per second of real time, at most; 0 for no limit.
        hil: sensors for PX4.
    """

    protocol: Protocol = Protocol.ardupilot
    host: str = "127.0.0.1"
    port: int | None = None
    peer: str | None = None
    timeout: float = param(
        30.0, "s", bounds=(0.1, 1e5), tolerance=0.0, source="chosen: three repeats", fit=False
    )
    speed: float = param(1.0, "1", bounds=(0.0, 1e3), tolerance=0.0, source="chosen", fit=False)
    hil: HilSettings = field(default_factory=HilSettings)

    several: ClassVar[bool] = False
