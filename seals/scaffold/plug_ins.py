"""Parameters of Gazebo plug-ins: motors, thrusters, wings, hydrodynamics, displaced volumes.

Lifting surfaces are stated by plug-ins of Gazebo and of the UUV simulator.
"""

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
from seals.errors import RobotError, refuse_unlisted

SEA_WATER = 1028.0
"""Density that the UUV simulator takes where a file states none [kg/m^3]."""


def vector(element: ElementTree.Element, tag: str, default: str, said: str) -> Floats:
    """Return three numbers, or raise `RobotError`."""
    words = (_text_of(element, tag) or default).split()
    if len(words) != 3:
        raise RobotError(f"{said}: {tag} has {len(words)} numbers.\nAllowed: 3.")
    return np.array([_finite(word, f"{said}: {tag}") for word in words])


def _six_by_six(element: ElementTree.Element, tag: str, said: str) -> Floats | None:
    """Return the matrix (6, 6) of 36 numbers, or the diagonal one of six; None if empty."""
    words = re.split(r"[\s,]+", _text_of(element, tag))
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


def _magnitudes(
    element: ElementTree.Element, said: str, names: Mapping[str, str]
) -> dict[str, float]:
    """Return magnitudes of the numbers in child elements, under new names, without zeros."""
    found = {}
    for tag, name in names.items():
        text = _text_of(element, tag)
        value = abs(_finite(text, f"{said}: {tag}")) if text else 0.0
        if value > 0.0:
            found[name] = value
    return found


def _text_of(element: ElementTree.Element, tag: str) -> str:
    """Return the text of a child element; names without the prefix of their model."""
    text = (element.findtext(tag) or "").strip()
    return last_name(text) if tag.lower().endswith(("name",)) else text


def last_name(name: str | None) -> str:
    """Return the name of a link or joint without the prefix of its model."""
    return (name or "").strip().split("::")[-1]


def _positive(text: str | None, where: str, unit: str) -> float:
    """Return a number above zero.

    Raises:
        RobotError: it is none.
    """
    value = _finite(text, where)
    if value <= 0.0:
        raise RobotError(f"{where}={value:g} is not allowed.\nAllowed: above zero, in {unit}.")
    return value


def _fluid_density(element: ElementTree.Element, said: str) -> float:
    """Return the density that a plug-in states, else that of the UUV simulator [kg/m^3]."""
    words = _text_of(element, "fluid_density") or str(SEA_WATER)
    return _positive(words, f"{said}: fluid_density", "kg/m^3")


def _finite(text: str | None, where: str) -> float:
    """Return a finite number.

    Raises:
        RobotError: it is none, or beyond 1e9.
    """
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


def _wings_of(plugin: ElementTree.Element, said: str) -> Iterator[Wing]:
    """Return the lifting surfaces of a plug-in.

    Raises:
        RobotError: a number is not finite, or its axes do not define a wing.
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
    damping = None if model is None else _six_by_six(model, FORWARD_SPEED, said)
    if damping is None:
        return
    density = _fluid_density(plugin, said)
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
    kind = _text_of(model, "type")
    link = _text_of(plugin, "link_name")
    keys = {"Quadratic": ("lift_constant", "drag_constant"), "TwoLines": ("cla", "area")}
    refuse_unlisted(
        kind, keys, f"{said}: the type '{kind[:40]}' of its lift is not known", error=RobotError
    )
    first, second = (_finite(_text_of(model, tag), f"{said}: {tag}") for tag in keys[kind])
    density = _fluid_density(model, said)
    area, drag, left = first * second, 0.0, ""
    if kind == "Quadratic":
        area, drag = 2.0 * first / density, 2.0 * second / density
    else:
        stated = {tag: _text_of(model, tag) for tag in ("a0", "cda", "alpha_stall")}
        left = ", ".join(t for t, x in stated.items() if x and _finite(x, f"{said}: {t}"))
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]).T
    source = f"{said} ({', '.join(keys[kind])} in water of {density:g} kg/m^3)"
    return Wing(link, area, density, np.zeros(3), turn, source, left, drag)


def _lift_drag(plugin: ElementTree.Element, said: str) -> Wing:
    """Plug-in LiftDrag: slope, area, place and axes of a wing; absent numbers are Gazebo's."""
    defaults = {"cla": 1.0, "area": 1.0, "air_density": 1.2041, "a0": 0.0, "cda": 0.0, "cma": 0.0}
    value = {
        tag: _finite(_text_of(plugin, tag) or str(default), f"{said}: {tag}")
        for tag, default in defaults.items()
    }
    place, chord, normal = (
        vector(plugin, tag, default, said)
        for tag, default in (("cp", "0 0 0"), ("forward", "1 0 0"), ("upward", "0 0 1"))
    )
    span = np.cross(normal, chord)
    if float(np.linalg.norm(span)) < 1e-6:
        raise RobotError(
            f"{said}: forward={chord.tolist()} and upward={normal.tolist()} do not define a wing.\n"
            "Allowed: two directions at right angles."
        )
    rows = [chord, span, np.cross(chord, span)]
    left = [f"{tag}={value[tag]:g}" for tag in ("a0", "cda", "cma") if value[tag]]
    left += ["stall"] if _text_of(plugin, "alpha_stall") else []
    left += ["control_joint_name"] if _text_of(plugin, "control_joint_name") else []
    return Wing(
        _text_of(plugin, "link_name"),
        value["cla"] * value["area"],
        value["air_density"],
        place,
        np.stack([row / np.linalg.norm(row) for row in rows], axis=1),
        f"{said} (cla, area{'' if _text_of(plugin, 'area') else ' 1 m^2, the default of Gazebo'})",
        ", ".join(left),
    )


