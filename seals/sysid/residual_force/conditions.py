"""Motion, medium and actuator wrench at the knots of the residual force."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from seals.arrays import Floats
from seals.effects.binding import bind_effects
from seals.effects.evaluation import thrust_wrench
from seals.environment.sample import Sample
from seals.frames import matrix_of
from seals.motion import Inputs
from seals.sysid.predictors.extended_model import ExtendedModel
from seals.sysid.predictors.trajectory_cache import TrajectoryCache
from seals.sysid.predictors.windows_fit import Fitter
from seals.sysid.residual_force.evidence import Evidence
from seals.sysid.residual_force.laws import Scene


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """Motion, medium and actuator wrench at the knots; n rows, window by window.

    Args:
        time: [s], shape (n,).
        position: world [m], shape (n, 3).
        turn: from body to world axes, shape (n, 3, 3).
        velocity: against the medium, body axes [m/s], shape (n, 3).
        spin: body axes [rad/s], shape (n, 3).
        submersion: submerged share of the hull [1], shape (n,).
        drive: wrench of the actuators, body axes [N, N m], shape (n, 6); None without actuators.
        drive_rate: its rate [N/s, N m/s], shape (n, 6).
        throttle: sum of the thrusts' sizes [N], shape (n,).
        voltage: of the battery [V], shape (n,); None when not known.
        ground: height of the ground [m]; None when there is none.
        water: height of the water surface [m]; None when there is none.
    """

    time: Floats
    position: Floats
    turn: Floats
    velocity: Floats
    spin: Floats
    submersion: Floats
    drive: Floats | None
    drive_rate: Floats | None
    throttle: Floats | None
    voltage: Floats | None
    ground: float | None
    water: float | None

    @property
    def speed(self) -> Floats:
        """Speed relative to the medium [m/s], shape (n,)."""
        out: Floats = np.linalg.norm(self.velocity, axis=1)
        return out

    @property
    def wet(self) -> bool:
        """Return true when the hull is under water at some time."""
        return bool(self.submersion.max() > 0.02)

    @property
    def crossing(self) -> bool:
        """Return true when the hull is sometimes in air and sometimes under water."""
        return self.wet and bool(self.submersion.min() < 0.98)

    def share(self, medium: str) -> Floats:
        """Fraction of the hull in a medium: water, air or any, shape (n, 1)."""
        table = {"water": self.submersion, "air": 1.0 - self.submersion}
        return table.get(medium, np.ones_like(self.submersion))[:, None]

    def scene(self, medium: str = "any") -> Scene:
        """Return the arguments of the formula's laws."""
        return Scene(
            time=self.time[:, None],
            position=self.position,
            rotation=self.turn,
            up=self.turn[:, 2, :],
            velocity=self.velocity,
            spin=self.spin,
            share=self.share(medium),
            drive=self.drive,
        )


def conditions(fitter: Fitter, found: Evidence) -> Conditions:
    """Return the conditions at the knots."""
    plant, trajectory = fitter.plant, fitter.trajectory
    rows = found.rows.ravel()
    turn = matrix_of(trajectory.quaternion[rows])
    cache = fitter.cache or TrajectoryCache(plant, trajectory)
    around = cache.response(found.values).sample
    wet, flow = (x[rows] for x in _medium(around, plant.samples.rows))
    wrench, throttle = _actuator_wrench(plant, found.values)
    rate = None
    if wrench is not None:
        rate = np.zeros_like(wrench)
        for first, last in plant.samples.runs:
            rate[first:last] = np.gradient(wrench[first:last], plant.samples.step, axis=0)
    voltage = plant.samples.voltage
    return Conditions(
        time=plant.samples.time[rows],
        position=trajectory.position[rows],
        turn=turn,
        velocity=trajectory.velocity[rows] - flow,
        spin=trajectory.angular_velocity[rows],
        submersion=wet,
        drive=None if wrench is None else wrench[rows],
        drive_rate=None if rate is None else rate[rows],
        throttle=None if throttle is None else throttle[rows],
        voltage=None if voltage is None or not np.any(voltage) else voltage[rows, 0],
        ground=plant.vehicle.environment.ground_level,
        water=plant.vehicle.environment.water_level if plant.vehicle.has_water else None,
    )


def _actuator_wrench(
    plant: ExtendedModel, values: Mapping[str, float]
) -> tuple[Floats | None, Floats | None]:
    """Return the nominal actuator wrench (T, 6) and the sum of absolute thrusts (T,)."""
    drive = plant.drive(values)
    if drive is None:
        return None, None
    actuators = {n: e for n, e in plant.vehicle.effects.items() if hasattr(e, "drives")}
    if not actuators:
        return None, None
    total, throttle = np.zeros((len(drive.at), 6)), np.zeros(len(drive.at))
    still = np.zeros((1, plant.vehicle.robot.tree.joints))
    for bound in bind_effects(actuators, plant.vehicle.robot.links).actuators:
        drives = bound.hooks.drives(Inputs(0.0, still, drive.at[:, 0]), bound.params)
        wrench = thrust_wrench(drives)
        total += np.concatenate([wrench.force, wrench.torque], axis=1)
        throttle += np.abs(drives.thrust).sum(axis=1)
    return total, throttle


def _medium(around: Sample, rows: int) -> tuple[Floats, Floats]:
    """Submerged share (T,) and velocity of the medium, body axes [m/s] (T, 3), at the base."""
    wet: Floats = around.submersion[:rows, 0] + np.zeros(rows)
    air, water = (v[:rows] for v in (around.air_velocity, around.water_velocity))
    return wet, (1.0 - wet)[:, None] * air + wet[:, None] * water
