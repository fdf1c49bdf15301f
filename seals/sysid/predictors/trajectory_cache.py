"""Cache of model evaluations along a trajectory."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.batch import Rates, TwinState
from seals.batch.response import Force, Response
from seals.batch.state import Posture
from seals.batch.tree import TreeBody
from seals.effects.binding import EffectSet, bind_effects, has_hook
from seals.effects.hooks import Hook
from seals.motion import Inputs
from seals.sysid.candidates.activity import ACTIVE
from seals.sysid.data.trajectory import Trajectory, difference
from seals.sysid.predictors.extended_model import ExtendedModel, Held, nonzero

_DRIVING: tuple[Hook, ...] = ("drives", "actuation", "drive_loads")
"""Hooks of effects that act on each other through the thrust."""
_KEPT = 6
"""Values whose predictions are kept."""
_EQUATIONS = 3
"""Values whose equations of motion are kept: those of a fit, and of its last trials."""
_ROUNDING = 1e-12
"""Difference of two commands to a joint by rounding alone, at most [rad or m]."""


@dataclass(frozen=True, kw_only=True)
class ExpansionPoint:
    """Exact step from every row at some values, about which predictions are expanded.

    Args:
        defect: state error after one step against the trajectory, shape (T, n).
        rate: accelerations at the rows, shape (T, 6 + J).
    """

    defect: Floats
    rate: Floats


class TrajectoryCache:
    """Cached evaluations of a plant at the states of a trajectory.

    Args:
        plant: extended model.
        trajectory: states at every row of its log.
    """

    def __init__(self, plant: ExtendedModel, trajectory: Trajectory) -> None:
        self.plant, self.trajectory = plant, trajectory
        self.rows = np.arange(plant.samples.rows)
        self.state: TwinState = trajectory.state(self.rows)
        self.time: Floats = plant.samples.clock[:, None]
        # shared by the plants in which effects act for a time: each has many models, one at a time
        self._responses: dict[tuple[ExtendedModel, Any], Response] = {}
        self._expansion_points: dict[Any, ExpansionPoint] = {}
        self._sensor_rates: dict[Any, Rates] = {}
        self._parts: dict[frozenset[str], EffectSet] = {}

    @cached_property
    def _posture(self) -> Posture:
        """Poses and surroundings of the stated model."""
        return self.plant.twin({}, len(self.rows)).posture(self.state, self.time)

    def release(self) -> None:
        """Release the memory of all evaluations: they are made again where they are asked for."""
        self.__dict__.pop("_posture", None)
        for kept in (self._responses, self._expansion_points, self._sensor_rates):
            kept.clear()

    def acting(self, plant: ExtendedModel) -> TrajectoryCache:
        """Return the cache of the same plant with other active times of effects."""
        other = copy.copy(self)
        other.plant, other._sensor_rates = plant, {}
        # what no such effect changes is known
        other._expansion_points = {
            key: point
            for key, point in self._expansion_points.items()
            if not any(k.endswith(ACTIVE) for k, _ in key)
        }
        return other

    def posture(self, values: Mapping[str, float]) -> Posture:
        """Poses and, where the water is still, surroundings."""
        if any(k.partition(".")[0] in self.plant.candidate_set.waves for k in values):
            return self._posture._replace(sample=None)
        return self._posture

    def inputs(self, values: Mapping[str, float], held: Held = Held.ends) -> Inputs:
        """Return the inputs at every row of the log."""
        drive = self.plant.drive(values)
        if drive is None:
            return self.plant.inputs(self.rows, None, held=held)
        return self.plant.inputs(self.rows, drive.at[:, 0], held=held, delay=drive.delay)

    def response(self, values: Mapping[str, float]) -> Response:
        """Return the equations of motion at given values; the latest are cached."""
        used = nonzero(values)
        key = self.plant, tuple(sorted(used.items()))
        if key not in self._responses:
            self._forget(self._responses, _EQUATIONS)
            twin = self.plant.twin(used, len(self.rows))
            self._responses[key] = Response(
                twin, self.state, self.time, self.inputs(used), self.posture(used)
            )
        return self._responses[key]

    def moved(
        self, values: Mapping[str, float], errors: Sequence[Floats], *, stiff: bool
    ) -> list[Floats] | None:
        """Return accelerations and specific force of a link tree at changed velocities.

        Args:
            values: changes by parameter key.
            errors: of the state, those of the pose zero, each (n,).
            stiff: whether effects that are too steep for explicit steps take part.

        Returns:
            One array (T, 9 + J) for each error; None for a single body, which has no such poses.
        """
        twin = self.plant.twin(values, len(self.rows), stiff=stiff)
        body, state, joints = twin.body, self.state, self.state.joints.shape[1]
        if not isinstance(body, TreeBody):
            return None
        drive = self.plant.drive(values)
        at = None if drive is None else drive.at[self.rows, 0]
        out = []
        for error in errors:
            other = state._replace(
                velocity=state.velocity + error[6:9],
                angular_velocity=state.angular_velocity + error[9:12],
                joint_velocity=state.joint_velocity + error[12 + joints :],
            )
            posture = body.moved(self._posture, other, self.time)
            out.append(packed(self.plant.rates(twin, other, self.rows, at, posture)))
        return out

    def sensor_rates(self, values: Mapping[str, float]) -> Rates:
        """Return the state derivatives that sensors read: servos follow the command at the row.

        A command that is held while its joint moves pushes least just before the next arrives.
        """
        if not self.plant.vehicle.servo:
            return self.response(values).rates
        used = nonzero(values)
        key = tuple(sorted(used.items()))
        if key not in self._sensor_rates:
            self._forget(self._sensor_rates)
            response, inputs = self.response(used), self.inputs(used, Held.row)
            # the same to rounding, as those at rest are
            same = (
                inputs.joint_command is response.inputs.joint_command
                if inputs.joint_command is None or response.inputs.joint_command is None
                else bool(
                    np.abs(inputs.joint_command - response.inputs.joint_command).max(initial=0.0)
                    < _ROUNDING
                )
            )
            self._sensor_rates[key] = response.rates if same else response.rates_under(inputs)
        return self._sensor_rates[key]

    def expansion_point(self, values: Mapping[str, float]) -> ExpansionPoint:
        """Return exact steps from every row at given values; the latest are cached."""
        used = nonzero(values)
        key = tuple(sorted(used.items()))
        if key not in self._expansion_points:
            self._forget(self._expansion_points)
            rate = accelerations(self.response(used).rates)
            self._expansion_points[key] = ExpansionPoint(defect=self._defect(used), rate=rate)
        return self._expansion_points[key]

    @staticmethod
    def _forget(kept: dict[Any, Any], most: int = _KEPT) -> None:
        """Remove the oldest entry to make room."""
        if len(kept) >= most:
            del kept[next(iter(kept))]

    def _defect(self, used: Mapping[str, float]) -> Floats:
        """State error after one step of the model from every row."""
        plant, trajectory, rows = self.plant, self.trajectory, self.rows
        torque = plant.friction(used, trajectory.joint_velocity)
        following = np.minimum(rows + 1, len(rows) - 1)
        pair = None if torque is None else (torque, torque[following])
        twin = plant.twin(used, len(rows), stiff=False, over_steps=True)
        drive = plant.drive(used)
        after, _ = plant.advance(twin, self.state, rows, drive, pair, posture=self.posture(used))
        return difference(after, trajectory.state(following))

    def changes(self, values: Mapping[str, float], keys: Sequence[str]) -> dict[str, Floats]:
        """Derivatives of accelerations and specific force by parameters, each (T, 9 + J)."""
        used, parameters = nonzero(values), self.plant.candidate_set.parameters
        base = self.response(used)
        alone = [k for k in keys if self._alone(k)]
        out: dict[str, Floats] = {}
        before: dict[str, Force] = {}
        forces = []
        for key in alone:
            instance, step = key.partition(".")[0], parameters[key].nudge
            if instance not in before:
                before[instance] = base.force(self._part(instance, used))
            moved = {**used, key: used.get(key, 0.0) + step}
            change = base.force(self._part(instance, moved)).less(before[instance])
            forces.append(change.over(step))
        if forces:
            out.update(zip(alone, base.changes(forces), strict=True))
        still = packed(base.rates)
        for key in (k for k in keys if k not in out):
            step = parameters[key].nudge
            moved = {**used, key: used.get(key, 0.0) + step}
            twin = self.plant.twin(moved, len(self.rows))
            out[key] = (
                packed(twin.rates(self.state, self.time, self.inputs(moved), self.posture(moved)))
                - still
            ) / step
        return out

    def pushed(self, values: Mapping[str, float], key: str) -> Floats:
        """Return the derivative of the one-step state error by a parameter, shape (T, n)."""
        used, step = nonzero(values), self.plant.candidate_set.parameters[key].nudge
        moved = nonzero({**used, key: used.get(key, 0.0) + step})
        out: Floats = (self._defect(moved) - self.expansion_point(used).defect) / step
        return out

    def _alone(self, key: str) -> bool:
        """Return true if a parameter changes only the loads of some effects."""
        instance = key.partition(".")[0]
        effect = self.plant.candidate_set.effects.get(instance)
        timed = instance in self.plant.timed
        return effect is not None and not timed and not has_hook(effect, "flow")

    def _part(self, instance: str, values: Mapping[str, float]) -> EffectSet:
        """Bind one effect with all effects of the same drive."""
        effects = self.plant.candidate_set.effects
        names = {instance}
        if _drives(effects[instance]):
            known = {*self.plant.vehicle.effects, *(k.partition(".")[0] for k in values)}
            names |= {n for n in known if n in effects and _drives(effects[n])}
        key = frozenset(names)
        if key not in self._parts:
            chosen = {n: e for n, e in effects.items() if n in names}
            self._parts[key] = bind_effects(chosen, self.plant.vehicle.robot.links)
        changes = self.plant.applied(values, len(self.rows)).items()
        given = {k: self.plant.total(k, v) for k, v in changes if k.partition(".")[0] in names}
        return self._parts[key].with_values(given, np.zeros(1), len(self.rows))


def _drives(effect: object) -> bool:
    """Return true if an effect acts through the thrust."""
    return any(has_hook(effect, hook) for hook in _DRIVING)


def accelerations(rates: Rates) -> Floats:
    """Linear, angular and joint accelerations, shape (T, 6 + J)."""
    out: Floats = np.concatenate(
        (rates.velocity, rates.angular_velocity, rates.joint_velocity), axis=1
    )
    return out


def packed(rates: Rates) -> Floats:
    """Linear, angular acceleration, specific force and joint accelerations, shape (T, 9 + J)."""
    parts = (rates.velocity, rates.angular_velocity, rates.specific_force, rates.joint_velocity)
    return np.concatenate(parts, axis=1)
