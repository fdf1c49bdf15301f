"""Task walk: walk to a target; actions are gait parameters at a low rate, a script's among them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.control import Reference
from seals.errors import ConfigError
from seals.field_roles import roles
from seals.learn.task import Draw, Instant, Task
from seals.plugins.tasks.rewards import Reward, chosen, near, unshaped
from seals.robot.model import RobotModel
from seals.schema import check_order, vector

SCRIPTED: Mapping[str, float] = {
    "frequency": 4.0,
    "stroke": 0.036,
    "lift": 0.009,
    "duty": 0.5,
    "spread": 0.0,
    "crouch": 0.0,
    "along": 0.5,
    "across": 0.5,
}
"""How the scripted crab steps: that of its folder, a tripod."""
PACE = 0.2
"""Speed of the scripted crab [m/s]."""
SLOWING = 0.05
"""Distance within which it slows down [m]."""
TURN_GAIN = 3.0
"""Of the rate of turn against the angle [1/s]."""


def _yaw_of(now: Instant) -> Array:
    """Return the heading of the body x axis [rad], shape (N, 1)."""
    return namespace(now.position).atan2(now.rotation[:, 1, 0:1], now.rotation[:, 0, 0:1])


def _over_ground(now: Instant) -> tuple[Array, Array]:
    """Return the horizontal vector to the target, heading axes [m] (N, 2), and its length."""
    xp = namespace(now.position)
    heading = _yaw_of(now)
    c, s = xp.cos(heading), xp.sin(heading)
    x, y = (now.target[:, k : k + 1] - now.position[:, k : k + 1] for k in (0, 1))
    away = xp.concat((c * x + s * y, c * y - s * x), axis=1)
    return away, xp.sqrt(x * x + y * y)


def scripted(
    task: TaskWalk, ranges: Mapping[str, tuple[float, float]], way: Array, far: Array
) -> Array:
    """Return actions that walk straight to the target with the leading side ahead.

    Args:
        task: with speeds, and the side that leads.
        ranges: of the manner of stepping, by name.
        way: to the target, heading axes [m], shape (N, 2).
        far: its length [m], shape (N, 1).
    """
    xp = namespace(way)
    one = far * 0.0 + 1.0
    share = xp.clip(far / SLOWING, 0.3, 1.0)
    going = xp.astype(far > 0.5 * task.success_distance, far.dtype)
    pace = going * share * (PACE / task.speed) / xp.maximum(far, one * 1e-6)
    angle = xp.atan2(way[:, 1:2], way[:, 0:1])
    if task.sideways:
        # the nearer of the two sides
        angle = angle - 0.5 * math.pi * xp.where(way[:, 1:2] >= 0.0, one, -one)
    turn = going * share * angle * (TURN_GAIN / max(task.turning, 1e-9))
    columns = [
        one * (2.0 * (SCRIPTED.get(name, 0.5 * (low + high)) - low) / max(high - low, 1e-12) - 1.0)
        for name, (low, high) in ranges.items()
    ]
    wanted = xp.concat((pace * way, turn, *columns), axis=1)
    return xp.clip(wanted, -1.0, 1.0)


GRAVITY = 9.81
"""By which the cost of transport is counted [m/s^2]."""
_BODY = ("target_x", "target_y", "distance", "velocity_x", "velocity_y", "velocity_z")
_TURN = ("spin_x", "spin_y", "spin_z", "up_x", "up_y")


def _manners() -> dict[str, Any]:
    """Ranges of the crab's gait parameters for the search, see docs/animals.md."""
    return {
        "frequency": [1.0, 6.0],
        "stroke": [0.015, 0.05],
        "lift": [0.003, 0.02],
        "duty": [0.4, 0.8],
    }