_ROWS, _SPEEDS = "xyzkmn", "UVWPQR"
_FLIP = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
"""Body axes x forward, y starboard, z down in x forward, y left, z up."""


_OTHER_MOTORS = ("position", "force")
"""Motor types of RotorS whose command is no speed: their constant is none of thrust."""


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
    """Displaced volume of one link, as stated in a file.

    Args:
        link: empty for the base.
        volume: [m^3]; of a link that neither floats nor sinks, that of one kilogram of water.
        centre: in link axes [m]; None if not stated.
        source: in words.
        from_mass: whether the centre is relative to the centre of mass of the link.
        neutral: whether the link with all that is fixed to it neither floats nor sinks.
    """

    link: str
    volume: float
    centre: Floats | None
    source: str
    neutral: bool = False
    from_mass: bool = False


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
    driven: set[str] = field(default_factory=set)
    """Joints that an actuator, a transmission or a plug-in of the file names."""
    damping: dict[str, float] = field(default_factory=dict)
    """Damping of joints as the file states it, by joint [N m s/rad or N s/m]."""
    armature: dict[str, float] = field(default_factory=dict)
    """Inertia of motor and gear at joints as the file states it, by joint [kg m^2 or kg]."""

    def size(self) -> int:
        """Return how many motors, wings and bodies in a fluid the file states."""
        return (
            len(self.motors) + len(self.hydrodynamics) + len(self.displacements) + len(self.wings)
        )

    def without_repeats(self) -> Stated:
        """Merge motors that are stated twice; the motor's own plug-in overrides a controller's."""
        known: dict[str, Motor] = {}
        for motor in self.motors:
            key = motor.joint or motor.link
            if key not in known or "max_speed" not in known[key].values:
                before = known[key].values if key in known else {}
                known[key] = motor._replace(values={**before, **motor.values})
            elif "max_speed" in motor.values:
                self.unread.append(f"a second motor of '{key}'")
        self.motors = list(known.values())
        self.unread = list(dict.fromkeys(self.unread))
        return self


def stated_of(root: ElementTree.Element) -> Stated:
    """Return the data of all plug-ins in a file.

    Raises:
        RobotError: a number in one is not finite.
    """
    found = Stated()
    for plugin in root.iter("plugin"):
        before = found.size()
        name = (plugin.get("filename") or plugin.get("name") or "plugin").split("/")[-1]
        said = f"plug-in {name}"
        found.motors += _motors(plugin, said)
        found.hydrodynamics += [*_coefficients(plugin, said), *_fossen(plugin, said)]
        found.displacements += _volumes(plugin, said)
        found.wings += _wings_of(plugin, said)
        if found.size() == before:
            found.unread.append(name)
    found.hydrodynamics += _fluid_added_mass(root)
    return found.without_repeats()


