"""The laws of one robot's step as machine code, from the poses of the links to the engine's loads.

What is compiled is what runs otherwise: kinematics, `EnvironmentSampler`, `Evaluator` and the
pure part of the body's coupling, on traced arrays (`seals.world.scalar_compiler`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Array, Floats
from seals.backend import CompiledBody, Dynamics
from seals.effects.evaluation import Evaluator
from seals.environment.build import build_surroundings, hulls_of
from seals.environment.sample import Sample
from seals.environment.settings import EnvironmentSettings
from seals.environment.waves import Waves
from seals.environment.wetting import Wet, Wetting, WettingExact
from seals.hydrostatics import Hull, HullCompound, HullTable
from seals.hydrostatics.placed import HullPlaced
from seals.motion import Inputs, Joints
from seals.multibody.kinematics import Kinematics, LinkVelocities
from seals.multibody.rows import link_motion
from seals.multibody.tree import forward
from seals.robot.model import RobotModel
from seals.world.scalar_compiler import Kernel, compiled, constant
from seals.world.sensor_suite import felt_by_links
from seals.world.servos import Servoing

_LIKE = constant(np.zeros(1))


class Look(NamedTuple):
    """The links at one instant.

    Args:
        kinematics: of the links.
        moving: velocities of the links.
        wet: how the hulls are wetted: ``none`` without water, ``dry``, ``submerged``, ``cut``; or
            their wetted parts where no closed form is known.
    """

    kinematics: Kinematics
    moving: LinkVelocities
    wet: str | Wet

    @property
    def state(self) -> str:
        """How the hulls are wetted, in a word."""
        return self.wet if isinstance(self.wet, str) else "given"

    @property
    def parts(self) -> tuple[Any, ...]:
        """Wetted parts of the hulls as arguments of a kernel."""
        return () if isinstance(self.wet, str) else self.wet


class Loads(NamedTuple):
    """Results of the laws.

    Args:
        row: of the ledger [N, N m], shape (effects, L, 6).
        memory: of the effects, by name.
        speeds: of the rotors, by actuator [rad/s].
        body: what `CompiledBody.give` takes.
    """

    row: Floats
    memory: dict[str, Floats]
    speeds: dict[str, Floats]
    body: list[Floats]


class CompiledStep:
    """Compiled laws of one robot; each form of a step is compiled when it first occurs.

    Args:
        robot: the robot.
        environment: air, water, ground.
        waves: motion of the water surface.
        servos: joint drives and effects of the robot.
        body: of the robot, `seals.backend.CompiledBody`.
    """

    def __init__(
        self,
        robot: RobotModel,
        environment: EnvironmentSettings,
        waves: Waves,
        servos: Servoing,
        body: Any,
    ) -> None:
        """Give the laws traced numbers."""
        effects = servos.effects
        self._robot, self._servos = robot, servos
        self._body: CompiledBody = body
        self._effects = effects.with_values({}, _LIKE, 1)
        self._places = {name: k for k, name in enumerate(effects.wrenching)}
        self._wetting = _Known()
        self._surroundings = build_surroundings(
            robot, environment, waves, self._wetting, like=_LIKE
        )
        self._evaluator = Evaluator(
            self._effects,
            self._surroundings,
            links=len(robot.links),
            batch=1,
            joint_links=robot.tree.child,
            implicit=servos.implicit,
        )
        self._evaluator.fed = True
        self._bodies = robot.bodies(_LIKE)
        self._hulls = hulls_of(robot)
        self._exact = None if environment.water_level is None else WettingExact(self._hulls)
        self._closed = all(_closed(hull) for hull in self._hulls)
        self._kernels: dict[Any, tuple[Kernel, list[str], list[str]]] = {}
        shapes = [(1, 3), (1, 4), (1, robot.tree.joints), (1, robot.degrees), (1, 1)]
        self._looking = compiled(self._look, shapes)
        self._feeling: dict[float, Kernel] = {}
        body.compile(inertial=bool(effects.inertias or effects.inertia_changes))

    def look(self, time: float) -> Look:
        """Return the links as they are now."""
        found = self._looking(*self._body.coordinates(), time)
        origins, rotations, *moving, normal, level = found
        kinematics = Kinematics(self._robot.tree, origins, rotations)
        return Look(kinematics, LinkVelocities(*moving), self._wet(normal, level))

    def _look(
        self, place: Array, turn: Array, joints: Array, native: Array, time: Array
    ) -> list[Array]:
        """Poses and velocities of the links, and the water surface at them."""
        position, rotation, speed = self._body.at_origin(place, turn, native)
        tree = self._robot.tree
        kinematics = Kinematics(tree, *forward(tree, position, rotation, joints))
        moving = kinematics.move(speed)
        found = [kinematics.origins, kinematics.rotations, *moving]
        if self._exact is None:
            return [*found, np.zeros((1, 3)), np.zeros((1, 1))]
        self._surroundings.sample(link_motion(kinematics, moving, time, self._bodies))
        return [*found, self._wetting.normal, self._wetting.level]

    def felt(self, given: Sequence[Floats], gravity: float, step: float) -> Sequence[Floats]:
        """Return `felt_by_links` of rotations and velocities, now and before."""
        kernel = self._feeling.get(step)
        if kernel is None:

            def law(*x: Array) -> Sequence[Array]:
                rotations, linear, angular, *before = x
                return felt_by_links(rotations, linear, angular, before, gravity, step)

            kernel = self._feeling[step] = compiled(law, _shapes(given))
        return kernel(*given)

    def sample(self, look: Look, time: float) -> Sample:
        """Return the surroundings of the links, without flow effects.

        Args:
            look: the links.
            time: [s].
        """
        kinematics, twists = look.kinematics, look.moving.twists
        values = [kinematics.origins, kinematics.rotations, twists, time, *look.parts]
        kept = self._kernels.get(look.state)
        if kept is None:
            names: list[str] = []

            def law(origins: Array, rotations: Array, twists: Array, *rest: Array) -> list[Array]:
                self._set(look.state, iter(rest[1:]))
                moving = LinkVelocities(None, None, None, twists)
                poses = Kinematics(self._robot.tree, origins, rotations)
                found = self._surroundings.sample(link_motion(poses, moving, rest[0], self._bodies))
                names[:] = [n for n, x in found._asdict().items() if x is not None]
                return [x for x in found if x is not None]

            kept = self._kernels[look.state] = compiled(law, _shapes(values)), names, []
        return Sample(**dict(zip(kept[1], kept[0](*values), strict=True)))

    def loads(
        self, look: Look, time: float, joints: Joints, inputs: Inputs, memory: Mapping[str, Floats]
    ) -> Loads | None:
        """Evaluate the laws, and pass their sum to the body.

        None where this step is not compiled.

        Args:
            look: the links.
            time: [s].
            joints: positions and rates, shape (1, J).
            inputs: of the effects.
            memory: of the effects.
        """
        driven = self._servos.drives(inputs)
        form = self._body.compiled_form(inputs.step, driven=driven)
        if form is None:
            return None
        commands = inputs.joint_torque, inputs.drive, inputs.voltage, inputs.joint_command
        present = tuple(x is not None for x in commands)
        kinematics = look.kinematics
        while True:
            values = [
                *(kinematics.origins, kinematics.rotations, look.moving.speed, time),
                joints.position,
                *(x for x in commands if x is not None),
                *look.parts,
                *memory.values(),
                *self._body.compiled_arguments(inputs.step),
            ]
            key = (form, present, look.state, inputs.step)
            kept = self._kernels.get(key)
            if kept is None:
                kept = self._kernels[key] = self._compiled(key, memory, values)
            kernel, remembered, turning = kept
            row, *results = kernel(*values)
            first, last = len(remembered), len(remembered) + len(turning)
            body = results[last:]
            if self._body.give(form, body, kinematics.origins[0], kinematics.rotations[0]):
                new = {**memory, **dict(zip(remembered, results, strict=False))}
                speeds = dict(zip(turning, results[first:last], strict=True))
                return Loads(row, new, speeds, body)

    def _wet(self, normal: Floats, level: Floats) -> str | Wet:
        """How the hulls are wetted, see `Look`.

        Args:
            normal: of the water surface, link axes [1], shape (L, 3).
            level: of the surface above the link origins along it [m], shape (L, 1).
        """
        if self._exact is None:
            return "none"
        levels = level.ravel().tolist()
        if max(levels) <= -self._exact.longest:
            return "dry"
        if min(levels) >= self._exact.longest:
            return "submerged"
        if self._closed:
            return "cut"
        found = self._exact.wet(normal, level)
        zero = level * 0.0
        return found if found.area is not None else Wet(*found[:2], zero, normal * 0.0)

    def _compiled(
        self, key: Any, memory: Mapping[str, Floats], values: Sequence[Any]
    ) -> tuple[Kernel, list[str], list[str]]:
        """Compile one form; return it with the names of memories and of actuators with speeds."""
        form, present, state, step = key
        names: list[list[str]] = [[], []]

        def law(
            origins: Array,
            rotations: Array,
            speed: Array,
            time: Array,
            position: Array,
            *rest: Array,
        ) -> list[Array]:
            more = iter(rest)
            commands = [next(more) if there else None for there in present]
            self._set(state, more)
            remembered = {name: next(more) for name in memory}
            kinematics = Kinematics(self._robot.tree, origins, rotations)
            moving = kinematics.move(speed)
            motion = link_motion(kinematics, moving, time, self._bodies)
            joints = Joints(position, speed[:, speed.shape[1] - position.shape[1] :])
            inputs = Inputs(step, *commands)
            found = self._evaluator.evaluate(motion, joints, inputs, remembered)
            row = self._row(found)
            total = constant(row).__array_namespace__().sum(row, axis=0)[None]
            due = Dynamics(
                kinematics, moving, motion, found, total, *self._servos.push(found, inputs)
            )
            speeds = {b.name: d.speed for b, d in found.drives if d.speed is not None}
            names[:] = list(found.memory), list(speeds)
            own = self._body.compiled_law(form, due, step, *more)
            return [row, *found.memory.values(), *speeds.values(), *own]

        kernel = compiled(law, _shapes(values))
        return kernel, names[0], names[1]

    def _set(self, state: str, more: Iterator[Array]) -> None:
        """Give the surroundings the wetted parts of the hulls; ``more``: where they are given."""
        found: Wet | None = None
        if state == "given":
            found = Wet(*(next(more) for _ in Wet._fields))
        elif state == "cut":
            self._wetting.tables = [HullTable.build(hull) for hull in self._hulls]
        elif self._exact is not None:
            whole = self._exact.whole(under=state == "submerged")
            found = Wet(constant(whole.volume), constant(whole.centre), None, None)
        else:
            return
        self._wetting.found = found

    def _row(self, found: Any) -> Array:
        """Return the wrenches of all effects on all links, shape (effects, L, 6)."""
        row = constant(np.zeros((len(self._places), len(self._robot.links), 6)))
        for b, rows, wrench in found.loads:
            where = slice(None) if rows is None else rows
            own = row.entries[self._places[b.name]]
            for values, part in ((wrench.force, slice(0, 3)), (wrench.torque, slice(3, 6))):
                if values is not None:
                    own[where, part] = (constant(own[where, part]) + values).entries
        return row


def _shapes(values: Sequence[Any]) -> list[tuple[int, ...]]:
    """Shapes of arguments; a number is an array of one."""
    return [np.shape(x) or (1, 1) for x in values]


class _Known(Wetting):
    """Wetted parts that are found elsewhere, or by closed forms.

    Attributes:
        found: of all hulls; None to evaluate the tables.
        normal: of the last question.
        level: of the last question.
    """

    def __init__(self) -> None:
        self.found: Wet | None = Wet(constant([[0.0]]), constant([[0.0] * 3]), None, None)
        self.tables: list[HullTable] = []
        self.normal: Array = None
        self.level: Array = None

    def wet(self, normal: Array, level: Array) -> Wet:
        """Return the submerged part of every hull."""
        self.normal, self.level = normal, level
        if self.found is not None:
            return self.found
        xp = constant(level).__array_namespace__()
        rows = [slice(k, k + 1) for k in range(len(self.tables))]
        level = level + normal[:, 2:3] * 0.0
        parts = [t.lookup(normal[r], level[r]) for t, r in zip(self.tables, rows, strict=True)]
        return Wet(*(xp.concat(list(column), axis=0) for column in zip(*parts, strict=True)))


def _closed(hull: Hull) -> bool:
    """Return whether the wetted part of a hull has a closed form."""
    if isinstance(hull, HullCompound):
        return all(_closed(part) for part in hull.parts)
    return isinstance(hull, HullPlaced)
