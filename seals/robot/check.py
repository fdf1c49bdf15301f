"""``seals check``: is this robot one that physics and water can work with?"""

from __future__ import annotations

import enum
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from seals.config.robot import RobotSettings
from seals.medium.seawater import density_of
from seals.robot.build import build_robot
from seals.robot.floating import FloatingBody
from seals.robot.meshes import mesh_names
from seals.robot.model import RobotModel

FRESH_WATER = float(density_of(np.array(20.0), np.array(0.0)))
"""Density of fresh water at 20 degC [kg/m^3]."""
MANY_TRIANGLES = 20_000
"""Triangles of a mesh above which loading and contacts become slow."""
_FEW = 6


class Verdict(enum.Enum):
    """How a check came out."""

    OK = "pass"
    WARN = "warn"
    FAIL = "fail"


@dataclass(frozen=True, kw_only=True)
class RobotFinding:
    """One line of the check of a robot.

    Args:
        verdict: how it came out.
        subject: what was looked at.
        found: what was found, with units.
        advice: what to do about it; empty when all is well.
    """

    verdict: Verdict
    subject: str
    found: str
    advice: str = ""

    def __str__(self) -> str:
        advice = f" {self.advice}" if self.advice else ""
        return f"[{self.verdict.value}] {self.subject}: {self.found}{advice}"


def check_robot(settings: RobotSettings) -> list[RobotFinding]:
    """Look at mass, inertia, hulls, floating, joints and meshes of a robot.

    Args:
        settings: the robot folder as configured.

    Raises:
        RobotError: the robot's files cannot be read at all; nothing can be said about it then.
    """
    robot = build_robot(settings)
    looks = (_mass, _inertia, _links, _floating, _joints)
    found = [finding for look in looks for finding in look(robot)]
    return [*found, *_meshes(settings)]


def _ok(subject: str, found: str) -> RobotFinding:
    return RobotFinding(verdict=Verdict.OK, subject=subject, found=found)


def _warn(subject: str, found: str, advice: str) -> RobotFinding:
    return RobotFinding(verdict=Verdict.WARN, subject=subject, found=found, advice=advice)


def _fail(subject: str, found: str, advice: str) -> RobotFinding:
    return RobotFinding(verdict=Verdict.FAIL, subject=subject, found=found, advice=advice)


def _mass(robot: RobotModel) -> Iterator[RobotFinding]:
    """Total mass, centre of gravity, moving parts without mass."""
    total = float(robot.mass.sum())
    words = f"{total:.4g} kg in {len(robot.links)} link(s)"
    if total <= 0.0:
        yield _fail("mass", words, "Give at least one moving link an <inertial> element.")
        return
    believable = 1e-4 <= total <= 1e5
    yield (
        _ok("mass", words)
        if believable
        else _warn("mass", words, "Masses are in kg; check the unit.")
    )
    body = FloatingBody(robot)
    yield _ok("centre of gravity", f"{_triple(body.gravity_centre)} m from the base origin")
    weightless = [
        name
        for j, name in enumerate(robot.joints)
        if float(robot.mass @ robot.tree.moves[:, j]) <= 0.0
    ]
    if weightless:
        advice = "Give the link below it, or one further out, an <inertial> element."
        yield _fail("moving mass", f"nothing with mass hangs on {_list(weightless)}", advice)


def _inertia(robot: RobotModel) -> Iterator[RobotFinding]:
    """Whether the inertia of each link fits its mass and its size."""
    odd = 0
    for k, link in enumerate(robot.links):
        mass = float(robot.mass[k])
        if mass <= 0.0:
            continue
        moments = np.linalg.eigvalsh(robot.inertia[k])
        hull = robot.hulls[k]
        gyration = math.sqrt(max(float(moments[-1]), 0.0) / mass)
        words = f"{link}: principal moments {_triple(moments)} kg m^2"
        if moments[-1] <= 0.0:
            odd += 1
            yield _fail(
                "inertia", f"{link}: zero, with {mass:.3g} kg", "Give it the inertia of its shape."
            )
        elif moments[0] <= 1e-6 * moments[-1]:
            odd += 1
            yield _warn(
                "inertia",
                words,
                "One is next to nothing: such a link spins up at the slightest torque.",
            )
        elif hull is not None and gyration > 1.5 * hull.reach:
            odd += 1
            size = f"{words}, radius of gyration {gyration:.3g} m, hull reaches {hull.reach:.3g} m"
            yield _warn("inertia", size, "Check the unit: kg m^2, about the centre of mass.")
    if not odd:
        yield _ok("inertia", "positive, within the triangle inequality, fits the size")


def _links(robot: RobotModel) -> Iterator[RobotFinding]:
    """Links that lack mass, hull or collision geometry."""
    bare = [name for name, mass in zip(robot.links, robot.mass, strict=True) if mass <= 0.0]
    if bare:
        yield _ok("links without mass", f"{_list(bare)} (frames)")
    ghosts = [
        name for name, there in zip(robot.links, robot.has_collision, strict=True) if not there
    ]
    solid = [name for name in ghosts if name not in bare]
    if solid:
        advice = "They pass through ground and other robots; add <collision> where that matters."
        yield _warn("links without collision", _list(solid), advice)
    dry = [
        name
        for name, hull, mass in zip(robot.links, robot.hulls, robot.mass, strict=True)
        if hull is None and mass > 0.0
    ]
    if dry and len(dry) < len([m for m in robot.mass if m > 0.0]):
        advice = "They displace no water; add them under hulls: in robot.yaml where that matters."
        yield _warn("links without hull", _list(dry), advice)


