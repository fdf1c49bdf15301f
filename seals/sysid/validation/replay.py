"""Replay of a log in the rigid-body simulator, window by window, from the measured trajectory."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.backend import Configuration
from seals.batch import TwinState
from seals.control.actuator_response import respond
from seals.frames import matrix_of, rotate
from seals.motion import Reading
from seals.sysid.data.samples import Samples
from seals.sysid.data.trajectory import Trajectory, difference
from seals.sysid.predictors.linearise import Dynamics, Prediction
from seals.sysid.predictors.windows import interpolation
from seals.sysid.validation.model import Model
from seals.sysid.validation.scene import VEHICLE, build_scene
from seals.world import World
from seals.world.drivetrain import response_of
from seals.world.felt import accelerations
from seals.world.readings import ReadingChain

STEP = 0.005
"""Longest step of the simulator [s]."""
ARM_STEP = 0.001
"""Longest step with joints, whose servos are stiff [s]."""


@dataclass(frozen=True, kw_only=True)
class Track:
    """Simulated readings of every window; W windows of K rows.

    Args:
        rows: of the log, shape (W, K).
        error: state of the simulator against the trajectory, shape (W, K, n).
        reading: of the inertial sensors, angular velocity and specific force, and the turn of the
            measured attitude where an effect turns it, (W, K, 6 or 9).
    """

    rows: NDArray[np.int64]
    error: Floats
    reading: Floats

    def prediction(self, dynamics: Dynamics, total: int) -> Prediction:
        """Convert the track to the predictions that the windows of a diagnosis use.

        Windows carry one-step errors on with their linear dynamics; taken back here, so that they
        end with exactly the states of the simulator.

        Args:
            dynamics: of those windows.
            total: rows of the log.
        """
        count = self.error.shape[2]
        width = self.reading.shape[2]
        defect, reading = np.zeros((total, count)), np.zeros((total, width))
        flat = self.rows[:, :-1]
        carried = np.einsum("wkij,wkj->wki", dynamics.transition[flat], self.error[:, :-1])
        defect[flat] = self.error[:, 1:] - carried
        felt = np.einsum("wkij,wkj->wki", dynamics.output_matrix[self.rows], self.error)
        own = np.concatenate([self.error[:, :, 9:12], felt], axis=2)
        reading[self.rows] = self.reading
        reading[self.rows, :6] -= own
        return Prediction(defect=defect, reading=reading)


def replay(
    model: Model,
    samples: Samples,
    trajectory: Trajectory,
    rows: NDArray[np.int64],
    *,
    prompt: bool = False,
    tell: Callable[[int], None] | None = None,
) -> Track:
    """Simulate every window under the logged commands, open loop, from the trajectory.

    Args:
        model: what acts.
        samples: the log.
        trajectory: where the windows start.
        rows: of the windows, shape (W, K).
        prompt: whether readings are reported at once, their delay being left to the windows.
        tell: takes the number of windows done.
    """
    usual = ARM_STEP if model.vehicle.robot.tree.joints else STEP
    most = model.vehicle.simulated_step or usual
    parts = max(1, int(np.ceil(samples.step / most - 1e-9)))
    delay = 0.0 if prompt else model.sensor_delay
    late = round(np.ceil(max(delay, 0.0) / samples.step - 1e-9))
    length = rows.shape[1]
    world = build_scene(model, step=samples.step / parts, rows=length * parts + 2)
    try:
        runner = _Runner(world, model, samples, trajectory, parts)
        states, felt = [], []
        for done, window in enumerate(rows, start=1):
            before = [runner.run(int(r), 1)[1] for r in window[0] - np.arange(late, 0, -1)]
            state, reading = runner.run(int(window[0]), length)
            states.append(state)
            felt.append(np.concatenate([*before, reading]))
            if tell is not None:
                tell(done)
    finally:
        world.close()
    flat = trajectory.state(rows.ravel())
    joined = TwinState(*(np.concatenate([s[i] for s in states]) for i in range(6)))
    error = difference(joined, flat).reshape(*rows.shape, trajectory.size)
    reading = reported(model, np.array(felt), late, delay / samples.step)
    return Track(rows=rows, error=error, reading=reading)


def _drive_states(model: Model, samples: Samples, *, parts: int) -> Floats | None:
    """States of all drives at every step of the simulator, shape (T, parts, n).

    The law is that of the drivetrain; it runs over the whole log, so that a window starts with
    rotors as they then were.
    """
    if not samples.command.shape[1]:
        return None
    response = response_of(model.bound)
    out = np.zeros((samples.rows, parts, len(response.lag)))
    command: Any = response.goal(samples.command, None)
    for first, last in samples.runs:
        out[first:last] = respond(
            command[first:last],
            samples.step,
            lag=response.lag,
            fall=response.fall,
            delay=model.command_delay,
            parts=parts,
        )
    return out


class _Runner:
    """World that restarts from the measured trajectory at every window."""

    def __init__(
        self, world: World, model: Model, samples: Samples, trajectory: Trajectory, parts: int
    ) -> None:
        self.latency = model.vehicle.command_latency
        self.mean_over = round((model.vehicle.simulated_step or 0.0) / world.step_size)
        self.world, self.samples, self.trajectory = world, samples, trajectory
        self.drive, self.parts = _drive_states(model, samples, parts=parts), parts
        self.actor = world.actors[VEHICLE]
        if samples.voltage is not None:
            # as measured: the model's battery is full again at the start of every window
            self.actor.battery, self.actor.evaluator.fed = None, True

    def run(self, first: int, length: int) -> tuple[TwinState, Floats]:
        """Return states at some rows and the readings of ideal sensors at the origin.

        Returns:
            States, and angular velocity, specific force and angular acceleration, and the angular
            velocity at the instant of these two, (length, 12).
        """
        first = max(first, 0)
        world, step = self.world, self.world.step_size
        world.reset({VEHICLE: placed(self.trajectory, first)})
        begin = float(self.samples.time[first])
        world.restore(world.snapshot()._replace(time=begin, steps=round(begin / step)))
        seen = [self.actor.body.read()]
        for k in range((length - 1) * self.parts + 2):
            row, part = min(first + k // self.parts, self.samples.rows - 1), k % self.parts
            self._command(row, part)
            world.step()
            seen.append(self.actor.body.read())
        return felt_at(
            stacked(seen),
            np.arange(length) * self.parts,
            step,
            self.actor.gravity,
            over=self.mean_over,
            straddle=not self.samples.joint_command.shape[1],
        )

    def _command(self, row: int, part: int) -> None:
        """Inputs of one step; joint commands arrive shortly after their row."""
        samples, actor = self.samples, self.actor
        if self.drive is not None:
            actor.drive = self.drive[row, part][None]
        if samples.voltage is not None:
            actor.voltage = samples.voltage[row][None]
        if samples.joint_command.shape[1]:
            late = min(self.latency / self.world.step_size, 1.0) if part == 0 else 0.0
            both = samples.joint_command[[max(row - 1, samples.begins[row]), row]]
            actor.joint_command = (late * both[0] + (1.0 - late) * both[1])[None]


def placed(state: TwinState, row: int) -> Configuration:
    """Return one state of a batch as a backend takes it, velocities in world axes."""
    turn = matrix_of(state.quaternion[row : row + 1])[0]
    return Configuration(
        position=state.position[row],
        quaternion=state.quaternion[row],
        velocity=turn @ state.velocity[row],
        angular_velocity=turn @ state.angular_velocity[row],
        joints=state.joints[row],
        joint_velocity=state.joint_velocity[row],
    )


def stacked(seen: Sequence[Configuration]) -> Configuration:
    """Return configurations of one body as one, shape (N, ...)."""
    return Configuration(*(np.array(x) for x in zip(*seen, strict=True)))


def felt_at(
    seen: Configuration,
    at: NDArray[np.int64],
    step: float,
    gravity: float,
    *,
    over: int = 0,
    straddle: bool = True,
) -> tuple[TwinState, Floats]:
    """Return states at some steps of a simulation, and the readings of ideal sensors at the origin.

    Args:
        seen: base and joints at the start and after every step, shape (N + 1, ...).
        at: numbers of the steps that begin at the rows of a log, from 0 on.
        step: of the simulation [s].
        gravity: [m/s^2].
        over: steps that make one of the simulation whose readings are followed; 0 for none.
        straddle: see `_at_rows`.

    Returns:
        States, and angular velocity, specific force and angular acceleration, and the angular
        velocity at the instant of these two, (rows, 12).
    """
    turn = matrix_of(seen.quaternion)
    rates = accelerations(seen, step)
    then = np.maximum(at - over, 0)
    if over:
        linear, angular = (_before_rows(rate, at, over) for rate in rates)
    else:
        linear, angular = (_at_rows(rate, at, straddle=straddle) for rate in rates)
    linear[:, 2] += gravity
    back, back_then = (turn[k].transpose(0, 2, 1) for k in (at, then))
    velocity, spin = rotate(back, seen.velocity[at]), rotate(back, seen.angular_velocity[at])
    force, angular = rotate(back_then, linear), rotate(back_then, angular)
    # no step lies before the first row
    force[0] += over * step * np.cross(spin[0], force[0])
    turning = rotate(back_then, seen.angular_velocity[then])
    felt = np.concatenate([spin, force, angular, turning], axis=1)
    parts = (seen.position[at], seen.quaternion[at], velocity, spin)
    return TwinState(*parts, seen.joints[at], seen.joint_velocity[at]), felt


def _at_rows(rate: Floats, at: NDArray[np.int64], *, straddle: bool) -> Floats:
    """Accelerations at rows, second order in the step.

    Args:
        rate: acceleration at the start of every step, shape (N, 3).
        at: number of the step that begins at each row.
        straddle: whether a row's value may use the step after it; where commands act at once they
            jump there, and the row was read before.
    """
    if straddle:
        return rate[at]
    return 2.0 * rate[np.maximum(at - 1, 0)] - rate[np.maximum(at - 2, 0)]


def _before_rows(rate: Floats, at: NDArray[np.int64], count: int) -> Floats:
    """Acceleration of the last step before each row, as the accelerometer of a run reads it.

    That of a longer step H is the second difference of places H apart: the mean of the shorter
    steps' with the weights of a triangle, whose middle lies H before the row.

    Args:
        rate: acceleration at the start of every step, shape (N, 3).
        at: number of the step that begins at each row.
        count: of steps that make one of the run.
    """
    out = np.zeros((len(at), rate.shape[1]))
    for back in range(1, 2 * count):
        share = (count - abs(back - count)) / count**2
        out += share * rate[np.maximum(at - back, 0)]
    # no step lies before the first row
    out[0] = 2.0 * rate[0] - rate[min(count, len(rate) - 1)]
    return out


def reported(model: Model, felt: Floats, late: int, delay: float) -> Floats:
    """Return the readings of the inertial sensors and the turn of the pose, (W, K, 6 or 9).

    Args:
        model: with its sensors' place, delay and errors.
        felt: at the origin, with ``late`` rows before every window, shape (W, late + K, 12).
        late: rows before.
        delay: of the sensors in rows.
    """
    vehicle = model.vehicle
    arm, turn = vehicle.imu_position, vehicle.imu_turn.T
    spin, force, rate, turning = np.split(felt, 4, axis=2)
    if np.any(arm):
        force = force + np.cross(rate, arm) + np.cross(turning, np.cross(turning, arm))
    both = np.concatenate([part @ turn for part in (spin, force, rate, turning)], axis=2)
    at = np.arange(late, both.shape[1]) - delay
    seen = between_rows(both, at)
    flat = seen.reshape(-1, 12)
    reading = Reading(*np.split(flat, 4, axis=1))
    for b in ReadingChain(model.bound).errors:
        reading = b.hooks.measure(reading, b.params)
    parts = [reading.angular_velocity, reading.specific_force]
    turns = [b.hooks.pose_turn(b.params) for b in model.bound.having("pose_turn")]
    if turns:
        parts.append(np.broadcast_to(np.sum(turns, axis=0), (len(flat), 3)))
    return np.concatenate(parts, axis=1).reshape(*seen.shape[:2], -1)


def between_rows(values: Floats, at: NDArray[np.floating[Any]]) -> Floats:
    """Interpolate values (W, K, k) at fractions of rows ``at`` (n,); ends continue straight."""
    chosen, weights = interpolation(values.shape[1], at)
    found: Floats = (weights[:, :, None] * values[:, chosen]).sum(axis=1)
    return found
