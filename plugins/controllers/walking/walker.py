"""Base of gait controllers: way of the toes, heading, inverse kinematics, forces of the feet.

The forces that carry a walking robot and hold it level act as offsets of its servos. Everything is
batch first.
"""

from __future__ import annotations

import copy
import enum
import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, NamedTuple

import numpy as np

from seals.arrays import Array, Floats, as_like, namespace
from seals.control import ActuatorCommand, Plant, Reference, RobotState
from seals.control.limbs import stowed
from seals.control.protocols import NO_LEGS, CommandLaw, Compiler, ControllerOptions
from seals.errors import ConfigError, suggestion
from seals.field_roles import roles
from seals.plugins.controllers.walking.anatomy import Anatomy, anatomy_of
from seals.schema import check_order, setting
from seals.state_records import state_record

LIGHT = 0.1
"""Weight of a leg that is about to leave the ground against one that stands [1]."""
RAMP = 0.15
"""Share of the stance over which a leg takes up its load, and gives it up [1]."""
SLACK = 1e-6
"""Regularisation of the distribution of loads: moments that no foot can give are left out [m^2]."""


class Support(NamedTuple):
    """Quantities of a robot for the distribution of loads.

    Args:
        legs: geometry of the legs.
        stiffness: of the servos of the legs [N m/rad], shape (N, 3).
        gravity: [m/s^2].
        share: of the weight that is fed forward [1].
        level: bandwidth at which the body is held level, 0 for not at all [rad/s].
    """

    legs: Anatomy
    stiffness: Floats
    gravity: float
    share: float
    level: float

    def offsets(self, s: RobotState, toes: Floats, stance: Floats) -> Floats:
        """Return offsets of the joint values with which the feet carry the body [rad].

        Equation:
            least sum_i f_i^2 / w_i with sum f_i = m g and sum r_i x f_i = M about the centre of
            gravity, M = -I (k^2 e + 1.4 k w), e the tilt; offset of a joint = -J^T f / stiffness.

        Args:
            s: situation of the robot.
            toes: wanted places, body axes [m], shape (N, 3).
            stance: share of its stance that each leg has done, 1 and more in the air [1],
                shape (N,).

        Returns:
            Shape (N, 3).
        """
        up = s.rotation[2]
        tilt = np.array([up[1], -up[0], 0.0])
        rate = s.angular_velocity * np.array([1.0, 1.0, 0.0])
        moment = -s.inertia @ (self.level * (self.level * tilt + 1.4 * rate))
        load = np.array([s.mass * self.gravity, moment[0], moment[1]])
        ends = np.minimum(stance, 1.0 - stance) / RAMP
        weight = np.where(stance < 1.0, np.clip(ends, LIGHT, 1.0), 0.0)
        arm = toes - s.centre
        rows = np.stack((np.ones(len(toes)), arm[:, 1], -arm[:, 0]))
        spread = (rows * weight) @ rows.T + SLACK * np.diag([0.0, 1.0, 1.0])
        lift = weight * (rows.T @ np.linalg.lstsq(spread, load, rcond=None)[0])
        force = self.share * np.maximum(lift, 0.0)[:, None] * up
        torque = np.einsum("nij,ni->nj", self.legs.jacobian(self.legs.angles(toes)), force)
        offsets: Floats = -torque / self.stiffness
        return offsets


def _leg_stiffness(plant: Plant, columns: Floats) -> Floats | None:
    """Return the stiffness of the servos of the legs [N m/rad], or None without servos.

    Args:
        plant: the robot.
        columns: joints of the legs, shape (N, 3).
    """
    joints = plant.robot.tree.joints
    for bound in plant.effects.joint_drives:
        if hasattr(bound.hooks, "of_joints"):
            found: Floats = np.maximum(bound.hooks.of_joints("kp", joints), 1e-6)[columns]
            return found
    return None


