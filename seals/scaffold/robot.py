"""``seals new robot``: writes a robot folder from a URDF, and says what was chosen or left out."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from seals.check.finding import listed
from seals.control.plant import ROTOR
from seals.errors import RobotError
from seals.logs.atomic import rename_new
from seals.robot.build import build_robot
from seals.robot.model import RobotModel
from seals.robot.settings import RobotSettings
from seals.scaffold.effects import (
    BACKWARDS,
    Entry,
    RobotMedium,
    effects_of,
    medium_of,
    share_afloat,
)
from seals.scaffold.estimates import NO_LIMIT, servo_values, short, thrust_loads, water_loads
from seals.scaffold.legs import DAMPED_ON_FOUR, gait_of, leg_servos, stances_of, with_feet
from seals.scaffold.limbs import Limbs, limbs_of
from seals.scaffold.mending import add_inertials, mended
from seals.scaffold.rotors import GRAVITY, WATER, Drives, drives_of, held_down
from seals.scaffold.shapes import LinkHull, extents_of, hulls_of, rounded, with_volumes
from seals.scaffold.takeover import Takeover
from seals.scaffold.wings import add_wing_frames, leave_out_blades, lift_effects
from seals.scaffold.writing import beside_of, flow, free_name, plain, rendered

_TWO_TURNS = 4.0 * np.pi + 1e-6
_AIR = 1.2
"""Density of air [kg/m^3]."""
_CARRIED = 0.1
"""Share of the weight above which the lift of displaced air is named [1]."""
_LATE = 0.1
"""Lag of the servos of legs by the time of the shortest step above which it is named [1]."""


def _remarks_of(made: NewRobot, source: Takeover, *, chosen: bool) -> list[str]:
    """Return remarks on what to check first.

    Args:
        made: the robot.
        source: the file that was taken over.
        chosen: whether the medium was chosen instead of given.
    """
    robot = made.robot
    out = list(_in_degrees(source))
    if made.limbs.legs:
        out.append(
            f"legs: the stance is {made.limbs.stance}; the parameters of the gait are chosen"
        )
        out += _late_legs(made, source)
    elif not made.drives:
        out.append(
            "no link is named like a rotor or thruster (rotor, prop, thruster, motor): "
            "write them under actuators: in robot.yaml"
        )
    for drives in made.drives:
        out += _of_rotors(drives, robot) if drives.kind == ROTOR else _of_thrusters(drives, source)
    bare = [n for n, m in zip(robot.links, robot.mass, strict=True) if m <= 0.0 and n in made.hulls]
    if bare:
        out.append(
            f"links with a shape and no <inertial>: {', '.join(bare[:6])}; "
            "density=500 would give them mass"
        )
    if not made.hulls:
        out.append(
            "no link has a shape, so the robot displaces no water; write hulls: in robot.yaml"
        )
    if made.limbs.others:
        out.append(f"joints left out of arms and grippers: {', '.join(made.limbs.others)}")
    out += _beyond_the_model(made)
    for each in source.stated.hydrodynamics:
        if each.added is not None and not np.any(each.added):
            out.append(f"{each.source.split(' (')[0]}: its added mass is zero, also in robot.yaml")
        if each.left_out:
            out.append(f"{each.source.split(' (')[0]}: not used: {each.left_out}")
    for wing in source.stated.wings:
        if wing.left_out:
            out.append(f"lift of {wing.link}: not used: {wing.left_out}")
    return [*out, *_left_out(made, chosen=chosen)]


def _late_legs(made: NewRobot, source: Takeover) -> Iterator[str]:
    """Name servos of legs that follow their commands late, by the gains of the file."""
    joints = [name for leg in made.limbs.legs.values() for name in leg["joints"]]
    gains = [source.stated.servos[name] for name in joints if name in source.stated.servos]
    stiff = [(kd / kp, kd) for kp, kd in gains if kp > 0.0]
    if not stiff:
        return
    lag, damping = max(stiff)
    share = lag * float(gait_of(made.robot, made.limbs.legs)["highest"])
    if share > _LATE:
        yield (
            f"legs: servos of the file follow {lag:.2g} s late, {share:.0%} of a step: it may stop "
            f"short of its goals; kp_each of {damping / DAMPED_ON_FOUR:.3g} N m/rad follows"
        )


def _beyond_the_model(made: NewRobot) -> Iterator[str]:
    """Name wheels, which no drive turns, and vehicles that air carries."""
    robot = made.robot
    free = [
        name
        for name, low, high in zip(robot.joints, robot.lower, robot.upper, strict=True)
        if name in made.limbs.others and not np.isfinite([low, high]).any()
    ]
    if free:
        yield f"joints without stops, such as wheels, are held at an angle: {', '.join(free)}"
    carried = _AIR * sum(hull.volume for hull in made.hulls.values()) / robot.mass.sum()
    if carried > _CARRIED:
        yield f"the buoyancy of air would carry {carried:.0%} of its weight: it is neglected"


def _in_degrees(source: Takeover) -> Iterator[str]:
    """Name angles of more than two turns, which are degrees most likely."""
    found = []
    for joint in source.root.iter("joint"):
        origin, limit = joint.find("origin"), joint.find("limit")
        words = [] if origin is None else origin.get("rpy", "").split()
        if limit is not None and joint.get("type") == "revolute":
            words += [limit.get("lower", "0"), limit.get("upper", "0")]
        if any(abs(float(word)) > _TWO_TURNS for word in words):
            found.append(str(joint.get("name")))
    if found:
        yield f"angles above two turns: {', '.join(found[:6])}; radians are expected, not degrees"


def _of_rotors(drives: Drives, robot: RobotModel) -> Iterator[str]:
    if "thrust" not in drives.sources:
        yield "rotors: thrust is chosen so that it hovers at half of full thrust"
    elif "max_speed" not in drives.sources:
        yield "rotors: the largest speed is chosen; check max_speed"
    if np.any(drives.axis[:, 2] < 0.5):
        yield "rotors: some axes do not point upwards; check axis"
    if "thrust" in drives.sources and "torque" not in drives.sources:
        yield "rotors: the drag torque is chosen; check torque_coefficient"
    if "direction" not in drives.sources:
        yield "rotors: directions of rotation alternate; check direction"
    followed = [link for link, _ in drives.by_carrier(robot) if link]
    yield from _of_tilting(drives, followed)


def _of_thrusters(drives: Drives, source: Takeover) -> Iterator[str]:
    if "max_force" not in drives.sources:
        yield "thrusters: the largest force is chosen; check axis and max_force"
    uneven = [
        motor.values
        for motor in source.stated.motors
        if {"max_force", "back_force"} <= motor.values.keys()
        and abs(motor.values["max_force"] - motor.values["back_force"])
        > 0.02 * motor.values["max_force"]
    ]
    if uneven:
        yield (
            f"thrusters: up to {uneven[0]['max_force']:g} N forwards and "
            f"{uneven[0]['back_force']:g} N backwards; max_force is the forward force for both"
        )
    yield from _of_tilting(drives)


def _of_tilting(drives: Drives, followed: Sequence[str] = ()) -> Iterator[str]:
    for link, joint in drives.tilting.items():
        if link in followed:
            yield f"{link} is tilted by the joint {joint}; the cascade commands both"
            continue
        text = f"{link} turns with the joint {joint}; its thrust keeps the direction"
        yield f"{text} at joint position zero"


def _left_out(made: NewRobot, *, chosen: bool) -> Iterator[str]:
    """Name the effects of air, water and waves that the new robot lacks."""
    medium, hulls = made.medium, bool(made.hulls)
    if chosen and made.drives:
        yield f"medium: {medium.value} is assumed; medium=air, water or both overrides it"
        if any(drives.kind == ROTOR for drives in made.drives):
            yield "rotors: they do not reverse; with medium=both they can reverse under water"
    if medium is RobotMedium.air and hulls:
        yield "left out: drag and added mass in water; medium=both writes them"
    if medium is RobotMedium.water:
        yield "left out: drag in air; medium=both writes it"
    if medium.wet and hulls:
        yield (
            "left out: wave radiation (radiation_damping) and impacts on water (slamming); "
            "seals describe effect slamming"
        )


SOURCE_OF = {
    "thrust_coefficient": "thrust",
    "torque_coefficient": "torque",
    "max_force": "max_force",
}
"""Names under which the sources of an actuator's fields are kept, where they differ."""


