"""Balance of a flight: mean thrusts that its commands ask of the drives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.effects.binding import has_hook
from seals.errors import LogError
from seals.logs.log import Log
from seals.logs.motor_curve import motor_curve, with_rotor_speeds
from seals.motion import Drives, Inputs
from seals.schema import parameters_of
from seals.sysid.data.vehicle import Vehicle

SIGNALS = "motor_pwm"
"""Channel of signals to the motors, from which thrusts follow by the stated motor curve."""
_FLOWN = 0.6
"""Share of its greatest height from which on a vehicle that stood on the ground counts as flown:
below it take-off and landing rule."""
_RUNNING = 0.5
"""Share of its median thrust above which a vehicle is carried by its drives."""
_SHORTEST = 2.0
"""Seconds that a leg lasts at least, for its mean to outweigh take-off and landing."""
_GAP = 1.0
"""Seconds on the ground that end a leg."""
_LEAST_HEIGHT = 0.1
"""Height that a vehicle must leave the ground by [m]."""
_NEXT = "Give the log of a flight, with take-off, flight and commands to all drives"


@dataclass(frozen=True, kw_only=True)
class DriveLayout:
    """Drives of a vehicle.

    Args:
        position: of the drives from the origin of the base link [m], shape (n, 3).
        radius: of their discs; zero if none is known [m], shape (n,).
        wrench: force [N] and torque [N m] per thrust of each drive, base axes, shape (6, n).
        limit: largest thrusts [N], shape (n,).
        mass: of the vehicle [kg].
        gravity: [m/s^2].
        signals: whether thrusts follow from signals to the motors, not from speeds or forces.
    """

    position: Floats
    radius: Floats
    wrench: Floats
    limit: Floats
    mass: float
    gravity: float
    signals: bool

    @property
    def weight(self) -> float:
        """Weight of the vehicle [N]."""
        return self.mass * self.gravity


@dataclass(frozen=True, kw_only=True)
class Balance:
    """Mean thrusts of one flight.

    Args:
        name: of the log.
        session: flights of one session share what differs from session to session.
        legs: mean thrusts between landings [N], shape (legs, n).
        travel: directions of the legs over ground, unit vectors or zero, shape (legs, 2).
        floats: whether water carries the vehicle, not its drives.
    """

    name: str
    session: int
    legs: Floats
    travel: Floats
    floats: bool = False

    @property
    def mean(self) -> Floats:
        """Thrusts [N], shape (n,)."""
        return np.asarray(self.legs.mean(axis=0))

    @property
    def turned(self) -> bool:
        """Whether it consists of two legs, there and back."""
        return len(self.legs) == 2 and float(self.travel[0] @ self.travel[1]) < -0.5


def layout_of(vehicle: Vehicle, log: Log) -> DriveLayout:
    """Return the drives of a vehicle as the commands of a log address them.

    Raises:
        LogError: it has no drives or no weight, or the log has no commands to them.
    """
    actuators = _actuators(vehicle)
    if not actuators:
        raise LogError(
            f"vehicle '{vehicle.name}' has no rotors or thrusters: healthy= compares the commands "
            "of the drives.\nGive the folder of the robot that was flown: robot=NAME"
        )
    if vehicle.environment.gravity == 0.0:
        raise LogError(
            f"log '{log.name}' states a gravity of zero: healthy= compares the weight carried "
            "by the drives.\n"
            "State environment.gravity in meta.yaml."
        )
    signals = not log.has(vehicle.commands) and log.has(SIGNALS)
    full = np.concatenate([np.asarray(a.limit, dtype=float) for a in actuators])
    each = _drives(actuators, full[None])
    limit = np.concatenate([drives.thrust[0] for drives in each])
    place = np.concatenate([drives.position for drives in each])
    axis = np.concatenate([drives.axis for drives in each])
    turn = np.concatenate([drives.torque[0] for drives in each]) / limit
    lever = np.cross(place, axis) + turn[:, None] * axis
    return DriveLayout(
        position=place,
        radius=np.concatenate([drives.radius for drives in each]),
        wrench=np.concatenate([axis, lever], axis=1).T,
        limit=limit,
        mass=float(vehicle.robot.mass.sum()),
        gravity=abs(float(vehicle.environment.gravity)),
        signals=signals,
    )


def balance_of(
    log: Log, vehicle: Vehicle, layout: DriveLayout, *, session: int = 0, inertial: bool = False
) -> Balance:
    """Return the mean thrusts of the legs of a flight.

    Equation:
        The mean over the rows of a leg of the nominal thrusts of its commands; with ``inertial``
        times g over the mean specific force, for in manoeuvres drives carry more than the weight.

    Args:
        log: of a flight.
        vehicle: that flew it.
        layout: its drives.
        session: number of its session.
        inertial: whether its accelerometer tells how much the drives carry.

    Raises:
        LogError: the log shows no flight, its commands do not fit the drives, or an axis of its
            accelerometer has no value in a leg.
    """
    thrusts = _thrusts(log, vehicle, layout)
    floats = _floats(log, vehicle, thrusts, layout)
    legs = _legs(log, thrusts, floats=floats)
    means = np.stack([thrusts[leg].mean(axis=0) for leg in legs])
    if inertial:
        force = log.channel("specific_force")
        for k, axis in enumerate("xyz"):
            if not all(np.isfinite(force[leg, k]).any() for leg in legs):
                raise LogError(
                    f"log '{log.name}': specific_force_{axis} has no value in flight.\n"
                    "Correct the channel, or leave it out: then commands alone are compared."
                )
        carried = [float(np.linalg.norm(np.nanmean(force[leg], axis=0))) for leg in legs]
        means = means * layout.gravity / np.array(carried)[:, None]
    place = _place(log)[:, :2]
    ways = np.stack([place[leg[-1]] - place[leg[0]] for leg in legs])
    size = np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-9)
    travel = np.nan_to_num(ways / size)
    return Balance(name=log.name, session=session, legs=means, travel=travel, floats=floats)


def has_inertial(log: Log) -> bool:
    """Return whether the log has the specific force along all axes."""
    return log.has("specific_force") and bool(
        np.isfinite(log.channel("specific_force")).any(axis=0).all()
    )


def _actuators(vehicle: Vehicle) -> list[Any]:
    return sorted(
        (e for e in vehicle.effects.values() if has_hook(e, "drives")),
        key=lambda e: e.first,
    )


def _drives(actuators: Sequence[Any], state: Floats) -> list[Drives]:
    """Drives of each actuator for commands that are reached, shape (T, n)."""
    inputs, found = Inputs(step=0.0, joint_torque=np.zeros((1, 0)), drive=state), []
    for actuator in actuators:
        values = {k: np.full((1, 1), float(getattr(actuator, k))) for k in parameters_of(actuator)}
        found.append(actuator.drives(inputs, {**values, **actuator.constants()}))
    return found


def _thrusts(log: Log, vehicle: Vehicle, layout: DriveLayout) -> Floats:
    """Nominal thrusts of the commands [N], held until the next one, shape (T, n)."""
    if layout.signals and log.has(SIGNALS):
        # the full speed of a rotor is that of its largest thrust
        full = [{"max_speed": w} for a in _actuators(vehicle) for w in np.asarray(a.limit)]
        log = with_rotor_speeds(log, motor_curve(log.meta.get("motors")), full)[0]
    if not log.has(vehicle.commands):
        raise LogError(
            f"log '{log.name}' has no channel '{vehicle.commands}'"
            f"{'' if layout.signals else f' (other logs have it, not {SIGNALS})'}.\n"
            "healthy= compares what the drives are commanded to do: give logs with their commands."
        )
    sent = log.channel(vehicle.commands)
    if sent.shape[1] != layout.limit.size:
        raise LogError(
            f"log '{log.name}': {vehicle.commands} has {sent.shape[1]} columns, the vehicle has "
            f"{layout.limit.size} drives.\nGive logs of one vehicle, and its folder: robot=NAME"
        )
    good = np.isfinite(sent)
    last = np.maximum.accumulate(np.where(good, np.arange(len(sent))[:, None], 0), axis=0)
    held = np.take_along_axis(sent, last, axis=0)
    for k in np.flatnonzero(~good.any(axis=0)):
        raise LogError(
            f"log '{log.name}': {vehicle.commands}_{k + 1} has no value.\n"
            "healthy= needs the commands of every drive: give a log with this column."
        )
    return np.concatenate([d.thrust for d in _drives(_actuators(vehicle), held)], axis=1)


def _floats(log: Log, vehicle: Vehicle, thrusts: Floats, layout: DriveLayout) -> bool:
    """Return whether water carries a vehicle: its hull is wetted at the median height.

    Thrust over weight tells only where no height does, or a vehicle with thrusters states no water:
    a stated mass may be wrong.

    Raises:
        LogError: the drives never run.
    """
    total = np.abs(thrusts).sum(axis=1)
    on = np.isfinite(total) & (total > 0.0)
    if not on.any():
        raise LogError(f"log '{log.name}' is not a flight: its drives never run.\n{_NEXT}.")
    height, level = _place(log)[on, 2], vehicle.environment.water_level
    if level is not None and vehicle.hull is not None and np.isfinite(height).any():
        above = level - float(np.nanmedian(height))
        return vehicle.hull.wetted((0.0, 0.0, 1.0), above).volume > 0.0
    swims = vehicle.has_water or vehicle.commands == "thruster_cmd"
    return swims and float(np.median(thrusts[on] @ layout.wrench[2])) < 0.5 * layout.weight


def _legs(log: Log, thrusts: Floats, *, floats: bool) -> list[NDArray[np.int64]]:
    """Rows of each leg: between take-off and landing, without both.

    Raises:
        LogError: there is none.
    """
    time, total = log.time, np.abs(thrusts).sum(axis=1)
    on = np.isfinite(total)
    # what floats does not stand on the ground where its drives rest
    if not floats:
        on &= total > _RUNNING * float(np.median(total[on & (total > 0.0)]))
        height = _place(log)[:, 2]
        resting = _resting(time, np.isfinite(total) & ~on, height)
        if resting.any():
            floor = float(np.median(height[resting]))
            top = float(np.nanquantile(height, 0.95)) - floor
            if top < _LEAST_HEIGHT:
                raise LogError(
                    f"log '{log.name}' is not a flight: it never leaves the ground by "
                    f"{_LEAST_HEIGHT:g} m.\n{_NEXT}; height is position_z, or estimated_position_z."
                )
            on &= height >= floor + _FLOWN * top
    rows = np.flatnonzero(on)
    parts = np.split(rows, np.flatnonzero(np.diff(time[rows]) > _GAP) + 1)
    legs = [part for part in parts if part.size and float(np.ptp(time[part])) >= _SHORTEST]
    if not legs:
        raise LogError(
            f"log '{log.name}' is not a flight: it never flies for {_SHORTEST:g} s.\n{_NEXT}."
        )
    return legs


def _resting(time: Floats, idle: NDArray[np.bool_], height: Floats) -> NDArray[np.bool_]:
    """Rows on the ground: drives idle for longer than `_GAP`, in the lower half of all heights.

    A command of zero that lasts shorter is no landing: readings are lost, or the vehicle falls.
    """
    out = np.zeros_like(idle)
    known = np.isfinite(height)
    rows = np.flatnonzero(idle & known)
    if not rows.size:
        return out
    middle = 0.5 * (float(np.min(height[known])) + float(np.quantile(height[known], 0.95)))
    # a stretch ends where the drives run again
    ends = np.flatnonzero(np.diff(np.cumsum(~idle)[rows]) > 0) + 1
    for part in np.split(rows, ends):
        long = float(np.ptp(time[part])) >= _GAP
        out[part] = long and float(np.median(height[part])) <= middle
    return out


def _place(log: Log) -> Floats:
    """Measured or estimated position [m], shape (T, 3); NaN where there is none."""
    for name in ("position", "estimated_position"):
        if log.has(name):
            return log.channel(name)
    return np.full((log.rows, 3), np.nan)
