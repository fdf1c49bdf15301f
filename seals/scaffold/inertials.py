"""Mass properties of links without ``<inertial>``, from their shapes and one density."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree import ElementTree

import numpy as np

from seals.arrays import Floats
from seals.scaffold.shapes import LinkHull
from seals.scaffold.takeover import Element

INERTIA_KEYS = {
    "ixx": (0, 0),
    "ixy": (0, 1),
    "ixz": (0, 2),
    "iyy": (1, 1),
    "iyz": (1, 2),
    "izz": (2, 2),
}
"""Rows and columns of the inertia's attributes."""


def add_inertials(root: Element, hulls: Mapping[str, LinkHull], density: float) -> list[str]:
    """Add mass properties to links without ``<inertial>``, from their shapes.

    Each shape counts as an even box of its own volume's mass: its inertia is exact for boxes, a
    fifth too large for cylinders and two thirds for spheres.

    Args:
        root: of the URDF; changed.
        hulls: shapes by link.
        density: [kg/m^3].

    Returns:
        Names of the links.
    """
    changed = []
    for link in root.findall("link"):
        name = str(link.get("name"))
        if link.find("inertial") is None and name in hulls:
            link.insert(0, _inertial(hulls[name], density))
            changed.append(name)
    return changed


def _inertial(hull: LinkHull, density: float) -> Element:
    masses = density * np.array(hull.volumes)
    total = float(masses.sum())
    centre: Floats = masses @ np.array([box.centre for box in hull.boxes]) / total
    inertia = np.zeros((3, 3))
    for mass, box in zip(masses, hull.boxes, strict=True):
        squares = box.edges**2
        own = np.diag(mass / 12.0 * (squares.sum() - squares))
        arm = box.centre - centre
        inertia += box.turn @ own @ box.turn.T
        inertia += mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    element = ElementTree.Element("inertial")
    words = " ".join(f"{x:.6g}" for x in centre)
    ElementTree.SubElement(element, "origin", {"xyz": words, "rpy": "0 0 0"})
    ElementTree.SubElement(element, "mass", {"value": f"{total:.6g}"})
    values = {key: f"{inertia[place]:.6g}" for key, place in INERTIA_KEYS.items()}
    ElementTree.SubElement(element, "inertia", values)
    return element