def _motors(plugin: ElementTree.Element, said: str) -> Iterator[Motor]:
    turns = _text_of(plugin, "motorType").lower() not in _OTHER_MOTORS
    if plugin.find("motorConstant") is not None and turns:
        yield _rotor(plugin, said, "motorConstant")
    for rotor in plugin.iter("rotor"):
        if rotor.find("forceConstant") is not None:
            yield _rotor(rotor, said, "forceConstant")
    has_thrust = any(
        plugin.find(tag) is not None
        for tag in ("propeller_diameter", "max_thrust_cmd", "thrust_coefficient")
    )
    if has_thrust and _text_of(plugin, "joint_name"):
        names = {
            "max_thrust_cmd": "max_force",
            "min_thrust_cmd": "back_force",
            "propeller_diameter": "radius",
        }
        numbers = _magnitudes(plugin, said, names)
        if "radius" in numbers:
            numbers["radius"] /= 2.0
        yield Motor(THRUSTER, "", _text_of(plugin, "joint_name"), numbers, said)
    if plugin.find("conversion") is not None and plugin.find("thrusterID") is not None:
        yield _uuv_thruster(plugin, said)
    for control in plugin.findall("control"):
        if "thrust" in _text_of(control, "cmd_topic") and _text_of(control, "jointName"):
            # a command is multiplier * (0 to 1, plus offset)
            scale, offset = (
                _finite(_text_of(control, tag) or default, f"{said}: {tag}")
                for tag, default in (("multiplier", "1"), ("offset", "0"))
            )
            ends = sorted((scale * offset, scale * (1.0 + offset)))
            forces = {
                "max_force": max(abs(x) for x in ends),
                "back_force": min(abs(x) for x in ends),
            }
            forces = {key: value for key, value in forces.items() if value > 0.0}
            yield Motor(THRUSTER, "", _text_of(control, "jointName"), forces, said)
    for thruster in plugin.findall("thruster"):
        if thruster.find("maxForceFwd") is not None:
            values = _magnitudes(
                thruster, said, {"maxForceFwd": "max_force", "maxForceRev": "back_force"}
            )
            link, joint = _text_of(thruster, "linkName"), _text_of(thruster, "propJointName")
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
    values = _magnitudes(element, said, names)
    if "torque" in values and "thrust" in values:
        values["torque"] *= values["thrust"]
    else:
        values.pop("torque", None)  # stated as a length: nothing without a thrust
    turning = (_text_of(element, "turningDirection") or _text_of(element, "direction")).lower()
    if turning in ("cw", "ccw"):
        values["direction"] = 1.0 if turning == "ccw" else -1.0
    elif turning in ("1", "-1", "1.0", "-1.0"):
        values["direction"] = float(turning)
    elif turning:
        raise RobotError(
            f"{said}: turningDirection='{turning[:40]}' is not allowed.\nAllowed: cw, ccw, 1, -1."
        )
    return Motor(ROTOR, _text_of(element, "linkName"), _text_of(element, "jointName"), values, said)


def _uuv_thruster(plugin: ElementTree.Element, said: str) -> Motor:
    """Thruster of the UUV simulator, along link x; its law of force says what it reaches."""
    values = _magnitudes(plugin, said, {"thrustMax": "max_force", "thrustMin": "back_force"})
    conversion = plugin.find("conversion")
    reached = {} if conversion is None else _reached(plugin, conversion, said)
    values = {**reached, **values}
    dynamics = plugin.find("dynamics")
    lag = "" if dynamics is None else _text_of(dynamics, "timeConstant")
    if lag:
        values["time_constant"] = abs(_finite(lag, f"{said}: timeConstant"))
    link = _text_of(plugin, "linkName")
    return Motor(THRUSTER, link, "" if link else _text_of(plugin, "jointName"), values, said)


