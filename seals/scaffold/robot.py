"""``seals new robot``: generates a robot folder from a URDF."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from seals.control.plant import ROTOR
from seals.errors import RobotError
from seals.robot.build import build_robot
from seals.robot.model import RobotModel
from seals.robot.settings import RobotSettings
from seals.scaffold.estimates import servo_values, short, water_effects
from seals.scaffold.inertials import add_inertials
from seals.scaffold.legs import gait_of, leg_servos
from seals.scaffold.limbs import Limbs, limbs_of
from seals.scaffold.naming import free_name
from seals.scaffold.rotors import Drives, drives_of
from seals.scaffold.shapes import LinkHull, extents_of, hulls_of, rounded
from seals.scaffold.takeover import Takeover
from seals.scaffold.writing import flow, rendered


class NewRobot(NamedTuple):
    """Summary of a generated robot folder.

    Args:
        folder: of the robot.
        robot: as its URDF now reads.
        drives: rotors or thrusters, None without any.
        limbs: arms and grippers.
        hulls: of the links that displace water.
        changes: to the URDF, in words.
        remarks: things to look at, in words.
    """

    folder: Path
    robot: RobotModel
    drives: Drives | None
    limbs: Limbs
    hulls: Mapping[str, LinkHull]
    changes: list[str]
    remarks: list[str]


def scaffold_robot(
    name: str,
    urdf: Path,
    *,
    parent: Path,
    packages: Mapping[str, Path] | None = None,
    density: float | None = None,
) -> NewRobot:
    """Create a robot folder from a URDF.

    Args:
        name: of the robot and its folder.
        urdf: the file; its meshes are found relative to it, or through ``package://``.
        parent: folder in which the new one is made.
        packages: folders of packages, by name, where they cannot be found around the URDF.
        density: that gives links without ``<inertial>`` the mass of their shapes [kg/m^3]; None
            leaves them without mass.

    Raises:
        RobotError: the name is taken, or the URDF or a mesh cannot be used; nothing is left behind.
    """
    folder = free_name("robot", name, parent)
    source = Takeover(urdf, packages or {})
    beside = parent / f".{name}.part"
    shutil.rmtree(beside, ignore_errors=True)
    beside.mkdir(parents=True)
    try:
        made = _fill(beside, name, source, density)
        beside.rename(folder)
    finally:
        shutil.rmtree(beside, ignore_errors=True)
    return made._replace(folder=folder)


def _fill(folder: Path, name: str, source: Takeover, density: float | None) -> NewRobot:
    """Write all files of the folder."""
    source.copy_meshes(folder)
    if density is not None:
        links = add_inertials(source.root, hulls_of(source.root, folder, set()), density)
        words = f"mass at {density:g} kg/m^3 of its shapes given to: {', '.join(links) or 'none'}"
        source.changes.append(words)
    path = folder / f"{name}.urdf"
    source.write(path)
    settings = RobotSettings(name=name, folder=str(folder.resolve()), urdf=path.name)
    robot = _built(settings, source)
    drives = drives_of(robot, source, extents_of(source.root, folder))
    if drives is not None and drives.joints:
        source.fix_joints(drives.joints)
        source.write(path)
        robot = build_robot(settings)
    rotor_links = set(drives.links) if drives is not None and drives.kind == ROTOR else set()
    hulls = hulls_of(source.root, folder, rotor_links)
    limbs = limbs_of(robot, set())
    made = NewRobot(folder, robot, drives, limbs, hulls, source.changes, [])
    made.remarks.extend(_remarks(made))
    facts = _facts(name, made, source)
    for file in ("robot.yaml", "README.md"):
        (folder / file).write_text(rendered(f"{file}.jinja", facts), encoding="utf-8")
    return made


def _built(settings: RobotSettings, source: Takeover) -> RobotModel:
    """Build the robot, naming the URDF as the user knows it."""
    try:
        return build_robot(settings)
    except RobotError as cause:
        text = str(cause).replace(str(settings.urdf_path), str(source.path))
        if "has no mass" in text:
            text += " Or --density 500: the mass of its shapes at 500 kg/m^3."
        raise RobotError(text) from cause


def _facts(name: str, made: NewRobot, source: Takeover) -> dict[str, Any]:
    """Return the variables of the templates."""
    robot, drives = made.robot, made.drives
    volume = sum(hull.volume for hull in made.hulls.values())
    mass = float(robot.mass.sum())
    imu = next((link for link in robot.links if "imu" in link.lower()), robot.links[0])
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
        "drives": None if drives is None else _drive_lines(drives),
        "kind": "" if drives is None else drives.kind,
        "drive_links": [] if drives is None else drives.links,
        "servos": {key: flow(v) for key, v in _servos(made, source).items()},
        "effects": {key: flow(v) for key, v in water_effects(robot, made.hulls).items()},
        "imu": imu,
        "arms": {key: flow(v) for key, v in made.limbs.arms.items()},
        "grippers": {key: flow(v) for key, v in made.limbs.grippers.items()},
        "legs": {key: flow(v) for key, v in made.limbs.legs.items()},
        "gait": gait_of(robot, made.limbs.legs) if made.limbs.legs else {},
        "others": made.limbs.others,
        "changes": made.changes,
        "remarks": made.remarks,
    }


def _servos(made: NewRobot, source: Takeover) -> dict[str, list[float]]:
    """Gains of the servos: those of legs carry the robot."""
    if made.limbs.legs:
        return leg_servos(made.robot, made.limbs.legs)
    return servo_values(made.robot, source) if made.robot.joints else {}


def _drive_lines(drives: Drives) -> dict[str, str]:
    """Fields of the actuator, as YAML text; numbers alike for all are written once."""
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
        }
    else:
        values = {"max_force": drives.thrust * drives.max_speed**2}
    for key, row in values.items():
        numbers = [short(float(x)) for x in row]
        lines[key] = flow(numbers[:1] if len(set(numbers)) == 1 else numbers)
    return lines


def _remarks(made: NewRobot) -> list[str]:
    """Return remarks on values that should be checked first."""
    robot, drives = made.robot, made.drives
    out = []
    if made.limbs.legs:
        out.append("legs: the pose at zero is taken for the stance; the gait's numbers are chosen")
    elif drives is None:
        out.append(
            "no link is named like a rotor or thruster (rotor, prop, thruster, motor): "
            "write them under actuators: in robot.yaml"
        )
    elif drives.kind == ROTOR:
        out.append("rotors: thrust is chosen so that it hovers at half of full thrust")
        if np.any(drives.axis[:, 2] < 0.5):
            out.append("rotors: some do not point up; check axis")
    else:
        out.append("thrusters: the largest force is chosen; check axis and max_force")
    bare = [n for n, m in zip(robot.links, robot.mass, strict=True) if m <= 0.0 and n in made.hulls]
    if bare:
        out.append(
            f"links with a shape and no <inertial>: {', '.join(bare[:6])}; "
            "--density 500 would give them mass"
        )
    if not made.hulls:
        out.append("no link has a shape: it displaces no water; write hulls: in robot.yaml")
    if made.limbs.others:
        out.append(f"joints left out of arms and grippers: {', '.join(made.limbs.others)}")
    return out
