"""Vehicle of a log: nominal model, sensors and tolerances."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.control.actuator_response import JITTER
from seals.effects.identification import Subject
from seals.environment.seawater import FRESH_WATER
from seals.environment.settings import EnvironmentSettings
from seals.errors import LogError
from seals.frames import matrix_of
from seals.sysid.data.known_sea import known_sea
from seals.sysid.data.robot_description import RobotDescription, describe_log
from seals.sysid.data.robot_vehicle import parts_of


@dataclass(frozen=True, kw_only=True)
class Vehicle(Subject):
    """Vehicle of a log: nominal model, and the accuracy of its properties and sensors.

    Args:
        gust: level of unmodelled force [N] and torque [N m], shape (2,).
        gust_time: correlation time of the gusts [s].
        imu_position: of the inertial sensor, body axes [m], shape (3,).
        imu_turn: from body to sensor axes, shape (3, 3).
        initial_state: of each segment, when stated.
        columns: for each joint the index of its column in the log.
        written: key in ``robot.yaml`` of each effect that stands there.
        sea: known waves; None for calm water.
        fall: time constants of the actuators while they slow down [s], shape (n,); None for
            ``lag``.
        command_latency: mean time from the row of a command to its effect [s].
    """

    gust: Floats
    gust_time: float
    imu_position: Floats
    imu_turn: Floats
    initial_state: tuple[Mapping[str, Any], ...] = ()
    columns: tuple[int, ...] = ()
    written: Mapping[str, str] = field(default_factory=dict)
    sea: Any = None
    fall: Floats | None = None
    command_latency: float = JITTER

    @property
    def name(self) -> str:
        """Name of the vehicle."""
        return self.robot.name


def read_vehicle(
    meta: Mapping[str, Any],
    robot: RobotDescription | None = None,
    *,
    still: Mapping[str, float] | None = None,
) -> Vehicle:
    """Build the nominal model from the metadata of a log, and the robot's folder where given.

    Args:
        meta: of the log, or of several joined ones.
        robot: of the folder; it replaces the entry ``vehicle`` of the metadata.
        still: where the joints stand in a log in which none of them moves [rad or m].

    Raises:
        LogError: something needed is missing or of an unknown kind.
    """
    try:
        return _vehicle_of(meta, robot, still or {})
    except (AttributeError, LookupError, TypeError, ValueError, ArithmeticError) as cause:
        said = " ".join(f"{type(cause).__name__}: {cause}".split())[:200]
        raise LogError(
            f"meta.yaml describes no vehicle that can be understood ({said}).\n"
            "See the description of the native log format, or give the robot: robot=FOLDER"
        ) from cause


def _vehicle_of(
    meta: Mapping[str, Any], robot: RobotDescription | None, still: Mapping[str, float]
) -> Vehicle:
    description = describe_log(meta) if robot is None else robot
    environment = _environment(_part(meta, "environment"))
    parts = parts_of(description, environment, meta, still)
    step = (meta.get("simulated") or {}).get("step")
    sea, beside = known_sea(meta, environment)
    if sea is None and meta["environment"].get("wave") is not None:
        sea = description.sea
    imu = meta.get("sensors", {}).get("imu", {})
    channels = meta.get("sensors", {}).get("channels", {})
    gust = meta.get("disturbance") or {}
    return Vehicle(
        robot=parts.robot,
        effects={**parts.effects, **beside},
        environment=environment,
        lag=parts.lag,
        fall=parts.fall,
        commands=parts.commands,
        servo=parts.servo,
        columns=parts.columns,
        written=parts.written,
        full_voltage=_full_voltage(meta if robot is not None else meta["vehicle"]),
        sigma={k: float(v["sigma"]) for k, v in channels.items() if k in READ},
        tolerance={k: float(v["sigma"]) for k, v in meta.get("tolerance", {}).items()},
        gust=np.array([gust.get("force_sigma", 0.0), gust.get("torque_sigma", 0.0)], dtype=float),
        gust_time=float(gust.get("correlation_time", 0.35)),
        imu_position=np.asarray(imu.get("position", [0.0, 0.0, 0.0]), dtype=float),
        imu_turn=_turn(imu.get("orientation", [1.0, 0.0, 0.0, 0.0])),
        initial_state=tuple(meta.get("initial_state", ())),
        sea=sea,
        # a run of SEALS states its step, and its commands act at the time of their row
        command_latency=JITTER if step is None else 0.0,
        simulated_step=None if step is None else float(step),
    )


_MOST_VOLTS = 1e4
"""Largest voltage of a battery [V]: ten times that of any ship."""
READ = (
    "position",
    "orientation",
    "velocity",
    "angular_velocity",
    "specific_force",
    "depth",
    "joint_position",
    "battery_voltage",
)
"""Channels that a diagnosis reads; readings of other sensors are carried along."""


def _full_voltage(spec: Mapping[str, Any]) -> float | None:
    """Return the voltage of the full battery in a description [V]; None where it says nothing.

    Raises:
        LogError: it is no voltage.
    """
    found = (spec.get("battery") or {}).get("full_voltage")
    if found is None:
        return None
    number = isinstance(found, int | float) and not isinstance(found, bool)
    if not number or not 0.0 < found <= _MOST_VOLTS:
        raise LogError(
            f"battery.full_voltage={found!r:.60} is not allowed.\n"
            f"Allowed: a number above 0, up to {_MOST_VOLTS:g} [V]"
        )
    return float(found)


def _part(meta: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    part = meta.get(name)
    if not isinstance(part, Mapping):
        raise LogError(
            f"meta.yaml holds no '{name}'.\nA diagnosis needs vehicle, environment, baseline, "
            "sensors and tolerance; see the description of the native log format."
        )
    return part


def _environment(around: Mapping[str, Any]) -> EnvironmentSettings:
    return EnvironmentSettings(
        gravity=-float(around.get("gravity", [0.0, 0.0, -9.81])[2]),
        air_density=float(around.get("air_density", 1.2)),
        water_level=_maybe(around.get("water_level")),
        tank_bottom=_maybe(around.get("tank_bottom")),
        ground_level=_maybe(around.get("ground_level")),
        water_density=float(around.get("water_density", FRESH_WATER)),
    )


def _maybe(value: Any) -> float | None:
    return None if value is None else float(value)


def _turn(wxyz: Any) -> Floats:
    w, x, y, z = (float(c) for c in wxyz)
    turned: Floats = matrix_of(np.array([[x, y, z, w]]))[0].T
    return turned
