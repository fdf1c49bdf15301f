"""Lifting surfaces that plug-ins of Gazebo and of the UUV simulator state."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from seals.arrays import Floats
from seals.errors import RobotError, refuse_unlisted
from seals.scaffold.plug_in_values import (
    finite,
    fluid_density,
    last_name,
    six_by_six,
    text_of,
    vector,
)

FORWARD_SPEED = "linear_damping_forward_speed"
"""Damping of the UUV simulator by the product of forward speed and velocity."""


class Wing(NamedTuple):
    """Lifting surface on a link, as stated in a file.

    Args:
        link: that carries it.
        area: slope of the lift coefficient times the area [m^2].
        density: of the medium that the file states [kg/m^3].
        place: centre of pressure in link axes [m], shape (3,).
        turn: chord, span and normal of the wing as columns, in link axes, shape (3, 3).
        source: in words.
        left_out: numbers that no effect takes, in words.
        drag: growth of the drag coefficient with the square of the angle of attack times the area
            [m^2].
    """

    link: str
    area: float
    density: float
    place: Floats
    turn: Floats
    source: str
    left_out: str
    drag: float = 0.0


def wings_of(plugin: ElementTree.Element, said: str) -> Iterator[Wing]:
    """Return the lifting surfaces of a plug-in.

    Raises:
        RobotError: a number is not finite, or its axes span no wing.
    """
    if plugin.find("cla") is not None:
        yield _lift_drag(plugin, said)
    for model in plugin.findall("liftdrag"):
        yield _fin(plugin, model, said)
    for link in plugin.findall("link"):
        yield from _under_way(plugin, link, said)


def _under_way(plugin: ElementTree.Element, link: ElementTree.Element, said: str) -> Iterator[Wing]:
    """Damping of a hull by its forward speed, as the lift of two upright and two level wings.

    Equation:
        Y = -D_y u v and N = -D_n u r are the lift rho A u v / 2 of two wings with half of D_y = rho
        A / 2 each, D_n / D_y the square of their distance from the origin; Z and M likewise.
    """
    model = link.find("hydrodynamic_model")
    damping = None if model is None else six_by_six(model, FORWARD_SPEED, said)
    if damping is None:
        return
    density = fluid_density(plugin, said)
    upright = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]).T
    source = f"{said} ({FORWARD_SPEED}, in water of {density:g} kg/m^3)"
    for along, about, turn in ((1, 5, upright), (2, 4, np.eye(3))):
        force, moment = (abs(float(damping[k, k])) for k in (along, about))
        if force == 0.0:
            continue
        arm = math.sqrt(moment / force)
        for x in (arm, -arm):
            place = np.array([x, 0.0, 0.0])
            yield Wing(
                last_name(link.get("name")), force / density, density, place, turn, source, ""
            )


def _fin(plugin: ElementTree.Element, model: ElementTree.Element, said: str) -> Wing:
    """Fin of the UUV simulator: chord along x of its link, hinge along z.

    Equation:
        Quadratic: L = C_L a V^2, D = C_D a^2 V^2; two lines: L = rho A c_la a V^2 / 2 to the stall.
    """
    kind = text_of(model, "type")
    link = text_of(plugin, "link_name")
    keys = {"Quadratic": ("lift_constant", "drag_constant"), "TwoLines": ("cla", "area")}
    refuse_unlisted(
        kind, keys, f"{said}: the type '{kind[:40]}' of its lift is not known", error=RobotError
    )
    first, second = (finite(text_of(model, tag), f"{said}: {tag}") for tag in keys[kind])
    density = fluid_density(model, said)
    area, drag, left = first * second, 0.0, ""
    if kind == "Quadratic":
        area, drag = 2.0 * first / density, 2.0 * second / density
    else:
        stated = {tag: text_of(model, tag) for tag in ("a0", "cda", "alpha_stall")}
        left = ", ".join(t for t, x in stated.items() if x and finite(x, f"{said}: {t}"))
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]).T
    source = f"{said} ({', '.join(keys[kind])} in water of {density:g} kg/m^3)"
    return Wing(link, area, density, np.zeros(3), turn, source, left, drag)


def _lift_drag(plugin: ElementTree.Element, said: str) -> Wing:
    """Plug-in LiftDrag: slope, area, place and axes of a wing; absent numbers are Gazebo's."""
    defaults = {"cla": 1.0, "area": 1.0, "air_density": 1.2041, "a0": 0.0, "cda": 0.0, "cma": 0.0}
    value = {
        tag: finite(text_of(plugin, tag) or str(default), f"{said}: {tag}")
        for tag, default in defaults.items()
    }
    place, chord, normal = (
        vector(plugin, tag, default, said)
        for tag, default in (("cp", "0 0 0"), ("forward", "1 0 0"), ("upward", "0 0 1"))
    )
    span = np.cross(normal, chord)
    if float(np.linalg.norm(span)) < 1e-6:
        raise RobotError(
            f"{said}: forward={chord.tolist()} and upward={normal.tolist()} span no wing.\n"
            "Allowed: two directions at right angles."
        )
    rows = [chord, span, np.cross(chord, span)]
    left = [f"{tag}={value[tag]:g}" for tag in ("a0", "cda", "cma") if value[tag]]
    left += ["stall"] if text_of(plugin, "alpha_stall") else []
    left += ["control_joint_name"] if text_of(plugin, "control_joint_name") else []
    return Wing(
        text_of(plugin, "link_name"),
        value["cla"] * value["area"],
        value["air_density"],
        place,
        np.stack([row / np.linalg.norm(row) for row in rows], axis=1),
        f"{said} (cla, area{'' if text_of(plugin, 'area') else ' 1 m^2, the default of Gazebo'})",
        ", ".join(left),
    )
