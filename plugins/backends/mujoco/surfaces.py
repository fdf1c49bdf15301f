"""Contact coefficients of links and of pairs of touching surfaces."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

from seals.errors import RobotError
from seals.robot.model import RobotModel, Surface

USUAL = Surface(friction=0.5, rolling=0.0, spinning=0.0, restitution=0.0)
"""Coefficients of a link whose URDF states none."""

_FIELDS = {
    "lateral_friction": "friction",
    "rolling_friction": "rolling",
    "spinning_friction": "spinning",
    "restitution": "restitution",
}


def surfaces_of(robot: RobotModel) -> list[Surface]:
    """Return the contact coefficients of every link: stated in the model, else URDF, else default.

    Raises:
        RobotError: a coefficient in the URDF is no number.
    """
    stated = {
        link.get("name", ""): link.find("contact")
        for link in ElementTree.fromstring(Path(robot.urdf).read_bytes()).iter("link")
    }
    found = []
    for name in robot.links:
        surface, contact = USUAL, stated.get(name)
        for element in contact if contact is not None else ():
            if element.tag in _FIELDS:
                surface = replace(surface, **{_FIELDS[element.tag]: _value(robot, name, element)})
        found.append(_overruled(surface, robot.surface))
    return found


def _value(robot: RobotModel, link: str, element: ElementTree.Element) -> float:
    try:
        return float(element.get("value", ""))
    except ValueError as cause:
        raise RobotError(
            f"URDF {robot.urdf}: link '{link}': <{element.tag}> is no number.\n"
            f'Write <{element.tag} value="0.5"/>.'
        ) from cause


def _overruled(surface: Surface, model: Surface | None) -> Surface:
    given = {} if model is None else {k: v for k, v in vars(model).items() if v is not None}
    return replace(surface, **given)


def combined(one: Surface, other: Surface) -> Surface:
    """Return the coefficients of two surfaces that touch.

    Equation:
        mu = mu_1 mu_2, e = e_1 e_2; the lever arms against rolling and spinning
        r = r_1 mu_2 + r_2 mu_1.

    Example:
        >>> combined(Surface(friction=0.5, rolling=0.0, spinning=0.0, restitution=1.0), USUAL)
        Surface(friction=0.25, rolling=0.0, spinning=0.0, restitution=0.0)
    """
    a, b = ((s.friction or 0.0, s.rolling or 0.0, s.spinning or 0.0) for s in (one, other))
    return Surface(
        friction=a[0] * b[0],
        rolling=a[1] * b[0] + b[1] * a[0],
        spinning=a[2] * b[0] + b[2] * a[0],
        restitution=(one.restitution or 0.0) * (other.restitution or 0.0),
    )
