"""Parameters of Gazebo plug-ins: motors, thrusters, wings, hydrodynamics, displaced volumes."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from seals.arrays import Floats
from seals.control.plant import ROTOR, THRUSTER
from seals.errors import RobotError

_ROWS, _SPEEDS = "xyzkmn", "UVWPQR"
_FLIP = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
"""Body axes x forward, y starboard, z down in x forward, y left, z up."""


class Motor(NamedTuple):
    """One rotor or thruster that a file states.

    Args:
        kind: ``rotor`` or ``thruster``.
        link: that it turns or that carries it; empty where the joint tells.
        joint: that turns it; empty where the link tells.
        values: what is stated, in SI units: ``thrust`` and ``torque`` coefficients, ``max_speed``,
            ``time_constant``, ``spin_down``, ``direction``, ``max_force``, ``back_force``,
            ``radius``.
        source: of the numbers, in words.
        position: in axes of the link [m].
        axis: of positive thrust in axes of the link; None for the joint's.
    """

    kind: str
    link: str
    joint: str
    values: Mapping[str, float]
    source: str
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axis: tuple[float, float, float] | None = None


class Hydrodynamics(NamedTuple):
    """Coefficients of one link as stated in a file, magnitudes in body axes; None if not stated.

    Args:
        link: empty for the base.
        added: added-mass matrix, shape (6, 6).
        linear: damping by speed, diagonal, shape (6,).
        quadratic: damping by speed squared, diagonal, shape (6,).
        source: in words.
        left_out: numbers that no effect takes, in words.
    """

    link: str
    added: Floats | None
    linear: Floats | None
    quadratic: Floats | None
    source: str
    left_out: str = ""


class Displacement(NamedTuple):
    """Displaced volume [m^3] of one link and its centre [m], as stated in a file."""

    link: str
    volume: float
    centre: Floats | None
    source: str


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
    """

    link: str
    area: float
    density: float
    place: Floats
    turn: Floats
    source: str
    left_out: str


