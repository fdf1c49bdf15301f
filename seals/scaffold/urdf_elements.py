"""XML elements of a URDF, built from numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from xml.etree import ElementTree

import numpy as np

from seals.arrays import Floats
from seals.errors import RobotError
from seals.robot.structure import LARGEST

WORLD = "world"
"""Name of the link without mass that stands for the world: a base of this name does not move."""


ENDLESS = 1e9
"""Limits of joints from which on there is none: files write 1e16, 1.8e308 or inf [any unit]."""


def number_or(text: str | None, default: float) -> float:
    """Return the number in a text, else a default; words such as inf are numbers.

    Example:
        >>> number_or("-inf", 0.0), number_or("", 0.0)
        (-inf, 0.0)
    """
    try:
        value = float(text or default)
    except ValueError:
        return default
    return default if math.isnan(value) else value


def link_element(name: str) -> ElementTree.Element:
    """Return an empty link."""
    return ElementTree.Element("link", {"name": name})


def cylinder_element(radius: float, length: float, *, capped: bool = False) -> ElementTree.Element:
    """Return a cylinder; a capsule, which URDF lacks, becomes one of equal radius and volume.

    Args:
        radius: [m].
        length: of the cylinder, or of the straight part of the capsule [m].
        capped: whether it is a capsule.
    """
    whole = length + (4.0 / 3.0 * radius if capped else 0.0)
    return ElementTree.Element("cylinder", {"radius": f"{radius:.9g}", "length": f"{whole:.9g}"})


def joint_element(
    name: str,
    kind: str,
    parent: str,
    child: str,
    origin: Floats,
    *,
    axis: Floats | None = None,
    limits: Mapping[str, float] | None = None,
) -> ElementTree.Element:
    """Return a joint.

    Args:
        name: of the joint.
        kind: type as URDF names it.
        parent: link.
        child: link.
        origin: pose of the child in the parent, shape (4, 4).
        axis: in axes of the child, shape (3,); None for a fixed joint.
        limits: lower and upper [rad or m], effort [N m or N], velocity [rad/s or m/s].
    """
    joint = ElementTree.Element("joint", {"name": name, "type": kind})
    ElementTree.SubElement(joint, "parent", {"link": parent})
    ElementTree.SubElement(joint, "child", {"link": child})
    ElementTree.SubElement(joint, "origin", pose_text(origin))
    if axis is not None:
        words = " ".join(f"{x:.17g}" for x in axis / max(float(np.linalg.norm(axis)), 1e-300))
        ElementTree.SubElement(joint, "axis", {"xyz": words})
        stated = {
            key: f"{value:.9g}"
            for key, value in (limits or {}).items()
            if kind != "continuous" or key in ("effort", "velocity")
        }
        ElementTree.SubElement(joint, "limit", stated)
    return joint


def pose_text(pose: Floats) -> dict[str, str]:
    """Return position and roll, pitch, yaw of a pose as attributes of an ``<origin>``.

    Example:
        >>> pose_text(np.eye(4))
        {'xyz': '0 0 0', 'rpy': '0 0 0'}
    """
    turn = pose[:3, :3]
    pitch = math.asin(float(np.clip(-turn[2, 0], -1.0, 1.0)))
    if abs(turn[2, 0]) < 1.0 - 1e-12:
        roll = math.atan2(float(turn[2, 1]), float(turn[2, 2]))
        yaw = math.atan2(float(turn[1, 0]), float(turn[0, 0]))
    else:
        roll, yaw = 0.0, math.atan2(-float(turn[0, 1]), float(turn[1, 1]))
    rpy = np.round([roll, pitch, yaw], 9) + 0.0
    place = np.round(pose[:3, 3], 9) + 0.0
    return {key: " ".join(f"{x:.9g}" for x in row) for key, row in (("xyz", place), ("rpy", rpy))}


def numbers(where: str, name: str, text: str | None, count: int) -> list[float]:
    """Return the numbers in a text; refuse those that are not finite.

    Raises:
        RobotError: another count, or one is not finite or beyond every size of a robot.

    Example:
        >>> numbers("link", "size", "1 2 3", 3)
        [1.0, 2.0, 3.0]
    """
    words = (text or "").split()
    try:
        values = [float(word) for word in words[: count + 1]]
    except ValueError:
        values = []
    if len(values) != count or not all(abs(x) < LARGEST for x in values):
        allowed = "a finite number" if count == 1 else f"{count} finite numbers"
        raise RobotError(
            f"{where}: {name}='{(text or '').strip()[:60]}' is not {allowed}.\n"
            f"Allowed: {allowed}, with a decimal point."
        )
    return values
