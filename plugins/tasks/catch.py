"""Task catch: find an animal on the bottom, grip it and lift it out of the water.

Its script is a diver without memory. The hand reaches ahead of the body, along x. An animal that
flees from the body then runs that way, at a steady pace that the hand can follow, and not back and
forth beneath it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.control import Reference
from seals.errors import ConfigError
from seals.field_roles import roles
from seals.learn.task import ActionMode, Draw, Instant
from seals.plugins.tasks.observation import ObservationKind, level_hand_offset
from seals.plugins.tasks.reach import TaskReach
from seals.plugins.tasks.rewards import Reward, chosen, near
from seals.robot.model import RobotModel
from seals.schema import vector

GAIN = 1.2
"""Of the velocity against the distance [1/s]."""
SIDE = 2.0
"""The same across the hand's reach: an animal that flees from the body behind it breaks away there,
at its speed over the reach, which this must exceed [1/s]."""
CLEAR = 0.2
"""Height of the open hand above the animal while it is not over it [m]."""
FUNNEL = 4.0
"""Rise of that height with the horizontal distance [1]."""
OVER = 0.03
"""Horizontal distance at which the hand is over the animal [m]."""
LOW = -0.004
"""Height of the open hand's tips above the animal's origin at which it closes: the tips then go
down by 13 mm and hold below the widest part of a carapace [m]."""
AT = (0.013, 0.12)
"""Distance, horizontal and vertical, at which the hand closes [m], and its rise with the animal's
pace [s]: a still one is held best in the middle, and one that runs is not to be waited for."""
EMPTY = 0.95
"""Closure of fingers that have met each other [1]."""
SLOW = 0.15
"""Largest speed down to the animal near it [m/s]."""
PACE = 0.12
"""Speed of an animal that is followed; what a hand jostles moves faster and is not [m/s]."""
LEAD = 3.5
"""By which the level hand leads an animal, because the hand itself trails behind a body that leans
against drag: distance over speed squared [s^2/m]."""
BESIDE = 0.5
"""Share of the animal's pace across the hand's reach that is followed: all of it would swing on,
because an animal that flees answers to every move [1]."""
EASE = 0.35
"""Share of a change of the horizontal velocity that is asked for in a control step: an animal's
pace comes and goes with its strides, and a body that followed that would swing its hand [1]."""
CALM = (0.1, 1.0)
"""Lean, as the sine of it, above which a hand swings too far to close [1], and its rise with the
pace [s/m]: a body leans against its drag."""
SWING = (0.25, 1.5)
"""Spin of the body above which it swings too fast to close [rad/s], and its rise [rad/m]."""
LIFT = 0.35
"""Speed of the lift [m/s]."""
JERK = 0.08
"""By which the wanted speed of the lift is above the present one [m/s]."""
LOOK = 1.1
"""Height above the water from which it looks for what it does not see [m]."""
RING = 0.4
"""Radius of the ring on which it looks [m]."""
LAP = 8.0
"""Time of a lap on that ring [s]."""


def _fetch(task: TaskCatch, now: Instant, seen: Array) -> Array:
    """Return actions: search, follow, descend, close, lift; begin again when it slipped away.

    The last action is its memory: a hand that has begun to close goes on, and one that has begun
    to open does, too.

    Args:
        task: with speeds, sizes and times.
        now: with the facts ``grip``, ``closed``, ``touch`` and ``level``.
        seen: 1 where the animal is seen, shape (N, 1).
    """
    xp = namespace(now.position)
    away, grip = now.target - now.tool, now.facts["grip"]
    flat = xp.sqrt(xp.sum(away[:, :2] * away[:, :2], axis=1, keepdims=True))
    level = now.target - now.position - level_hand_offset(now)
    far = xp.sqrt(xp.sum(away * away, axis=1, keepdims=True))
    there = seen > 0.5
    fast = _speed(now)
    at = AT[0] + AT[1] * fast
    below = xp.abs(away[:, 2:3] + LOW) < at
    open_ = grip < 1.0 / (task.rate * task.closing)
    ready = there & open_ & (flat < at) & below & _calm(now, fast)
    begun = now.action[:, 3:4] > 0.0
    # the fingers have come to something, or to each other
    shut = (grip > 1.0 - 1e-6) | (grip - now.facts["closed"] > task.squeeze - 0.02)
    empty = now.facts["closed"] > EMPTY
    done = task.delivered(now)
    closing = (ready | (begun & ~(shut & ((far > task.grasp) | empty)))) & ~done
    firm = xp.astype(now.facts["touch"] > task.firm, far.dtype)
    # one finger alone would push it over
    lifting = closing & shut & (xp.sum(firm, axis=1, keepdims=True) > 1.5)
    pace = _pace(now, closing)
    follow = _follow(level + _lead(pace), flat, grip, closing) + pace
    velocity = xp.where(there, follow, away * 0.0)
    velocity = xp.where(there | closing, velocity, _search(now))
    velocity = xp.where(lifting, task.bring(now), velocity)
    velocity = xp.where(done, task.leave(now), velocity)
    one = grip * 0.0 + 1.0
    flat = now.action[:, :2] + EASE * (velocity[:, :2] / task.speed - now.action[:, :2])
    wanted = xp.concat((flat, velocity[:, 2:3] / task.speed, xp.where(closing, one, -one)), axis=1)
    return xp.clip(wanted, -1.0, 1.0)


def _speed(now: Instant) -> Array:
    """Horizontal speed of the animal, up to that at which it is followed [m/s], shape (N, 1)."""
    xp = namespace(now.position)
    flat = now.target_velocity[:, :2]
    fast = xp.sqrt(xp.sum(flat * flat, axis=1, keepdims=True))
    return xp.minimum(fast, fast * 0.0 + PACE)


def _calm(now: Instant, fast: Array) -> Array:
    """Test if the body is level and slow enough for the hand to stay in place, shape (N, 1)."""
    xp = namespace(now.position)
    lean, turn = now.rotation[:, 2, 0:2], now.angular_velocity[:, 0:2]
    most, spin = CALM[0] + CALM[1] * fast, SWING[0] + SWING[1] * fast
    level = xp.sum(lean * lean, axis=1, keepdims=True) < most * most
    return level & (xp.sum(turn * turn, axis=1, keepdims=True) < spin * spin)


def _pace(now: Instant, closing: Array) -> Array:
    """Feedforward velocity: that of the animal; while the hand closes, that of the hand [m/s].

    A hand that went along with what it jostles would jostle it the more, and one that changed its
    pace while it closes would swing.
    """
    xp = namespace(now.position)
    own = xp.concat((now.velocity[:, :2], now.velocity[:, 2:3] * 0.0), axis=1)
    pace = xp.clip(xp.where(closing, own, now.target_velocity), -PACE, PACE)
    return xp.concat((pace[:, 0:1], BESIDE * pace[:, 1:2], pace[:, 2:3]), axis=1)


def _lead(pace: Array) -> Array:
    """Distance by which a hand trails behind a body at a pace along its reach [m], shape (N, 3)."""
    xp = namespace(pace)
    ahead = pace[:, 0:1]
    return xp.concat((LEAD * ahead * xp.abs(ahead), ahead * 0.0, ahead * 0.0), axis=1)


def _follow(away: Array, aside: Array, grip: Array, closing: Array) -> Array:
    """Velocity relative to the animal: to a place above it, then down within a cone [m/s].

    Args:
        away: way of the level hand to it [m], shape (N, 3).
        aside: horizontal distance of the hand itself [m], shape (N, 1).
        grip: that is wanted [1], shape (N, 1).
        closing: whether the hand closes, shape (N, 1).
    """
    xp = namespace(away)
    # open fingers of a hand that swings would knock it over
    flat = xp.maximum(xp.sqrt(xp.sum(away[:, :2] * away[:, :2], axis=1, keepdims=True)), aside)
    zero = flat * 0.0
    above = xp.minimum(xp.maximum(FUNNEL * (flat - OVER), zero), zero + CLEAR)
    # a hand that opens goes up first
    above = xp.where((grip > 0.0) & ~closing, zero + CLEAR, above)
    gap = away[:, 2:3] + LOW + above
    down = xp.maximum(GAIN * gap, zero - SLOW - 1.5 * xp.maximum(-gap - CLEAR, zero))
    return xp.concat((GAIN * away[:, 0:1], SIDE * away[:, 1:2], down), axis=1)


def _search(now: Instant) -> Array:
    """Velocity to a circle above the water, and along it [m/s]."""
    xp = namespace(now.position)
    turn = 2.0 * math.pi * now.time / LAP
    level = now.facts["level"]
    place = xp.concat((RING * xp.cos(turn), RING * xp.sin(turn), level + LOOK), axis=1)
    return GAIN * (place - now.position)


def lifted(now: Instant, end: Array) -> Array:
    """Return the upward velocity that brings what is held to a height, shape (N, 3) [m/s].

    Args:
        now: of N robots.
        end: world height [m], shape (N, 1).
    """
    xp = namespace(now.position)
    up = xp.minimum(GAIN * (end - now.target[:, 2:3]), end * 0.0 + LIFT)
    up = xp.minimum(up, xp.maximum(now.velocity[:, 2:3], end * 0.0) + JERK)
    return xp.concat((up * 0.0, up * 0.0, up), axis=1)


_BOX = (-1e4, 1e4)
_OWN = ("x", "y", "height", "velocity_x", "velocity_y", "velocity_z", "spin_x", "spin_y", "spin_z")
_AWAY = ("target_x", "target_y", "target_z", "drift_x", "drift_y", "drift_z", "seen")


@roles(data="object")
@dataclass(kw_only=True)
class TaskCatch(TaskReach):
    """Find an animal, grip it and hold it above the water; actions are velocities and the grip.

    The arm keeps its posture, straight down by default. The target is an object of the run; what
    it does is its guide's affair, for instance ``objects.crab.guide=freeze``. It is seen while it
    is within a cone below the body; outside of it, its place and velocity are observed as zeros.

    Args:
        success_distance: what may be lacking of the height, and of the hand on the animal [m].
        hold: for how long the animal must be held above the water [s].
        object: name of the animal among the objects.
        height: of the animal above the water at which it is caught [m]; below zero for a lift
            under water.
        depth: under the water from which a lift is rewarded [m].
        grasp: distance of the hand from an animal that is in it [m].
        closing: time in which an action of 1 closes the open hand [s].
        squeeze: how far the wanted grip may be ahead of the fingers' own, which bounds their force
            [1].
        view: half of the angle of the cone in which the animal is seen, from the vertical [rad].
        firm: force on a finger-tip that counts as a grip [N].
        target_low: corner of the rectangle in which the animal begins, x and y [m]; its z is that
            of the object.

    All other fields are those of `TaskReach`; ``clearance`` and ``width`` are not used.

    Example:
        >>> TaskCatch().action_names[-1]
        'grip'
    """

    rate: float = chosen(10.0, "Hz", 1.0, 250.0, "a hand's breadth per step at full speed")
    duration: float = chosen(25.0, "s", 0.1, 1e4, "twice the expert's time")
    speed: float = chosen(0.5, "m/s", 0.01, 20.0, "faster than a crab on the sea bed")
    success_distance: float = chosen(0.02, "m", 1e-4, 10.0, "a tenth of the height")
    hold: float = chosen(1.0, "s", 0.0, 60.0, "as the mission's last stage")
    object: str = "crab"
    height: float = chosen(0.2, "m", -1e4, 100.0, "clear of waves in a tank")
    depth: float = chosen(1.0, "m", 0.0, 1e4, "of the tank of the recipe")
    grasp: float = chosen(0.07, "m", 1e-3, 10.0, "half of a carapace and a finger")
    closing: float = chosen(1.0, "s", 0.01, 60.0, "as the mission")
    squeeze: float = chosen(0.2, "1", 0.0, 1.0, "one or two newtons on each fingertip of aam")
    view: float = chosen(0.5, "rad", 0.01, 3.2, "the lens of an action camera")
    firm: float = chosen(0.3, "N", 1e-6, 1e3, "above splashes, as the mission")
    start_low: list[float] = vector((-0.7, -0.7, 0.5), "m", bounds=_BOX, source="chosen: in air")
    start_high: list[float] = vector((0.7, 0.7, 0.8), "m", bounds=_BOX, source="chosen: in air")
    target_low: list[float] = vector((-0.7, -0.7, 0.0), "m", bounds=_BOX, source="chosen")
    target_high: list[float] = vector((0.7, 0.7, 0.0), "m", bounds=_BOX, source="chosen")

    _pads = 0

    def bind(self, robot: RobotModel) -> None:
        """Look up hand and held joint positions of the robot.

        Raises:
            ConfigError: the robot has no gripper with tips, or actions command no velocity.
        """
        hand: Any = next((g for g in robot.grippers.values() if g.tips), None)
        if hand is None:
            raise ConfigError(
                f"task catch needs a gripper with tips; robot '{robot.name}' has none.\n"
                "Choose a robot with a hand: robot=aam"
            )
        if self.actions is not ActionMode.velocity:
            raise ConfigError(
                f"task.actions={self.actions.name} has no form for catching.\n"
                "Allowed: velocity; the other ones in env=hover, reach or oval."
            )
        super().bind(robot)
        self._hand, self._pads = hand.name, len(hand.tips)

    @property
    def knows(self) -> tuple[str, ...]:
        """Quantities that observations use: grip, contact and water level."""
        return ("grip", "closed", "touch", "level")

    @property
    def action_names(self) -> tuple[str, ...]:
        """Names of the actions: body velocity relative to ``speed``, and rate of the grip."""
        return ("velocity_x", "velocity_y", "velocity_z", "grip")

    @property
    def observation_names(self) -> tuple[str, ...]:
        """Names of the components of an observation, in order."""
        pads = self._pads
        hand = ("grip", "closed", *(f"touch_{k + 1}" for k in range(pads)))
        rest = ("up_x", "up_y", "submersion", *hand)
        first = () if self.sight is ObservationKind.blind else _AWAY
        return (*first, *_OWN, *rest, *(f"last_{name}" for name in self.action_names))

    def draw(self, rng: np.random.Generator, count: int) -> Draw:
        """Return random starts, and position and heading of the animal."""
        start = rng.uniform(self.start_low, self.start_high, (count, 3))
        place = rng.uniform(self.target_low[:2], self.target_high[:2], (count, 2))
        yaw = rng.uniform(-math.pi, math.pi, (count, 1))
        still = np.zeros((count, 3))
        return Draw(start, still[:, :1], still, np.concatenate((place, yaw), axis=1))

    def places(self, goal: Floats) -> Mapping[str, Floats]:
        """Return the animal's initial pose: x, y, heading."""
        return {self.object: goal[0]}

    def aim(self, action: Array, now: Instant) -> Reference:
        """Return the wanted velocity and grip of an action."""
        velocity, yaw = self.command(action, now)
        grip = {self._hand: float(self.grip(action, now)[0, 0])}
        return Reference(velocity=velocity[0], yaw=float(yaw[0, 0]), grip=grip)

    def grip(self, action: Array, now: Instant) -> Array:
        """Return the wanted grip of an action, 0 for open and 1 for closed, shape (N, 1)."""
        xp, facts = namespace(action), now.facts
        grip = facts["grip"] + action[:, 3:4] / (self.rate * self.closing)
        return xp.clip(xp.minimum(grip, facts["closed"] + self.squeeze), 0.0, 1.0)

    def command(self, action: Array, now: Instant) -> tuple[Array, Array]:
        """Return the wanted velocity and a heading of zero."""
        return super().command(action[:, :3], now)

    def seen(self, now: Instant) -> Array:
        """Return 1 for an animal within the cone below the body, else 0, shape (N, 1)."""
        xp = namespace(now.position)
        away = now.target - now.position
        down = -away[:, 2:3]
        flat = xp.sqrt(xp.sum(away[:, :2] * away[:, :2], axis=1, keepdims=True))
        angle = xp.atan2(flat, down)
        return xp.astype(angle < self.view, down.dtype)

    def observation(self, now: Instant) -> Array:
        """Return observations, shape (N, d)."""
        xp = namespace(now.position)
        facts, there = now.facts, self.seen(now)
        touch = xp.tanh(facts["touch"] / self.firm)
        own = (
            now.position[:, :2],
            now.position[:, 2:3] - facts["level"],
            now.velocity,
            now.angular_velocity,
        )
        rest = (now.rotation[:, 2, 0:2], now.submersion, facts["grip"], facts["closed"], touch)
        away = (
            (now.target - now.position - level_hand_offset(now)) * there,
            now.target_velocity * there,
            there,
        )
        first = () if self.sight is ObservationKind.blind else away
        return xp.concat((*first, *own, *rest, now.action), axis=1)

    def distance(self, now: Instant) -> Array:
        """Return the remaining height and grip before success [m], shape (N,)."""
        xp = namespace(now.position)
        lacking = now.facts["level"][:, 0] + self.height - now.target[:, 2]
        away = xp.maximum(self.reached(now) - self.grasp, lacking * 0.0)
        return xp.maximum(lacking, lacking * 0.0) + away

    def reached(self, now: Instant) -> Array:
        """Return the distance of the hand from the animal [m], shape (N,)."""
        return super().distance(now)

    def stages(self, now: Instant) -> Array:
        """Return the progress of the catch: nearness, grip, way of what is held, shape (N,)."""
        xp = namespace(now.position)
        away = self.reached(now)
        close = near(away, self.grasp)
        press = xp.tanh(now.facts["touch"] / self.firm)
        grip = xp.sum(press, axis=1) / press.shape[1]
        held = close * xp.astype(xp.sum(press, axis=1) > 1.0, away.dtype)
        done = xp.astype(self.delivered(now)[:, 0], away.dtype)
        gone = xp.maximum(held, done) * xp.clip(self.gone(now), 0.0, 1.0)
        bonus = self.bonus * (close + close * grip + 4.0 * gone + 2.0 * done)
        return bonus - xp.minimum(away, away * 0.0 + 2.0)

    def gone(self, now: Instant) -> Array:
        """Return the share of the way of what is held [1], shape (N,): here of the lift."""
        lacking = now.facts["level"][:, 0] + self.height - now.target[:, 2]
        return 1.0 - lacking / (self.height + self.depth)

    def delivered(self, now: Instant) -> Array:
        """Test if the hand is to let go, shape (N, 1): here never."""
        return now.time < 0.0

    def bring(self, now: Instant) -> Array:
        """Return the script's velocity with a full hand [m/s], shape (N, 3): here upward."""
        return lifted(now, now.facts["level"] + self.height + 0.5 * abs(self.height))

    def leave(self, now: Instant) -> Array:
        """Return the script's velocity after it has let go [m/s], shape (N, 3)."""
        return self.bring(now)

    def gained(self, now: Instant, before: Instant) -> Array:
        """Return the rewards of a step without the cost of its action, shape (N,)."""
        if self.reward_form is Reward.progress:
            return self.rate * (self.stages(now) - self.stages(before))
        return self.stages(now)

    def scripted_policy(self, now: Instant) -> Array:
        """Return the actions of a memoryless scripted diver, shape (N, 4)."""
        return _fetch(self, now, self.seen(now))
