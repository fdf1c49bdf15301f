"""Poses, velocities and accelerations of a robot's links as machine code, in one block."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.backend import CompiledBody
from seals.environment.sampler import EnvironmentSampler
from seals.environment.settings import EnvironmentSettings
from seals.environment.wetting import Wet, Wetting, WettingExact
from seals.hydrostatics import Hull, HullCompound, HullTable
from seals.hydrostatics.placed import HullPlaced
from seals.motion import Body
from seals.multibody.kinematics import Kinematics, LinkVelocities, link_motion
from seals.multibody.tree import forward
from seals.robot.model import RobotModel
from seals.scalar_compiler import Kernel, compiled, constant
from seals.world.felt import LinkTrack, arms_of, axes_of, felt_by_links, mean_velocities

_FLOAT = np.dtype(np.float64)


class Layout:
    """Places of arrays in a block of numbers.

    Args:
        shapes: of the arrays, by name.
    """

    def __init__(self, shapes: dict[str, tuple[int, ...]]) -> None:
        sizes = [int(np.prod(shape, dtype=int)) for shape in shapes.values()]
        starts = np.cumsum([0, *sizes]).tolist()
        table = zip(shapes.items(), starts[:-1], sizes, strict=True)
        self._places = {name: (shape, k, size) for (name, shape), k, size in table}
        self._memory = {name: (shape, 8 * k) for name, (shape, k, _) in self._places.items()}

    def span(self, name: str) -> tuple[int, int]:
        """Return where an array begins in a block, and how many numbers it has."""
        return self._places[name][1:]

    def of(self, block: Floats, name: str) -> Floats:
        """Return an array in a block of numbers; it shares the memory."""
        shape, place = self._memory[name]
        found: Floats = np.ndarray(shape, _FLOAT, block, place)
        return found

    def rows(self, blocks: Floats, name: str) -> Floats:
        """Return an array in blocks of many instants, a row each, shape (N, ...)."""
        shape, start, size = self._places[name]
        found: Floats = blocks[:, start : start + size].reshape(len(blocks), *shape)
        return found

    def traced(self, block: Array, name: str) -> Array:
        """Return an array in a block on any array library."""
        shape, start, size = self._places[name]
        return namespace(block).reshape(block[start : start + size], shape)

    def moving(self, block: Array) -> LinkVelocities:
        """Return the velocities of the links in a block on any array library."""
        of = self.of if type(block) is np.ndarray else self.traced
        both = of(block, "velocities")
        return LinkVelocities(of(block, "speed"), both[:1], both[1:], of(block, "twists"))


class Look:
    """The links at one instant.

    Args:
        tree: of the robot.
        time: [s].
        block: of numbers.
        layout: of the block.
        wet: how the hulls are wetted: ``none`` without water, ``dry``, ``submerged``, ``cut``; or
            their wetted parts where no closed form is known.
        begun: whether a step has led there, see `seals.world.felt.LinkTrack`.
    """

    __slots__ = ("_kinematics", "_moving", "_tree", "begun", "block", "layout", "time", "wet")

    def __init__(  # noqa: PLR0917  one instant
        self,
        tree: Any,
        time: float,
        block: Floats,
        layout: Layout,
        wet: str | Wet,
        begun: bool,
    ) -> None:
        self._tree, self.block, self.layout, self.wet = tree, block, layout, wet
        self.time, self.begun = time, begun
        self._kinematics: Kinematics | None = None
        self._moving: LinkVelocities | None = None

    @property
    def kinematics(self) -> Kinematics:
        """Poses of the links."""
        if self._kinematics is None:
            of, block = self.layout.of, self.block
            self._kinematics = Kinematics(self._tree, of(block, "origins"), of(block, "rotations"))
        return self._kinematics

    @property
    def moving(self) -> LinkVelocities:
        """Velocities of the links."""
        if self._moving is None:
            self._moving = self.layout.moving(self.block)
        return self._moving

    @property
    def track(self) -> LinkTrack:
        """The links with their motion over the last step."""
        of, block = self.layout.of, self.block
        arms, axes, means = (of(block, name) for name in ("arms", "axes", "means"))
        return LinkTrack(self.time, of(block, "rotations")[0], arms, axes, means, self.begun)

    @property
    def seen(self) -> tuple[Floats, Floats, Floats]:
        """Origins, rotations and twists of the links, without a batch."""
        of, block = self.layout.of, self.block
        return of(block, "origins")[0], of(block, "rotations")[0], of(block, "twists")[0]

    @property
    def joints(self) -> Floats:
        """Positions of the joints [rad or m], shape (1, J)."""
        return self.layout.of(self.block, "joints")

    def felt(self) -> tuple[Floats, Floats, Floats]:
        """Accelerations in the last step, see `seals.world.felt.felt_by_links`; zero at a start."""
        of, block = self.layout.of, self.block
        return of(block, "force"), of(block, "rate"), of(block, "turning")

    @property
    def state(self) -> str:
        """Wetting of the hulls: none, dry, cut, submerged, or given as parts."""
        return self.wet if isinstance(self.wet, str) else "given"

    @property
    def parts(self) -> tuple[Any, ...]:
        """Wetted parts of the hulls as arguments of a kernel."""
        return () if isinstance(self.wet, str) else self.wet


class CompiledLinks:
    """Kinematics of one robot as machine code.

    Args:
        robot: the robot.
        environment: air, water, ground.
        body: of the robot.
        hulls: of the links.
    """

    def __init__(
        self,
        robot: RobotModel,
        environment: EnvironmentSettings,
        body: CompiledBody,
        hulls: Sequence[Hull],
    ) -> None:
        links, joints = len(robot.links), robot.tree.joints
        self.wetting, self.hulls = Known(), hulls
        self._robot, self._gravity, self._body = robot, environment.gravity, body
        self._exact = None if environment.water_level is None else WettingExact(hulls)
        self._closed = all(_closed(hull) for hull in hulls)
        three = (1, links, 3)
        self.layout = Layout(
            {"origins": three, "rotations": (1, links, 3, 3), "speed": (1, robot.degrees)}
            | {"velocities": (2, links, 3), "twists": (1, links, 6), "joints": (1, joints)}
            | {"arms": (links, 3), "axes": (joints, 3), "means": (2, links, 3)}
            | {"force": (links, 3), "rate": (links, 3), "turning": (links, 3)}
            | {"change": (joints,)}
            | {"normal": (links, 3), "level": (links, 1), "least": (1,), "most": (1,)}
        )
        self._sampler: EnvironmentSampler | None = None
        self._kernels: dict[Any, Kernel] = {}
        self._start: Look | None = None
        self._time = 0.0
        self._past: list[tuple[int, ...]] = [
            (links, 3, 3),
            (links, 3),
            (joints, 3),
            (2, links, 3),
            (1, 1),
        ]
        self._shapes: list[tuple[int, ...]] = [(1, 3), (1, 4), (1, joints), (1, robot.degrees)]

    def bind(self, sampler: EnvironmentSampler, bodies: Body) -> None:
        """Take the sampler of the surroundings, made with ``wetting``, and the links' bodies."""
        self._sampler, self._bodies = sampler, bodies

    def look(self, time: float, before: LinkTrack | None, step: float) -> Look:
        """Return the links as they are now.

        Args:
            time: [s].
            before: the links one step earlier; those of this very time after a snapshot was
                restored; None at the start.
            step: since then [s].
        """
        block = self._body.followed
        begun = before is not None or block is not None
        if block is None:
            same = before is not None and before.time == time
            past: tuple[Any, ...] = ()
            if before is not None and not same:
                halved = self._body.middle_speed() is not None
                past = (self._body.mean_speed()[None], *_past(before, step, halved=halved))
            key = ("look", bool(past), step if past else 0.0)
            kernel = self._kernels.get(key) or self._compiled(key)
            block = kernel(*self._body.coordinates(), time, *past)[0]
            if before is not None and same:
                begun = before.begun
                for name in ("arms", "axes", "means"):
                    self.layout.of(block, name)[...] = getattr(before, name)
        return Look(self._robot.tree, time, block, self.layout, self._wet(block), begun)

    def expect(self, look: Look, time: float) -> None:
        """Note the links at the start of a step, and the time of its end [s], for `follow`."""
        self._start, self._time = look, time

    def leap(
        self, native: tuple[Floats, ...], own: tuple[Floats, ...], step: float
    ) -> tuple[Kernel, list[Any]]:
        """Return the law of the state after a step, see `follow`, and its arguments.

        Without ``own``: after a step in which something touched.
        """
        key = ("leap" if own else "land", len(own) > 2, step)
        kernel = self._kernels.get(key) or self._compiled(key, native, own)
        assert self._start is not None
        past = _past(self._start.track, step, halved=bool(own))
        return kernel, [*native, *own, self._time, *past]

    def follow(
        self, native: tuple[Floats, ...], own: tuple[Floats, ...], step: float
    ) -> tuple[Floats, list[Floats]] | None:
        """Return the state after a step, see `seals.backend.Follow`."""
        kernel, given = self.leap(native, own, step)
        block, *found = kernel(*given)
        return None if found[-1].item() else (block, found)

    def _compiled(self, key: Any, native: Sequence[Any] = (), own: Sequence[Floats] = ()) -> Kernel:
        """Compile a form: the links as they are, or after a step; ``key[1]``: with a past."""
        kind, past, step = key
        joints = len(self._robot.joints)
        if kind == "look":

            def law(*x: Array) -> list[Array]:
                return [self._law(x[:5], x[5:], step, np.zeros(joints))]

            shapes = [*self._shapes, (1, 1)]
            shapes += [(1, self._robot.degrees), *self._past] if past else []
        else:
            count, last = len(native), len(native) + len(own)

            def law(*x: Array) -> list[Array]:
                if kind == "land":
                    state, found = self._body.landed(x[:count])
                else:
                    both = [y[None] for y in x[count:last]]
                    state, found = self._body.leapt(x[:count], both, step)
                place, turn, angles, now, middle = state
                change = (2.0 / step) * (now - middle)[0, now.shape[1] - joints :]
                given = place, turn, angles, now, x[last]
                return [self._law(given, (middle, *x[last + 1 :]), step, change), *found]

            shapes = [*(np.shape(x) for x in (*native, *own)), (1, 1), *self._past]
        kernel = self._kernels[key] = compiled(law, shapes)
        return kernel

    def _law(
        self, given: Sequence[Array], past: Sequence[Array], step: float, change: Array
    ) -> Array:
        """Return the block for place, attitude, joints, velocity and time.

        Args:
            given: these.
            past: the mean speed over the last step, and what `_past` gives; nothing at a start.
            step: h [s].
            change: acceleration of the joints.
        """
        place, turn, joints, native, time = given
        tree, xp = self._robot.tree, namespace(place)
        position, rotation, speed = self._body.at_origin(place, turn, native)
        kinematics = Kinematics(tree, *forward(tree, position, rotation, joints))
        moving = kinematics.move(speed)
        arms, axes = arms_of(kinematics, self._body.reference), axes_of(kinematics)
        means = xp.concat((moving.linear, moving.angular), axis=0)
        felt = [means[0] * 0.0] * 3
        if past:
            mean, turns, start, turned, earlier, span = past
            before = LinkTrack(0.0, turns, start, turned, earlier, begun=True)
            means = mean_velocities(tree, before, arms, axes, mean[0], step)
            felt = [*felt_by_links(before, means, self._gravity, span, step)]
        found = [kinematics.origins, kinematics.rotations, *moving, joints, arms, axes, means]
        found += [*felt, change]
        normal, level = xp.zeros((len(tree.parent), 3)), xp.zeros((len(tree.parent), 1))
        if self._exact is not None:
            assert self._sampler is not None
            self.wetting.found = ANY
            self._sampler.sample(link_motion(kinematics, moving, time, self._bodies))
            normal, level = normal + self.wetting.normal, level + self.wetting.level
        found += [normal, level, xp.min(level), xp.max(level)]
        return xp.concat([xp.reshape(x, (-1,)) for x in found], axis=0)

    def _wet(self, block: Floats) -> str | Wet:
        """How the hulls are wetted, see `Look`."""
        if self._exact is None:
            return "none"
        least, most = block[-2:].tolist()
        if self._above(most):
            return "dry"
        if self._under(least):
            return "submerged"
        if self._closed:
            return "cut"
        normal, level = self.layout.of(block, "normal"), self.layout.of(block, "level")
        found = self._exact.wet(normal, level)
        zero = level * 0.0
        return found if found.area is not None else Wet(*found[:2], zero, normal * 0.0)

    def _above(self, most: Any) -> Any:
        """Whether all hulls are above the water, by the deepest one's level."""
        assert self._exact is not None
        return most <= -self._exact.longest

    def _under(self, least: Any) -> Any:
        """Whether all hulls are under it, by the highest one's level."""
        assert self._exact is not None
        return least >= self._exact.longest

    def changes(self, state: str, least: Array, most: Array) -> Array:
        """Return whether hulls are wetted in another way than in a word of `Look`; pure.

        Args:
            state: none, dry, cut or submerged.
            least: level of the highest hull, the last but one of a block [m].
            most: that of the deepest one.
        """
        if self._exact is None:
            return least < -np.inf
        above, under = self._above(most), self._under(least)
        return {"dry": ~above, "submerged": above | ~under, "cut": above | under}[state]

    def give(self, state: str, more: Iterator[Array]) -> None:
        """Give the sampler the wetted parts of the hulls; ``more``: where they are given."""
        found: Wet | None = None
        if state == "given":
            found = Wet(*(next(more) for _ in Wet._fields))
        elif state == "cut":
            self.wetting.tables = [HullTable.build(hull) for hull in self.hulls]
        elif self._exact is not None:
            whole = self._exact.whole(under=state == "submerged")
            found = Wet(constant(whole.volume), constant(whole.centre), None, None)
        else:
            return
        self.wetting.found = found


def _past(before: LinkTrack, step: float, *, halved: bool) -> tuple[Any, ...]:
    """Return the links at the start of a step as arguments of a kernel, and the time between."""
    return *before[1:5], before.span(step, halved=halved)


ANY = Wet(constant([[0.0]]), constant([[0.0] * 3]), None, None)
"""Stands for wetted parts that nothing depends on."""


class Known(Wetting):
    """Wetted parts that are found elsewhere, or by closed forms.

    Attributes:
        found: of all hulls; None to evaluate the tables.
        normal: of the last question.
        level: of the last question.
    """

    def __init__(self) -> None:
        self.found: Wet | None = ANY
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
