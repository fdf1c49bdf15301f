"""The library's effects: who can hide which, how large, and what it changes in the plant."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.validation.hidden import references
from tests.validation.hidden.plant import Plant
from tests.validation.hidden.rotation import Array
from tests.validation.hidden.vehicles import Vehicle, six

Rng = np.random.Generator
XYZ = ("x", "y", "z")


@dataclass
class Hidden:
    """One hidden effect of one case.

    Attributes:
        name: Name in the catalogue.
        values: Parameters, without units.
        groups: Parameters that are compared as one vector.
        facts: Medium, link and the like.
        set_in: Changes a plant so that it holds the effect.
    """

    name: str
    values: dict[str, float]
    groups: list[list[str]]
    set_in: Callable[[Plant], None]
    facts: dict[str, Any] = field(default_factory=dict)


UNITS = {
    "linear_drag": "N s/m",
    "quadratic_drag": "N s^2/m^2",
    "angular_drag": "N m s/rad",
    "buoyancy": "m^3",
    "centre_of_buoyancy": "m",
    "wind": "m/s",
    "current": "m/s",
    "centre_of_gravity": "m",
    "inertia": "kg m^2",
    "rotor_drag": "s/m",
    "rotor_lag": "s",
    "command_delay": "s",
    "accelerometer_bias": "m/s^2",
    "gyroscope_bias": "rad/s",
    "sensor_misalignment": "rad",
    "sensor_delay": "s",
}
PARAMETER_UNITS = {
    ("added_mass", "mass"): "kg",
    ("added_mass", "inertia"): "kg m^2",
    ("waves", "amplitude"): "m",
    ("waves", "period"): "s",
    ("waves", "direction"): "rad",
    ("tether", "anchor"): "m",
    ("tether", "length"): "m",
    ("tether", "stiffness"): "N/m",
    ("payload", "mass"): "kg",
    ("payload", "position"): "m",
    ("joint_friction", "coulomb"): "N m",
    ("joint_friction", "viscous"): "N m s/rad",
    ("joint_backlash", "width"): "rad",
}


def unit_of(effect: str, parameter: str) -> str:
    """Unit of a parameter, as the truth file writes it."""
    if parameter in {"rotor", "joint"}:
        return "index"
    stem = parameter.split("_", maxsplit=1)[0]
    return PARAMETER_UNITS.get((effect, stem), UNITS.get(effect, "1"))


def _three(name: str, stem: str, value: Array, key: str, *, start: int = 0, **facts: Any) -> Hidden:
    """An effect that adds a vector to a plant array."""
    value = six(value)
    names = [f"{stem}_{axis}" for axis in XYZ]

    def set_in(plant: Plant) -> None:
        changed = plant[key].copy()
        changed[start : start + 3] += value
        plant[key] = changed

    return Hidden(name, dict(zip(names, value.tolist(), strict=True)), [names], set_in, facts)


def _one(name: str, parameter: str, value: float, key: str, **facts: Any) -> Hidden:
    """An effect that adds a number to a plant array."""
    value = six(value)

    def set_in(plant: Plant) -> None:
        plant[key] = plant[key] + value

    return Hidden(name, {parameter: value}, [[parameter]], set_in, facts)


def _signs(rng: Rng, low: float, high: float) -> Array:
    return rng.uniform(low, high, 3) * rng.choice([-1.0, 1.0], 3)


def _flat(rng: Rng, size: float, upward: float = 0.0) -> Array:
    heading = rng.uniform(0.0, 2.0 * np.pi)
    return np.array([size * np.cos(heading), size * np.sin(heading), upward])


def linear_drag(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """Drag in proportion to the speed."""
    base: Any = {"quad": 0.34, "aam": 0.45, "auv": 11.5, "drop": 3.2, "crossing": 4.5}
    base = base.get(v.kind, 0.7 * v.water_quadratic[0] if v.water else 0.2 * v.mass)
    value = f * base * rng.uniform(0.85, 1.15) * rng.uniform(0.9, 1.1, 3)
    return _three("linear_drag", "coefficient", value, "hidden_linear", medium=_medium(v))


def quadratic_drag(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """Drag with the square of the speed."""
    if v.water:
        value = f * v.water_quadratic * rng.uniform(0.55, 0.75) * rng.uniform(0.85, 1.15, 3)
    else:
        base = {"quad": 0.18, "aam": 0.34}.get(v.kind, 0.1 * v.mass)
        value = f * base * rng.uniform(0.8, 1.2) * rng.uniform(0.85, 1.15, 3)
    return _three("quadratic_drag", "coefficient", value, "hidden_quadratic", medium=_medium(v))


def _medium(v: Vehicle) -> str:
    return "water" if v.water else "air"


def angular_drag(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """Linear resistance to turning."""
    if v.water:
        value = f * v.angular_linear * rng.uniform(1.1, 1.6) * rng.uniform(0.85, 1.15, 3)
    else:
        value = f * v.inertia / v.inertia[0] * 2.4 * v.inertia[0] * rng.uniform(0.85, 1.15, 3)
    medium = "water" if v.water else "any"
    return _three("angular_drag", "coefficient", value, "hidden_spin", medium=medium)


def added_mass(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """Water that moves along: three masses and three inertias."""
    value = six(f * v.added * rng.uniform(0.85, 1.15) * rng.uniform(0.8, 1.2, 6))
    names = [f"mass_{a}" for a in XYZ] + [f"inertia_{a}" for a in XYZ]

    def set_in(plant: Plant) -> None:
        plant["added"] = plant["added"] + value

    values = dict(zip(names, value.tolist(), strict=True))
    return Hidden("added_mass", values, [names[:3], names[3:]], set_in)


def buoyancy(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """Error of the displaced volume."""
    value = f * v.volume * rng.uniform(0.05, 0.075) * rng.choice([-1.0, 1.0])
    return _one("buoyancy", "volume", value, "volume")


def centre_of_buoyancy(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """Shift of the centroid of the displaced volume."""
    size = {"auv": 0.012, "drop": 0.009, "crossing": 0.012}.get(v.kind, 0.012)
    value = f * _flat(rng, size * rng.uniform(0.9, 1.25), size * rng.uniform(-0.35, 0.35))
    made = _three("centre_of_buoyancy", "offset", value, "cob_shift")
    first = made.set_in

    def set_in(plant: Plant) -> None:
        first(plant)
        plant["centroid_whole"] = plant["centroid_whole"] + np.array(list(made.values.values()))

    made.set_in = set_in
    return made


def slamming(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """Entry force."""
    size = rng.uniform(0.6, 1.1) * (6.0 if v.kind == "crossing" else 1.0)
    return _one("slamming", "coefficient", f * size, "slam")


def wind(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """Constant wind."""
    value = f * _flat(rng, rng.uniform(2.2, 3.4), rng.uniform(-0.3, 0.3))
    return _three("wind", "velocity", value, "wind")


def current(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """Constant current."""
    return _three("current", "velocity", f * _flat(rng, rng.uniform(0.22, 0.34)), "current")


def waves(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """A long-crested wave."""
    values = {
        "amplitude": six(f * rng.uniform(0.025, 0.042)),
        "period": six(rng.uniform(0.95, 1.5)),
        "direction": six(rng.uniform(0.0, 2.0 * np.pi)),
    }

    def set_in(plant: Plant) -> None:
        changed = plant["wave"].copy()
        changed[:3] = list(values.values())
        plant["wave"] = changed

    return Hidden("waves", values, [["amplitude"], ["period"]], set_in)


def ground_effect(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """More thrust near the ground."""
    return _one("ground_effect", "coefficient", f * rng.uniform(0.9, 1.4), "ground_gain")


def tether(v: Vehicle, rng: Rng, f: float, wanted: references.Wanted | None = None) -> Hidden:
    """A cable to a fixed anchor, taut for about half of the time."""
    bottom = 0.0 if v.ground is not None else (v.bottom or -3.0)
    anchor = _flat(rng, rng.uniform(0.8, 1.3), bottom if v.kind != "auv" else -3.5)
    value = rng.uniform(1.3, 2.0) if not v.water else 12.0 * rng.uniform(0.8, 1.2)
    length = 2.0
    if wanted is not None:
        batch = {k: a[..., None] for k, a in wanted.items()}
        path = np.stack([references.at(batch, t)[0][:3, 0] for t in np.arange(0.0, 18.0, 0.1)])
        length = float(np.quantile(np.linalg.norm(path - anchor, axis=1), rng.uniform(0.4, 0.55)))
    values = {f"anchor_{a}": six(x) for a, x in zip(XYZ, anchor, strict=True)}
    values |= {"length": six(length), "stiffness": six(f * value)}

    def set_in(plant: Plant) -> None:
        plant["tether_anchor"] = np.array([values[f"anchor_{a}"] for a in XYZ])
        plant["tether_length"] = np.array(values["length"])
        plant["tether_gain"] = np.array(values["stiffness"])

    groups = [[f"anchor_{a}" for a in XYZ], ["length"], ["stiffness"]]
    return Hidden("tether", values, groups, set_in)


def payload(v: Vehicle, rng: Rng, f: float, place: Array | None = None) -> Hidden:
    """A point mass on the body."""
    mass = six(f * v.mass * rng.uniform(0.07, 0.12) * (1.0 if v.arm is None else 0.55))
    if v.arm is not None and place is None:
        place = six(np.array([0.0, 0.0, -v.arm.lengths[2] - rng.uniform(0.0, 0.03)]))
    elif place is None:
        place = six(np.array([rng.uniform(-0.03, 0.03), rng.uniform(-0.03, 0.03), -0.05]))
    values = {"mass": mass} | {f"position_{a}": float(x) for a, x in zip(XYZ, place, strict=True)}

    def set_in(plant: Plant) -> None:
        plant["payload_mass"] = plant["payload_mass"] + mass
        plant["payload_place"] = np.asarray(place, dtype=float)

    link = "body" if v.arm is None else "link3"
    return Hidden("payload", values, [["mass"]], set_in, {"link": link})


def centre_of_gravity(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """Centre of gravity away from the origin."""
    size: Any = {"quad": 0.01, "aam": 0.012, "auv": 0.01, "drop": 0.007, "crossing": 0.009}
    size = size.get(v.kind, 0.01)
    value = f * _flat(rng, size * rng.uniform(0.9, 1.2))
    return _three("centre_of_gravity", "offset", value, "com")


def inertia(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """More or less resistance to turning."""
    share = rng.uniform(0.22, 0.3) * rng.uniform(0.85, 1.15, 3)
    made = _three("inertia", "delta", f * share * v.inertia, "inertia")
    made.values = {k + k[-1]: x for k, x in made.values.items()}
    made.groups = [list(made.values)]
    return made


def rotor_drag(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """In-plane drag of the rotors."""
    return _one("rotor_drag", "coefficient", f * rng.uniform(0.018, 0.027), "rotor_drag")


def thrust_coefficient(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """All actuators stronger or weaker."""
    size = rng.uniform(0.11, 0.15) if v.rotor else rng.uniform(0.14, 0.2)
    sign = rng.choice([-1.0, 1.0])
    made = _one("thrust_coefficient", "relative_change", f * sign * size, "act_common")
    first = made.values["relative_change"]

    def set_in(plant: Plant) -> None:
        plant["act_common"] = plant["act_common"] * (1.0 + first)

    made.set_in = set_in
    return made


def weak_rotor(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """One actuator with less thrust."""
    loss = six(f * (rng.uniform(0.07, 0.11) if v.rotor else rng.uniform(0.2, 0.35)))
    which = int(rng.integers(v.count))

    def set_in(plant: Plant) -> None:
        changed = plant["act_weak"].copy()
        changed[which] *= 1.0 - loss
        plant["act_weak"] = changed

    values = {"rotor": float(which + 1), "relative_loss": loss}
    return Hidden("weak_rotor", values, [["relative_loss"]], set_in)


def rotor_lag(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """Slower actuators; the rise faster than the fall."""
    value = six(f * (rng.uniform(0.022, 0.03) if v.rotor else rng.uniform(0.07, 0.1)))
    lean = rng.uniform(0.0, 0.08)

    def set_in(plant: Plant) -> None:
        plant["lag_up"] = plant["lag_up"] + value * (1.0 - lean)
        plant["lag_down"] = plant["lag_down"] + value * (1.0 + lean)

    name = "time_constant_change"
    return Hidden("rotor_lag", {name: value}, [[name]], set_in)


def battery_sag(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """Thrust that falls with the voltage."""
    return _one("battery_sag", "sensitivity", f * rng.uniform(0.8, 1.2), "sag")


def command_delay(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """Commands that act later."""
    value = rng.uniform(0.022, 0.03) if v.rotor else rng.uniform(0.06, 0.09)
    return _one("command_delay", "delay", f * value, "act_delay")


def thrust_in_water(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """Another thrust ratio of submerged rotors."""
    value = f * rng.uniform(0.13, 0.17) * rng.choice([-1.0, 1.0])
    return _one("thrust_in_water", "ratio_change", value, "water_ratio")


def accelerometer_bias(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """Offset of the accelerometer."""
    return _three(
        "accelerometer_bias", "bias", f * _signs(rng, 0.25, 0.4), "imu_bias", sensor="imu"
    )


def accelerometer_scale(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """Scale of the accelerometer, axis by axis."""
    value = f * rng.uniform(0.045, 0.065) * rng.uniform(0.85, 1.15, 3) * rng.choice([-1.0, 1.0])
    return _three("accelerometer_scale", "scale", value, "imu_scale", sensor="imu")


def gyroscope_bias(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """Offset of the gyroscope."""
    return _three("gyroscope_bias", "bias", f * _signs(rng, 0.025, 0.04), "gyro_bias", sensor="imu")


def sensor_misalignment(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """IMU turned against the body."""
    value = f * _signs(rng, 0.025, 0.045)
    return _three("sensor_misalignment", "rotation", value, "imu_turn", sensor="imu")


def sensor_delay(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """IMU late against the time base."""
    return _one("sensor_delay", "delay", f * rng.uniform(0.018, 0.028), "imu_delay", sensor="imu")


def accelerometer_scale_of(value: Array) -> Hidden:
    """Given scale errors of the accelerometer."""
    return _three("accelerometer_scale", "scale", value, "imu_scale", sensor="imu")


def joint_friction(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """Dry friction and grease in one joint."""
    which = int(rng.integers(v.arm.joints))
    values = {
        "joint": float(which + 1),
        "coulomb": six(f * rng.uniform(0.09, 0.13)),
        "viscous": six(f * rng.uniform(0.03, 0.07)),
    }

    def set_in(plant: Plant) -> None:
        one = np.arange(plant["hidden_rub"].shape[0]) == which
        plant["hidden_rub"] = plant["hidden_rub"] + one * values["coulomb"]
        plant["hidden_viscous"] = plant["hidden_viscous"] + one * values["viscous"]

    return Hidden("joint_friction", values, [["coulomb"]], set_in)


def joint_backlash(v: Vehicle, rng: Rng, f: float) -> Hidden:
    """Play between motor and link of one joint."""
    which = int(rng.integers(v.arm.joints))
    values = {"joint": float(which + 1), "width": six(f * rng.uniform(0.05, 0.075))}

    def set_in(plant: Plant) -> None:
        one = np.arange(plant["backlash"].shape[0]) == which
        plant["backlash"] = plant["backlash"] + one * values["width"]

    return Hidden("joint_backlash", values, [["width"]], set_in)