@roles(data="manner sideways")
@dataclass(kw_only=True)
class TaskWalk(Task):
    """Task: walk to a target from any direction; actions are gait parameters.

    An action sets the velocity of the body, its rate of turn, and how the legs step, each from its
    least to its largest value. The gait must turn as it is told: ``controller.facing=aim`` and
    ``controller.turn_gain=0``, as in the recipe.

    Equation:
        shaped reward = progress v / speed + heading cos(e) h - energy P / (m g speed) - slip s /
        speed - lean (1 - up) - smooth |da|^2 + bonus near the target; v towards the target, e the
        angle between the way to it and the nearer side (or the front).

    Args:
        rate: control steps a second [Hz].
        duration: of an episode [s].
        speed: velocity that an action of 1 asks for [m/s].
        turning: rate of turn that an action of 1 asks for [rad/s].
        manner: what else an action sets, and its least and largest values; see docs/animals.md.
        sideways: whether a side leads, as in crabs, or the front.
        reward_form: which reward is given.
        success_distance: within which the target counts as reached [m].
        hold: for how long it must be [s].
        goal: x and y of the place to go to [m].
        nearest: least distance of the starts from it [m].
        farthest: largest distance of the starts [m].
        height: of the body origin at the start, world [m].
        fallen: cosine of the tilt below which it has fallen, which ends the episode [1].
        progress: reward of a speed of ``speed`` towards the target [1].
        heading: reward of the heading away from the target [1].
        energy: cost of a cost of transport of 1 at ``speed`` [1].
        slip: cost of toes that slide at ``speed`` [1].
        lean: cost of a tilt of 90 degrees [1].
        smooth: cost of a change of one number of the action by 1 [1].
        bonus: at the target [1].
        width: over which the bonus falls [m].
        overspeed: speed that the paper's reward punishes [m/s].

    References:
        Appendix of the AAM-SEALS paper for the fixed target and the random starts and headings.

    Example:
        >>> TaskWalk().action_names[3:]
        ('frequency', 'stroke', 'lift', 'duty')
    """

    rate: float = chosen(5.0, "Hz", 1.0, 250.0, "once or twice a cycle")
    duration: float = chosen(8.0, "s", 0.1, 1e4, "three times the scripted crab's time")
    speed: float = chosen(0.25, "m/s", 1e-3, 20.0, "three widths of the crab a second")
    turning: float = chosen(2.0, "rad/s", 0.0, 100.0, "the gait's own limit")
    manner: dict[str, Any] = field(default_factory=_manners)
    sideways: bool = True
    reward_form: Reward = Reward.shaped
    success_distance: float = chosen(0.03, "m", 1e-4, 10.0, "less than half a carapace")
    hold: float = chosen(0.4, "s", 0.0, 60.0, "two control steps")
    goal: list[float] = vector((0.0, 0.0), "m", bounds=(-1e4, 1e4), source="chosen")
    nearest: float = chosen(0.4, "m", 0.0, 1e4, "five widths of the crab")
    farthest: float = chosen(0.4, "m", 0.0, 1e4, "five widths of the crab")
    height: float = chosen(0.029, "m", -1e4, 1e4, "the crab's stance")
    fallen: float = chosen(0.5, "1", -1.0, 1.0, "60 degrees")
    progress: float = chosen(1.0, "1", 0.0, 100.0, "the measure of the others")
    heading: float = chosen(0.1, "1", 0.0, 100.0, "a tenth")
    energy: float = chosen(0.1, "1", 0.0, 100.0, "a tenth: a crab has 0.6 to 1.3")
    slip: float = chosen(0.1, "1", 0.0, 100.0, "a tenth")
    lean: float = chosen(0.5, "1", 0.0, 100.0, "half")
    smooth: float = chosen(0.01, "1", 0.0, 100.0, "a hundredth")
    bonus: float = chosen(1.0, "1", 0.0, 100.0, "as walking")
    width: float = chosen(0.04, "m", 1e-4, 10.0, "as the success")
    overspeed: float = chosen(0.5, "m/s", 0.0, 100.0, "the paper gives none")

    def __post_init__(self) -> None:
        """Refuse an empty start ring, a goal that is no position, and empty ranges."""
        self._names: tuple[str, ...] = ()
        check_order(self, "nearest", "farthest", where="task", equal=True)
        for name, pair in self.manner.items():
            numbers = isinstance(pair, list) and all(isinstance(v, int | float) for v in pair)
            if not numbers or len(pair) != 2 or pair[0] > pair[1]:
                raise ConfigError(
                    f"task.manner.{name}={pair} is not a range.\n"
                    "Allowed: two numbers [least, largest]."
                )

    def bind(self, robot: RobotModel) -> None:
        """Look up the legs of the robot.

        Raises:
            ConfigError: the robot has none.
        """
        if not robot.legs:
            raise ConfigError(
                f"task walk needs legs; robot '{robot.name}' has none.\n"
                "Choose an animal: robot=crab, robot=sea_spider"
            )
        self._weight = GRAVITY * float(robot.mass.sum())
        self._names = tuple(robot.legs)
        self._posture: Floats = np.minimum(np.maximum(0.0, robot.lower), robot.upper)

    @property
    def posture(self) -> Floats:
        """Joint positions of the stance at the start [rad], shape (J,)."""
        return self._posture

    @property
    def knows(self) -> tuple[str, ...]:
        """Quantities that observations use: phases, power and slip of the legs."""
        return ("phase", "power", "slip")

    @property
    def action_names(self) -> tuple[str, ...]:
        """Names of the actions: body velocity, yaw rate, and gait parameters."""
        return ("ahead", "aside", "turn", *self.manner)

    @property
    def observation_names(self) -> tuple[str, ...]:
        """Names of the observations: target, twist, tilt in body axes, leg phases, last action."""
        legs = self._names
        phases = (f"{f}_{leg}" for f in ("cos", "sin") for leg in legs)
        return (*_BODY, *_TURN, *phases, *(f"last_{name}" for name in self.action_names))

    def draw(self, rng: np.random.Generator, count: int) -> Draw:
        """Return random starts on a ring about the target, with any heading."""
        way, yaw = rng.uniform(-math.pi, math.pi, (2, count, 1))
        far = rng.uniform(self.nearest, self.farthest, (count, 1))
        place = np.asarray(self.goal, dtype=float)
        flat = place + far * np.concatenate((np.cos(way), np.sin(way)), axis=1)
        start = np.concatenate((flat, np.full((count, 1), self.height)), axis=1)
        goal = np.concatenate((np.tile(place, (count, 1)), start[:, 2:]), axis=1)
        return Draw(start, yaw, np.zeros((count, 3)), goal)

    def places(self, goal: Floats) -> Mapping[str, Floats]:
        """Return an empty mapping: the target is a fixed position."""
        return {}

    def target(self, goal: Array, time: Array) -> tuple[Array, Array]:
        """Return the fixed position to walk to."""
        return goal, goal * 0.0

    def aim(self, action: Array, now: Instant) -> Reference:
        """Return velocity, yaw rate and gait parameters of an action."""
        velocity, turn, manner = self.steer(action, now)
        yaw = float(_yaw_of(now)[0, 0])
        plain = {name: float(value[0, 0]) for name, value in manner.items()}
        return Reference(velocity=velocity[0], yaw=yaw, yaw_rate=float(turn[0, 0]), manner=plain)

    def steer(self, action: Array, now: Instant) -> tuple[Array, Array, dict[str, Array]]:
        """Return velocities (N, 3), yaw rates (N, 1) and gait parameters (N, 1) of N actions."""
        shares = 0.5 * (1.0 + action[:, 3:])
        manner = {
            name: low + shares[:, k : k + 1] * (high - low)
            for k, (name, (low, high)) in enumerate(self.manner.items())
        }
        return self.command(action, now)[0], self.turning * action[:, 2:3], manner

    def command(self, action: Array, now: Instant) -> tuple[Array, Array]:
        """Return the wanted velocity, world axes, and the present heading."""
        xp = namespace(action)
        heading = _yaw_of(now)
        c, s = xp.cos(heading), xp.sin(heading)
        ahead, aside = self.speed * action[:, 0:1], self.speed * action[:, 1:2]
        return xp.concat((c * ahead - s * aside, s * ahead + c * aside, c * 0.0), axis=1), heading

    def observation(self, now: Instant) -> Array:
        """Return observations, shape (N, d)."""
        xp = namespace(now.position)
        away, far = _over_ground(now)
        own = xp.sum(now.rotation * now.velocity[:, :, None], axis=1)
        turn = (now.angular_velocity, now.rotation[:, 2, 0:2], now.facts["phase"])
        return xp.concat((away, far, own, *turn, now.action), axis=1)

    def distance(self, now: Instant) -> Array:
        """Return the horizontal distance to the target [m], shape (N,)."""
        return _over_ground(now)[1][:, 0]

    def reward(self, now: Instant, before: Instant, memory: Array) -> tuple[Array, Array]:
        """Return the rewards of a step, shape (N,), and the new state."""
        xp = namespace(now.position)
        far = self.distance(now)
        given = unshaped(self, now, far, memory)
        if given is not None:
            return given
        gained = self.rate * (self.distance(before) - far) / self.speed
        bonus = self.bonus * near(far, self.width)
        change = now.action - before.action
        cost = self.smooth * xp.sum(change * change, axis=1)
        if self.reward_form is Reward.progress:
            return self.progress * gained + bonus - cost, memory
        way, _ = _over_ground(now)
        leads = xp.abs(way[:, 1]) if self.sideways else way[:, 0]
        # at the target there is no way to face
        faced = leads / xp.maximum(far, far * 0.0 + self.width)
        cost = cost + self.energy * now.facts["power"][:, 0] / (self._weight * self.speed)
        cost = cost + self.slip * now.facts["slip"][:, 0] / self.speed
        cost = cost + self.lean * (1.0 - now.rotation[:, 2, 2])
        return self.progress * gained + self.heading * faced + bonus - cost, memory

    def effort(self, now: Instant) -> Array:
        """Return the work of the joints in a step over the weight [m], shape (N,)."""
        return now.facts["power"][:, 0] / (self._weight * self.rate)

    def ended(self, now: Instant, memory: Array) -> Array:
        """Return True where the robot has fallen, bool (N,)."""
        return now.rotation[:, 2, 2] < self.fallen

    def scripted_policy(self, now: Instant) -> Array:
        """Scripted policy: turn the leading side to the target, then walk straight."""
        ranges = {name: (float(low), float(high)) for name, (low, high) in self.manner.items()}
        return scripted(self, ranges, *_over_ground(now))
