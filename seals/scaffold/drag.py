"""Drag in water of the links of a new robot, from the shapes of their hulls."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.effects.drag_form import DragForm, HullAxis, form_of_hull
from seals.environment.seawater import FRESH_WATER
from seals.hydrostatics import HullBox, HullCapsule, HullCylinder, HullSphere
from seals.hydrostatics.wetted import Hull
from seals.scaffold.shapes import Box, LinkHull

WATER, AIR = FRESH_WATER, 1.2
"""Densities for the estimates [kg/m^3]."""
BLUFF = 1.0
"""Drag coefficient of a bluff body at these speeds [1]; cubes and cylinders lie at 0.8 to 1.2."""
SPHERE = 0.47
"""That of a sphere below the drag crisis (Hoerner 1965)."""
ROUND = 0.3
"""That of a capsule along its axis: hemispherical ends (Hoerner 1965)."""
FRICTION = 0.01
"""Skin friction of a turning round body [1], order of Sawatzki 1970 for spheres."""


class LinkDrag(NamedTuple):
    """Drag of links that share the same numbers.

    Args:
        options: form and size of the body; empty for drag per axis.
        coefficients: along the link axes [N s^2/m^2], shape (3,).
        turning: quadratic drag of turning that the form does not hold [N m s^2/rad^2], shape (3,).
    """

    options: dict[str, Any]
    coefficients: Floats
    turning: Floats

    @property
    def source(self) -> str:
        """Origin of the numbers, in words."""
        return "drag of the hull's shape" if self.options else "bluff boxes around the shapes"


def drag_of(hulls: Sequence[LinkHull]) -> LinkDrag:
    """Return the mean drag of links: by the form of their common shape, else as bluff boxes."""
    forms = [form_of_hull(_only_shape(hull)) for hull in hulls]
    kinds = {(form.get("form"), form.get("axis")) for form in forms}
    if len(kinds) > 1 or not forms[0]:
        boxes = [box for hull in hulls for box in hull.boxes]
        areas = sum((box.areas for box in boxes), np.zeros(3)) / len(hulls)
        turning = sum((_box_turning(box) for box in boxes), np.zeros(3)) / len(hulls)
        return LinkDrag({}, 0.5 * WATER * BLUFF * areas, turning)
    lengths = [k for k, v in forms[0].items() if isinstance(v, float)]
    mean = {k: float(np.mean([form[k] for form in forms])) for k in lengths}
    used = {k: v for k, v in mean.items() if round(v, 6)}
    chosen: dict[str, Any] = {k: forms[0][k].value for k in ("form", "axis") if k in forms[0]}
    each = [_of_one_shape(hull, form) for hull, form in zip(hulls, forms, strict=True)]
    drag, turning = (np.mean(part, axis=0) for part in zip(*each, strict=True))
    return LinkDrag({**chosen, **used}, drag, turning)


def _only_shape(hull: LinkHull) -> Hull | None:
    """Hull of a link that consists of one primitive; None for other links."""
    shape = hull.shapes[0]
    if len(hull.shapes) > 1 or shape["type"] == "mesh":
        return None
    size, position = shape["size"], shape.get("position", (0.0, 0.0, 0.0))
    if shape["type"] == "sphere":
        return HullSphere(radius=size[0], position=position)
    rpy = shape.get("rpy", (0.0, 0.0, 0.0))
    if shape["type"] == "box":
        return HullBox(size=size, position=position, rpy=rpy)
    made = HullCylinder if shape["type"] == "cylinder" else HullCapsule
    return made(radius=size[0], length=size[1], position=position, rpy=rpy)


def _of_one_shape(hull: LinkHull, form: dict[str, Any]) -> tuple[Floats, Floats]:
    """Coefficients along the link axes, and friction of a round body about its own axis."""
    areas, size = hull.boxes[0].areas, hull.shapes[0]["size"]
    if form["form"] is DragForm.faces:
        return 0.5 * WATER * BLUFF * areas, np.zeros(3)
    radius, disc = size[0], 0.25 * np.pi
    if form["form"] is DragForm.isotropic:
        turning = np.full(3, FRICTION * WATER * radius**5)
        return 0.5 * WATER * SPHERE * disc * areas, turning
    along = np.eye(3)[list(HullAxis).index(form["axis"])]
    capsule = hull.shapes[0]["type"] == "capsule"
    across = areas - (4.0 - np.pi) * radius**2 * capsule
    end = disc * (ROUND if capsule else BLUFF)
    factor = 0.5 * WATER * (BLUFF * across * (1.0 - along) + end * areas * along)
    return factor, along * np.pi * FRICTION * WATER * radius**4 * size[1]


def _box_turning(box: Box) -> Floats:
    """Quadratic torque of one box turning about each axis of its link [N m s^2/rad^2].

    Strips of the box feel 1/2 rho C (w y)^2: about its own centre their moments sum to
    rho C l b^4 / 64 a face; its centre feels 1/2 rho C A r^3.
    """
    x, y, z = box.size
    own = WATER * BLUFF / 64.0 * np.array([x * (y**4 + z**4), y * (x**4 + z**4), z * (x**4 + y**4)])
    for k in range(3):
        arm = np.delete(box.centre, k)
        reach = float(np.hypot(*arm))
        if reach > 0.0:
            # moving across the arm: the shadow along one axis counts by the other's share of it
            facing = float(np.delete(box.areas, k) @ np.abs(arm[::-1])) / reach
            own[k] += 0.5 * WATER * BLUFF * facing * reach**3
    return own
