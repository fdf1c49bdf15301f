"""Model of a vehicle along its log, with the parameters of all candidate effects."""

from __future__ import annotations

import copy
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.batch import BatchDynamics, Rates, TwinState
from seals.batch.state import Posture
from seals.control.actuator_response import respond
from seals.effects.binding import EffectSet, bind_effects, changes_commands, has_hook
from seals.effects.derived import strengths_of
from seals.effects.effect import Effect, Timed
from seals.effects.hooks import names_any, pick_of
from seals.motion import Inputs, Joints, Reading
from seals.registry import get
from seals.schema import parameters_of
from seals.sysid.candidates.activity import ACTIVE, Activity
from seals.sysid.candidates.parameters import Candidate, CandidateSet
from seals.sysid.data.known_sea import sea_of
from seals.sysid.data.samples import Samples
from seals.sysid.data.vehicle import Vehicle
from seals.world.drivetrain import command_laws_of, commanded

Values = Mapping[str, Any]
"""Changes by parameter key: numbers, or arrays over the batch."""

_KEPT = 12
"""Timings of the actuators that are kept."""


@dataclass(frozen=True, kw_only=True)
class Drive:
    """Actuator states at the start, middle and end of every integration step.

    Args:
        at: shape (T, 2 parts + 1, n).
        delay: of all commands, those to the joints among them [s].
    """

    at: Floats
    delay: float = 0.0


class Held(Enum):
    """Choice of the joint command at a row, given that commands are held between rows."""

    step = "the mean over the step that begins at a row"
    ends = "that at a row of which the mean of two rows is the mean over the step between"
    row = "what is in force at the row itself"