class NewRobot(NamedTuple):
    """Summary of a generated robot folder.

    Args:
        folder: of the robot.
        robot: as its URDF now reads.
        drives: rotors and thrusters, none of them or both.
        medium: in which it works.
        reverses: whether its rotors turn backwards under water.
        limbs: arms and grippers.
        hulls: of the links that displace water.
        wings: links that carry the lifting surfaces of the file.
        changes: to the URDF, in words.
        remarks: things warnings, in words.
        unused: number of kinds of entries of the file that are left out; the README lists them.
    """

    folder: Path
    robot: RobotModel
    drives: list[Drives]
    medium: RobotMedium
    reverses: bool
    limbs: Limbs
    hulls: Mapping[str, LinkHull]
    wings: list[str]
    changes: list[str]
    remarks: list[str]
    unused: int = 0


def scaffold_robot(
    name: str,
    urdf: Path,
    *,
    parent: Path,
    packages: Mapping[str, Path] | None = None,
    arguments: Mapping[str, str] | None = None,
    density: float | None = None,
    medium: str | None = None,
    boxes: bool = False,
    forward: str = "x",
) -> NewRobot:
    """Create a robot folder from a URDF, xacro, SDF or MJCF file.

    Args:
        name: of the robot and its folder.
        urdf: the file; its meshes are found relative to it, or through ``package://``.
        parent: folder in which the new one is made.
        packages: folders of packages, by name, where they cannot be found around the URDF.
        arguments: values of the arguments of a xacro file, by name.
        density: that gives links without ``<inertial>`` the mass of their shapes [kg/m^3]; None
            leaves them without mass.
        medium: ``air``, ``water`` or ``both``; None for what its drives tell.
        boxes: whether boxes of the inertia take the places of missing collision meshes.
        forward: axis of the base link that points forward: ``x``, ``-x``, ``y``, ``-y``.

    Raises:
        RobotError: the name is taken, or the URDF or a mesh cannot be used; nothing is left behind.
    """
    folder = free_name("robot", name, parent)
    source = Takeover(urdf, packages or {}, arguments or {})
    beside = beside_of(parent, name)
    try:
        source.changes += mended(source, forward)
        source.copy_meshes(beside, boxes=boxes)
        made = _fill(beside, name, source, density, medium)
        rename_new(beside, folder)
    finally:
        shutil.rmtree(beside, ignore_errors=True)
    return made._replace(folder=folder)