def cadence(
    walk: Array, places: Array, *, duty: Any, stroke: Any, low: Any, high: Any
) -> tuple[Array, Array]:
    """Return the cycle frequency [Hz], shape (B, 1), and the walk limited to what it allows.

    The legs cycle as fast as strokes of a length need; a walk that needs more than the highest
    frequency is shortened.

    Args:
        walk: wanted, body axes: ahead and aside [m/s], turn [rad/s], shape (B, 3).
        places: of the toes in the middle of their strokes [m], shape (B, N, 2) or more columns.
        duty: share of the cycle on the ground [1], a number or shape (B, 1), as all others.
        stroke: way of a toe on the ground, in body axes [m].
        low: lowest frequency [Hz].
        high: highest frequency [Hz].
    """
    xp, (x, y) = namespace(walk), _speeds(walk, places)
    needed = xp.max(xp.sqrt(x * x + y * y), axis=1, keepdims=True) * duty / stroke
    high, low = needed * 0.0 + high, needed * 0.0 + low
    short = xp.where(needed > high, high / xp.maximum(needed, high), high * 0.0 + 1.0)
    return xp.where(needed > high, high, xp.maximum(needed, low)), walk * short


def _speeds(walk: Array, places: Array) -> tuple[Array, Array]:
    """Velocity of body-fixed points along x and y [m/s], shape (B, N) each."""
    turn = walk[:, 2:3]
    return walk[:, 0:1] - turn * places[:, :, 1], walk[:, 1:2] + turn * places[:, :, 0]


def toes_of(
    phase: Array, places: Array, walk: Array, *, frequency: Any, duty: Any, lift: Any
) -> Array:
    """Return the wanted toe positions, body axes [m], shape (B, N, 3).

    On the ground a toe goes back as fast as the body goes on; in the air it comes forward on a
    cycloid, at rest against the body when it leaves and when it lands.

    Args:
        phase: share of the cycle, 0 where a toe lands, shape (B, N).
        places: of the toes in the middle of their strokes, on the ground [m], shape (B, N, 3).
        walk: of the body: ahead and aside [m/s], turn [rad/s], shape (B, 3).
        frequency: of the cycle [Hz], a number or shape (B, 1), as all others.
        duty: share of the cycle on the ground [1].
        lift: height of the toes in the middle of their way through the air [m].
    """
    xp, share = namespace(places), duty / frequency
    swing = xp.clip(phase - duty, 0.0, None) / (1.0 - duty)
    back = 0.5 - xp.clip(phase / duty, None, 1.0)
    turn = 2.0 * math.pi * swing
    along = back + swing - xp.sin(turn) / (2.0 * math.pi)
    x, y = (along * (share * speed) for speed in _speeds(walk, places))
    height = places[:, :, 2] + 0.5 * lift * (1.0 - xp.cos(turn))
    return xp.stack((places[:, :, 0] + x, places[:, :, 1] + y, height), axis=2)


STILL = 0.02
"""Liveliness below which the legs stand [1]."""
SLOWEST = 1e-3
"""Speed [m/s] or turn [rad/s] below which there is no way to face, and no walk."""
SHUFFLE = 0.03
"""Error of the heading that is left to a standing robot [rad]."""


class Facing(enum.Enum):
    """Heading while walking: ``aim`` as commanded, ``ahead`` along or ``sideways`` to the path."""

    aim = "aim"
    ahead = "ahead"
    sideways = "sideways"


@state_record
class Pace(NamedTuple):
    """State of a gait between calls; immutable. One robot is a batch of one.

    Args:
        phase: of every leg, share of the cycle, shape (B, N).
        walk: of the body, smooth: ahead and aside [m/s], turn [rad/s], shape (B, 3).
        heading: that belongs to the way [rad], shape (B, 1); not a number before the first call.
        lively: 1 while walking, 0 standing, between them on the way [1], shape (B, 1).
        frequency: of the cycle [Hz], shape (B, 1).
        shift: of the toes, level, to catch the body, x and y in turn [m], shape (B, 2 N).
    """

    phase: Array
    walk: Array
    heading: Array
    lively: Array
    frequency: Array
    shift: Array