class ExtendedModel:
    """Model of a vehicle with all candidate parameters, evaluated at rows of a log.

    Args:
        vehicle: stated model.
        candidate_set: parameters and instances.
        samples: the log.
        parts: integration steps per row.

    Attributes:
        timed: instances that change the timing of the actuators, or their commands.
        command_delay: delay of all commands besides that of those instances [s].
        activity: when the effects act that do so for a time, by the keys of their parameters.
        half_step_readings: step of a simulation whose half steps the inertial readings follow
            [s], see `seals.sysid.predictors.sensor_readings.as_simulated`; 0 for none.
    """

    def __init__(
        self, vehicle: Vehicle, candidate_set: CandidateSet, samples: Samples, *, parts: int
    ) -> None:
        self.vehicle, self.candidate_set, self.samples, self.parts = (
            vehicle,
            candidate_set,
            samples,
            parts,
        )
        self._nominal = tuple(vehicle.effects)
        self._sets: dict[frozenset[str], EffectSet] = {}
        self._drives: dict[tuple[Any, ...], Drive] = {}
        self.waves = vehicle.sea or get("wave", "still").load()()
        effects = candidate_set.effects
        self._stiff = {
            n
            for n, e in effects.items()
            if e.stiff
            and has_hook(e, "joint_loads")
            and not names_any(e, "joint_loads", ("motion", "medium"))
        }
        self._quiet = {
            n
            for n, e in effects.items()
            if any(has_hook(e, h) for h in ("measure", "pose_turn", "timing"))
        }
        self._turning = {n for n, e in effects.items() if has_hook(e, "pose_turn")}
        self._commanding = frozenset(n for n, e in effects.items() if changes_commands(e))
        timing = {
            n
            for n, e in effects.items()
            if has_hook(e, "timing") and any(_timing_of(e, dict.fromkeys(parameters_of(e), 1.0)))
        }
        self.timed = self._commanding | timing
        self.command_delay = 0.0
        # implicit servos answer a jump of their command up to a step late, which undoes that
        resting = not np.ptp(samples.joint_command, axis=0).any()
        self.half_step_readings = (vehicle.simulated_step or 0.0) if resting else 0.0
        self.activity: Mapping[str, Activity] = {}
        self._weights: dict[bool, dict[str, Floats]] = {False: {}, True: {}}

    def of(self, candidate_set: CandidateSet, *, parts: int = 0) -> ExtendedModel:
        """Return the model of the same vehicle and log with other candidates, or finer steps.

        Args:
            candidate_set: parameters and instances.
            parts: integration steps per row; as many as here when left out.
        """
        return ExtendedModel(self.vehicle, candidate_set, self.samples, parts=parts or self.parts)

    def acting(self, candidates: Sequence[Candidate]) -> ExtendedModel:
        """Return the plant with some effects restricted to their active times."""
        activity = {k: c.activity for c in candidates if c.activity for k in c.all_keys}
        if activity == self.activity:
            return self
        other = copy.copy(self)
        other.activity = activity
        other._weights = {
            over_steps: {
                k: a.weights(self.samples, over_steps=over_steps) for k, a in activity.items()
            }
            for over_steps in (False, True)
        }
        return other

    def applied(self, values: Values, batch: int, *, over_steps: bool = False) -> Values:
        """Return parameter changes by model key, as arrays where they are active for a time.

        Args:
            values: changes by parameter key.
            batch: rows, those of the log once or several times over.
            over_steps: for the step after each row; else for the row.
        """
        if not any(k.endswith(ACTIVE) for k in values):
            return values
        out = {k: v for k, v in values.items() if not k.endswith(ACTIVE)}
        for key, weights in self._weights[over_steps].items():
            if key in values:
                own = key.removesuffix(ACTIVE)
                out[own] = out.get(own, 0.0) + values[key] * np.resize(weights, batch)
        return out

    def drive(self, values: Values) -> Drive | None:
        """Actuator states with commands, delays and time constants of ``values`` (numbers)."""
        if not len(self.vehicle.lag):
            return None
        changed = {k: v for k, v in values.items() if _instance(k) in self._commanding}
        timing, key = self.timing(values), tuple(sorted(changed.items()))
        if (timing, key) not in self._drives:
            if len(self._drives) >= _KEPT:
                del self._drives[next(iter(self._drives))]
            self._drives[timing, key] = self._respond(*timing, self.commanding(changed))
        return self._drives[timing, key]

    def commanding(self, values: Values) -> EffectSet:
        """Return the effects of the model, and those of ``values`` (numbers) on its commands."""
        chosen = {k: v for k, v in values.items() if _instance(k) in self._commanding}
        bound = self._bound({_instance(k) for k in chosen})
        return bound.with_values({k: self.total(k, v) for k, v in chosen.items()}, np.zeros(1), 1)

    def timing(self, values: Values) -> tuple[float, float, float]:
        """Command delay, change and asymmetry of the actuator time constant [s].

        Args:
            values: changes by parameter key, numbers.
        """
        delay, lag, asymmetry = self.command_delay, 0.0, 0.0
        for instance in {k.partition(".")[0]: None for k in values}:
            if instance not in self.timed - self._commanding:
                continue
            effect = self.candidate_set.effects[instance]
            timing = _timing_of(
                effect, {p: values.get(f"{instance}.{p}", 0.0) for p in parameters_of(effect)}
            )
            delay += timing[0]
            lag += timing[1]
            asymmetry += timing[2]
        return delay, lag, asymmetry

    @property
    def reading_size(self) -> int:
        """Columns of a reading: inertial sensors, and the turn of the pose if an effect has one."""
        return 9 if self._turning else 6

    def changes_readings(self, instance: str) -> bool:
        """Return true if an instance changes readings, of the pose also, but not the motion."""
        effect = self.candidate_set.effects.get(instance)
        return instance in self._quiet - self.timed if effect is not None else False

    def _respond(self, delay: float, lag: float, asymmetry: float, effects: EffectSet) -> Drive:
        samples, parts = self.samples, 2 * self.parts
        command: Any = commanded(samples.command, command_laws_of(effects, samples.command))
        tau = np.maximum(self.vehicle.lag + lag - asymmetry, 1e-4)
        fall = self.vehicle.fall
        fall = self.vehicle.lag if fall is None and asymmetry else fall
        at = np.zeros((samples.rows, parts + 1, len(tau)))
        for first, last in samples.runs:
            states = respond(
                command[first:last],
                samples.step,
                lag=tau,
                fall=None if fall is None else np.maximum(fall + lag + asymmetry, 1e-4),
                delay=max(self.vehicle.command_latency + delay, 0.0),
                parts=parts,
            )
            at[first:last, :-1] = states
            at[first : last - 1, -1] = states[1:, 0]
            at[last - 1, -1] = states[-1, -1]
        return Drive(at=at, delay=delay)

    def twin(
        self, values: Values, batch: int, *, stiff: bool = True, over_steps: bool = False
    ) -> BatchDynamics:
        """Batch dynamics of the stated model changed by ``values``.

        Args:
            values: numbers or arrays (batch,) by parameter key; those left out are zero.
            batch: rows.
            stiff: whether effects that are too steep for explicit steps take part.
            over_steps: whether the twin goes from row to row, see `applied`.
        """
        used = {key.partition(".")[0] for key in values} - self._quiet
        for instance in used & set(self.candidate_set.waves):
            used |= set(self.candidate_set.waves[instance].beside)
        if not stiff:
            used -= self._stiff
        bound = self._bound(used & set(self.candidate_set.effects))
        changes = self.applied(values, batch, over_steps=over_steps).items()
        given = {k: self.total(k, v) for k, v in changes if k.partition(".")[0] in bound.index}
        waves = self._waves(values, batch)
        twin = BatchDynamics(
            self.vehicle.robot, bound, self.vehicle.environment, waves, batch=batch, values=given
        )
        twin.evaluator.fed = self.samples.voltage is not None
        return twin

    def _bound(self, used: Collection[str], *, alone: bool = False) -> EffectSet:
        """Bind some effects, beside those of the stated model or alone, once for each choice."""
        chosen = frozenset(used) if alone else frozenset((*self._nominal, *used))
        if chosen not in self._sets:
            effects = {n: e for n, e in self.candidate_set.effects.items() if n in chosen}
            self._sets[chosen] = bind_effects(effects, self.vehicle.robot.links)
        return self._sets[chosen]

    def total(self, key: str, change: Any) -> Any:
        """Value of a parameter: that of its instance plus the change."""
        name, _, parameter = key.partition(".")
        nominal = float(getattr(self.candidate_set.effects[name], parameter))
        return nominal + change if np.ndim(change) else float(nominal + change)

    def _waves(self, values: Values, batch: int) -> Any:
        """Waves at ``values``, one per link of each vehicle; the stated waves without any."""
        for instance, waves in self.candidate_set.waves.items():
            own = {k.partition(".")[2]: v for k, v in values.items() if _instance(k) == instance}
            if not own:
                continue
            calm = waves.law.of_log(**dict.fromkeys(strengths_of(waves.law), 0.0))
            given = {name: self._tiled(value, batch) for name, value in own.items()}
            return sea_of(calm, given, self.samples.logs)
        return self.waves

    def _tiled(self, value: Any, batch: int) -> Floats:
        """Repeat a value for each link of each vehicle, links in blocks."""
        each = np.broadcast_to(np.asarray(value, dtype=float), (batch,))
        return np.tile(each, len(self.vehicle.robot.links))

    def inputs(
        self, rows: Any, drive: Floats | None, *, held: Held = Held.step, delay: float = 0.0
    ) -> Inputs:
        """Inputs of the model at some rows with given actuator states.

        Args:
            rows: of the log.
            drive: states of the actuators.
            held: the command that the joints follow.
            delay: of the commands to the joints [s].
        """
        samples, torque = self.samples, np.zeros((1, self.vehicle.robot.tree.joints))
        voltage = None if samples.voltage is None else samples.voltage[rows]
        joint = None
        if samples.joint_command.shape[1]:
            whole, share = _in_force(
                delay, samples.step, held, latency=self.vehicle.command_latency
            )
            newer, older = (np.maximum(rows - whole - k, samples.begins[rows]) for k in (0, 1))
            command = samples.joint_command
            joint = share * command[older] + (1.0 - share) * command[newer]
        return Inputs(0.0, torque, drive, voltage, joint)

    def rates(
        self,
        twin: BatchDynamics,
        state: TwinState,
        rows: Any,
        drive: Floats | None,
        posture: Posture | None = None,
    ) -> Rates:
        """State derivatives at rows of the log; rows may repeat, known poses are reused."""
        time = self.samples.clock[rows][:, None]
        return twin.rates(state, time, self.inputs(rows, drive, held=Held.row), posture)

    def advance(
        self,
        twin: BatchDynamics,
        state: TwinState,
        rows: Any,
        drive: Drive | None,
        torque: tuple[Floats, Floats] | None = None,
        *,
        posture: Posture | None = None,
    ) -> tuple[TwinState, Rates]:
        """States one row later, and the state derivatives at the start.

        Args:
            twin: of the model.
            state: at the rows.
            rows: of the log.
            drive: states of the actuators.
            torque: of the joints from outside the twin at the start and the end of the step, each
                (N, J); None for none.
            posture: at the rows, where it is known.
        """
        step = self.samples.step / self.parts
        first: Rates | None = None
        for part in range(self.parts):
            time = self.samples.clock[rows][:, None] + part * step
            at = []
            for i in range(3):
                inputs = (
                    self.inputs(rows, None)
                    if drive is None
                    else self.inputs(rows, drive.at[rows, 2 * part + i], delay=drive.delay)
                )
                if torque is not None:
                    late = (part + 0.5 * i) / self.parts
                    inputs = inputs._replace(
                        joint_torque=(1.0 - late) * torque[0] + late * torque[1]
                    )
                at.append(inputs)
            known = None if part else posture
            state, k1 = twin.advance(state, time, step, (at[0], at[1], at[2]), known)
            first = k1 if first is None else first
        assert first is not None
        return state, first

    def friction(self, values: Values, rates: Floats) -> Floats | None:
        """Joint torque of the stiff effects at given rates, shape (T, J); None without any."""
        used = {key.partition(".")[0] for key in values} & self._stiff
        if not used:
            return None
        changes = self.applied(values, len(rates)).items()
        given = {k: self.total(k, v) for k, v in changes if k.partition(".")[0] in used}
        bound = self._bound(used, alone=True).with_values(given, np.zeros(1), len(rates))
        joints, inputs = Joints(rates * 0.0, rates), Inputs(0.0, rates * 0.0)
        torque = np.zeros_like(rates)
        for b in bound.joint_loads:
            taken = (None, None, joints, inputs, None, b.params)
            torque = torque + b.hooks.joint_loads(*pick_of(b.effect, "joint_loads")(taken))[0]
        return torque

    def reading(self, state: TwinState, rates: Rates, values: Values) -> Reading:
        """Return the inertial readings in sensor axes; values are numbers or arrays (N,)."""
        arm, spin = self.vehicle.imu_position, state.angular_velocity
        force = rates.specific_force
        if np.any(arm):
            force = (
                force + np.cross(rates.angular_velocity, arm) + np.cross(spin, np.cross(spin, arm))
            )
        turn = self.vehicle.imu_turn.T
        turned = spin @ turn
        reading = Reading(turned, force @ turn, rates.angular_velocity @ turn, turned)
        used = {key.partition(".")[0] for key in values}
        effects = self.candidate_set.effects
        sensors = {n for n in used if n in effects and has_hook(effects[n], "measure")}
        if not sensors:
            return reading
        changes = self.applied(values, len(state.angular_velocity)).items()
        given = {k: v for k, v in changes if k.partition(".")[0] in sensors}
        rows = len(state.angular_velocity)
        bound = self._bound(sensors, alone=True).with_values(given, np.zeros(1), rows)
        for b in sorted(bound.measures, key=lambda b: b.effect.order):
            reading = b.hooks.measure(reading, b.params)
        return reading

    def pose_turn(self, values: Values, rows: int) -> Floats | None:
        """Return the rotation vector of the measured against the true attitude, (rows, 3) [rad].

        None where no effect turns it.
        """
        if not self._turning:
            return None
        changes = self.applied(values, rows).items()
        given = {k: self.total(k, v) for k, v in changes if k.partition(".")[0] in self._turning}
        bound = self._bound(self._turning, alone=True).with_values(given, np.zeros(1), rows)
        turns = [b.hooks.pose_turn(b.params) for b in bound.bound]
        return np.broadcast_to(np.sum(turns, axis=0), (rows, 3))


