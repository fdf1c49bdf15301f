"""Typed settings of ``seals convert``."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from seals.field_roles import roles
from seals.logs.axes import AxesSettings
from seals.robot.settings import LogRobotSettings


@roles(data="command points")
@dataclass(kw_only=True)
class MotorSettings:
    """Curve from commands to speeds or forces; see `seals.logs.motor_curve.MotorCurve`.

    What is left out comes from ``motors`` in ``datasheet.yaml``, else from the values themselves.

    Args:
        command: kind of the commands.
        range: commands at rest and at full speed.
        thrust_factor: weight of the quadratic term in the curve of thrust over command [1].
        points: rows of command and rotor speed [rad/s] or thruster force [N].
        full_voltage: voltage for which the points are valid [V].
        voltage_power: exponent of the voltage in the speed [1].
        order: index of the command for each rotor or thruster.
        reverse: indices of the commands that push against the axes of their thrusters.
    """

    command: str | None = None
    range: list[float] | None = None
    thrust_factor: float | None = None
    # whole numbers in nested lists are refused by a stricter type; `motor_curve` checks the numbers
    points: list[Any] | None = None
    full_voltage: float | None = None
    voltage_power: float | None = None
    order: list[int] | None = None
    reverse: list[int] | None = None


@roles(data="table name reader late", read="log map meta urdf", write="out", permission="replace")
@dataclass(kw_only=True)
class ConvertSettings(LogRobotSettings):
    """Settings of a conversion: foreign log, reader options, output folder.

    The robot's rotors turn motor commands into speeds; its ``datasheet.yaml`` says what is known of
    motors and sensors.

    Args:
        name: of the conversion, part of the name of Hydra's own folder.
        log: file or folder.
        out: log folder to write.
        reader: plug-in that reads the log.
        map: YAML file with fields of the reader, such as ``columns`` and ``units``.
        meta: YAML file with data of vehicle and sensors.
        urdf: description of the vehicle, copied to the log folder.
        axes: conventions of the log.
        motors: curve from motor commands to rotor speeds.
        late: delay of the time stamps of each channel [s].
        span: first and last time of the rows that are kept [s]; empty for all.
        rate: evenly spaced rows per second [Hz]; zero keeps the times of the log.
        table: name of the table: ``log.parquet`` or ``log.csv``.
        replace: whether an existing log folder may be replaced.
    """

    name: str = "convert"
    log: Any = None
    out: str | None = None
    reader: Any = None
    map: str | None = None
    meta: str | None = None
    urdf: str | None = None
    axes: AxesSettings = field(default_factory=AxesSettings)
    motors: MotorSettings = field(default_factory=MotorSettings)
    late: Any = None
    span: list[float] = field(default_factory=list)
    rate: float = 0.0
    table: str = "log.parquet"
    replace: bool = False