class Manner(NamedTuple):
    """Stepping parameters: those of the reference override those of the gait.

    Each is a number, or a column (B, 1) for a batch.

    Args:
        duty: share of the cycle on the ground [1].
        stroke: longest way of a toe on the ground [m].
        lift: height of the toes in the air [m].
        low: lowest frequency [Hz].
        high: highest frequency [Hz].
        spread: of the toes outwards of the stance [m].
        crouch: of the body below the stance [m].
        along: phase by which a leg lags behind the one in front [cycles].
        across: phase by which the right side lags behind the left [cycles].
    """

    duty: Any
    stroke: Any
    lift: Any
    low: Any
    high: Any
    spread: Any
    crouch: Any
    along: Any = 0.5
    across: Any = 0.5


@roles(data="sense")
@dataclass(kw_only=True)
class Walker(ControllerOptions, ABC):
    """Base of walking controllers: track a reference velocity by stepping.

    Args:
        rate: calls a second [Hz].
        sense: sensor of pose and velocity, or ``truth``.
        facing: ``aim``, ``ahead`` or ``sideways``; crabs walk sideways, to either side.
        stroke: longest way of a toe on the ground, in body axes [m].
        lift: height of the toes in the air [m].
        lowest: frequency at which slow walks step [Hz].
        highest: largest frequency [Hz].
        spread: of the toes outwards of the stance [m].
        crouch: of the body below the stance [m].
        turn_gain: of the heading's error [1/s].
        turn_limit: largest rate of turn [rad/s].
        smooth: time in which a change of walk is taken up [s].
        support: share of the weight that is fed forward to the servos of the legs that stand [1].
        level: bandwidth at which the feet hold the body level, 0 for not at all [rad/s].
        catch: time by which the error of the velocity shifts where a toe lands [s].
    """

    rate: float = setting(125.0, "Hz", bounds=(1.0, 1e4), source="chosen: 30 a cycle")
    sense: str = "truth"
    facing: Facing = Facing.aim
    stroke: float = setting(0.03, "m", bounds=(1e-4, 10.0), source="chosen")
    lift: float = setting(0.01, "m", bounds=(0.0, 10.0), source="chosen")
    lowest: float = setting(1.0, "Hz", bounds=(0.01, 100.0), source="chosen")
    highest: float = setting(4.0, "Hz", bounds=(0.01, 100.0), source="chosen")
    spread: float = setting(0.0, "m", bounds=(-10.0, 10.0), source="chosen: the stance")
    crouch: float = setting(0.0, "m", bounds=(-10.0, 10.0), source="chosen: the stance")
    turn_gain: float = setting(3.0, "1/s", bounds=(0.0, 100.0), source="chosen")
    turn_limit: float = setting(2.0, "rad/s", bounds=(0.0, 100.0), source="chosen")
    smooth: float = setting(0.12, "s", bounds=(1e-3, 10.0), source="chosen: a step")

    support: float = setting(0.0, "1", bounds=(0.0, 2.0), source="chosen: stiff servos", later=True)
    level: float = setting(
        0.0, "rad/s", bounds=(0.0, 100.0), source="chosen: many legs", later=True
    )
    catch: float = setting(0.0, "s", bounds=(0.0, 1.0), source="chosen: many legs", later=True)

    needs_mass_properties: ClassVar[bool] = False

    def bind(self, plant: Plant) -> None:
        """Find the legs of the robot.

        Raises:
            ConfigError: it has none, or legs that a gait cannot move.
        """
        check_order(self, "lowest", "highest", where="controller", equal=True)
        self._legs: Anatomy = anatomy_of(plant.robot)
        self._rest = stowed(plant.robot)
        self._drives = plant.layout.drives
        self._columns = self._legs.joints.astype(int)
        self._into(np.zeros(1))
        stiff = _leg_stiffness(plant, self._columns) if self.support > 0.0 else None
        self._support = (
            None
            if stiff is None
            else Support(self._legs, stiff, plant.gravity, self.support, self.level)
        )

    def _into(self, like: Array) -> None:
        """Put the geometry into the library of an array."""
        self._like, self._outward = like, as_like(self._legs.outward(), like)
        self._body = Anatomy(*(as_like(x, like) for x in self._legs))
        self._stepping: Callable[..., Sequence[Array]] = self._stepped
        self._pacing: Callable[..., tuple[Pace, Array]] = self.paced
        self._compiler: Compiler | None = None
        self._laws: dict[float, CommandLaw] = {}

    def start(self, batch: int = 1) -> Pace:
        """Return the initial legs, all in stance, in the order of the gait."""
        phase = as_like(np.tile(self.order(self.manner({})), (batch, 1)), self._like)
        zero = phase[:, 0:1] * 0.0
        walk, shift = (as_like(np.zeros((batch, n)), self._like) for n in (3, 2 * phase.shape[1]))
        return Pace(phase, walk, zero + math.nan, zero, zero + self.lowest, shift)

    def leg_phase(self, memory: Pace | None) -> Floats:
        """Return the phase of every leg in its cycle, shape (N,)."""
        return NO_LEGS if memory is None else memory.phase[0]

    def command(
        self, situation: RobotState, aim: Reference, memory: Pace
    ) -> tuple[ActuatorCommand, Pace]:
        """Return the joint values for the next control period."""
        s, manner = situation, self.manner(aim.manner)
        heading = memory.heading
        if self.facing is Facing.aim:
            heading = np.full((1, 1), aim.yaw)
        elif math.isnan(heading.item()):
            heading = np.full((1, 1), s.yaw)
        last = memory._replace(heading=heading)
        given = s.rotation[None], aim.velocity[None], np.full((1, 1), aim.yaw_rate), s.step
        pace, places = self._pacing(given, manner, last)
        if self.catch > 0.0:
            pace = pace._replace(shift=self._caught(s, pace, manner))
            places[:, :, :2] += pace.shift.reshape(1, -1, 2)
        values, toes = (x[0] for x in self._stepping(*self.numbers(pace, places, manner)))
        if self._support is not None:
            stance = pace.phase[0] / manner.duty if pace.lively > 0.0 else 0.0 * pace.phase[0] + 0.5
            values = values + self._support.offsets(s, toes, stance)
            values = np.minimum(np.maximum(values, self._legs.lower), self._legs.upper)
        joints = self._rest.copy()
        joints[self._columns] = values
        return ActuatorCommand(np.zeros(self._drives), joints), pace

    def compile(self, compiled: Compiler | None) -> None:
        """Pace, and place toes and legs by machine code, or without."""
        legs, self._stepping, self._pacing = len(self._legs.toe), self._stepped, self.paced
        self._compiler, self._laws = compiled, {}
        if compiled is not None:
            self._stepping = compiled(self._stepped, [(1, legs), (1, legs, 3), (1, 6)])
            self._pacing = partial(self._paced_fast, {}, compiled)

    def _paced_fast(
        self, kernels: dict[float, Any], compiled: Compiler, given: Any, manner: Manner, memory: Any
    ) -> tuple[Pace, Floats]:
        """Return what `paced` does, by machine code that is made for each step."""
        *arrays, step = given

        def law(
            numbers: Array, rotation: Array, velocity: Array, feed: Array, *state: Array
        ) -> Any:
            own = Manner(*(numbers[:, k : k + 1] for k in range(len(manner))))
            last = Pace._make((*state, memory.shift))
            pace, places = self.paced((rotation, velocity, feed, step), own, last)
            return [*pace[:-1], places]

        arrays += memory[:-1]
        if step not in kernels:
            kernels[step] = compiled(law, [(1, len(manner)), *(x.shape for x in arrays)])
        *pace, places = kernels[step](np.array([manner]), *arrays)
        return Pace._make((*pace, memory.shift)), places

    def command_law(self, period: float, memory: Pace, aim: Reference) -> CommandLaw | None:
        """Return its law, where no toe asks what the robot does."""
        if self._compiler is None or self._support is not None or self.catch > 0.0:
            return None
        if period not in self._laws:
            self._laws[period] = self._law(self._compiler, period, memory)
        return self._laws[period]

    def _law(self, compiled: Compiler, period: float, form: Pace) -> CommandLaw:
        """Compile the law of `command`; ``form``: a state of any numbers."""
        shapes, names = [x.shape for x in form[:-1]], Manner._fields
        ends = np.cumsum([0, *(int(np.prod(shape)) for shape in shapes)]).tolist()
        # the legs' joints in the order of the legs, then those that rest
        rest = np.setdiff1d(np.arange(len(self._rest)), self._columns)
        order = np.argsort(np.concatenate((self._columns.ravel(), rest)))

        def law(*arrays: Array) -> list[Array]:
            rotation, velocity, yaw, feed, block, wishes = arrays
            xp, cuts = namespace(block), itertools.pairwise(ends)
            parts = [block[a:b].reshape(s) for (a, b), s in zip(cuts, shapes, strict=True)]
            last = Pace._make((*parts, as_like(form.shift, block)))
            if self.facing is Facing.aim:
                last = last._replace(heading=yaw)
            manner = Manner(*(wishes[:, k : k + 1] for k in range(len(names))))
            given = rotation[None], velocity[None], feed, period
            pace, places = self.paced(given, manner, last)
            values, _ = self._stepped(*self.numbers(pace, places, manner))
            joints = xp.concat((values.reshape(-1), as_like(self._rest[rest], block)), axis=0)
            numbers = xp.concat([x.reshape(-1) for x in pace[:-1]], axis=0)
            return [joints[order], numbers]

        kernel = compiled(law, [(3, 3), (3,), (1, 1), (1, 1), (ends[-1],), (1, len(names))])

        def remembered(numbers: Floats, last: Pace) -> Pace:
            cuts = itertools.pairwise(ends)
            parts = [numbers[a:b].reshape(s) for (a, b), s in zip(cuts, shapes, strict=True)]
            return Pace._make((*parts, last.shift))

        return CommandLaw(
            *(kernel, ("rotation", "velocity_wanted", "yaw", "yaw_rate", "memory", "manner"), 1),
            numbers=lambda memory: np.concatenate([x.reshape(-1) for x in memory[:-1]]),
            remembered=remembered,
            targets=0,
            aimed=lambda aim: {"manner": np.array([self.manner(aim.manner)])},
        )

    def numbers(self, pace: Pace, places: Array, manner: Manner) -> tuple[Array, Array, Array]:
        """Return the arguments of `_stepped`."""
        one = pace.lively * 0.0 + 1.0
        more = pace.frequency, manner.duty * one, manner.lift * pace.lively
        return pace.phase, places, namespace(one).concat((pace.walk, *more), axis=1)

    def _stepped(self, phase: Array, places: Array, numbers: Array) -> Sequence[Array]:
        """Return hip, lift and bend of all legs [rad] and their toes [m], (B, N, 3) each; pure."""
        frequency, duty, lift = (numbers[:, k : k + 1] for k in (3, 4, 5))
        toes = toes_of(phase, places, numbers[:, :3], frequency=frequency, duty=duty, lift=lift)
        return self._body.angles(toes), toes

    def manner(self, wishes: Mapping[str, float]) -> Manner:
        """Return the stepping parameters: those of the gait, overridden by the reference."""
        own = Manner(
            stroke=self.stroke,
            lift=self.lift,
            low=self.lowest,
            high=self.highest,
            spread=self.spread,
            crouch=self.crouch,
            **self.rhythm(),
        )
        return _wished(own, wishes)

    def share(self, step: float) -> float:
        """Return the share of a change of walk that is taken up in a step [s]."""
        return 1.0 - math.exp(-step / self.smooth)

    @abstractmethod
    def rhythm(self) -> dict[str, float]:
        """Return the stepping parameters that depend on the kind of gait."""

    @abstractmethod
    def order(self, manner: Manner) -> Array:
        """Return the phase offsets of the legs, shape (N,)."""

    @abstractmethod
    def advanced(self, pace: Pace, manner: Manner, step: float) -> Array:
        """Return the phases one period later, shape (B, N)."""

    def paced(
        self, given: tuple[Array, Array, Array, float], manner: Manner, memory: Pace
    ) -> tuple[Pace, Array]:
        """Update the commanded walk and advance the leg phases; pure, on any array library.

        Args:
            given: rotation of the bodies, shape (B, 3, 3); wanted velocity, world axes [m/s], shape
                (B, 3); rate of turn that is fed forward where the robots face their aim [rad/s],
                shape (B, 1); time until the next call [s].
            manner: of stepping.
            memory: of the last call; its heading is a number, and the aim's where robots face it.

        Returns:
            New state, and toes in the middle of their strokes, body axes [m], shape (B, N, 3).
        """
        rotation, velocity, feed, step = given
        xp, one = namespace(rotation), memory.lively * 0.0 + 1.0
        toe = self._body.toe[None]
        level = toe[:, :, :2] + (manner.spread * one)[:, :, None] * self._outward[None]
        height = toe[:, :, 2] + manner.crouch * one
        places = xp.concat((level, height[:, :, None]), axis=2)
        wanted, heading = self._wanted(rotation, velocity, feed, memory.heading)
        bounds = {k: getattr(manner, k) for k in ("duty", "stroke", "low", "high")}
        _, wanted = cadence(wanted, places, **bounds)
        share = self.share(step)
        walk = memory.walk + share * (wanted - memory.walk)
        going = xp.astype(xp.max(xp.abs(wanted), axis=1, keepdims=True) > SLOWEST, one.dtype)
        lively = memory.lively + share * (going - memory.lively)
        frequency, walk = cadence(walk, places, **bounds)
        stands = lively < STILL
        pace = Pace(memory.phase, walk, heading, lively, frequency, memory.shift)
        return pace._replace(
            phase=xp.where(stands, memory.phase, self.advanced(pace, manner, step)),
            lively=xp.where(stands, lively * going, lively),
        ), places

    def _caught(self, s: RobotState, pace: Pace, manner: Manner) -> Floats:
        """Shift of the toes: those in the air follow the error of the velocity (Raibert 1986)."""
        last = pace.shift.reshape(-1, 2)
        forward = s.rotation[:2, 0] / max(float(np.hypot(*s.rotation[:2, 0])), 1e-9)
        left = np.array([-forward[1], forward[0]])
        now = np.array([forward @ s.velocity[:2], left @ s.velocity[:2]])
        limit = 0.5 * manner.stroke
        target = np.clip(self.catch * (now - pace.walk[0, :2]), -limit, limit)
        # a toe is where it shall land when half of its way through the air is done
        swing = np.clip((pace.phase[0] - manner.duty) / (1.0 - manner.duty), 0.0, 1.0)
        left_over = np.maximum(0.5 - swing, 0.0) / max(s.step * pace.frequency.item(), 1e-9)
        share = np.where(swing > 0.0, 1.0 / (1.0 + left_over * (1.0 - manner.duty)), 0.0)
        shifted: Floats = last + pace.lively * share[:, None] * (target - last)
        return shifted.reshape(1, -1)

    def _wanted(
        self, rotation: Array, velocity: Array, feed: Array, heading: Array
    ) -> tuple[Array, Array]:
        """Return the walk in body axes that tracks velocity and heading, and that heading [rad]."""
        xp, yaw = namespace(rotation), _yaw(rotation)
        east, north = velocity[:, 0:1], velocity[:, 1:2]
        goes = xp.sqrt(east * east + north * north) >= SLOWEST
        if self.facing is not Facing.aim:
            way, feed = xp.atan2(north, east), feed * 0.0
            if self.facing is Facing.sideways:
                # the nearer of the two sides
                half = way * 0.0 + 0.5 * math.pi
                way = way - xp.where(xp.sin(way - yaw) >= 0.0, half, -half)
            heading = xp.where(goes, way, heading)
        error = xp.atan2(xp.sin(heading - yaw), xp.cos(heading - yaw))
        # an animal that stands does not shuffle for a degree
        turn = xp.where(~goes & (xp.abs(error) < SHUFFLE), feed, self.turn_gain * error + feed)
        turn = xp.clip(turn, -self.turn_limit, self.turn_limit)
        c, n = xp.cos(yaw), xp.sin(yaw)
        return xp.concat((c * east + n * north, c * north - n * east, turn), axis=1), heading


