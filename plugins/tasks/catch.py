"""Task catch: find an animal on the bottom, grip it and lift it out of the water."""

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
from seals.learn.task import Draw, Instant
from seals.plugins.tasks.catching import fetch
from seals.plugins.tasks.observation import ObservationKind, level_hand_offset
from seals.plugins.tasks.reach import TaskReach
from seals.plugins.tasks.rewards import Reward, near, unshaped
from seals.robot.model import RobotModel
from seals.schema import setting, vector

_BOX = (-1e4, 1e4)
_OWN = ("x", "y", "height", "velocity_x", "velocity_y", "velocity_z", "spin_x", "spin_y", "spin_z")
_AWAY = ("target_x", "target_y", "target_z", "drift_x", "drift_y", "drift_z", "seen")


def _number(default: float, unit: str, low: float, high: float, why: str) -> float:
    return setting(default, unit, bounds=(low, high), source=f"chosen: {why}")


@roles(data="object")
@dataclass(kw_only=True)
class TaskCatch(TaskReach):
    """Find an animal, grip it and hold it above the water; actions are velocities and the grip.

    The arm keeps its posture, straight down by default. The target is an object of the run; what
    it does is its guide's affair, for instance ``objects.crab.guide=freeze``. It is seen while it
    is within a cone below the body; outside of it, its place and velocity are observed as zeros.

    Args:
        rate: control steps a second [Hz].
        duration: of an episode [s].
        speed: velocity that an action of 1 asks for [m/s].
        success_distance: what may be lacking of the height, and of the hand on the animal [m].
        hold: for how long the animal must be held above the water [s].
        object: name of the animal among the objects.
        height: of the animal above the water at which it is caught [m].
        depth: under the water from which a lift is rewarded [m].
        grasp: distance of the hand from an animal that is in it [m].
        closing: time in which an action of 1 closes the open hand [s].
        squeeze: how far the wanted grip may be ahead of the fingers' own, which bounds their force
            [1].
        view: half of the angle of the cone in which the animal is seen, from the vertical [rad].
        firm: force on a finger-tip that counts as a grip [N].
        start_low: corner of the box of starting places, world [m].
        start_high: opposite corner [m].
        target_low: corner of the rectangle in which the animal begins, x and y [m]; its z is that
            of the object.
        target_high: opposite corner [m].

    All other fields are those of `TaskReach`; ``clearance`` and ``width`` are not used.

    Example:
        >>> TaskCatch().action_names[-1]
        'grip'
    """

    rate: float = _number(10.0, "Hz", 1.0, 250.0, "a hand's breadth a step at full speed")
    duration: float = _number(25.0, "s", 0.1, 1e4, "twice the expert's time")
    speed: float = _number(0.5, "m/s", 0.01, 20.0, "faster than a crab on the sea bed")
    success_distance: float = _number(0.02, "m", 1e-4, 10.0, "a tenth of the height")
    hold: float = _number(1.0, "s", 0.0, 60.0, "as the mission's last stage")
    object: str = "crab"
    height: float = _number(0.2, "m", 0.0, 100.0, "clear of waves in a tank")
    depth: float = _number(1.0, "m", 0.0, 1e4, "of the tank of the recipe")
    grasp: float = _number(0.07, "m", 1e-3, 10.0, "half of a carapace and a finger")
    closing: float = _number(1.0, "s", 0.01, 60.0, "as the mission")
    squeeze: float = _number(0.2, "1", 0.0, 1.0, "a newton or two on each tip of the hand of aam")
    view: float = _number(0.5, "rad", 0.01, 3.2, "the lens of an action camera")
    firm: float = _number(0.3, "N", 1e-6, 1e3, "above splashes, as the mission")
    start_low: list[float] = vector((-0.7, -0.7, 0.5), "m", bounds=_BOX, source="chosen: in air")
    start_high: list[float] = vector((0.7, 0.7, 0.8), "m", bounds=_BOX, source="chosen: in air")
    target_low: list[float] = vector((-0.7, -0.7, 0.0), "m", bounds=_BOX, source="chosen")
    target_high: list[float] = vector((0.7, 0.7, 0.0), "m", bounds=_BOX, source="chosen")

    _pads = 0

    def bind(self, robot: RobotModel) -> None:
        """Look up hand and held joint positions of the robot.

        Raises:
            ConfigError: the robot has no gripper with tips.
        """
        hand: Any = next((g for g in robot.grippers.values() if g.tips), None)
        if hand is None:
            raise ConfigError(
                f"task catch needs a gripper with tips; robot '{robot.name}' has none.\n"
                "Choose a robot with a hand: robot=aam"
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
        """Return the progress of the catch: nearness, grip, height, from -2 to 6, shape (N,)."""
        xp = namespace(now.position)
        away = self.reached(now)
        close = near(away, self.grasp)
        press = xp.tanh(now.facts["touch"] / self.firm)
        grip = xp.sum(press, axis=1) / press.shape[1]
        held = close * xp.astype(xp.sum(press, axis=1) > 1.0, away.dtype)
        lacking = now.facts["level"][:, 0] + self.height - now.target[:, 2]
        lift = xp.maximum(1.0 - lacking / (self.height + self.depth), away * 0.0)
        lift = xp.minimum(lift, away * 0.0 + 1.0)
        return self.bonus * (close + close * grip + 4.0 * held * lift) - xp.minimum(
            away, away * 0.0 + 2.0
        )

    def reward(self, now: Instant, before: Instant, memory: Array) -> tuple[Array, Array]:
        """Return the rewards of a step, shape (N,), and the new state."""
        xp = namespace(now.position)
        given = unshaped(self, now, self.distance(now), memory)
        if given is not None:
            return given
        change = now.action - before.action
        cost = self.smooth * xp.sqrt(xp.sum(change * change, axis=1))
        if self.reward_form is Reward.progress:
            return self.rate * (self.stages(now) - self.stages(before)) - cost, memory
        return self.stages(now) - cost, memory

    def scripted_policy(self, now: Instant) -> Array:
        """Return the actions of a memoryless scripted diver, shape (N, 4)."""
        return fetch(self, now, self.seen(now))
