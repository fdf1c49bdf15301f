"""Checks of joints and servos."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.check.finding import RobotFinding, failed, listed, passed, warned
from seals.effects.binding import bind_effects
from seals.effects.effect import Effect
from seals.errors import ConfigError
from seals.multibody.tree import poses_in_base
from seals.robot.limbs import standing
from seals.robot.model import RobotModel

GRAVITY = 9.81
STEP = 0.004
"""Step of a run unless it says otherwise [s]."""
WEAK = 1.5
"""Torque limit by the torque that holds a joint level below which it is called weak [1]."""
RINGING = 0.2
"""Damping ratio below which a joint swings on after a command [1]."""
FASTEST = 60.0
"""Natural frequency beyond which a servo is faster than any real one [Hz]."""


def look_at_joints(robot: RobotModel) -> Iterator[RobotFinding]:
    """Yield findings about joint limits that allow no motion, or exclude the start."""
    if not robot.joints:
        return
    stuck, away = [], []
    start = standing(robot.legs, len(robot.joints))
    for name, low, high, at in zip(robot.joints, robot.lower, robot.upper, start, strict=True):
        if high <= low:
            stuck.append(name)
        elif not low <= at <= high:
            away.append(f"{name} ({low:.3g} to {high:.3g})")
    if stuck:
        advice = "They cannot move; set lower and upper, or change their type to fixed."
        yield warned("joint limits", f"no travel: {listed(stuck)}", advice)
    if away:
        place = "zero" if not robot.legs else "the stance (zero if there is none)"
        advice = f"Runs start at {place} unless initial.joint_position says otherwise; give it."
        where = "zero" if not robot.legs else "the start"
        yield warned("joint limits", f"{where} lies outside: {listed(away)}", advice)
    if not stuck and not away:
        free = int(np.sum(np.isinf(robot.lower) & np.isinf(robot.upper)))
        yield passed("joint limits", f"{len(robot.joints)} joint(s), {free} without limits")


def look_at_servos(robot: RobotModel, actuators: Mapping[str, Effect]) -> Iterator[RobotFinding]:
    """Yield findings about frequency, damping and torque of the servos.

    Args:
        robot: the robot.
        actuators: by instance name; rotors and thrusters are passed over.
    """
    servos: list[Any] = [a for a in actuators.values() if "joint drive" in a.accounts_for]
    if not robot.joints:
        return
    if not servos:
        advice = (
            "They have no servos and swing freely. Add servos under actuators: if they are driven."
        )
        yield warned("servos", f"none, with {len(robot.joints)} joint(s)", advice)
        return
    yield from _bounds(robot, actuators)
    inertia, hold = joint_loads_of(robot)
    for servo in servos:
        stiffness, damping, limit, armature = (
            servo.of_joints(key, len(robot.joints))
            for key in ("kp", "kd", "torque_limit", "armature")
        )
        yield from _dynamics(robot, inertia + armature, stiffness, damping)
        yield from _strength(robot, hold, limit)


def _bounds(robot: RobotModel, actuators: Mapping[str, Effect]) -> Iterator[RobotFinding]:
    """Check that the gains are stable at the default step."""
    from seals.world.servos import check_gains

    try:
        check_gains(robot, bind_effects(actuators, robot.links), STEP)
    except ConfigError as refusal:
        first, _, advice = str(refusal).partition("\n")
        yield failed("servo bounds", first, advice)
        return
    yield passed("servo bounds", f"the gains are stable at steps of {STEP * 1e3:g} ms")


def joint_loads_of(robot: RobotModel) -> tuple[Floats, Floats]:
    """Return the load on each joint, all joints at zero.

    Returns:
        Inertia of everything beyond each joint about its axis [kg m^2], mass for one that slides
        [kg]; and the torque [N m] or force [N] that holds it when its axis lies level, shape (J,).
    """
    tree = robot.tree
    origins, turns = poses_in_base(tree)
    places = origins + np.einsum("lij,lj->li", turns, robot.centre)
    inertia, hold = np.zeros(tree.joints), np.zeros(tree.joints)
    for j, child in enumerate(tree.child):
        mass = robot.mass * tree.moves[:, j]
        axis = turns[child] @ tree.axis[j]
        if tree.prismatic[j]:
            inertia[j], hold[j] = mass.sum(), GRAVITY * mass.sum()
            continue
        arm = places - origins[child]
        across = arm - np.outer(arm @ axis, axis)
        own = np.einsum("i,lij,ljk,lmk,m->l", axis, turns, robot.inertia, turns, axis)
        inertia[j] = float(mass @ np.sum(across**2, axis=1) + tree.moves[:, j] @ own)
        hold[j] = GRAVITY * float(np.linalg.norm(mass @ across))
    return inertia, hold


def _dynamics(
    robot: RobotModel, inertia: Floats, stiffness: Floats, damping: Floats
) -> Iterator[RobotFinding]:
    """Check the bandwidth and damping of the joints."""
    safe = np.maximum(inertia, 1e-12)
    rate = np.sqrt(stiffness / safe) / (2.0 * math.pi)
    ratio = damping / (2.0 * np.sqrt(np.maximum(stiffness * safe, 1e-24)))
    words = f"{_range(rate)} Hz, damping ratio {_range(ratio)}"
    ringing = [n for n, r in zip(robot.joints, ratio, strict=True) if r < RINGING]
    hasty = [n for n, r in zip(robot.joints, rate, strict=True) if r > FASTEST]
    if ringing:
        advice = "They oscillate after a command; raise kd (2 sqrt(kp I) damps critically)."
        yield warned("servo gains", f"{words}: {listed(ringing)}", advice)
    elif hasty:
        advice = (
            "This is faster than real servos; lower kp, or state the armature of motor and gear."
        )
        yield warned("servo gains", f"{words}: {listed(hasty)}", advice)
    else:
        yield passed("servo gains", words)


def _strength(robot: RobotModel, hold: Floats, limit: Floats) -> Iterator[RobotFinding]:
    """Check that the servos hold the arm stretched out level."""
    margin = limit / np.maximum(hold, 1e-9)
    weak = [
        f"{name} ({top:.3g} of {need:.3g})"
        for name, top, need, m in zip(robot.joints, limit, hold, margin, strict=True)
        if m < WEAK
    ]
    if weak:
        advice = (
            "With a level arm in air they sag or move slowly; "
            "raise torque_limit, or reduce the mass of the arm."
        )
        yield warned(
            "servo strength", f"torque limit, of the torque by weight: {listed(weak)} N m", advice
        )
    else:
        least = min(float(margin.min()), 999.0)
        yield passed("servo strength", f"at least {least:.3g} times the weight that it supports")


def _range(values: Floats) -> str:
    low, high = float(values.min()), float(values.max())
    return f"{low:.3g}" if math.isclose(low, high, rel_tol=0.01) else f"{low:.3g} to {high:.3g}"
