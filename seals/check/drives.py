"""Checks of rotors and thrusters."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from seals.arrays import Floats
from seals.check.finding import RobotFinding, failed, passed, warned
from seals.check.floating import FloatingBody
from seals.check.lift import (
    CommandedDirections,
    authority,
    hover_share,
)
from seals.control.axes import wrench_matrix
from seals.control.fins import with_fins
from seals.control.plant import ROTOR, Layout, layout_of, rest_poses
from seals.control.tilts import tilts_of
from seals.effects.binding import bind_effects
from seals.effects.effect import Effect, MediumKind
from seals.robot.model import RobotModel
from seals.robot.whole_body import whole_body

GRAVITY, AIR = 9.81, 1.2041
"""Gravity [m/s^2] and density of air [kg/m^3]."""
ATTACK = 0.2
"""Angle of attack below stall at which wings carry a vehicle [rad]."""
LEVEL = 0.7
"""Upright part of the normal of a wing that carries [1]."""
THIN_MARGIN = 1.3
"""Full thrust by weight below which a robot hovers, but hardly steers [1]."""
STIFF = 100.0
"""Condition number of an allocation from which on one direction is nearly out of reach."""
SLUGGISH = {"roll": 5.0, "pitch": 5.0, "yaw": 0.5}
"""Angular accelerations below which flying gets hard [rad/s^2]."""


def look_at_drives(
    robot: RobotModel,
    actuators: Mapping[str, Effect],
    *,
    steers: bool = False,
    wings: float = 0.0,
) -> Iterator[RobotFinding]:
    """Yield findings about thrust and control allocation.

    Args:
        robot: the robot.
        actuators: by instance name; servos are passed over.
        steers: whether it commands surge and yaw by thrusters or fins: other axes may be passive.
        wings: slope of the lift of its level wings in air, from `lift_slope` [m^2].

    Raises:
        ConfigError: the actuators do not fit together or sit on unknown links.
    """
    layout = layout_of(robot, bind_effects(actuators, robot.links))
    body = FloatingBody(robot)
    if layout.drives == 0 or robot.tree.fixed_base or body.mass <= 0.0:
        return
    rotor = np.array([kind == ROTOR for kind in layout.kind])
    tilts = tilts_of(robot, layout, body.mass * GRAVITY / max(int(rotor.sum()), 1))
    whole = with_fins(layout, tilts)
    matrix = wrench_matrix(whole, body.gravity_centre)
    count = layout.drives
    # a servo turns both ways
    flying = np.hstack((matrix[:, :count][:, rotor], matrix[:, count:], -matrix[:, count:]))
    if tilts.joints:
        # what a tilt pushes aside, the lean takes back
        flying[:2], matrix[:2] = 0.0, 0.0
    weight = body.mass * GRAVITY
    if wings > 0.0 and rotor.all() and (hover_share(flying, weight) or math.inf) > 1.0:
        # level flight of what cannot hover: rho A_L a V^2 / 2 = weight
        speed = math.sqrt(2.0 * weight / (AIR * wings * ATTACK))
        words = (
            f"its rotors do not carry it, its wings do at {speed:.3g} m/s with "
            f"{ATTACK:g} rad of attack"
        )
        advice = (
            "No controller that ships flies or starts it; controller=direct takes commands of its "
            "drives and joints."
        )
        yield warned("on wings", words, advice)
        return
    if rotor.any():
        yield from _hover(flying, body.mass, int(rotor.sum()))
    yield from _allocation(layout, whole, matrix, body, steers)
    if rotor.any():
        yield from _authority(robot, flying, body.mass)


def lift_slope(robot: RobotModel, effects: Mapping[str, Effect]) -> float:
    """Return the sum of A_L of the effects ``lift`` in air whose wings lie level [m^2].

    Args:
        robot: joints at zero.
        effects: by instance name.
    """
    turns, total = rest_poses(robot)[1], 0.0
    for bound in bind_effects(effects, robot.links).loads:
        if "lift" not in bound.effect.accounts_for or bound.kind is MediumKind.water:
            continue
        slope = float(np.reshape(bound.params["coefficient"], -1)[0])
        total += sum(slope for link in bound.links if abs(turns[link][2, 2]) > LEVEL)
    return total


def _hover(matrix: Floats, mass: float, count: int) -> Iterator[RobotFinding]:
    """Check that the rotors carry the robot level in air, and their thrust margin."""
    weight = mass * GRAVITY
    share = hover_share(matrix, weight)
    subject = "hover in air"
    if share is None:
        spinning = hover_share(matrix, weight, yaw=False)
        if spinning is None:
            found = f"no thrusts of the {count} rotor(s) carry {weight:.3g} N without tipping it"
            advice = "Look at position and axis of the rotors against the centre of gravity above."
        else:
            found = f"the {count} rotor(s) carry it, but it spins about its vertical"
            advice = "Let direction alternate between 1 and -1 from one rotor to the next."
        yield failed(subject, found, advice)
        return
    found = (
        f"{share:.0%} of full thrust, {math.sqrt(share):.0%} of full speed; "
        f"full thrust is {1.0 / share:.2f} times the weight"
    )
    if share > 1.0:
        advice = "Too weak to fly: check thrust_coefficient, max_speed, and the mass above."
        yield failed(subject, found, advice)
    elif share * THIN_MARGIN > 1.0:
        advice = "Little is left to steer with; 1.5 to 2.5 times is usual."
        yield warned(subject, found, advice)
    elif share < 0.04:
        yield warned(subject, found, "Far more than usual: check the unit of thrust_coefficient.")
    else:
        yield passed(subject, found)


def _allocation(
    layout: Layout, whole: Layout, matrix: Floats, body: FloatingBody, steers: bool
) -> Iterator[RobotFinding]:
    """Rank and condition number of the map from drives to force and moments."""
    reach: CommandedDirections = CommandedDirections.of(matrix, body.gravity_centre, whole.position)
    tilts = whole.drives - layout.drives
    words = f", {tilts} tilted by a servo" if tilts else ""
    found = f"{layout.drives} drive(s){words}, rank {reach.rank} of {reach.wanted}"
    if reach.rank < reach.wanted and steers:
        yield passed("allocation", f"{found}: the rest is passive")
    elif reach.rank < reach.wanted:
        advice = (
            "Some motion cannot be commanded; check positions, axes, directions and coefficients."
        )
        yield warned("allocation", f"{found}: {reach.weakest} is out of reach", advice)
    elif reach.condition > STIFF:
        advice = f"Commands in {reach.weakest} saturate first; check the coefficients."
        yield warned("allocation", f"{found}, condition number {reach.condition:.3g}", advice)
    else:
        yield passed("allocation", f"{found}, condition number {reach.condition:.3g}")


def _authority(robot: RobotModel, matrix: Floats, mass: float) -> Iterator[RobotFinding]:
    """Angular accelerations that are left while the rotors carry the weight."""
    share = hover_share(matrix, mass * GRAVITY)
    if share is None or share > 1.0:
        return
    moments = np.diag(whole_body(robot)[2])
    gains = {
        way: authority(matrix, mass * GRAVITY, way) / max(float(moments[k]), 1e-12)
        for k, way in enumerate(SLUGGISH)
    }
    words = ", ".join(f"{way} {gain:.3g}" for way, gain in gains.items())
    slow = [way for way, gain in gains.items() if gain < SLUGGISH[way]]
    if slow:
        advice = f"Slow in {', '.join(slow)}: longer arms, stronger rotors or less inertia."
        yield warned("authority in hover", f"{words} rad/s^2", advice)
    else:
        yield passed("authority in hover", f"{words} rad/s^2")