def _reached(
    plugin: ElementTree.Element, conversion: ElementTree.Element, said: str
) -> dict[str, float]:
    """Return the largest forces ahead and back [N] by the law of a thruster, where it tells them.

    Equation:
        Of the command u between clampMin and clampMax: c u abs(u); with a dead band (Bessa)
        c_R (u abs(u) - d_R) above d_R, c_L (u abs(u) - d_L) below d_L; or a table of forces over
        commands, straight between its rows and constant beyond them.
    """

    def number(element: ElementTree.Element, tag: str) -> float | None:
        text = _text_of(element, tag)
        return _finite(text, f"{said}: {tag}") if text else None

    low, high = number(plugin, "clampMin"), number(plugin, "clampMax")
    given, forces = (
        np.array([_finite(w, f"{said}: {tag}") for w in _text_of(conversion, tag).split()])
        for tag in ("inputValues", "outputValues")
    )
    if len(given) != len(forces) or np.any(np.diff(given) <= 0.0):
        raise RobotError(
            f"{said}: inputValues has {len(given)} numbers, outputValues {len(forces)}.\n"
            "Allowed: equally many of both, increasing inputValues."
        )
    if given.size:
        ends = [given[0] if low is None else low, given[-1] if high is None else high]
        inside = forces[(given >= ends[0]) & (given <= ends[1])]
        found = np.concatenate((inside, np.interp(ends, given, forces)))
        return _either_way(float(found.max()), float(found.min()))
    if high is None:
        return {}
    low = -abs(high) if low is None else low
    constant = number(conversion, "rotorConstant")
    if constant is not None:
        return {"max_force": force} if (force := abs(constant) * high**2) else {}
    right, left = (number(conversion, f"rotorConstant{side}") for side in "RL")
    if right is None or left is None:
        return {}
    upper, lower = (number(conversion, f"delta{side}") or 0.0 for side in "RL")
    ahead = right * max(high * abs(high) - upper, 0.0)
    return _either_way(ahead, left * min(low * abs(low) - lower, 0.0))


def _either_way(ahead: float, back: float) -> dict[str, float]:
    """Return the largest forces of a thruster, from the ends of its range [N]."""
    values = {"max_force": max(ahead, 0.0), "back_force": max(-back, 0.0)}
    return {key: value for key, value in values.items() if value > 0.0}


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
        (_text_of(plugin, t) for t in ("link_name", "bodyName", "linkName") if _text_of(plugin, t)),
        "",
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
        added = _six_by_six(model, "added_mass", said)
        flip = np.outer(_FLIP, _FLIP)
        left_out, rows = [], {}
        for key in ("linear_damping", "quadratic_damping"):
            matrix = _six_by_six(model, key, said)
            if matrix is not None and np.any(matrix - np.diag(np.diag(matrix))):
                left_out.append(f"coupling of axes in {key}")
            rows[key] = None if matrix is None else np.abs(np.diag(matrix))
        under_way = _six_by_six(model, FORWARD_SPEED, said)
        if under_way is not None:
            # along x u abs(u) itself; across it is lift, see wings_of
            if np.any(under_way - np.diag(np.diag(under_way))) or under_way[3, 3]:
                left_out.append(f"roll, and coupling of axes, in {FORWARD_SPEED}")
            quadratic = rows["quadratic_damping"]
            quadratic = np.zeros(6) if quadratic is None else quadratic
            rows["quadratic_damping"] = quadratic + np.abs(under_way[0, 0]) * np.eye(6)[0]
        yield Hydrodynamics(
            last_name(link.get("name")),
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
        yield Hydrodynamics(last_name(link.get("name")), matrix, None, None, "<fluid_added_mass>")


def _volumes(plugin: ElementTree.Element, said: str) -> Iterator[Displacement]:
    for link in plugin.findall("link"):
        text = _text_of(link, "volume")
        word = _text_of(link, "neutrally_buoyant").lower()
        if word not in ("", "0", "1", "false", "true"):
            raise RobotError(
                f"{said}: neutrally_buoyant='{word[:40]}' is not allowed.\n"
                "Allowed: 0, 1, true, false."
            )
        neutral = word in ("1", "true")
        if not (text or neutral):
            continue
        centre = _text_of(link, "center_of_buoyancy") or _text_of(link, "center_of_volume")
        numbers = [_finite(word, f"{said}: centre of volume") for word in centre.split()]
        volume = _positive(text or "1", f"{said}: volume", "m^3")
        density = _fluid_density(plugin, said)
        place = np.array(numbers) if len(numbers) == 3 else None
        name = last_name(link.get("name"))
        # the UUV simulator adds its buoyancy at a place relative to the centre of mass
        relative = link.find("center_of_buoyancy") is not None
        words = f"{said} (neutrally_buoyant in water of {density:g} kg/m^3)" if neutral else said
        volume = 1.0 / density if neutral else volume
        yield Displacement(name, volume, place, words, neutral=neutral, from_mass=relative)