def _fill(
    folder: Path, name: str, source: Takeover, density: float | None, given: str | None
) -> NewRobot:
    """Write all files of the folder."""
    if density is not None:
        links = add_inertials(source, hulls_of(source, folder), density)
        words = f"mass at {density:g} kg/m^3 of its shapes given to: {', '.join(links) or 'none'}"
        source.changes.append(words)
    source.bolt_base_of_no_mass()
    path = folder / f"{name}.urdf"
    source.write(path)
    settings = RobotSettings(
        name=name, folder=str(folder.resolve()), urdf=path.name, fixed_base=source.fixed_base
    )
    robot = _built(settings, source)
    drives = drives_of(robot, source, extents_of(source, folder), medium=given or "")
    propellers = {source.child_of(joint) for each in drives for joint in each.joints}
    propellers |= {link for each in drives if each.kind == ROTOR for link in each.links}
    held = _held(drives, source)
    source.changes += leave_out_blades(source.stated.wings, propellers)
    wings = add_wing_frames(source, source.stated.wings)
    moved = {name for each in drives for name in (*each.joints, *each.tilting.values())}
    flies = drives and set(robot.joints) <= moved
    if source.fixed_base and flies and robot.mass[0] > 0.0:
        # a vehicle on a test stand, or one that another file lets fly
        source.fixed_base = False
        source.changes.append(
            "fixed to the world in the file, but released: fixed_base in robot.yaml"
        )
    if wings or held or source.fixed_base != settings.fixed_base:
        source.write(path)
        settings = replace(settings, fixed_base=source.fixed_base)
        robot = build_robot(settings)
    _refuse_pushed_world(robot, drives)
    hulls = hulls_of(source, folder, source.drawn_only)
    turning = [link for link in hulls if link in propellers and link != robot.links[0]]
    if turning:
        names = listed(turning)
        source.changes.append(f"shapes of propellers have no hull and no drag: {names}")
    hulls = {link: hull for link, hull in hulls.items() if link not in turning}
    hulls = with_volumes(hulls, robot, source)
    medium = medium_of(given, drives, source)
    if medium.wet and hulls and share_afloat(robot, hulls) == 1.0:
        water = WATER * sum(hull.volume for hull in hulls.values())
        held_down(drives, GRAVITY * (float(robot.mass.sum()) - water))
    # that rotors can turn backwards is for the user to say
    reverses = given is not None and medium.wet
    tilting = {name for each in drives for name in each.tilting.values()}
    limbs = limbs_of(robot, tilting | set(source.rig))
    legs = with_feet(limbs.legs, hulls, robot)
    stances, said = stances_of(robot, legs, source.stated.pose)
    for leg, values in stances.items():
        legs[leg] |= {"stance": values} if values else {}
    limbs = limbs._replace(legs=legs, stance=said)
    made = NewRobot(
        folder, robot, drives, medium, reverses, limbs, hulls, wings, source.changes, []
    )
    made.remarks.extend(_remarks_of(made, source, chosen=given is None))
    made = made._replace(unused=sum(map(len, source.unused.values())))
    facts = _facts(name, made, source)
    for file in ("robot.yaml", "README.md"):
        (folder / file).write_text(rendered(f"{file}.jinja", facts), encoding="utf-8")
    return made