def _floating(robot: RobotModel) -> Iterator[RobotFinding]:
    """Volume, net buoyancy, draught and stability in fresh water."""
    body = FloatingBody(robot)
    if not body.parts:
        advice = (
            "In water it weighs what it weighs in air; add hulls: in robot.yaml if it meets water."
        )
        yield _warn("hull", "no link has one", advice)
        return
    yield _ok("hull", f"{body.volume * 1e3:.4g} litre in {len(body.parts)} link(s)")
    if robot.tree.fixed_base or body.mass <= 0.0:
        return
    lift = FRESH_WATER * body.volume - body.mass
    net = f"{lift * 9.81:+.3g} N in fresh water"
    wanted = body.mass / FRESH_WATER
    if abs(lift) < 0.005 * body.mass:
        yield _ok("net buoyancy", f"{net}: neutral within 0.5 %")
        wanted = body.volume
    elif lift < 0.0:
        yield _ok("net buoyancy", f"{net}: sinks")
        wanted = body.volume
    else:
        share = wanted / body.volume
        depth = body.draught(wanted)
        yield _ok("net buoyancy", f"{net}: floats, {share:.0%} under water, draught {depth:.4g} m")
    yield from _stability(body, wanted)


def _stability(body: FloatingBody, volume: float) -> Iterator[RobotFinding]:
    """Restoring moment for a small roll and pitch, and whether upright is an equilibrium at all."""
    for name, axis in (("roll", (1.0, 0.0, 0.0)), ("pitch", (0.0, 1.0, 0.0))):
        height = body.metacentric_height(axis, volume)
        arm = body.righting_arm(axis, volume)
        words = f"metacentric height {round(height * 1e3, 2) + 0.0:.4g} mm"
        if abs(height) < 1e-4 * body.reach:
            yield _ok(f"stability in {name}", f"{words}: indifferent")
        elif height < 0.0:
            advice = "Upright it turns over; move mass down or buoyancy up."
            yield _warn(f"stability in {name}", words, advice)
        elif abs(arm) > math.tan(math.radians(1.0)) * height:
            angle = math.degrees(math.atan2(abs(arm), height))
            advice = "Put the centre of gravity below the centre of buoyancy, or expect the list."
            yield _warn(
                f"stability in {name}", f"{words}, but lies at about {angle:.0f} deg", advice
            )
        else:
            yield _ok(f"stability in {name}", words)


def _joints(robot: RobotModel) -> Iterator[RobotFinding]:
    """Limits that hold a joint still, or exclude zero."""
    if not robot.joints:
        return
    stuck, away = [], []
    for name, low, high in zip(robot.joints, robot.lower, robot.upper, strict=True):
        if high <= low:
            stuck.append(name)
        elif not low <= 0.0 <= high:
            away.append(f"{name} ({low:.3g} to {high:.3g})")
    if stuck:
        advice = "They cannot move; set lower and upper, or make them type fixed."
        yield _warn("joint limits", f"no travel: {_list(stuck)}", advice)
    if away:
        advice = "Runs start at zero unless initial.joint_position says otherwise; give it."
        yield _warn("joint limits", f"zero lies outside: {_list(away)}", advice)
    if not stuck and not away:
        free = int(np.sum(np.isinf(robot.lower) & np.isinf(robot.upper)))
        yield _ok("joint limits", f"{len(robot.joints)} joint(s), {free} without limits")


def _meshes(settings: RobotSettings) -> Iterator[RobotFinding]:
    """Meshes that are heavy, or not closed."""
    from seals.hulls import hull_from_mesh

    folder = Path(settings.folder)
    names = mesh_names(settings.urdf_path)
    fine = len(names)
    for name in names:
        triangles = _triangles(settings.urdf_path.parent / name)
        if triangles > MANY_TRIANGLES:
            fine -= 1
            advice = f"Above {MANY_TRIANGLES:,} loading and contacts are slow; simplify it."
            yield _warn("mesh", f"{name} has about {triangles:,} triangles", advice)
    for link, hull in settings.hulls.items():
        for shape in hull.shapes:
            if shape.type.value != "mesh" or not shape.file:
                continue
            notes = hull_from_mesh(
                folder / shape.file, position=shape.position, rpy=shape.rpy
            ).notes
            fine += not notes
            for note in notes:
                yield _warn(
                    f"hull of {link}", note.text, "Export the mesh closed and wound outwards."
                )
    if fine:
        yield _ok("meshes", f"{fine} without remark")


def _triangles(path: Path) -> int:
    """Number of triangles of a binary STL, or a guess from the size of any other file."""
    size = path.stat().st_size
    return (size - 84) // 50 if path.suffix.lower() == ".stl" else size // 100


def _triple(values: object) -> str:
    # adding zero turns -0 into 0
    return "(" + ", ".join(f"{float(value) + 0.0:.4g}" for value in np.asarray(values)) + ")"


def _list(names: list[str]) -> str:
    more = f" and {len(names) - _FEW} more" if len(names) > _FEW else ""
    return ", ".join(names[:_FEW]) + more
