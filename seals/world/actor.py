"""One robot in the world: its body in the backend, its effects, its sensors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Array, Floats
from seals.backend import Backend, Configuration, Dynamics
from seals.config.environment import EnvironmentSettings
from seals.dynamics.rows import link_motion
from seals.dynamics.tree import Kinematics
from seals.effects.binding import EffectSet
from seals.effects.evaluation import Evaluator
from seals.errors import ConfigError, suggestion
from seals.medium.build import build_surroundings, exact_of
from seals.motion import Inputs, Joints
from seals.robot.model import RobotModel
from seals.sensor import Felt, Sensor
from seals.waves import Waves
from seals.world.ledger import Ledger


class Actor:
    """A robot with its effects and sensors.

    Args:
        robot: the robot.
        effects: bound effects.
        sensors: by instance name.
        backend: open scene.
        environment: air, water, ground.
        waves: motion of the water surface.
        steps: rows to reserve in the ledger.

    Attributes:
        ledger: every effect's wrench at every step.
        memory: of the effects, by name.
        joint_torque: commanded generalised forces [N m or N], shape (1, J).
        readings: last reading of every sensor, by sensor and channel.
    """

    def __init__(
        self,
        robot: RobotModel,
        effects: EffectSet,
        sensors: Mapping[str, Sensor],
        backend: Backend,
        environment: EnvironmentSettings,
        waves: Waves,
        *,
        steps: int,
    ) -> None:
        """Add the robot to the scene."""
        self.robot, self.effects, self.sensors = robot, effects, dict(sensors)
        self.gravity = environment.gravity
        self.body = backend.add(robot)
        surroundings = build_surroundings(
            robot, environment, waves, exact_of(robot, environment), like=np.zeros(1)
        )
        self.evaluator = Evaluator(effects, surroundings, links=len(robot.links), batch=1)
        self._bodies = robot.bodies(np.zeros(1))
        names = [b.name for b in effects.loads]
        self.ledger = Ledger(names, robot.links, steps=steps)
        self.memory: Mapping[str, Array] = effects.zero_memory()
        self.joint_torque = np.zeros((1, robot.tree.joints))
        self.readings: dict[str, dict[str, Floats] | None] = {}
        self._sense_memory: dict[str, Any] = {}
        self._next: dict[str, float] = {}
        self._before: _Velocities | None = None
        self._carriers = {name: _carrier(name, sensor, robot) for name, sensor in self.sensors.items()}

    def reset(self, configuration: Configuration, rng: np.random.Generator) -> None:
        """Place the robot, clear all memory."""
        self.body.reset(configuration)
        self.memory = self.effects.zero_memory()
        self.joint_torque = np.zeros_like(self.joint_torque)
        self.ledger.rewind(0)
        self._sense_memory = {name: sensor.start(rng) for name, sensor in self.sensors.items()}
        self._next = dict.fromkeys(self.sensors, 0.0)
        self.readings = dict.fromkeys(self.sensors)
        self._before = None

    def load(self, time: float, step: float) -> None:
        """Evaluate the effects into the ledger and hand the sum to the backend."""
        poses = self.body.poses()
        kinematics = Kinematics(self.robot.tree, poses.origins, poses.rotations)
        twists = kinematics.twists(poses.speed)
        motion = link_motion(kinematics, twists, np.array([[time]]), self._bodies)
        lead = 0 if self.robot.tree.fixed_base else 6
        tree = self.body.read() if self.robot.tree.joints else None
        q = np.zeros((1, 0)) if tree is None else tree.joints[None]
        joints = Joints(q, poses.speed[:, lead:])
        inputs = Inputs(step, self.joint_torque)
        found = self.evaluator.evaluate(motion, joints, inputs, self.memory)
        row = self.ledger.open_row(time)
        for b, rows, wrench in found.loads:
            self.ledger.write(row, b.name, rows, wrench)
        joint_force = self.joint_torque
        for _, more in found.joint_loads:
            joint_force = joint_force + more
        total = row.sum(axis=0)[None]
        self.body.apply(Dynamics(kinematics, poses.speed, twists, motion, found, total, joint_force), step)
        self.memory = found.memory
        self._before = _velocities(motion)

    def sense(self, time: float, step: float, rng: np.random.Generator) -> None:
        """Take the readings that are due at the new time."""
        self.readings = dict.fromkeys(self.sensors)
        if not self.sensors:
            return
        poses = self.body.poses()
        kinematics = Kinematics(self.robot.tree, poses.origins, poses.rotations)
        twists = kinematics.twists(poses.speed)[0]
        turn = poses.rotations[0]
        for name, sensor in self.sensors.items():
            due = time >= self._next[name] - 1e-9
            k = self._carriers[name]
            felt = self._felt(time, step, poses.origins[0, k], turn[k], twists[k], k)
            reading, self._sense_memory[name] = sensor.sense(felt, self._sense_memory[name], rng, due=due)
            self.readings[name] = reading
            if due:
                self._next[name] += max(1.0 / sensor.rate, 1e-9)

    def _felt(self, time: float, step: float, position: Floats, turn: Floats, twist: Floats, link: int) -> Felt:
        """Motion of one link with its mean accelerations over the last step."""
        velocity, spin = twist[:3], twist[3:]
        force, rate = self.gravity * turn[2], np.zeros(3)
        if self._before is not None and step > 0.0:
            force = turn.T @ ((turn @ velocity - self._before.linear[link]) / step) + force
            rate = turn.T @ ((turn @ spin - self._before.angular[link]) / step)
        return Felt(time, step, position, turn, velocity, spin, force, rate)

    def snapshot(self) -> Any:
        """Return memory of effects and sensors and the length of the ledger."""
        kept = (self.memory, dict(self._sense_memory), dict(self._next), dict(self.readings))
        return (*kept, self.ledger.rows, self._before, self.joint_torque.copy())

    def restore(self, kept: Any) -> None:
        """Put a snapshot back; the ledger forgets later rows."""
        self.memory, sense, following, readings, rows, self._before, torque = kept
        self._sense_memory, self._next, self.readings = dict(sense), dict(following), dict(readings)
        self.joint_torque = torque.copy()
        self.ledger.rewind(rows)


class _Velocities(NamedTuple):
    """Velocities of the link origins, world axes, shape (L, 3)."""

    linear: Floats
    angular: Floats


def _velocities(motion: Any) -> _Velocities:
    turn = motion.rotation
    linear = np.matmul(turn, motion.velocity[:, :, None])[:, :, 0]
    return _Velocities(linear, np.matmul(turn, motion.angular_velocity[:, :, None])[:, :, 0])


def _carrier(name: str, sensor: Sensor, robot: RobotModel) -> int:
    if sensor.link == "root":
        return 0
    if sensor.link not in robot.links:
        raise ConfigError(
            f"sensors.{name}.link: there is no link '{sensor.link}'.\n{suggestion(sensor.link, [*robot.links, 'root'])}"
        )
    return robot.links.index(sensor.link)