def _held(drives: list[Drives], source: Takeover) -> bool:
    """Fix the joints that drives turn, and those that turn thrusters; return whether there are."""
    held = False
    for each in drives:
        source.fix_joints(each.joints, each.kind)
        held |= bool(each.joints)
        if each.kind != ROTOR and each.tilting:
            source.fix_legs(each.tilting)
            each.tilting.clear()
            held = True
    return held


def _refuse_pushed_world(robot: RobotModel, drives: list[Drives]) -> None:
    """Refuse drives on a rig whose forces would act on the world."""
    if robot.mass[0] > 0.0:
        return
    for whole in drives:
        for carrier, each in whole.by_carrier(robot):
            if not carrier:
                raise RobotError(
                    f"{each.links[0]} drives a robot that is connected to the world by joints.\n"
                    "Allowed there: rotors on one hinge. Release the robot: make the joint below "
                    f"'{robot.links[0]}' fixed and leave that link out, or give it a free joint."
                )


def _built(settings: RobotSettings, source: Takeover) -> RobotModel:
    """Build the robot; error messages name the user's own file."""
    try:
        return build_robot(settings)
    except RobotError as cause:
        text = str(cause).replace(str(settings.urdf_path), str(source.path))
        if "has no mass" in text:
            text += " If it is fixed to the world: name it 'world'."
            text += " Or density=500: the mass of its shapes at 500 kg/m^3."
        raise RobotError(text) from cause


def _facts(name: str, made: NewRobot, source: Takeover) -> dict[str, Any]:
    """Return the variables of the templates."""
    robot = made.robot
    volume = sum(hull.volume for hull in made.hulls.values())
    mass = float(robot.mass.sum())
    # the first link with mass: a robot on a rig begins with the world
    body = robot.links[int(np.argmax(robot.mass > 0.0))]
    imu = next((link for link in robot.links if "imu" in link.lower()), body)
    masses = list(zip(robot.links, (f"{m:.4g}" for m in robot.mass), strict=True))
    return {
        "name": name,
        "original": source.path.name,
        "title": source.name,
        "mass": f"{mass:.4g}",
        "volume": f"{volume * 1e3:.4g}",
        "density": f"{mass / volume:.0f}" if volume > 0.0 else "",
        "links": masses,
        "joints": list(robot.joints),
        "hulls": {link: [flow(s) for s in h.shapes] for link, h in made.hulls.items()},
        "drives": _drive_facts(made),
        "fixed_base": str(source.fixed_base).lower(),
        "medium": made.medium.value,
        "source_of": SOURCE_OF,
        "stiff_source": "position actuators of the MJCF, else " if source.stated.servos else "",
        "servos": {key: flow(v) for key, v in _servos(made, source).items()},
        "effects": _effect_lines(made, source),
        "volumes": {link: h.stated for link, h in made.hulls.items() if h.stated},
        "imu": imu,
        "arms": {key: flow(v) for key, v in made.limbs.arms.items()},
        "grippers": {key: flow(v) for key, v in made.limbs.grippers.items()},
        "legs": {key: flow(v) for key, v in made.limbs.legs.items()},
        "gait": gait_of(robot, made.limbs.legs) if made.limbs.legs else {},
        "others": made.limbs.others,
        "changes": made.changes,
        "unused": source.unused,
        "remarks": made.remarks,
    }


