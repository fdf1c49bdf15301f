"""What links feel: specific forces and angular accelerations over a step."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import NamedTuple, Protocol

import numpy as np

from seals.arrays import Array, Floats, as_like, namespace
from seals.backend import BodyOptions, Configuration
from seals.frames import conjugate, multiply, rotation_vector, unrotate
from seals.multibody.kinematics import Kinematics, LinkVelocities
from seals.multibody.tree import Tree
from seals.state_records import state_record


@state_record
class LinkTrack(NamedTuple):
    """The links at an instant, and how they moved over the step that led there.

    Args:
        time: of the instant [s].
        rotations: R_WL, shape (L, 3, 3).
        arms: link origins less the body's reference point, world axes [m], shape (L, 3).
        axes: joint axes, world [1], shape (J, 3).
        means: mean velocities of the link origins [m/s] and mean angular velocities [rad/s] over
            the step, world axes, shape (2, L, 3); at a start the velocities themselves.
        begun: whether a step has led there; not at a start.
    """

    time: float
    rotations: Array
    arms: Array
    axes: Array
    means: Array
    begun: bool

    def span(self, step: float, *, halved: bool) -> float:
        """Return the time over which the mean velocities change in the next step [s].

        The mean velocity of a step stands at its middle, so two of them are h apart; that of the
        first step, if it has a middle, is half a step after the velocity at the start.

        Args:
            step: h [s].
            halved: whether the body moved with the velocity at the middle of that step.
        """
        return 0.5 * step if halved and not self.begun else step


class Tracked(Protocol):
    """Links of a robot at one instant, with their track."""

    @property
    def track(self) -> LinkTrack:
        """The links with their motion over the last step."""
        ...


def arms_of(kinematics: Kinematics, reference: Floats) -> Array:
    """Return the link origins less a point of the base, world axes [m], shape (L, 3).

    Args:
        kinematics: of one robot.
        reference: the point in axes of the base [m], shape (3,).
    """
    origins, turn = kinematics.origins[0], kinematics.rotations[0, 0]
    arms = origins - origins[:1]
    if np.any(reference):
        arms = arms - (turn @ as_like(reference, origins))[None]
    return arms


def axes_of(kinematics: Kinematics) -> Array:
    """Return the joint axes of one robot, world [1], shape (J, 3)."""
    if kinematics.tree.joints:
        return kinematics.axes[0]
    return namespace(kinematics.origins).zeros((0, 3))


def mean_velocities(  # noqa: PLR0917  two instants and what lies between
    tree: Tree, before: LinkTrack, arms: Array, axes: Array, speed: Array, step: float
) -> Array:
    """Return mean velocities of link origins and mean angular velocities over a step, (2, L, 3).

    Equation:
        (p(t + h) - p(t)) / h of every link origin p, found as the mean velocity of the reference
        point and the change of the arms, so that no difference of far positions is taken; and
        w + sum (a_j(t) + a_j(t + h)) / 2 q_j' with the joint axes a_j at both ends.

    Args:
        tree: of the robot.
        before: the links at the start of the step.
        arms: at its end [m], shape (L, 3).
        axes: at its end, shape (J, 3).
        speed: mean generalised velocity over the step: of the reference point [m/s] and angular
            [rad/s], world axes, of the joints, shape (n,); a fixed base has the joints alone.
        step: h [s].
    """
    xp = namespace(arms)
    lead = 0 if tree.fixed_base else 6
    linear = (arms - before.arms) * (1.0 / step)
    angular = linear * 0.0
    if tree.joints:
        turning = 0.5 * (before.axes + axes) * speed[lead:, None]
        if tree.sliding:
            turning = turning * (1.0 - as_like(tree.slides, turning))
        angular = xp.matmul(as_like(tree.moves, turning), turning)
    if lead:
        linear = linear + speed[None, :3]
        angular = angular + speed[None, 3:6]
    return xp.concat((linear[None], angular[None]), axis=0)


def felt_by_links(
    before: LinkTrack, means: Array, gravity: float, span: Array | float, step: float
) -> tuple[Array, Array, Array]:
    """Return specific force, angular acceleration and velocity of all links, shape (L, 3) each.

    The acceleration of a step is the change of the mean velocity since the step before, over the
    time between the middles of both. With half-step velocities it is that of the forces at the
    start of the step, and it is told in the axes that the links had then [m/s^2, rad/s^2]. So is
    the angular velocity of that instant [rad/s]: a sensor off the origin feels w x (w x r) of the
    time at which it feels w' x r.

    Equation:
        f = R^T ((u_k - u_(k-1)) / h + g z), u_k the mean velocity over step k: summed over steps
        h (R f - g z) is the change of u, through every impact. w = w_k - w' h / 2, w_k the mean
        angular velocity over step k.

    Args:
        before: the links at the start of the step.
        means: mean velocities over the step, see `mean_velocities`.
        gravity: [m/s^2].
        span: time between the mean velocities, see `LinkTrack.span` [s].
        step: h [s].

    References:
        Hairer, Lubich and Wanner 2003, doi:10.1017/S0962492902000144: the Stoermer-Verlet method.
    """
    change = (means - before.means) / span
    force = unrotate(before.rotations, change[0]) + gravity * before.rotations[:, 2]
    turning = unrotate(before.rotations, means[1] - (0.5 * step) * change[1])
    return force, unrotate(before.rotations, change[1]), turning


class Tracker:
    """Follows the links of one robot from step to step, for what its inertial sensors feel.

    Args:
        tree: of the robot.
        body: of the robot.
        gravity: [m/s^2].
        wanted: whether any sensor needs it; else nothing is followed.
    """

    def __init__(self, tree: Tree, body: BodyOptions, gravity: float, *, wanted: bool) -> None:
        self._tree, self._body, self._gravity, self._wanted = tree, body, gravity, wanted
        self._last: LinkTrack | None = None
        self._noted: Tracked | None = None

    def begin(self, time: float, kinematics: Kinematics, moving: LinkVelocities) -> None:
        """Note the links where a run starts; later calls do nothing."""
        if self.last is None and self._wanted:
            self.last = self._at(time, kinematics, moving, begun=False)

    @property
    def last(self) -> LinkTrack | None:
        """The links at the last instant; None before the first."""
        if self._noted is not None:
            self._last, self._noted = self._noted.track, None
        return self._last

    @last.setter
    def last(self, track: LinkTrack | None) -> None:
        self._last, self._noted = track, None

    def note(self, look: Tracked) -> None:
        """Note the links as machine code found them."""
        if self._wanted:
            # their track is found when it is asked for
            self._noted = look

    def follow(
        self, time: float, kinematics: Kinematics, moving: LinkVelocities, step: float
    ) -> Callable[[], tuple[Array, Array, Array]]:
        """Follow the links over the last step [s]; return what gives `felt_by_links`."""
        before = self.last
        if before is None:
            return lambda: (moving.linear[0] * 0.0,) * 3
        now, speed = self._at(time, kinematics, moving, begun=True), self._body.mean_speed()
        if speed is not None:
            means = mean_velocities(self._tree, before, now.arms, now.axes, speed, step)
            now = now._replace(means=means)
        self.last, span = now, step
        if not before.begun:
            span = before.span(step, halved=self._body.middle_speed() is not None)
        return cache(partial(felt_by_links, before, now.means, self._gravity, span, step))

    def _at(
        self, time: float, kinematics: Kinematics, moving: LinkVelocities, *, begun: bool
    ) -> LinkTrack:
        """Return the links with their present velocities."""
        arms, axes = arms_of(kinematics, self._body.reference), axes_of(kinematics)
        both = np.concatenate((moving.linear, moving.angular))
        return LinkTrack(time, kinematics.rotations[0], arms, axes, both, begun)


def mean_motion(before: Configuration, after: Configuration, step: float) -> tuple[Floats, Floats]:
    """Return mean velocity of the base origin and mean angular velocity over steps, (N, 3) each.

    Args:
        before: at the start of each step, shape (N, ...).
        after: at its end.
        step: h [s].
    """
    turn = rotation_vector(multiply(after.quaternion, conjugate(before.quaternion)))
    return (after.position - before.position) / step, turn / step


def accelerations(seen: Configuration, step: float) -> tuple[Floats, Floats]:
    """Return the accelerations of steps that follow each other from a start, world axes.

    The velocity of a configuration holds half of the last kick more than the way of its step: its
    difference is not the acceleration, see `felt_by_links`.

    Args:
        seen: base at the start and after every step, shape (N + 1, ...).
        step: h [s].

    Returns:
        Acceleration of the base origin [m/s^2] and angular acceleration [rad/s^2] by the forces at
        the start of every step, shape (N, 3) each.
    """
    first, last = (Configuration(*(x[s] for x in seen)) for s in (slice(-1), slice(1, None)))
    found = []
    for way, start in zip(
        mean_motion(first, last, step), (seen.velocity, seen.angular_velocity), strict=True
    ):
        at_start = 2.0 * (way[:1] - start[:1])
        found.append(np.concatenate((at_start, np.diff(way, axis=0))) / step)
    return found[0], found[1]