@dataclass
class Stated:
    """Data of a file beside links and joints: motors, servos, wings, hydrodynamics, volumes."""

    motors: list[Motor] = field(default_factory=list)
    wings: list[Wing] = field(default_factory=list)
    hydrodynamics: list[Hydrodynamics] = field(default_factory=list)
    displacements: list[Displacement] = field(default_factory=list)
    unread: list[str] = field(default_factory=list)
    servos: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Stiffness and damping of position servos, by joint."""
    pose: dict[str, float] = field(default_factory=dict)
    """Joint values of a pose that the file holds, by joint [rad or m]."""


def stated_of(root: ElementTree.Element) -> Stated:
    """Return the data of all plug-ins in a file.

    Raises:
        RobotError: a number in one is not finite.
    """
    found = Stated()
    for plugin in root.iter("plugin"):
        before = _count(found)
        name = (plugin.get("filename") or plugin.get("name") or "plugin").split("/")[-1]
        said = f"plug-in {name}"
        found.motors += _motors(plugin, said)
        found.hydrodynamics += [*_coefficients(plugin, said), *_fossen(plugin, said)]
        found.displacements += _volumes(plugin, said)
        found.wings += _wings(plugin, said)
        if _count(found) == before:
            found.unread.append(name)
    found.hydrodynamics += _fluid_added_mass(root)
    return _without_repeats(found)


def _count(found: Stated) -> int:
    return (
        len(found.motors) + len(found.hydrodynamics) + len(found.displacements) + len(found.wings)
    )


def _without_repeats(found: Stated) -> Stated:
    """Merge motors that are stated twice; the motor's own plug-in overrides a controller's."""
    known: dict[str, Motor] = {}
    for motor in found.motors:
        key = motor.joint or motor.link
        if key not in known or "max_speed" not in known[key].values:
            known[key] = motor if key not in known else _joined(known[key], motor)
    found.motors = list(known.values())
    found.unread = list(dict.fromkeys(found.unread))
    return found


def _joined(first: Motor, second: Motor) -> Motor:
    return second._replace(values={**first.values, **second.values})


def _motors(plugin: ElementTree.Element, said: str) -> Iterator[Motor]:
    if plugin.find("motorConstant") is not None:
        yield _rotor(plugin, said, "motorConstant")
    for rotor in plugin.iter("rotor"):
        if rotor.find("forceConstant") is not None:
            yield _rotor(rotor, said, "forceConstant")
    has_thrust = any(
        plugin.find(tag) is not None
        for tag in ("propeller_diameter", "max_thrust_cmd", "thrust_coefficient")
    )
    if has_thrust and _text(plugin, "joint_name"):
        yield _gz_thruster(plugin, said)
    if plugin.find("conversion") is not None and plugin.find("thrusterID") is not None:
        yield _uuv_thruster(plugin, said)
    for control in plugin.findall("control"):
        if "thrust" in _text(control, "cmd_topic") and _text(control, "jointName"):
            yield _commanded_thruster(control, said)
    for thruster in plugin.findall("thruster"):
        if thruster.find("maxForceFwd") is not None:
            values = _values(
                thruster, said, {"maxForceFwd": "max_force", "maxForceRev": "back_force"}
            )
            link, joint = _text(thruster, "linkName"), _text(thruster, "propJointName")
            yield Motor(THRUSTER, link, "" if link else joint, values, said, axis=(1.0, 0.0, 0.0))


def _rotor(element: ElementTree.Element, said: str, constant: str) -> Motor:
    """Motor model of multicopters: thrust constant [N s^2], moment by thrust [m]."""
    names = {
        constant: "thrust",
        "momentConstant": "torque",
        "maxRotVelocity": "max_speed",
        "timeConstantUp": "time_constant",
        "timeConstantDown": "spin_down",
        "rotorDragCoefficient": "drag",
    }
    values = _values(element, said, names)
    if "torque" in values and "thrust" in values:
        values["torque"] *= values["thrust"]
    else:
        values.pop("torque", None)  # stated as a length: nothing without a thrust
    turning = (_text(element, "turningDirection") or _text(element, "direction")).lower()
    if turning in ("cw", "ccw"):
        values["direction"] = 1.0 if turning == "ccw" else -1.0
    elif turning in ("1", "-1", "1.0", "-1.0"):
        values["direction"] = float(turning)
    elif turning:
        raise RobotError(
            f"{said}: turningDirection='{turning[:40]}' is not allowed.\nAllowed: cw, ccw, 1, -1."
        )
    return Motor(ROTOR, _text(element, "linkName"), _text(element, "jointName"), values, said)


def _gz_thruster(plugin: ElementTree.Element, said: str) -> Motor:
    names = {
        "max_thrust_cmd": "max_force",
        "min_thrust_cmd": "back_force",
        "propeller_diameter": "radius",
    }
    values = _values(plugin, said, names)
    if "radius" in values:
        values["radius"] /= 2.0
    return Motor(THRUSTER, "", _text(plugin, "joint_name"), values, said)


def _commanded_thruster(control: ElementTree.Element, said: str) -> Motor:
    """Thruster of an autopilot's channel, whose command is multiplier * (0 to 1, plus offset)."""
    scale, offset = (
        _finite(_text(control, tag) or default, f"{said}: {tag}")
        for tag, default in (("multiplier", "1"), ("offset", "0"))
    )
    ends = sorted((scale * offset, scale * (1.0 + offset)))
    values = {"max_force": max(abs(x) for x in ends), "back_force": min(abs(x) for x in ends)}
    values = {key: value for key, value in values.items() if value > 0.0}
    return Motor(THRUSTER, "", _text(control, "jointName"), values, said)


def _uuv_thruster(plugin: ElementTree.Element, said: str) -> Motor:
    """Thruster of the UUV simulator: force by rotorConstant times speed squared, along link x."""
    values = _values(plugin, said, {"thrustMax": "max_force", "thrustMin": "back_force"})
    conversion = plugin.find("conversion")
    constant = "" if conversion is None else _text(conversion, "rotorConstant")
    clamp = _text(plugin, "clampMax")
    if constant and clamp and "max_force" not in values:
        speed = _finite(clamp, f"{said}: clampMax")
        values["max_force"] = abs(_finite(constant, f"{said}: rotorConstant")) * speed**2
    dynamics = plugin.find("dynamics")
    lag = "" if dynamics is None else _text(dynamics, "timeConstant")
    if lag:
        values["time_constant"] = abs(_finite(lag, f"{said}: timeConstant"))
    link = _text(plugin, "linkName")
    return Motor(THRUSTER, link, "" if link else _text(plugin, "jointName"), values, said)