def _timing_of(effect: Effect, values: Mapping[str, float]) -> tuple[float, float, float]:
    """Delay of commands, change and asymmetry of the lag [s] of a timed effect."""
    if not isinstance(effect, Timed):
        return 0.0, 0.0, 0.0
    timing = effect.timing({p: np.array([[float(v)]]) for p, v in values.items()})
    delay, lag, asymmetry = (
        float(np.ravel(x)[0]) for x in (timing.command_delay, timing.lag, timing.asymmetry)
    )
    return delay, lag, asymmetry


def _instance(key: str) -> str:
    return key.partition(".")[0]


def nonzero(values: Mapping[str, float]) -> dict[str, float]:
    """Return the changes that are not zero."""
    return {k: v for k, v in values.items() if v != 0.0}


def _in_force(delay: float, step: float, held: Held, *, latency: float) -> tuple[int, float]:
    """Delay of a command in whole rows, and the weight of the preceding command."""
    if held is Held.row:
        # a command arrives up to twice the mean latency late: the odds that this one has not
        behind = max(int(np.floor(delay / step)) + 1, 1)
        missing = delay + 2.0 * latency - behind * step
        return behind, float(np.clip(missing / (2.0 * latency), 0.0, 1.0)) if latency else 0.0
    late = max(delay / step + (1.0 if held is Held.ends else latency / step), 0.0)
    return int(late), late - int(late)
