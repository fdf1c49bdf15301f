"""What each family of robots may hide, all the time or for a while, and in pairs."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.validation.hidden import catalogue, levels, outsiders
from tests.validation.hidden.catalogue import Hidden
from tests.validation.hidden.plant import Plant
from tests.validation.hidden.references import Wanted
from tests.validation.hidden.vehicles import six
from tests.validation.hidden.wild.robots import Rng, Robot

AIR = [
    *("wind", "payload", "centre_of_gravity", "inertia", "thrust_coefficient", "weak_rotor"),
    *("rotor_lag", "command_delay", "linear_drag", "quadratic_drag", "tether", "rotor_drag"),
    "battery_sag",
]
DIVING = [
    *("current", "added_mass", "buoyancy", "quadratic_drag", "angular_drag", "weak_rotor"),
    *("thrust_coefficient", "payload", "rotor_lag", "tether", "centre_of_buoyancy", "linear_drag"),
    "command_delay",
]
ARM = ["payload", "joint_friction", "joint_backlash", "wind", "weak_rotor", "thrust_coefficient"]
LIBRARY: dict[str, list[str]] = {
    "hexa": AIR,
    "octo": AIR,
    "grip": [*ARM, "linear_drag", "rotor_lag"],
    "dual": [*ARM, "linear_drag", "rotor_lag"],
    "rov6": [*DIVING, "centre_of_gravity", "waves"],
    "rov8": [*DIVING, "inertia", "waves"],
    "torpedo": [*DIVING[:7], "current"],
    "boat": ["current", "weak_rotor", "thrust_coefficient", "quadratic_drag", "payload", "waves"],
    "buoy": ["waves", "current", "payload", "quadratic_drag", "waves"],
    "spar": ["waves", "current", "payload", "added_mass"],
    "float": ["waves", "current", "payload", "added_mass"],
    "projectile": ["slamming", "slamming", "buoyancy", "added_mass", "quadratic_drag"],
}
# what may begin or end: the sensors and the path of the command are the same all the time
STEPS: dict[str, list[str]] = {
    "hexa": ["wind", "payload", "payload", "weak_rotor", "thrust_coefficient", "tether"],
    "octo": ["wind", "payload", "weak_rotor", "thrust_coefficient", "centre_of_gravity"],
    "grip": ["payload", "payload", "wind", "weak_rotor", "joint_friction"],
    "dual": ["payload", "payload", "wind", "weak_rotor", "joint_friction"],
    "rov6": ["current", "payload", "buoyancy", "weak_rotor", "tether", "thrust_coefficient"],
    "rov8": ["current", "payload", "buoyancy", "weak_rotor", "tether", "thrust_coefficient"],
    "torpedo": ["current", "weak_rotor", "payload", "thrust_coefficient", "quadratic_drag"],
    "boat": ["current", "weak_rotor", "thrust_coefficient", "payload"],
    "buoy": ["current", "payload"],
    "spar": ["current", "payload"],
    "float": ["current", "payload"],
}
OUTSIDE: dict[str, list[str]] = {
    "hexa": ["magnet", "slung_mass", "periodic_torque", "force_region", "spinning_wheel"],
    "octo": ["magnet", "slung_mass", "periodic_torque", "force_region", "spinning_wheel"],
    "grip": ["magnet", "force_region", "periodic_torque", "spinning_wheel"],
    "dual": ["magnet", "force_region", "periodic_torque"],
    "rov6": ["magnet", "force_region", "periodic_torque", "vortex_shedding"],
    "rov8": ["magnet", "force_region", "periodic_torque", "vortex_shedding"],
    "torpedo": ["periodic_torque", "vortex_shedding", "spinning_wheel"],
    "boat": ["force_region", "periodic_torque", "magnet"],
    "buoy": ["periodic_torque", "spinning_wheel"],
    "spar": ["periodic_torque"],
    "float": ["periodic_torque"],
    "projectile": ["spinning_wheel", "periodic_torque"],
}
# numbers of an outsider that its strength scales
GAIN = {
    "magnet": "magnet_gain",
    "slung_mass": "sling_mass",
    "periodic_torque": "hum",
    "force_region": "field",
    "spinning_wheel": "wheel",
    "vortex_shedding": "vortex_gain",
}
TOO_CLOSE = [
    *levels.TOO_CLOSE,
    {"buoyancy", "tether"},
    {"current", "tether"},
    {"current", "linear_drag"},
    {"current", "quadratic_drag"},
    {"wind", "linear_drag"},
    {"thrust_coefficient", "quadratic_drag"},
    {"thrust_coefficient", "linear_drag"},
    {"inertia", "rotor_lag"},
    {"inertia", "thrust_coefficient"},
]


def pair(family: str, rng: Rng) -> list[str]:
    """Two effects that the logs of a family hold apart."""
    names = [n for n in LIBRARY[family] if n not in {"waves", "tether"}]
    while True:
        one, two = (str(n) for n in rng.choice(names, 2, replace=False))
        if one != two and {one, two} not in TOO_CLOSE:
            return [one, two]


def hide(name: str, robot: Robot, rng: Rng, size: float, wanted: Wanted) -> Hidden:
    """Draw one effect in about a clear size times a factor."""
    v = robot.vehicle
    if name == "tether":
        return catalogue.tether(v, rng, size, wanted)
    if name == "payload":
        return _payload(robot, rng, size)
    if name == "waves":
        return _waves(robot, rng, size)
    if name == "thrust_coefficient":
        size = min(size, 2.0)
    if name == "weak_rotor":
        size = min(size, 2.2)
    return getattr(catalogue, name)(v, rng, size)


def _payload(robot: Robot, rng: Rng, size: float) -> Hidden:
    v, tree = robot.vehicle, robot.tree
    if tree is None:
        low = -0.5 * robot.box[2] - rng.uniform(0.01, 0.04)
        place = six([*rng.uniform(-0.08, 0.08, 2) * robot.box[:2] / 0.4, low])
        if v.water:
            size *= 0.3 if v.count else 0.6
        return catalogue.payload(v, rng, size, place)
    tool = tree.tool if tree.joints == 2 or rng.random() < 0.5 else 3
    made = catalogue.payload(v, rng, size, tree.tip)
    inner = made.set_in

    def set_in(plant: Plant) -> None:
        inner(plant)
        plant["payload_link"] = np.array(float(tool))

    made.set_in, made.facts = set_in, {"link": tree.names[tool]}
    return made


def _waves(robot: Robot, rng: Rng, size: float) -> Hidden:
    values = {
        "amplitude": six(min(size * rng.uniform(0.035, 0.05), 0.09)),
        "period": six(rng.uniform(1.6, 2.4)),
        "direction": six(rng.uniform(0.0, 2.0 * np.pi)),
    }

    def set_in(plant: Plant) -> None:
        changed = plant["wave"].copy()
        changed[:3] = list(values.values())
        plant["wave"] = changed

    return Hidden("waves", values, [["amplitude"], ["period"]], set_in)


def outsider(name: str, robot: Robot, rng: Rng, size: float, middle: float) -> Hidden:
    """A force that no catalogue holds."""
    seed = int(rng.integers(2**31))

    def set_in(plant: Plant) -> None:
        kind = "auv" if robot.vehicle.water else "quad"
        outsiders.draw(name, kind, np.random.default_rng(seed), plant)
        if name == "magnet":
            plant["magnet_place"][2] += middle - (-2.0 if kind == "auv" else 1.4)
        plant[GAIN[name]] = plant[GAIN[name]] * size

    facts: dict[str, Any] = {}
    return Hidden(name, {}, [], set_in, facts)