def _coefficients(plugin: ElementTree.Element, said: str) -> Iterator[Hydrodynamics]:
    """Coefficients named after derivatives: ``xDotU``, ``xU``, ``xUU``, ``xUabsU``, ``xAbsU``."""
    added, linear, quadratic = np.zeros((6, 6)), np.zeros(6), np.zeros(6)
    used: dict[str, list[str]] = {"added": [], "linear": [], "quadratic": [], "other": []}
    for child in plugin:
        tag = str(child.tag)
        if not re.fullmatch(r"[xyzkmn](Dot|[aA]bs)?[UVWPQR]([aA]bs)?[UVWPQR]?", tag):
            continue
        value = _finite(child.text, f"{said}: {tag}")
        bare = re.sub("abs", "", tag, flags=re.IGNORECASE)
        row = _ROWS.index(tag[0])
        if tag[1:4] == "Dot":
            added[row, _SPEEDS.index(tag[-1])] = value
            kind = "added"
        elif len(set(bare[1:])) == 1 and _SPEEDS.index(bare[1]) == row:
            kind = "quadratic" if bare != tag or len(bare) == 3 else "linear"
            (quadratic if kind == "quadratic" else linear)[row] = abs(value)
        elif value:
            kind = "other"
        else:
            continue
        used[kind].append(tag)
    other = used.pop("other")
    if not any(used.values()):
        return
    link = next(
        (_text(plugin, t) for t in ("link_name", "bodyName", "linkName") if _text(plugin, t)), ""
    )
    # derivatives of the force are negative in most files, inertias in some
    added *= -1.0 if np.trace(added) < 0.0 else 1.0
    tags = ", ".join(tag for kind in used.values() for tag in kind)
    yield Hydrodynamics(
        link,
        0.5 * (added + added.T) if used["added"] else None,
        linear if used["linear"] else None,
        quadratic if used["quadratic"] else None,
        f"{said} ({tags})",
        ", ".join(other),
    )


def _fossen(plugin: ElementTree.Element, said: str) -> Iterator[Hydrodynamics]:
    """Hydrodynamic models of the UUV simulator; their axes are x forward, y starboard, z down."""
    for link in plugin.findall("link"):
        model = link.find("hydrodynamic_model")
        if model is None:
            continue
        added = _matrix(model, "added_mass", said)
        flip = np.outer(_FLIP, _FLIP)
        left_out, rows = [], {}
        for key in ("linear_damping", "quadratic_damping"):
            matrix = _matrix(model, key, said)
            if matrix is not None and np.any(matrix - np.diag(np.diag(matrix))):
                left_out.append(f"what couples axes in {key}")
            rows[key] = None if matrix is None else np.abs(np.diag(matrix))
        if _text(model, "linear_damping_forward_speed"):
            left_out.append("linear_damping_forward_speed")
        yield Hydrodynamics(
            _last(link.get("name")),
            None if added is None else 0.5 * (added + added.T) * flip,
            rows["linear_damping"],
            rows["quadratic_damping"],
            f"{said} (hydrodynamic_model)",
            ", ".join(left_out),
        )


def _fluid_added_mass(root: ElementTree.Element) -> Iterator[Hydrodynamics]:
    """Added mass of SDF's own ``<fluid_added_mass>``, upper triangle over x, y, z, p, q, r."""
    for link in root.iter("link"):
        element = link.find("inertial/fluid_added_mass")
        if element is None:
            continue
        matrix = np.zeros((6, 6))
        for child in element:
            match = re.fullmatch(r"([xyzpqr])([xyzpqr])", str(child.tag))
            if match:
                i, j = ("xyzpqr".index(letter) for letter in match.groups())
                where = f"fluid_added_mass of {link.get('name')}"
                matrix[i, j] = matrix[j, i] = _finite(child.text, where)
        yield Hydrodynamics(_last(link.get("name")), matrix, None, None, "<fluid_added_mass>")


