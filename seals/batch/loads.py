"""Loads of the effects on a batch of robots whose bodies an engine moves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Array, as_like, index_on, namespace
from seals.effects.binding import EffectSet
from seals.effects.evaluation import Evaluation, Evaluator
from seals.effects.joint_inertia import armature_of
from seals.environment.sampler import build_surroundings, tables_of
from seals.environment.settings import EnvironmentSettings
from seals.environment.waves import Waves
from seals.errors import ConfigError
from seals.frames import rotate, unrotate
from seals.motion import Inputs, JointDrive, Joints, Motion
from seals.multibody.kinematics import by_batch, by_link, take_motion
from seals.multibody.spatial import added_terms
from seals.robot.model import RobotModel
from seals.world.drivetrain import response_of


class LinkStates(NamedTuple):
    """Poses and velocities of all links of B robots, world axes.

    Args:
        origins: of the links [m], shape (B, L, 3).
        rotations: R_WL, shape (B, L, 3, 3).
        linear: velocity of the origins [m/s], shape (B, L, 3).
        angular: velocity [rad/s], shape (B, L, 3).
    """

    origins: Array
    rotations: Array
    linear: Array
    angular: Array


class Loads(NamedTuple):
    """Loads at one instant.

    Args:
        force: on the links, world axes [N], shape (B, L, 3).
        torque: about their origins, world axes [N m], shape (B, L, 3).
        added: inertia by link about its origin, link axes, shape (1 or B, 6, 6); its velocity
            terms are part of force and torque.
        joint_force: generalised force on the joints besides the drives [N m or N], (1 or B, J).
        drive: of the joints before its limit; None for none.
        resistance: share of the joint rates in ``joint_force``, (1 or B, J); None for none.
        memory: of the effects, after the instant.
        submersion: submerged share of the volume of all hulls [1], shape (B, 1).
    """

    force: Array
    torque: Array
    added: dict[int, Array]
    joint_force: Array
    drive: JointDrive | None
    resistance: Array | None
    memory: Mapping[str, Array]
    submersion: Array


class BatchLoads:
    """Effects of a run evaluated on the links of B robots, for engines that hold them all.

    Args:
        robot: the robot.
        effects: bound to its links.
        environment: air, water, gravity.
        waves: motion of the water surface.
        batch: number of robots B.
        like: array whose library, type and device to use.
        values: ``"effect.parameter"`` to a number or an array (B,), in place of the settings.

    Attributes:
        armature: inertia of the joint drives [kg m^2 or kg], shape (J,); None for none.

    Raises:
        ConfigError: the robot's base is fixed, or commands arrive late.
    """

    def __init__(
        self,
        robot: RobotModel,
        effects: EffectSet,
        environment: EnvironmentSettings,
        waves: Waves,
        *,
        batch: int,
        like: Array,
        values: Mapping[str, Any] | None = None,
    ) -> None:
        # refuse what has no form in a batch of worlds
        late = response_of(effects).delay
        for wrong, what in (
            (robot.tree.fixed_base, "a fixed base"),
            (late > 0.0, f"commands that arrive {late:g} s late"),
        ):
            if wrong:
                raise ConfigError(
                    f"robot '{robot.name}' has {what}, which batches of worlds with "
                    "contacts do not support.\n"
                    "Use backend=mujoco, or backend=twin if there are no contacts."
                )
        self.robot, self.batch, self.like = robot, batch, like
        self.effects = effects.with_values(values or {}, like, batch)
        self._bodies = robot.bodies(like, batch)
        surroundings = build_surroundings(
            robot, environment, waves, tables_of(robot, environment), like=like, batch=batch
        )
        volume = robot.bodies(np.zeros(1)).volume.reshape(1, -1)
        self._share = as_like(volume / max(float(volume.sum()), 1e-300), like)
        self._evaluator = Evaluator(
            self.effects,
            surroundings,
            links=len(robot.links),
            batch=batch,
            joint_links=robot.tree.child,
            implicit=True,
        )
        self.armature = armature_of(effects, robot)

    def zero_memory(self) -> dict[str, Array]:
        """Return the memory of all effects at reset."""
        return {k: as_like(v, self.like) for k, v in self.effects.zero_memory(self.batch).items()}

    def voltage_share(self, memory: Mapping[str, Array]) -> Array | None:
        """Return the battery's voltage by its full one [1], shape (B, 1); None without one."""
        batteries = self.effects.batteries
        voltage = self._evaluator.supplied(memory)
        return None if voltage is None else voltage / batteries[0].hooks.full_voltage

    def inertial_links(self) -> tuple[int, ...]:
        """Return the links that any effect adds inertia to."""
        changes = (*self.effects.inertias, *self.effects.inertia_changes)
        return tuple(sorted({link for b in changes for link in b.links}))

    def evaluate(
        self,
        states: LinkStates,
        joints: Joints,
        time: Array,
        inputs: Inputs,
        memory: Mapping[str, Array],
    ) -> Loads:
        """Return the loads of all effects.

        Args:
            states: of the links.
            joints: of all robots.
            time: [s], shape (B, 1).
            inputs: joint commands and torques, states of rotors and thrusters.
            memory: of the effects.
        """
        links = len(self.robot.links)
        rotation = by_link(states.rotations)
        motion = Motion(
            time=namespace(time).concat([time] * links, axis=0),
            position=by_link(states.origins),
            rotation=rotation,
            up=rotation[:, 2, :],
            velocity=unrotate(rotation, by_link(states.linear)),
            angular_velocity=unrotate(rotation, by_link(states.angular)),
            body=self._bodies,
        )
        found = self._evaluator.evaluate(motion, joints, inputs, memory)
        force, torque = self._wrenches(motion, found)
        wet = found.sample.submersion + motion.velocity[:, 0:1] * 0.0
        # added inertia of every link that has any
        out: dict[int, Array] = {}
        for b, _, added, _ in found.inertias:
            for j, link in enumerate(b.links):
                matrix = self._of(added.weight, j)[:, :, None] * self._of(added.matrix, j)
                out[link] = out[link] + matrix if link in out else matrix
        return Loads(
            by_batch(rotate(rotation, force), links),
            by_batch(rotate(rotation, torque), links),
            out,
            found.joint_force(inputs.joint_torque),
            found.joint_drive,
            found.resistance,
            found.memory,
            namespace(wet).sum(self._share * by_batch(wet, links)[:, :, 0], axis=1)[:, None],
        )

    def _wrenches(self, motion: Motion, found: Evaluation) -> tuple[Array, Array]:
        """Sums of wrenches less velocity terms of added inertia, link axes, rows link by link."""
        total = [motion.velocity * 0.0, motion.velocity * 0.0]
        for _, rows, wrench in found.loads:
            for whole, part in zip(total, wrench, strict=True):
                if part is not None:
                    _add(whole, rows, part)
        for _, rows, added, medium in found.inertias:
            terms = added_terms(added, medium, take_motion(motion, rows))
            for whole, part in zip(total, terms, strict=True):
                _add(whole, rows, -part)
        return total[0], total[1]

    def _of(self, values: Array, j: int) -> Array:
        """Rows of one link of an effect; rows of one robot stand for all."""
        count = values.shape[0]
        if count == 1:
            return values
        each = count if count == self.batch else self.batch
        return values[:each] if count == each else values[j * each : (j + 1) * each]


def _add(whole: Array, rows: Any, part: Array) -> None:
    """Add rows of some links, each once, to those of all, in place."""
    place = slice(None) if rows is None else rows
    whole[place if isinstance(place, slice) else index_on(place, whole)] += part