class BatchGait:
    """Gait of B robots.

    Args:
        gait: bound to the robot.
        batch: number of robots B.
        like: array whose library, type and device to use.

    Attributes:
        joints: columns of the legs' joints, shape (3 N,).
    """

    def __init__(self, gait: Walker, batch: int, like: Array) -> None:
        self._gait, self._batch = copy.copy(gait), batch
        self._gait._into(like)
        self.joints = gait._columns.ravel().tolist()

    def start(self) -> Pace:
        """Return standing gaits."""
        return self._gait.start(self._batch)

    def command(
        self,
        rotation: Array,
        velocity: Array,
        turn: Array | None,
        wishes: Mapping[str, Array],
        memory: Pace,
        *,
        step: float,
    ) -> tuple[Array, Pace]:
        """Return the joint values for the next period, shape (B, 3 N), and the new state.

        Args:
            rotation: of the bodies, shape (B, 3, 3).
            velocity: wanted, world axes [m/s], shape (B, 3).
            turn: wanted rate of turn [rad/s], shape (B, 1); None where the gait turns the robot.
            wishes: stepping parameters over those of the gait, shape (B, 1) each.
            memory: of the last call.
            step: until the next call [s].
        """
        xp, gait, yaw = namespace(velocity), self._gait, _yaw(rotation)
        # told how to turn, a robot has the heading that it has
        heading, feed = yaw, turn
        if turn is None:
            last = memory.heading
            heading, feed = xp.where(xp.isnan(last), yaw, last), yaw * 0.0
        manner, memory = gait.manner(wishes), memory._replace(heading=heading)
        pace, places = gait.paced((rotation, velocity, feed, step), manner, memory)
        values, _ = gait._stepped(*gait.numbers(pace, places, manner))
        return xp.reshape(values, (self._batch, -1)), pace


def _yaw(rotation: Array) -> Array:
    """Heading of the body x axis [rad], shape (B, 1)."""
    return namespace(rotation).atan2(rotation[:, 1, 0:1], rotation[:, 0, 0:1])


def _wished(own: Manner, wishes: Mapping[str, float]) -> Manner:
    """Return stepping parameters overridden by those of a reference.

    Args:
        own: of the gait.
        wishes: values by name; those of ``frequency`` mean the lowest and the highest one.

    Raises:
        ConfigError: a wish names nothing that a manner has.
    """
    if not wishes:
        return own
    values = dict(wishes)
    if "frequency" in values:
        values["low"] = values["high"] = values.pop("frequency")
    for name in values:
        if name not in Manner._fields:
            allowed = ["frequency", *Manner._fields]
            raise ConfigError(
                f"a gait has no parameter '{name}'.\n{suggestion(str(name), allowed)}"
            )
    numbers = {k: x if hasattr(x, "shape") else float(x) for k, x in values.items()}
    return own._replace(**numbers)
