"""Task reach: move the hand to a position in air or under water."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.control.limbs import stowed
from seals.errors import ConfigError
from seals.field_roles import roles
from seals.learn.task import ActionMode, Draw, Instant, Task
from seals.plugins.tasks.observation import (
    ObservationKind,
    level_hand_offset,
    names_of,
    observation_of,
)
from seals.plugins.tasks.rewards import Reward, length, near, unshaped
from seals.robot.model import RobotModel
from seals.schema import LATER, setting, vector

EXPERT_GAIN = 1.5
"""Of the expert's velocity against the distance [1/s]."""
INTEGRAL = 0.3
"""Of the velocity against the sum of the distance, of the expert in a current [1/s^2]."""
DRIFT, NEAR = 0.6, 0.15
"""Largest velocity by that sum [m/s], and largest distance in it [m]."""
TOPPLED = 20.0
"""Cost of a body that lies on its side where nobody holds its attitude, beyond that of a way [1]:
less, and to topple would be better than to drift away."""
DIGITS = 1e3
"""By which a target is multiplied, so that what stands behind the point chooses another [1/m]."""
_BOX = (-1e4, 1e4)


@roles(data="ends shuffled")
@dataclass(kw_only=True)
class TaskReach(Task):
    """Task: move until the hand is at the target, and hold it.

    Args:
        rate: control steps a second [Hz].
        duration: of an episode [s].
        speed: velocity that an action of 1 asks for [m/s].
        actions: what actions command, see `ActionMode`.
        rates: largest body rates that actions ask for with ``actions=body_rates`` [rad/s].
        sight: what is seen.
        reward_form: which reward is given.
        success_distance: within which the target counts as reached [m].
        hold: for how long it must be [s].
        ends: whether success ends the episode; it always does with the reward of the paper.
        shuffled: whether another place is shown than the target, as a negative control.
        arm: values of the joints of all arms [rad or m]; empty for straight down, which is zero.
        start_low: corner of the box of starting places, world [m].
        start_high: opposite corner [m].
        target_low: corner of the box of targets [m].
        target_high: opposite corner [m].
        clearance: targets this far from the water level are moved away from it [m].
        overspeed: speed that the paper's reward punishes [m/s].
        width: over which the bonus near the target falls [m].
        bonus: its size, in metres of distance [m].
        smooth: cost of a change of the action by 1 [m].

    References:
        Appendix of the AAM-SEALS paper for action, state, reward and termination.

    Example:
        >>> TaskReach(reward_form=Reward.paper).success_distance
        0.05
    """

    rate: float = setting(25.0, "Hz", bounds=(1.0, 250.0), source="chosen: ten steps")
    duration: float = setting(8.0, "s", bounds=(0.1, 1e4), source="chosen: 3 m at half speed")
    speed: float = setting(1.0, "m/s", bounds=(0.01, 20.0), source="chosen")
    sight: ObservationKind = ObservationKind.full
    reward_form: Reward = Reward.shaped
    success_distance: float = setting(0.05, "m", bounds=(1e-4, 10.0), source="opening of the hand")
    hold: float = setting(0.2, "s", bounds=(0.0, 60.0), source="chosen: the hand closes")
    ends: bool = False
    shuffled: bool = False
    arm: list[float] = vector((), "rad or m", bounds=(-1e3, 1e3), source="chosen: straight down")
    start_low: list[float] = vector((-0.7, -0.7, 0.7), "m", bounds=_BOX, source="chosen: in air")
    start_high: list[float] = vector((0.7, 0.7, 1.3), "m", bounds=_BOX, source="chosen")
    target_low: list[float] = vector(
        (-0.7, -0.7, -1.0), "m", bounds=_BOX, source="chosen: in water"
    )
    target_high: list[float] = vector((0.7, 0.7, 0.6), "m", bounds=_BOX, source="chosen: in air")
    clearance: float = setting(0.0, "m", bounds=(0.0, 10.0), source="chosen: none")
    overspeed: float = setting(1.5, "m/s", bounds=(0.0, 100.0), source="chosen: paper gives none")
    width: float = setting(0.1, "m", bounds=(1e-4, 10.0), source="chosen: twice the success")
    bonus: float = setting(1.0, "m", bounds=(0.0, 100.0), source="chosen: of the size of the path")
    smooth: float = setting(0.1, "m", bounds=(0.0, 10.0), source="chosen: of 0.02, 0.1 and 0.3")
    actions: ActionMode = field(default=ActionMode.velocity, metadata=LATER)
    rates: list[float] = vector(
        (3.0, 3.0, 1.5), "rad/s", bounds=(0.01, 50.0), source="chosen: a lean in 0.2 s", later=True
    )

    def __post_init__(self) -> None:
        """Refuse empty boxes."""
        for name in ("start", "target"):
            low, high = getattr(self, f"{name}_low"), getattr(self, f"{name}_high")
            if (
                len(low) != 3
                or len(high) != 3
                or any(a > b for a, b in zip(low, high, strict=True))
            ):
                raise ConfigError(
                    f"task.{name}_low={list(low)}, task.{name}_high={list(high)} do not define "
                    "a box.\n"
                    "Allowed: three numbers each, none of the low ones above the high ones."
                )

    def bind(self, robot: RobotModel) -> None:
        """Set the held posture: arms as given or straight, grippers open.

        Raises:
            ConfigError: the number of joint values does not fit.
        """
        values = stowed(robot)
        arms = [j for arm in robot.arms.values() for j in arm.joints]
        if self.arm and len(self.arm) != len(arms):
            raise ConfigError(
                f"task.arm has {len(self.arm)} values; robot '{robot.name}' has {len(arms)} joints "
                f"in its arms.\nAllowed: {len(arms)} numbers, or none for straight arms."
            )
        values[arms] = self.arm or 0.0
        self._posture = np.minimum(np.maximum(values, robot.lower), robot.upper)
        self._rotors = 0

    def equip(self, drives: int) -> None:
        """Note the number of rotors."""
        self._rotors = drives

    @property
    def posture(self) -> Floats:
        """Held joint positions [rad or m], shape (J,)."""
        return self._posture

    @property
    def action_names(self) -> tuple[str, ...]:
        """Names of the actions: body velocity in world axes, relative to ``speed``, or others."""
        if self.actions is ActionMode.rotor_thrust:
            return tuple(f"thrust_{k + 1}" for k in range(self._rotors))
        if self.actions is ActionMode.body_rates:
            return ("thrust", "rate_x", "rate_y", "rate_z")
        return ("velocity_x", "velocity_y", "velocity_z")

    @property
    def observation_names(self) -> tuple[str, ...]:
        """Names of the components of an observation, in order."""
        return names_of(self.sight, self.action_names, turning=self._turning)

    @property
    def _turning(self) -> bool:
        return self.actions is not ActionMode.velocity

    def draw(self, rng: np.random.Generator, count: int) -> Draw:
        """Return random starts and targets, uniform in their boxes."""
        start = rng.uniform(self.start_low, self.start_high, (count, 3))
        target = rng.uniform(self.target_low, self.target_high, (count, 3))
        if self.clearance > 0.0:
            side = np.where(target[:, 2] < 0.0, -1.0, 1.0)
            target[:, 2] = side * np.maximum(np.abs(target[:, 2]), self.clearance)
        still = np.zeros((count, 3))
        return Draw(start, still[:, :1], still, target)

    def target(self, goal: Array, time: Array) -> tuple[Array, Array]:
        """Return the fixed position of the target, with zero velocity."""
        place = goal[:, :3]
        return place, place * 0.0

    def command(self, action: Array, now: Instant) -> tuple[Array, Array]:
        """Return the wanted velocity and a heading of zero."""
        return action * self.speed, now.time * 0.0

    def observation(self, now: Instant) -> Array:
        """Return observations, shape (N, d)."""
        target = self._elsewhere(now.target) if self.shuffled else now.target
        seen = now._replace(tool=self.place(now), target=target)
        return observation_of(self.sight, seen, turning=self._turning)

    def _elsewhere(self, target: Array) -> Array:
        """Return a pseudo-random point of the target box, hashed from the target, shape (N, 3).

        It stays the same for an episode, and tells no learner where the target is.
        """
        xp = namespace(target)
        columns = []
        for k, (low, high) in enumerate(zip(self.target_low, self.target_high, strict=True)):
            digits = DIGITS * target[:, k : k + 1]
            columns.append(low + (high - low) * (digits - xp.floor(digits)))
        return xp.concat(columns, axis=1)

    def distance(self, now: Instant) -> Array:
        """Return the distance of the hand from the target [m], shape (N,)."""
        return length(now.target - self.place(now))

    def way(self, now: Instant) -> Array:
        """Return the vector from the hand to the target with the body level [m], shape (N, 3)."""
        return now.target - now.position - level_hand_offset(now._replace(tool=self.place(now)))

    def lacking(self, now: Instant) -> Array:
        """Return the larger of the target distances of hand and level hand [m], shape (N,).

        Of the hand alone, a body would gain by leaning it to the target; of the level hand alone,
        it might swing as it likes.
        """
        return namespace(now.position).maximum(self.distance(now), length(self.way(now)))

    def place(self, now: Instant) -> Array:
        """Return the point that must reach the target: the hand [m], shape (N, 3)."""
        return now.tool

    def reward(self, now: Instant, before: Instant, memory: Array) -> tuple[Array, Array]:
        """Return the rewards of a step, shape (N,), and the new state."""
        given = unshaped(self, now, self.distance(now), memory)
        if given is not None:
            return given
        gained = self.gained(now, before) - self.smooth * length(now.action - before.action)
        if self._turning:
            toppled = namespace(gained).astype(self.ended(now, memory), gained.dtype)
            gained = gained - TOPPLED * toppled
        return gained, memory

    def gained(self, now: Instant, before: Instant) -> Array:
        """Return the rewards of a step without the cost of its action, shape (N,)."""
        away = self.lacking(now)
        bonus = self.bonus * near(away, self.width)
        if self.reward_form is Reward.progress:
            return self.rate * (self.lacking(before) - away) + bonus
        return bonus - away

    def ended(self, now: Instant, memory: Array) -> Array:
        """Return True for bodies on their side where actions turn them; no other episode fails."""
        if self._turning:
            return now.rotation[:, 2, 2] < 0.0
        return now.time[:, 0] < 0.0

    @property
    def over_with_success(self) -> bool:
        """True if success ends the episode."""
        return self.ends or self.reward_form is Reward.paper

    def scripted_policy(self, now: Instant) -> Array:
        """Scripted policy: velocity towards the target, slower near it, shape (N, 3).

        Raises:
            ConfigError: actions command something else.
        """
        if self._turning:
            raise ConfigError(
                f"task.actions={self.actions.name} has no scripted policy, only velocity has.\n"
                "Leave it out (beside=[random]), or use task.actions=velocity"
            )
        wanted = self.way(now) * (EXPERT_GAIN / self.speed)
        return namespace(wanted).clip(wanted, -1.0, 1.0)


