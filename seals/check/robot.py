"""Plausibility check of a robot: mass, inertia, hulls, stability, rotors and thrusters."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from seals.arrays import Floats
from seals.check.finding import RobotFinding, Verdict, failed, listed, passed, triple, warned
from seals.check.floating import FloatingBody
from seals.check.joints import look_at_joints, look_at_servos
from seals.check.reach import CommandedDirections, authority, hover_share, look_at_reach, reach_of
from seals.control.axes import wrench_matrix
from seals.control.fins import with_fins
from seals.control.plant import ROTOR, Layout, layout_of
from seals.control.tilts import tilts_of
from seals.effects.binding import bind_effects
from seals.effects.effect import Effect, MediumKind
from seals.environment.seawater import FRESH_WATER
from seals.errors import SealsError
from seals.hydrostatics.meshes import load_triangles
from seals.multibody.tree import poses_in_base
from seals.robot.build import build_robot
from seals.robot.model import RobotModel
from seals.robot.settings import RobotSettings
from seals.robot.urdf import mesh_names
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


def _look_at_drives(
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
        wings: slope of the lift of its level wings in air, from `_lift_slope` [m^2].

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
            f"its rotors do not carry it, but its wings do at {speed:.3g} m/s with "
            f"{ATTACK:g} rad of attack"
        )
        advice = (
            "No controller of SEALS flies or launches it; controller=direct accepts commands "
            "for its "
            "drives and joints."
        )
        yield warned("on wings", words, advice)
        return
    if rotor.any():
        yield from _hover(flying, body.mass, int(rotor.sum()))
    yield from _allocation(layout, whole, matrix, body, steers)
    if rotor.any():
        yield from _authority(robot, flying, body.mass)


def _lift_slope(robot: RobotModel, effects: Mapping[str, Effect]) -> float:
    """Return the sum of A_L of the effects ``lift`` in air whose wings lie level [m^2].

    Args:
        robot: joints at zero.
        effects: by instance name.
    """
    turns, total = poses_in_base(robot.tree)[1], 0.0
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
            found = (
                f"no thrusts of the {count} rotor(s) carry {weight:.3g} N without tipping the robot"
            )
            advice = "Compare positions and axes of the rotors with the centre of gravity above."
        else:
            found = f"the {count} rotor(s) carry it, but the robot spins about its vertical axis"
            advice = "Alternate direction between 1 and -1 from one rotor to the next."
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
        advice = "Little thrust remains for control; 1.5 to 2.5 times is usual."
        yield warned(subject, found, advice)
    elif share < 0.04:
        yield warned(
            subject, found, "This is much more than usual: check the unit of thrust_coefficient."
        )
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
        yield passed("allocation", f"{found}: the other axes are passive")
    elif reach.rank < reach.wanted:
        advice = (
            "Some motion cannot be commanded; check positions, axes, directions and coefficients."
        )
        yield warned("allocation", f"{found}: {reach.weakest} cannot be commanded", advice)
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


__all__ = ["RobotFinding", "Verdict", "check_robot"]

TRIFLE = 0.03
"""Share of the whole mass up to which a link may lack collision shapes and a hull [1]."""
ROUNDING = 1e-6
"""Excess over a limit that is one of rounding [rad or m]."""


def check_robot(
    settings: RobotSettings,
    actuators: Mapping[str, Effect] | None = None,
    effects: Mapping[str, Effect] | None = None,
) -> list[RobotFinding]:
    """Check mass, inertia, hulls, floating, drives, joints and meshes of a robot.

    Args:
        settings: the robot folder as configured.
        actuators: of the robot, by instance name.
        effects: of the robot, by instance name.

    Raises:
        RobotError: the robot's files cannot be read at all; nothing can be said about it then.
    """
    robot = build_robot(settings)
    looks = (_mass, _inertia, _links, _floating)
    found = [finding for look in looks for finding in look(robot)]
    reach = reach_of(robot, actuators or {}, effects)
    found += _look_at_drives(
        robot,
        actuators or {},
        steers=reach is not None and reach.steers,
        wings=_lift_slope(robot, effects or {}),
    )
    found += [] if reach is None else look_at_reach(reach, FloatingBody(robot))
    found += [*look_at_joints(robot), *_look_at_limbs(robot)]
    found += look_at_servos(robot, actuators or {})
    return [*found, *_look_at_mimics(settings), *_look_at_meshes(settings)]


def _mass(robot: RobotModel) -> Iterator[RobotFinding]:
    """Check total mass, centre of gravity, and moving parts without mass."""
    total = float(robot.mass.sum())
    words = f"{total:.4g} kg in {len(robot.links)} link(s)"
    if total <= 0.0:
        yield failed("mass", words, "Give at least one moving link an <inertial> element.")
        return
    believable = 1e-4 <= total <= 1e5
    yield (
        passed("mass", words)
        if believable
        else warned("mass", words, "Masses are in kg; check the unit.")
    )
    centre = FloatingBody(robot).gravity_centre.round(7)
    yield passed("centre of gravity", f"{triple(centre)} m from the base origin")
    weightless = [
        name
        for j, name in enumerate(robot.joints)
        if float(robot.mass @ robot.tree.moves[:, j]) <= 0.0
    ]
    if weightless:
        advice = "Give the link below it, or one further out, an <inertial> element."
        yield failed(
            "moving mass", f"no link with mass is attached to {listed(weightless)}", advice
        )


def _inertia(robot: RobotModel) -> Iterator[RobotFinding]:
    """Check that the inertia of each link fits its mass and its size."""
    odd = 0
    for k, link in enumerate(robot.links):
        mass = float(robot.mass[k])
        if mass <= 0.0:
            continue
        moments = np.linalg.eigvalsh(robot.inertia[k])
        hull = robot.hulls[k]
        gyration = math.sqrt(max(float(moments[-1]), 0.0) / mass)
        words = f"{link}: principal moments {triple(moments)} kg m^2"
        if moments[-1] <= 0.0:
            odd += 1
            yield failed(
                "inertia", f"{link}: zero, with {mass:.3g} kg", "Give it the inertia of its shape."
            )
        elif moments[0] <= 1e-6 * moments[-1]:
            odd += 1
            yield warned(
                "inertia",
                words,
                "One of them is almost zero: such a link accelerates strongly under a small "
                "torque.",
            )
        elif hull is not None and gyration > 1.5 * hull.reach:
            odd += 1
            size = f"{words}, radius of gyration {gyration:.3g} m, hull reaches {hull.reach:.3g} m"
            yield warned("inertia", size, "Check the unit: kg m^2, about the centre of mass.")
    if not odd:
        yield passed("inertia", "positive, within the triangle inequality, fits the size")


def _links(robot: RobotModel) -> Iterator[RobotFinding]:
    """Find links that lack mass, hull or collision geometry."""
    # propellers and screws need neither collision shapes nor hulls
    share = TRIFLE * float(robot.mass.sum())
    slight = [name for name, mass in zip(robot.links, robot.mass, strict=True) if mass <= share]
    bare = [name for name, mass in zip(robot.links, robot.mass, strict=True) if mass <= 0.0]
    if bare:
        yield passed("links without mass", f"{listed(bare)} (frames)")
    ghosts = [
        name for name, there in zip(robot.links, robot.has_collision, strict=True) if not there
    ]
    solid = [name for name in ghosts if name not in slight]
    if solid:
        advice = "They pass through ground and other robots; add <collision> if contacts matter."
        yield warned("links without collision", listed(solid), advice)
    dry = [
        name
        for name, hull, mass in zip(robot.links, robot.hulls, robot.mass, strict=True)
        if hull is None and mass > share
    ]
    if dry and len(dry) < len([m for m in robot.mass if m > share]):
        advice = "They displace no water; add them under hulls: in robot.yaml if buoyancy matters."
        yield warned("links without hull", listed(dry), advice)


def _floating(robot: RobotModel) -> Iterator[RobotFinding]:
    """Check volume, net buoyancy, draught and stability in fresh water."""
    body = FloatingBody(robot)
    if not body.parts:
        advice = "It has no buoyancy; add hulls: in robot.yaml if it enters water."
        yield warned("hull", "no link has one", advice)
        return
    yield passed("hull", f"{body.volume * 1e3:.4g} litre in {len(body.parts)} link(s)")
    if robot.tree.fixed_base or body.mass <= 0.0:
        return
    lift = FRESH_WATER * body.volume - body.mass
    net = f"{lift * 9.81:+.3g} N in fresh water"
    wanted = body.mass / FRESH_WATER
    if abs(lift) < 0.005 * body.mass:
        yield passed("net buoyancy", f"{net}: neutral within 0.5 %")
        wanted = body.volume
    elif lift < 0.0:
        yield passed("net buoyancy", f"{net}: sinks")
        wanted = body.volume
    else:
        share = wanted / body.volume
        depth = body.draught(wanted)
        yield passed(
            "net buoyancy", f"{net}: floats, {share:.0%} under water, draught {depth:.4g} m"
        )
    yield from _stability(body, wanted)


def _stability(body: FloatingBody, volume: float) -> Iterator[RobotFinding]:
    """Check the restoring moment in roll and pitch, and that upright is an equilibrium."""
    for name, axis in (("roll", (1.0, 0.0, 0.0)), ("pitch", (0.0, 1.0, 0.0))):
        height = body.metacentric_height(axis, volume)
        arm = body.righting_arm(axis, volume)
        words = f"metacentric height {round(height * 1e3, 2) + 0.0:.4g} mm"
        if abs(height) < 1e-4 * body.reach:
            yield passed(f"stability in {name}", f"{words}: indifferent")
        elif height < 0.0:
            advice = "It capsizes when upright; move mass down or buoyancy up."
            yield warned(f"stability in {name}", words, advice)
        elif abs(arm) > math.tan(math.radians(1.0)) * height:
            angle = math.degrees(math.atan2(abs(arm), height))
            advice = (
                "Put the centre of gravity below the centre of buoyancy, "
                "or expect it to float with a list."
            )
            yield warned(
                f"stability in {name}",
                f"{words}, but floats with a list of about {angle:.0f} deg",
                advice,
            )
        else:
            yield passed(f"stability in {name}", words)


def _look_at_limbs(robot: RobotModel) -> Iterator[RobotFinding]:
    """Yield findings about poses beyond joint limits, and arms listed from tip to base."""
    poses = [(f"{a.name}.stowed", a.joints, a.stowed) for a in robot.arms.values()]
    for hand in robot.grippers.values():
        poses += [
            (f"{hand.name}.{word}", hand.joints, getattr(hand, word)) for word in ("open", "closed")
        ]
    if not poses:
        return
    beyond = [
        f"{where}: {robot.joints[j]} {value:.3g} ({low:.3g} to {high:.3g})"
        for where, joints, pose in poses
        for j, value in zip(joints, pose, strict=True)
        for low, high in [(float(robot.lower[j]), float(robot.upper[j]))]
        if not low - ROUNDING <= value <= high + ROUNDING
    ]
    # a joint moves all links beyond it: the nearer the base, the more
    moved = robot.tree.moves.sum(axis=0)
    turned = [
        arm.name
        for arm in robot.arms.values()
        if any(moved[near] < moved[far] for near, far in pairwise(arm.joints))
    ]
    if beyond:
        advice = (
            "The joint limits prevent these poses; correct the pose in robot.yaml, or the "
            "limits in the URDF."
        )
        yield warned("arm poses", f"beyond a joint limit: {listed(beyond)}", advice)
    if turned:
        advice = "List the joints of an arm in order from the base, and its stowed values likewise."
        yield warned("arm joints", f"not in order from the base: {listed(turned)}", advice)
    if not beyond and not turned:
        yield passed("arm poses", f"{len(poses)} within the joint limits")


def _look_at_mimics(settings: RobotSettings) -> Iterator[RobotFinding]:
    """Yield a finding for every ``<mimic>`` that is not part of one gripper."""
    root = ElementTree.fromstring(settings.urdf_path.read_bytes())
    for joint in root.findall("joint"):
        mimic = joint.find("mimic")
        if mimic is None or joint.get("type") == "fixed":
            continue
        name, leader = joint.get("name", ""), mimic.get("joint", "")
        words = f"{name} follows {leader} in the URDF"
        if any({name, leader} <= set(g.joints) for g in settings.grippers.values()):
            yield passed("mimic joint", f"{words}; both belong to one gripper")
        else:
            advice = (
                "Here it moves on its own: name both in one entry under grippers: in robot.yaml, "
                "or make it fixed."
            )
            yield warned("mimic joint", words, advice)


MANY_TRIANGLES = 20_000
"""Triangles of a mesh above which loading and contacts become slow."""
FAR = 20.0
"""Extent of a mesh beyond which millimetres were probably taken for metres [m]."""
TINY = 1e-4
"""Extent of a mesh below which it was probably scaled twice [m]."""


def _look_at_meshes(settings: RobotSettings) -> Iterator[RobotFinding]:
    """Yield findings about large, oddly sized or open meshes."""
    fine = 0
    for name, scale in _scaled(settings.urdf_path):
        remarks = list(_look(settings.urdf_path.parent / name, name, scale))
        fine += not remarks
        yield from remarks
    for link, notes in _hulls(settings):
        fine += not notes
        for note in notes:
            yield warned(f"hull of {link}", note, "Export a closed mesh with outward normals.")
    if fine:
        yield passed("meshes", f"{fine} ok")


def _scaled(path: Path) -> list[tuple[str, float]]:
    """Meshes of the URDF, each once, with the largest factor it is scaled by."""
    names = mesh_names(path)
    elements = list(ElementTree.fromstring(path.read_bytes()).iter("mesh"))
    scales = dict.fromkeys(names, 1.0)
    for mesh in elements:
        numbers = [abs(float(word)) for word in mesh.get("scale", "1").split()]
        name = next((n for n in names if str(mesh.get("filename")).endswith(n)), "")
        scales[name] = max(numbers)
    return [(name, scales[name]) for name in names]


def _look(path: Path, name: str, scale: float) -> Iterator[RobotFinding]:
    """Yield findings about one mesh file."""
    triangles, extent = _size(path)
    if triangles > MANY_TRIANGLES:
        advice = f"Above {MANY_TRIANGLES:,} loading and contacts are slow; simplify the mesh."
        yield warned("mesh", f"{name} has about {triangles:,} triangles", advice)
    size = extent * scale
    if size > FAR:
        advice = 'Drawn in millimetres? Write scale="0.001 0.001 0.001" in the URDF\'s <mesh>.'
        yield warned("mesh", f"{name} is {size:.4g} m long", advice)
    elif 0.0 < size < TINY:
        advice = "Scaled twice? URDF lengths are metres."
        yield warned("mesh", f"{name} is {size:.2g} m long", advice)


def _size(path: Path) -> tuple[int, float]:
    """Number of triangles and largest extent in the mesh's own unit, estimated for large files."""
    size = path.stat().st_size
    if size > 100 * MANY_TRIANGLES:
        return ((size - 84) // 50 if path.suffix.lower() == ".stl" else size // 100), 0.0
    try:
        mesh = load_triangles(path, where="mesh")
        return len(mesh.faces), float(np.ptp(np.asarray(mesh.vertices), axis=0).max())
    except (ValueError, IndexError, KeyError, AttributeError, TypeError, SealsError):
        # what cannot be drawn is refused elsewhere, with the words of the loader
        return size // 100, 0.0


def _hulls(settings: RobotSettings) -> Iterator[tuple[str, list[str]]]:
    """Yield link and remarks of the meshes that displace water."""
    from seals.hydrostatics import hull_from_mesh

    folder = Path(settings.folder)
    for link, hull in settings.hulls.items():
        for shape in hull.shapes:
            if shape.type.value == "mesh" and shape.file:
                found = hull_from_mesh(folder / shape.file, position=shape.position, rpy=shape.rpy)
                yield link, [note.text for note in found.notes]
