"""Capability of a robot in air and in water: its drives against weight, buoyancy and flow.

Of a set of drives: hover thrust, control authority, rank of the allocation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.check.finding import RobotFinding, failed, passed, warned
from seals.check.floating import FloatingBody
from seals.control.actuator_limits import ActuatorLimitEstimator, ActuatorLimits
from seals.control.added import added_inertia
from seals.control.axes import (
    AXES,
    HEAVE,
    PITCH,
    ROLL,
    STATION_ORDER,
    SURGE,
    SWAY,
    YAW,
    commanded_axes,
    mean_arm,
    named_axes,
    wrench_matrix,
)
from seals.control.fins import fins_of, with_fins
from seals.control.plant import ROTOR, Layout, Plant, build_plant, lifting
from seals.control.tilts import tilts_of
from seals.effects.binding import bind_effects
from seals.effects.effect import Effect
from seals.environment.sample import Sample
from seals.environment.seawater import FRESH_WATER, viscosity_of
from seals.environment.settings import EnvironmentSettings
from seals.motion import Motion
from seals.robot.model import RobotModel

WEAKEST = 1e-3
"""Singular value, against the largest, from which on a direction counts as commanded."""
WAYS = ("forward force", "sideways force", "vertical force", "roll", "pitch", "yaw")
"""Rows of a wrench matrix."""


class CommandedDirections(NamedTuple):
    """Directions of force and torque that the drives can command.

    Args:
        rank: number of directions.
        wanted: 4 for drives that all push the same way, 6 otherwise.
        condition: largest by smallest singular value, infinite below full rank [1].
        weakest: name of the direction that is hardest to command.
    """

    rank: int
    wanted: int
    condition: float
    weakest: str

    @classmethod
    def of(cls, matrix: Floats, centre: Floats, positions: Floats) -> CommandedDirections:
        """Return rank and condition of an allocation in units of full command.

        Moments are taken per mean arm, so that forces and moments compare.

        Args:
            matrix: from `wrench_matrix`.
            centre: of gravity [m], shape (3,).
            positions: of the drives [m], shape (n, 3).
        """
        arm = max(float(np.mean(np.linalg.norm(positions - centre, axis=1))), 1e-6)
        scaled = matrix / np.array([1.0, 1.0, 1.0, arm, arm, arm])[:, None]
        forces = np.linalg.matrix_rank(matrix[:3], tol=WEAKEST * float(np.abs(matrix[:3]).max()))
        # drives that all push along z can only ever command that force and three moments
        flat = forces == 1 and np.abs(matrix[2]).max() > 0.9 * np.abs(matrix[:3]).max()
        # fewer than six that all push up, canted or not, lift and turn it
        size = np.linalg.norm(matrix[:3], axis=0)
        flat |= matrix.shape[1] < 6 and bool(np.all(matrix[2] > 0.5 * size))
        rows = [2, 3, 4, 5] if flat else list(range(6))
        left, values, _ = np.linalg.svd(scaled[rows], full_matrices=True)
        values = np.concatenate((values, np.zeros(len(rows) - len(values))))
        rank = int(np.sum(values > WEAKEST * values[0]))
        condition = float(values[0] / values[-1]) if rank == len(rows) else float("inf")
        weakest = WAYS[rows[int(np.argmax(np.abs(left[:, -1])))]]
        return cls(rank, len(rows), condition, weakest)


def hover_share(matrix: Floats, weight: float, *, yaw: bool = True) -> float | None:
    """Return the fraction of full thrust at which the most loaded rotor holds the robot level.

    Args:
        matrix: of the rotors, from `wrench_matrix`.
        weight: [N].
        yaw: whether the yaw moment must vanish, too.

    Returns:
        The share [1], above one when the rotors are too weak; None when no thrusts balance.
    """
    from scipy.optimize import linprog

    count = matrix.shape[1]
    rows = slice(0, 6 if yaw else 5)
    size = np.abs(matrix).max(axis=1) + 1e-12
    # unknowns: one share a rotor, and the largest of them
    equal = np.concatenate((matrix / size[:, None], np.zeros((6, 1))), axis=1)[rows]
    load = (np.array([0.0, 0.0, weight, 0.0, 0.0, 0.0]) / size)[rows]
    below = np.concatenate((np.eye(count), -np.ones((count, 1))), axis=1)
    cost = np.zeros(count + 1)
    cost[-1] = 1.0
    found = linprog(cost, A_ub=below, b_ub=np.zeros(count), A_eq=equal, b_eq=load, bounds=(0, None))
    return float(np.asarray(found.x)[-1]) if found.status == 0 else None


def authority(matrix: Floats, weight: float, way: str) -> float:
    """Return the largest moment about one axis, both ways, while the weight is carried [N m].

    Args:
        matrix: of the rotors, from `wrench_matrix`.
        weight: [N].
        way: ``roll``, ``pitch`` or ``yaw``.
    """
    from scipy.optimize import linprog

    row = WAYS.index(way)
    others = [k for k in range(6) if k != row]
    load = np.array([0.0, 0.0, weight, 0.0, 0.0, 0.0])[others]
    most = []
    for sign in (1.0, -1.0):
        found = linprog(-sign * matrix[row], A_eq=matrix[others], b_eq=load, bounds=(0.0, 1.0))
        most.append(-float(found.fun or 0.0) if found.status == 0 else 0.0)
    return min(most)


GRAVITY = 9.81
DEEP = 1000.0
"""Depth at which every drive is under water [m]."""
BALLAST = 0.01
"""Net buoyancy to aim at, share of the weight: it comes up by itself [1]."""
RESERVE = 0.5
"""Share of the vertical thrust above which the net buoyancy leaves little to move with [1]."""
SLOW = 0.5
"""Speed that a vehicle which dives should bear level [m/s]."""
STEERED = (SURGE, YAW, PITCH, ROLL, HEAVE, SWAY)


class Reach(NamedTuple):
    """Capability of a robot according to its model.

    Args:
        axes: that drives and fins command, numbers into `seals.control.axes.AXES`.
        rotors: whether its drives are rotors.
        weight: [N].
        buoyancy: wholly submerged in fresh water, 0 without hulls [N].
        lift_in_air: largest level force upwards of its rotors in air [N].
        up: largest level force upwards under water [N].
        down: downwards [N].
        fins: number of fins.
        hovers: whether the rotors that push upward command heave, roll, pitch and yaw.
        munk: added mass in heave less that in surge [kg].
    """

    axes: tuple[int, ...]
    rotors: bool
    weight: float
    buoyancy: float
    lift_in_air: float
    up: float
    down: float
    fins: int
    hovers: bool
    munk: float = 0.0

    @property
    def net(self) -> float:
        """Net buoyancy under water, upwards [N]."""
        return self.buoyancy - self.weight

    @property
    def flies(self) -> bool:
        """Whether its rotors can carry its weight in air."""
        return self.rotors and self.lift_in_air > self.weight

    @property
    def keeps_station(self) -> bool:
        """Whether it commands surge, sway, heave, yaw, and more thrust than its net buoyancy."""
        held = {SURGE, SWAY, HEAVE, YAW} <= set(self.axes)
        return held and not self.rotors and -self.up < self.net < self.down

    @property
    def keeps_afloat(self) -> bool:
        """Whether it floats, and commands surge, sway and yaw."""
        return not self.rotors and {SURGE, SWAY, YAW} <= set(self.axes) and self.net > 0.0

    @property
    def steers(self) -> bool:
        """Whether it commands surge and yaw."""
        return not self.rotors and {SURGE, YAW} <= set(self.axes)

    def first_run(self) -> str:
        """Return arguments of `seals run` for a first run that the robot is capable of."""
        if self.flies and self.hovers:
            return "guide=hover controller=cascade initial.position=[0,0,2]"
        if self.keeps_station:
            return "water=fossen guide=hover controller=station initial.position=[0,0,-2]"
        if self.keeps_afloat and HEAVE not in self.axes:
            return "water=fossen guide=hover controller=station initial.position=[0,0,0]"
        lifted = -self.up < self.net < self.down and self.down > 0.0
        finned = PITCH in self.axes and self.fins > 0
        if self.steers and (lifted or finned or self.net > 0.0):
            depth = "-2" if lifted or finned else "0"
            course = f"guide.places=[[20,0,{depth}]] initial.position=[0,0,{depth}]"
            # 20 m at 1 m/s; a run ends at its goal
            return f"water=fossen guide=los controller=autopilot {course} time.duration=40"
        return "water=fossen"


def reach_of(
    robot: RobotModel,
    actuators: Mapping[str, Effect],
    effects: Mapping[str, Effect] | None = None,
) -> Reach | None:
    """Return the capability of a robot, joints at zero; None without drives.

    Args:
        robot: the robot.
        actuators: by instance name.
        effects: by instance name: fins, and how drives change in water.

    Raises:
        ConfigError: the actuators do not fit together or sit on unknown links.
    """
    environment = EnvironmentSettings(water_level=0.0, water_density=FRESH_WATER)
    bound = bind_effects({**(effects or {}), **actuators}, robot.links)
    plant = build_plant(robot, bound, environment)
    layout, body = plant.layout, FloatingBody(robot)
    if not layout.drives or robot.tree.fixed_base or body.mass <= 0.0:
        return None
    fins = fins_of(plant)
    centre, rotors = body.gravity_centre, ROTOR in layout.kind
    whole = with_fins(layout, fins)
    order = STEERED if fins.joints else STATION_ORDER
    axes = commanded_axes(wrench_matrix(whole, centre), mean_arm(whole, centre), order)
    matrix = wrench_matrix(layout, centre)
    wet = _submerged(plant)
    # by drive: the largest wrench to that in air, and the least to the largest
    rotor = np.array([kind == ROTOR for kind in layout.kind])
    part = wet.limit / layout.limit
    back = np.where(wet.limit > 0.0, wet.low / np.maximum(wet.limit, 1e-12), 0.0)
    gain = wet.gain * np.where(rotor, part**2, part)
    low = np.where(rotor, back * np.abs(back) * layout.reverse, back)
    held = [k for k in axes if k != HEAVE]
    carried = np.diag(added_inertia(plant))
    return Reach(
        axes=axes,
        rotors=rotors,
        weight=body.mass * GRAVITY,
        buoyancy=FRESH_WATER * body.volume * GRAVITY,
        lift_in_air=_level_force(matrix * rotor, np.where(rotor, 0.0, -1.0), held, 1.0),
        up=_level_force(matrix * gain, low, held, 1.0),
        down=_level_force(matrix * gain, low, held, -1.0),
        fins=len(fins.joints),
        hovers=_hovers(robot, layout, centre),
        munk=float(carried[HEAVE] - carried[SURGE]),
    )


def _hovers(robot: RobotModel, layout: Layout, centre: Floats) -> bool:
    """Return whether upright rotors, and servos that tilt some, command lift and all torques."""
    if any(kind != ROTOR for kind in layout.kind):
        return False
    layout = lifting(layout)
    share = GRAVITY * float(robot.mass.sum()) / layout.drives
    whole = with_fins(layout, tilts_of(robot, layout, share))
    level = wrench_matrix(whole, centre)
    level[:HEAVE] = 0.0
    return CommandedDirections.of(level, centre, whole.position).rank == len(level) - HEAVE


def _level_force(matrix: Floats, low: Floats, held: list[int], sign: float) -> float:
    """Return the largest vertical force without any other commanded force or moment [N].

    Args:
        matrix: wrench of each drive at its largest command, shape (6, n).
        low: least command, share of the largest wrench, shape (n,).
        held: rows that must vanish.
        sign: 1 for upwards, -1 for downwards.
    """
    from scipy.optimize import linprog

    rows = matrix[held]
    size = np.abs(rows).max(axis=1, initial=0.0) + 1e-12
    bounds = [(float(a), 1.0) for a in low]
    found = linprog(
        -sign * matrix[HEAVE], A_eq=rows / size[:, None], b_eq=np.zeros(len(held)), bounds=bounds
    )
    return max(0.0, -float(found.fun or 0.0)) if found.status == 0 else 0.0


def _submerged(plant: Plant) -> ActuatorLimits:
    """Limits and gains of the drives at rest deep under water."""
    robot = plant.robot
    count = len(robot.links)
    one, none = np.ones((count, 1)), np.zeros((count, 3))
    up = np.tile([0.0, 0.0, 1.0], (count, 1))
    level = np.repeat(np.eye(3)[None], count, axis=0)
    motion = Motion(np.zeros((1, 1)), -DEEP * up, level, up, none, none, robot.bodies(one))
    e = plant.environment
    viscosity = float(viscosity_of(np.array(20.0), np.array(0.0)))
    sample = Sample(
        submersion=one,
        submersion_rate=0.0 * one,
        buoyancy_centre=none,
        normal=up,
        sinking_speed=0.0 * one,
        gravity=GRAVITY * one,
        water_velocity=none,
        water_acceleration=none,
        water_density=FRESH_WATER * one,
        water_viscosity=viscosity * one,
        air_velocity=none,
        air_density=e.air_density * one,
        air_viscosity=e.air_viscosity * one,
        one=one,
        depth=DEEP * one,
    )
    return ActuatorLimits(*(x[0] for x in ActuatorLimitEstimator(plant).now(motion, sample)))


def look_at_reach(reach: Reach, body: FloatingBody) -> Iterator[RobotFinding]:
    """Yield findings: commanded axes, and whether it dives, surfaces, hovers and takes off."""
    if not reach.rotors:
        yield _axes(reach, body)
        yield from _under_way(reach, body)
    if body.parts:
        yield _rotors_in_water(reach) if reach.rotors else _thrusters_in_water(reach)


def _axes(reach: Reach, body: FloatingBody) -> RobotFinding:
    passive = [k for k in range(6) if k not in reach.axes]
    words = f"commands {named_axes(reach.axes)}"
    words += f" ({reach.fins} fins, while it moves)" if reach.fins else ""
    words += f"; passive: {named_axes(passive)}" if passive else ""
    if body.parts:
        # under water where it dives, afloat where it does not
        dives = HEAVE in reach.axes or reach.fins > 0
        volume = body.volume if dives else min(body.mass / FRESH_WATER, body.volume)
        along = {ROLL: (1.0, 0.0, 0.0), PITCH: (0.0, 1.0, 0.0)}
        loose = [
            AXES[k]
            for k in passive
            if k in along and body.metacentric_height(along[k], volume) < 1e-4 * body.reach
        ]
        if loose:
            advice = f"It is not stable in {' and '.join(loose)}: move mass down."
            return warned("axes", words, advice)
    if not (reach.steers or len(reach.axes) == 6):
        advice = (
            "No controller of SEALS drives it: station needs surge, sway, heave and yaw, "
            "autopilot surge and yaw, with or without heave."
        )
        return warned("axes", words, advice)
    return passed("axes", words)


def _under_way(reach: Reach, body: FloatingBody) -> Iterator[RobotFinding]:
    """Yield the speed up to which a diving vehicle with passive pitch stays level.

    Equation:
        Pitched by a small angle a at the speed u, the added mass of a body that carries more in
        heave than in surge turns it further by (A_z - A_x) u^2 a (Munk moment); its weight W
        rights it by W GM a.

    References:
        Munk 1924, NACA Report 184; Fossen 2021, Handbook of Marine Craft, ch. 6.
    """
    dives = SURGE in reach.axes and HEAVE in reach.axes and PITCH not in reach.axes
    if not (dives and body.parts and reach.munk > 0.0):
        return
    height = body.metacentric_height((0.0, 1.0, 0.0), body.volume)
    if height <= 0.0:
        return
    speed = math.sqrt(reach.weight * height / reach.munk)
    words = f"level up to {speed:.2g} m/s: above this speed its added mass destabilises it in pitch"
    advice = "Move mass down, or stay below this speed: guide.speed."
    yield (passed("under way", words) if speed >= SLOW else warned("under way", words, advice))


def _thrusters_in_water(reach: Reach) -> RobotFinding:
    net, subject = reach.net, "in water"
    words = f"net buoyancy {net:+.3g} N"
    if HEAVE not in reach.axes:
        if PITCH in reach.axes and reach.fins:
            return passed(
                subject, f"{words}, no vertical thrust: its fins make it dive when it moves"
            )
        if net > 0.0:
            does = "steers" if reach.steers else "stays"
            return passed(subject, f"{words}, no vertical thrust: {does} at the surface")
        return warned(
            subject, f"{words}, no vertical thrust: it sinks", "Add volume, or a vertical thruster."
        )
    words += f" against {reach.down:.3g} N of thrust downwards, {reach.up:.3g} N upwards"
    most = reach.down if net > 0.0 else reach.up
    if abs(net) >= most:
        mass = (abs(net) - BALLAST * reach.weight) / GRAVITY
        can = "dive: it stays at the surface" if net > 0.0 else "come up: it sinks"
        change = (
            f"Add {max(mass, 0.0):.3g} kg of ballast low in the hull, or correct hulls"
            if net > 0.0
            else f"Remove {mass:.3g} kg, or add volume under hulls"
        )
        return failed(
            subject, f"{words}: it cannot {can}", f"{change} and max_force in robot.yaml."
        )
    if abs(net) > RESERVE * most:
        advice = f"{abs(net) / most:.0%} of the thrust is needed to hold the depth; trim it."
        return warned(subject, f"{words}: dives and surfaces", advice)
    return passed(subject, f"{words}: dives, hovers, surfaces")


def _rotors_in_water(reach: Reach) -> RobotFinding:
    net = reach.net
    can = []
    if net > 0.0:
        can.append("dives" if reach.down > net else "stays at the surface")
    else:
        can.append("hovers and surfaces" if reach.up > -net else "sinks")
    can.append("takes off" if reach.flies else "does not take off")
    words = (
        f"net buoyancy {net:+.3g} N against {reach.down:.3g} N of thrust downwards, "
        f"{reach.up:.3g} N upwards: {', '.join(can)}"
    )
    if can[0] == "sinks":
        short = math.ceil((-net - reach.up) / GRAVITY * 100.0) / 100.0
        return warned("in water", words, f"Add {short:g} litre of hull, or stronger rotors.")
    return passed("in water", words)