@dataclass(kw_only=True)
class TaskReachCurrent(TaskReach):
    """Task: move the hand to a position against a steady current, and hold it there.

    All fields are those of `TaskReach`; the current is an effect of the run, and no policy is told
    it. The script finds it by an integral of the error that it keeps in its own last action.

    Example:
        >>> TaskReachCurrent().hold
        0.2
    """

    def scripted_policy(self, now: Instant) -> Array:
        """Scripted policy: proportional and integral law, shape (N, 3).

        Equation:
            u = k w + i, i' = INTEGRAL (target - hand), |i| <= DRIFT, with w the way of the level
            hand; i of the step before is what its action held beside k w, while it was within its
            bounds.
        """
        xp, step, way = namespace(now.action), 1.0 / self.rate, self.way(now)
        # where the hand was seen a step ago, nearly
        before = EXPERT_GAIN * (way + step * (now.velocity - now.target_velocity))
        held = self.speed * now.action - before
        free = (xp.abs(now.action) < 1.0) & (now.time > 0.5 * step)
        held = xp.where(free, xp.clip(held, -DRIFT, DRIFT), held * 0.0)
        gained = xp.clip(now.target - self.place(now), -NEAR, NEAR)
        wanted = EXPERT_GAIN * way + held + INTEGRAL * step * gained
        return xp.clip(wanted / self.speed, -1.0, 1.0)