def _servos(made: NewRobot, source: Takeover) -> dict[str, list[float]]:
    """Gains of the servos; those of legs are stiff enough to carry the robot."""
    if not made.robot.joints:
        return {}
    water = water_loads(made.robot, made.hulls) if made.medium.wet else 0.0
    thrust = thrust_loads(made.robot, made.drives)
    legs, values = made.limbs.legs, servo_values(made.robot, source, thrust, water)
    walking = {name for leg in legs.values() for name in leg["joints"]}
    carrying = leg_servos(made.robot, legs) if legs else values
    for k, joint in enumerate(made.robot.joints):
        if joint in walking:
            for key, row in carrying.items():
                values[key][k] = row[k]
        stated = source.stated.servos.get(joint)
        if stated is not None:
            values["kp_each"][k], values["kd_each"][k] = stated
        effort = source.effort_limit(joint)
        if effort > 0.0:
            values["torque_limit_each"][k] = min(effort, NO_LIMIT)
        if joint in source.rig:
            damping = source.stated.damping.get(joint, 0.0)
            values["kp_each"][k], values["kd_each"][k] = 0.0, short(damping)
            values["torque_limit_each"][k] = NO_LIMIT
    return values


def _effect_lines(made: NewRobot, source: Takeover) -> list[tuple[str, list[tuple[str, str]]]]:
    """Effects as YAML text, grouped by source."""
    entries = effects_of(made.robot, made.hulls, source, made.drives, made.medium)
    for name, (values, said) in lift_effects(source.stated.wings, made.wings).items():
        entries[name] = Entry(values, said)
    lines: dict[str, list[tuple[str, str]]] = {}
    for name, entry in entries.items():
        lines.setdefault(entry.source, []).append((name, flow(entry.values)))
    return list(lines.items())


def _drive_facts(made: NewRobot) -> list[dict[str, Any]]:
    """Actuators of ``robot.yaml``: names, fields as YAML text, and their sources."""
    found: list[dict[str, Any]] = []
    first = 0
    for whole in made.drives:
        for carrier, drives in whole.by_carrier(made.robot):
            facts = {
                "kind": drives.kind,
                "name": f"{plain(carrier)}_{drives.kind}s" if carrier else f"{drives.kind}s",
                "carrier": carrier,
                "links": drives.links,
                "first": first,
                "lines": _drive_lines(drives, reverses=made.reverses),
                "sources": drives.sources,
            }
            found.append(facts)
            first += len(drives.links)
    return found


def _drive_lines(drives: Drives, *, reverses: bool) -> dict[str, str]:
    """Fields of the actuator as YAML text; a number that is the same for all is written once."""
    lines = {"position": flow([rounded(row) for row in drives.position])}
    axes = [rounded(row) for row in drives.axis]
    if axes != [[0.0, 0.0, 1.0]] * len(axes):
        lines["axis"] = flow(axes)
    if drives.kind == ROTOR:
        lines["direction"] = flow([float(x) for x in drives.direction])
        values = {
            "thrust_coefficient": drives.thrust,
            "torque_coefficient": drives.torque,
            "radius": drives.radius,
            "max_speed": drives.max_speed,
            "time_constant": drives.time_constant,
        }
        if np.any(drives.spin_down != drives.time_constant):
            values["spin_down"] = drives.spin_down
        if reverses:
            values["reverse"] = np.full(len(drives.links), BACKWARDS)
    else:
        values = {"max_force": drives.thrust, "time_constant": drives.time_constant}
    for key, row in values.items():
        exact = SOURCE_OF.get(key, key) in drives.sources
        numbers = [float(f"{x:.9g}") if exact else short(float(x)) for x in row]
        lines[key] = flow(numbers[:1] if len(set(numbers)) == 1 else numbers)
    return lines