def _volumes(plugin: ElementTree.Element, said: str) -> Iterator[Displacement]:
    for link in plugin.findall("link"):
        text = _text(link, "volume")
        if not text:
            continue
        centre = _text(link, "center_of_buoyancy") or _text(link, "center_of_volume")
        numbers = [_finite(word, f"{said}: centre of volume") for word in centre.split()]
        volume = _finite(text, f"{said}: volume")
        if volume <= 0.0:
            raise RobotError(f"{said}: volume={text} is not allowed.\nAllowed: above zero, in m^3.")
        place = np.array(numbers) if len(numbers) == 3 else None
        yield Displacement(_last(link.get("name")), volume, place, said)


def _wings(plugin: ElementTree.Element, said: str) -> Iterator[Wing]:
    """Plug-in LiftDrag: slope, area, place and axes of a wing; absent numbers are Gazebo's."""
    if plugin.find("cla") is None:
        return
    defaults = {"cla": 1.0, "area": 1.0, "air_density": 1.2041, "a0": 0.0, "cda": 0.0, "cma": 0.0}
    value = {
        tag: _finite(_text(plugin, tag) or str(default), f"{said}: {tag}")
        for tag, default in defaults.items()
    }
    place, chord, normal = (
        _vector(plugin, tag, default, said)
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
    left += ["stall"] if _text(plugin, "alpha_stall") else []
    left += ["control_joint_name"] if _text(plugin, "control_joint_name") else []
    yield Wing(
        _text(plugin, "link_name"),
        value["cla"] * value["area"],
        value["air_density"],
        place,
        np.stack([row / np.linalg.norm(row) for row in rows], axis=1),
        f"{said} (cla, area{'' if _text(plugin, 'area') else ' 1 m^2, the default of Gazebo'})",
        ", ".join(left),
    )


def _vector(element: ElementTree.Element, tag: str, default: str, said: str) -> Floats:
    """Three numbers."""
    words = (_text(element, tag) or default).split()
    if len(words) != 3:
        raise RobotError(f"{said}: {tag} has {len(words)} numbers.\nAllowed: 3.")
    return np.array([_finite(word, f"{said}: {tag}") for word in words])


def _matrix(element: ElementTree.Element, tag: str, said: str) -> Floats | None:
    """Matrix (6, 6) of 36 numbers, or diagonal matrix of six."""
    words = re.split(r"[\s,]+", _text(element, tag))
    if words == [""]:
        return None
    numbers = np.array([_finite(word, f"{said}: {tag}") for word in words])
    if numbers.size == 6:
        return np.diag(numbers)
    if numbers.size != 36:
        raise RobotError(
            f"{said}: {tag} has {numbers.size} numbers.\nAllowed: 6, or 36 row by row."
        )
    return numbers.reshape(6, 6)


def _values(element: ElementTree.Element, said: str, names: Mapping[str, str]) -> dict[str, float]:
    """Magnitudes of the numbers in child elements, under new names; zeros are left out."""
    found = {}
    for tag, name in names.items():
        text = _text(element, tag)
        value = abs(_finite(text, f"{said}: {tag}")) if text else 0.0
        if value > 0.0:
            found[name] = value
    return found


def _text(element: ElementTree.Element, tag: str) -> str:
    text = (element.findtext(tag) or "").strip()
    return _last(text) if tag.lower().endswith(("name",)) else text


def _last(name: str | None) -> str:
    """Name of a link or joint without the prefix of its model."""
    return (name or "").strip().split("::")[-1]


def _finite(text: str | None, where: str) -> float:
    try:
        value = float((text or "").strip())
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or abs(value) > 1e9:
        raise RobotError(
            f"{where}='{(text or '').strip()[:40]}' is not allowed.\n"
            "Allowed: a finite number up to 1e9."
        )
    return value
