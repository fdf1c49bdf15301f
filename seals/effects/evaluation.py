"""Evaluation of the effects of a scene or a batch at one instant.

Simulator, twin and screen use the same code.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Array, Floats, fixed, namespace
from seals.effects.binding import BoundEffect, EffectSet, rows_of, spread
from seals.effects.effect import MediumKind
from seals.effects.hooks import ARGUMENTS, names_any, pick_of
from seals.effects.rigid import weight_of
from seals.effects.scene import Rotors, Scene
from seals.environment.sample import Sample
from seals.environment.sampler import EnvironmentSampler
from seals.environment.waves import carried
from seals.errors import PhysicsError
from seals.frames import cross, unrotate
from seals.motion import (
    AddedInertia,
    Body,
    Drives,
    Inputs,
    JointDrive,
    Joints,
    Medium,
    Motion,
    Wrench,
)
from seals.multibody.kinematics import picked, take, take_motion

Memory = Mapping[str, Array]


class Evaluation(NamedTuple):
    """Outputs of all hooks, each with its effect and the rows it acts on.

    Args:
        sample: the surroundings at all rows.
        loads: (effect, rows, wrench about the link origin, link axes); those of actuators are
            among them.
        inertias: (effect, rows, added inertia, medium of the effect).
        joint_loads: (effect, generalised force (batch, J)); those of joint drives are among them
            unless they are taken implicitly.
        joint_drives: (effect, joint drive before its limit).
        resistance: share of the joint rates in ``joint_loads``, force = -share q' [N m s/rad or
            N s/m], shape (batch, J); None for none.
        drives: (actuator, thrusts and torques as they really are); empty while they stand still.
        memory: new memory by effect name.
    """

    sample: Sample
    loads: list[tuple[BoundEffect, Any, Wrench]]
    inertias: list[tuple[BoundEffect, Any, AddedInertia, Medium]]
    joint_loads: list[tuple[BoundEffect, Array]]
    memory: dict[str, Array]
    joint_drives: list[tuple[BoundEffect, JointDrive]]
    drives: list[tuple[BoundEffect, Drives]]
    resistance: Array | None = None

    def joint_force(self, outer: Array, *, driven: bool = True) -> Array:
        """Return forces on the joints and those of all effects, joint drives left out if asked."""
        drives = () if driven else {b.name for b, _ in self.joint_drives}
        for b, force in self.joint_loads:
            if b.name not in drives:
                outer = outer + force
        return outer

    @property
    def joint_drive(self) -> JointDrive | None:
        """Sum of the joint drives; None without any."""
        total: JointDrive | None = None
        for _, drive in self.joint_drives:
            parts = drive if total is None else (a + b for a, b in zip(total, drive, strict=True))
            total = JointDrive(*parts)
        return total


class Evaluator:
    """Evaluator of an effect set on rows ordered link by link.

    Args:
        effects: bound effects.
        surroundings: of all rows.
        links: number of links.
        batch: rows per link.
        joint_links: the link that each joint moves, J of them.
        implicit: whether joint drives are taken implicitly, by their slopes.
        folded: whether changes of the rigid inertia are part of the bodies already; otherwise they
            are evaluated as added inertia with a weight.
        sparing: whether effects that vanish out of the water are left out of a dry batch, too.

    Attributes:
        fed: whether the inputs hold the voltage of the battery already.
        alike: whether a link has the same mass properties in the whole batch.
        rotors: returns the rotors of the other robots of the run.
    """

    def __init__(
        self,
        effects: EffectSet,
        surroundings: EnvironmentSampler,
        *,
        links: int,
        batch: int,
        joint_links: tuple[int, ...] = (),
        folded: bool = False,
        implicit: bool = False,
        sparing: bool = False,
    ) -> None:
        self.implicit = implicit
        self.fed = self.alike = False
        self.rotors: Callable[[], Sequence[Rotors]] = tuple
        self.effects, self.surroundings = effects, surroundings
        self.inertia_changes = () if folded else effects.inertia_changes
        self.rows = {b.name: rows_of(b.links, links, batch) for b in effects.bound}
        kinds = list(dict.fromkeys((b.links, b.kind) for b in effects.bound))
        self._keys = {b.name: kinds.index((b.links, b.kind)) for b in effects.bound}
        self._batch = batch
        self._joint_rows = rows_of(joint_links, links, batch) if joint_links else slice(0, 0)
        # arguments of a hook, and whether it declares those that are costly to compute
        self._picks = {
            (b.name, hook): (pick_of(b.effect, hook), names_any(b.effect, hook, wanted))
            for hook, wanted in _DEAR.items()
            for b in effects.having(hook)
        }
        self._arms: dict[str, tuple[Array, Array, Array]] = {}
        self._bodies: dict[tuple[int, ...], tuple[Body, Body]] = {}
        self._held_places: Floats | None = None
        # a robot in the air does without half of its effects; a batch is mostly wet somewhere
        drying = {b.name for b in effects.bound if (batch == 1 or sparing) and vanishes_dry(b)}
        self._wet_loads = tuple(b for b in effects.loads if b.name not in drying)
        self._drying = drying
        self._dry: dict[str, tuple[BoundEffect, Any, AddedInertia, Medium]] = {}

    def evaluate(
        self,
        motion: Motion,
        joints: Joints,
        inputs: Inputs,
        memory: Memory,
        sample: Sample | None = None,
    ) -> Evaluation:
        """Evaluate flows, then inertias and loads in the resulting medium.

        The surroundings are sampled unless ``sample`` holds them already.
        """
        new: dict[str, Array] = dict(memory)
        if self.effects.held is not None:
            joints = self._held(motion)
        if self.effects.batteries and not self.fed:
            inputs = inputs._replace(voltage=self.supplied(memory))
        sample = self.surroundings.sample(motion) if sample is None else sample
        if self.effects.flows:
            sample = self._with_flows(sample, motion, joints, inputs, memory, new)
        seen: dict[Any, Any] = {}
        scene = self._scene(motion, inputs)
        loads, joint_loads = [], []
        # true if nothing is submerged
        dry = bool(self._drying) and (
            type(sample.submersion) is np.ndarray and not np.count_nonzero(sample.submersion)
        )
        inertias = self._inertias(motion, sample, joints, inputs, memory, new, seen, dry)
        running: list[tuple[BoundEffect, Drives]] = []
        for b in self.inertia_changes:
            rows, part, medium = self._seen(b, motion, sample, seen)
            # a change of the rigid inertia moves with the link in a medium at rest, and weighs
            matrix = b.hooks.inertia_change(part.body, b.params)
            one = part.velocity[:, 0:1] * 0.0 + 1.0
            added, wrench = AddedInertia(matrix, one), weight_of(matrix, part, medium.gravity)
            none = medium.velocity * 0.0
            inertias.append((b, rows, added, medium._replace(velocity=none, acceleration=none)))
            loads.append((b, rows, wrench))
        for b in self._wet_loads if dry else self.effects.loads:
            rows, part, medium = self._seen(b, motion, sample, seen)
            given = (part, medium, joints, inputs, memory.get(b.name), b.params, scene)
            wrench, kept = b.hooks.loads(*self._given(b, "loads", given))
            loads.append((b, rows, wrench))
            _keep(new, b, kept)
        if self.effects.actuators and inputs.drive is not None:
            for b in self.effects.actuators:
                loads += self._driven(b, motion, sample, joints, inputs, memory, new, seen, running)
        for b in self.effects.batteries:
            new[b.name] = b.hooks.battery_update(
                _power_of(running, memory[b.name]), inputs, memory[b.name], b.params
            )
        joint_drives = [
            (b, b.hooks.joint_drive(joints, inputs, b.params)) for b in self.effects.joint_drives
        ]
        for b in self.effects.joint_others if self.implicit else self.effects.joint_loads:
            pick, dear = self._picks[b.name, "joint_loads"]
            beside = self._at_joints(b, motion, sample, seen) if dear else (None, None)
            given = (*beside, joints, inputs, memory.get(b.name), b.params)
            force, kept = b.hooks.joint_loads(*pick(given))
            _check_joint_force(b, force, joints, self._batch)
            joint_loads.append((b, force))
            _keep(new, b, kept)
        resistance = None
        for b in self.effects.joint_resistances:
            share = b.hooks.joint_resistance(joints, inputs, b.params)
            resistance = share if resistance is None else resistance + share
        return Evaluation(
            sample, loads, inertias, joint_loads, new, joint_drives, running, resistance
        )

    def _inertias(  # noqa: PLR0917  one instant of the scene
        self,
        motion: Motion,
        sample: Sample,
        joints: Joints,
        inputs: Inputs,
        memory: Memory,
        new: dict[str, Array],
        seen: dict[Any, Any],
        dry: bool,
    ) -> list[tuple[BoundEffect, Any, AddedInertia, Medium]]:
        """Added inertias; of one robot those that vanish out of the water are cached while dry."""
        out = []
        for b in self.effects.inertias:
            if dry and self._batch > 1 and b.name in self._drying:
                continue
            if dry and b.name in self._dry:
                out.append(self._dry[b.name])
                continue
            rows, part, medium = self._seen(b, motion, sample, seen)
            given = (part, medium, joints, inputs, memory.get(b.name), b.params)
            added, kept = b.hooks.inertia(*self._given(b, "inertia", given))
            out.append((b, rows, added, medium))
            _keep(new, b, kept)
            if dry and b.name in self._drying:
                self._dry[b.name] = out[-1]
            if added.more is not None:
                out[-1] = b, rows, added._replace(more=None), medium
                one = 0.0 * added.weight + 1.0
                out.append((b, rows, AddedInertia(added.more, one, apart=True), medium))
        return out

    def _scene(self, motion: Motion, inputs: Inputs) -> Scene:
        """The scene of this instant, for effects that ask for more than their links."""
        return Scene(self.surroundings, self.effects, motion, inputs, self.rotors)

    def supplied(self, memory: Memory) -> Array | None:
        """Return the voltage of the battery [V], shape (batch, 1); None without one."""
        for b in self.effects.batteries:
            return b.hooks.state(memory[b.name], b.params)[0]
        return None

    def _driven(  # noqa: PLR0917  one instant of the scene
        self,
        actuator: BoundEffect,
        motion: Motion,
        sample: Sample,
        joints: Joints,
        inputs: Inputs,
        memory: Memory,
        new: dict[str, Array],
        seen: dict[Any, Any],
        running: list[tuple[BoundEffect, Drives]],
    ) -> list[tuple[BoundEffect, Any, Wrench]]:
        """Wrenches of one actuator, and of the effects on its thrust."""
        drives = actuator.hooks.drives(inputs, actuator.params)
        for b in self.effects.actuations:
            if b.links == actuator.links:
                _, part, medium = self._seen(b, motion, sample, seen)
                drives = b.hooks.actuation(drives, part, medium, inputs, b.params)
        running.append((actuator, drives))
        arm = self._arms.get(actuator.name)
        if arm is None or arm[0] is not drives.position or arm[1] is not drives.axis:
            arm = (drives.position, drives.axis, cross(drives.position, drives.axis))
            self._arms[actuator.name] = arm
        out = [(actuator, self.rows[actuator.name], thrust_wrench(drives, arm[2]))]
        for b in self.effects.drive_loads:
            if b.links == actuator.links:
                rows, part, medium = self._seen(b, motion, sample, seen)
                own = memory.get(b.name)
                given = (drives, part, medium, joints, inputs, own, b.params)
                wrench, kept = b.hooks.drive_loads(*self._given(b, "drive_loads", given))
                _keep(new, b, kept)
                out.append((b, rows, wrench))
        return out

    def _with_flows(  # noqa: PLR0917  one instant of the scene
        self,
        sample: Sample,
        motion: Motion,
        joints: Joints,
        inputs: Inputs,
        memory: Memory,
        new: dict[str, Array],
    ) -> Sample:
        """Add the flow effects to the velocity of water and air."""
        flows: dict[MediumKind, Array] = {}
        seen: dict[Any, Any] = {}
        scene = self._scene(motion, inputs)
        for b in self.effects.flows:
            rows, part, medium = self._seen(b, motion, sample, seen)
            given = (part, medium, joints, inputs, memory.get(b.name), b.params, scene)
            velocity, kept = b.hooks.flow(*self._given(b, "flow", given))
            _keep(new, b, kept)
            if rows is not None:
                velocity = spread(velocity, rows, motion.position)
            both = (MediumKind.water, MediumKind.air)
            for kind in [k for k in both if b.kind in (k, None, MediumKind.any)]:
                flows[kind] = flows[kind] + velocity if kind in flows else velocity
        water, air, gain = sample.water_velocity, sample.air_velocity, sample.water_acceleration
        if MediumKind.water in flows:
            flow = flows[MediumKind.water]
            water = water + unrotate(motion.rotation, flow)
            if sample.water_gradient is not None:
                # water that flows through the waves' motion
                gain = gain + unrotate(motion.rotation, carried(sample.water_gradient, flow))
        if MediumKind.air in flows:
            air = air + unrotate(motion.rotation, flows[MediumKind.air])
        return sample._replace(water_velocity=water, air_velocity=air, water_acceleration=gain)

    def _seen(
        self, b: BoundEffect, motion: Motion, sample: Sample, seen: dict[Any, Any]
    ) -> tuple[Any, Motion, Medium]:
        """Rows, motion and medium of one effect, shared among effects of equal rows and medium."""
        key = self._keys[b.name]
        rows = self.rows[b.name]
        pair = seen.get(key)
        if pair is None:
            part = seen.get(b.links)
            if part is None:
                part = seen[b.links] = self._part(b.links, rows, motion, sample)
            pair = seen[key] = (part[0], part[1].view(b.kind))
        return rows, *pair

    def _given(self, b: BoundEffect, hook: str, given: tuple[Any, ...]) -> tuple[Any, ...]:
        """Arguments of a hook on links; joint states are repeated for every link of the effect."""
        pick, dear = self._picks[b.name, hook]
        if dear and len(b.links) > 1:
            at = _JOINTS[hook]
            given = (*given[:at], _repeated(given[at], len(b.links)), *given[at + 1 :])
        return pick(given)

    def _at_joints(
        self, b: BoundEffect, motion: Motion, sample: Sample, seen: dict[Any, Any]
    ) -> tuple[Motion, Medium]:
        """Motion and medium of the links that the joints move, rows joint by joint."""
        key = ("joints", b.kind)
        pair: tuple[Motion, Medium] | None = seen.get(key)
        if pair is None:
            rows = self._joint_rows
            pair = seen[key] = take_motion(motion, rows), take(sample, rows).view(b.kind)
        return pair

    def _held(self, motion: Motion) -> Joints:
        """Joint states of a robot with held joints: held positions, zero rates."""
        if self._held_places is None:
            self._held_places = np.array([self.effects.held or ()])
        place = motion.velocity[:1, 0:1] * 0.0 + fixed(self._held_places, motion.velocity)
        return Joints(place, place * 0.0)

    def _part(
        self, links: tuple[int, ...], rows: Any, motion: Motion, sample: Sample
    ) -> tuple[Motion, Sample]:
        """Motion and surroundings of some links; their body properties are cached."""
        if rows is None:
            return motion, sample
        kept = self._bodies.get(links)
        if kept is None or kept[0] is not motion.body:
            # one row stands for the batch
            alike = self.alike and len(links) == 1
            own = slice(rows.start, rows.start + 1) if alike else rows
            kept = self._bodies[links] = (motion.body, take(motion.body, own))
        chosen = picked(motion[:-1], rows)
        return Motion._make((*chosen, kept[1])), take(sample, rows)


def _check_joint_force(b: BoundEffect, force: Array, joints: Joints, batch: int) -> None:
    """Refuse a generalised force that is not one number for each joint of each body."""
    rows, count = joints.velocity.shape
    shape = tuple(force.shape)
    if len(shape) != 2 or shape[0] not in (1, rows, batch) or shape[1] not in (1, count):
        raise PhysicsError(
            f"effects.{b.name}: joint_loads of {type(b.effect).__name__} returns a force of shape "
            f"{shape} for {max(rows, batch)} x {count} joints.\nAllowed: (N, J) for N bodies of J "
            "joints: seals.by_joint(column, joints) turns a column of the motion or the medium "
            "into (N, J)."
        )


_DEAR = {
    "flow": ("joints",),
    "inertia": ("joints",),
    "loads": ("joints",),
    "drive_loads": ("joints",),
    "joint_loads": ("motion", "medium"),
}
"""Arguments of the hooks that are made only where they are named."""
_JOINTS = {hook: names.index("joints") for hook, names in ARGUMENTS.items()}


def _repeated(joints: Joints, times: int) -> Joints:
    """Joints of every body once for each of its links, rows link by link."""
    if joints.position.shape[0] == 1:
        return joints
    xp = namespace(joints.position)
    return Joints(*(xp.concat([x] * times, axis=0) for x in joints))


def vanishes_dry(b: BoundEffect) -> bool:
    """Return true if an effect is zero while nothing is submerged."""
    return b.effect.zero_when_dry and b.kind is MediumKind.water and not b.effect.memory_size


def _power_of(running: list[tuple[BoundEffect, Drives]], like: Array) -> Array:
    """Electrical power of all drives [W], shape (batch, 1).

    Args:
        running: actuators and their drives as they really are.
        like: memory of the battery, shape (batch, k).
    """
    total = None
    for b, drives in running:
        if hasattr(b.effect, "power"):
            power = b.hooks.power(drives, b.params)
            if type(power) is np.ndarray:
                power = np.add.reduce(power, axis=1, keepdims=True)
            else:
                power = namespace(power).sum(power, axis=1, keepdims=True)
            total = power if total is None else total + power
    return like[:, 0:1] * 0.0 if total is None else total


def thrust_wrench(drives: Drives, arm: Array | None = None) -> Wrench:
    """Sum of thrusts and reaction torques about the link origin, link axes [N, N m].

    Args:
        drives: of one actuator.
        arm: position x axis [m], shape (n, 3), where it is known.
    """
    arm = cross(drives.position, drives.axis) if arm is None else arm
    force = drives.thrust @ drives.axis
    return Wrench(force, drives.thrust @ arm + drives.torque @ drives.axis)


def _keep(new: dict[str, Array], b: BoundEffect, kept: Array) -> None:
    if b.effect.memory_size:
        new[b.name] = kept
