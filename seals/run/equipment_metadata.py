"""Metadata of rotors, thrusters, servos, battery and whole robots for ``meta.yaml``."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from seals.control.plant import ROTOR, Layout, layout_of
from seals.effects.binding import bind_effects
from seals.effects.effect import EffectOptions
from seals.errors import LogError
from seals.logs.check_meta import check_meta
from seals.logs.log import Log
from seals.multibody.servo import GAINS
from seals.plugin_options import options_of
from seals.robot.model import RobotModel
from seals.robot.whole_body import whole_body
from seals.run.settings import RunSettings
from seals.untrusted_io import read_yaml, refuse_references

_ELECTRICAL = ("friction_torque", "copper_loss")
"""What a rotor states of its power."""
ROTORS, THRUSTERS, SERVOS = "rotor_thrust", "thruster_force", "arm"
"""Names of drives and servos in the list of what the model holds."""
AT_ONCE = 1e-4
"""Time constant of a drive without lag: the format of a log knows none of zero [s]."""


def _drives(actuators: Mapping[str, Any], layout: Layout) -> dict[str, list[dict[str, Any]]]:
    """Rotors and thrusters one by one, in body axes, in the order of their commands."""
    out: dict[str, list[dict[str, Any]]] = {"rotors": [], "thrusters": []}
    own = {key: np.zeros(layout.drives) for key in ("radius", *_ELECTRICAL)}
    for actuator in actuators.values():
        if hasattr(actuator, "first"):
            columns = slice(actuator.first, actuator.first + actuator.count)
            for key, values in own.items():
                values[columns] = actuator.constants().get(key, 0.0)
    own["reverse"] = np.where(layout.low < 0.0, layout.reverse, 0.0)
    own["reverse"][np.array(layout.kind) != ROTOR] = 0.0
    # what is zero for all rotors says nothing
    stated = {key: values for key, values in own.items() if key == "radius" or values.any()}
    for k, kind in enumerate(layout.kind):
        entry: dict[str, Any] = {
            "position": layout.position[k],
            "axis": layout.axis[k],
            "time_constant": max(float(layout.lag[k]), AT_ONCE),
        }
        if kind == ROTOR:
            reaction = float(layout.reaction_coefficient[k])
            entry |= {
                # turning counter-clockwise pushes the body clockwise
                "direction": -1.0 if reaction > 0.0 else 1.0,
                "thrust_coefficient": layout.thrust_coefficient[k],
                "torque_coefficient": abs(reaction),
                "spin_down": layout.fall[k],
                "max_speed": layout.limit[k],
                **{key: values[k] for key, values in stated.items()},
            }
            out["rotors"].append(entry)
        else:
            out["thrusters"].append({**entry, "max_force": layout.limit[k]})
    return out


def describe_servos(settings: RunSettings, robot: RobotModel) -> dict[str, Any] | None:
    """Return the gains of the joint servos, or None without any.

    A gain is one number where all joints have the same, and a list in the order of the joints
    otherwise.
    """
    joints = robot.tree.joints
    for actuator in settings.actuators.values():
        if joints and hasattr(actuator, "of_joints"):
            each = {gain: actuator.of_joints(gain, joints) for gain in GAINS}
            alike = {g: float(x[0]) if np.all(x == x[0]) else x.tolist() for g, x in each.items()}
            speed = actuator.speeds(joints) if hasattr(actuator, "speeds") else np.zeros(0)
            if (speed < np.finfo(float).max).any():
                alike["speed_limit"] = speed.tolist()
            return {**alike, "encoder": "link side"}
    return None


def describe_battery(settings: RunSettings) -> dict[str, float] | None:
    """Return the voltage of the full battery, or None without a battery."""
    for effect in settings.effects.values():
        voltage = options_of(effect, EffectOptions).full_voltage
        if voltage is not None:
            return {"full_voltage": float(voltage)}
    return None


def held(vehicle: Mapping[str, Any]) -> list[dict[str, str]]:
    """Return the entries of the stated model that describe drives and servos."""
    out = []
    if vehicle["rotors"]:
        law = "T = k_T * omega^2, first-order lag on omega"
        out.append({"name": ROTORS, "law": law})
    if vehicle["thrusters"]:
        out.append({"name": THRUSTERS, "law": "force = command, first-order lag"})
    if vehicle["arm"] is not None and vehicle["arm"]["controller"] is not None:
        law = "torque = kp (cmd - angle) - kd rate within torque_limit, armature inertia"
        out.append({"name": SERVOS, "law": law})
    return out


DATASHEET = "datasheet.yaml"
"""File of a robot folder with what its logs have in common: motors, sensors, tolerances."""


def vehicle_of(robot: RobotModel, actuators: Mapping[str, Any]) -> dict[str, Any]:
    """Return mass properties and drives of a robot, as in ``meta.yaml``; joints stand at zero.

    Args:
        robot: its links.
        actuators: of ``robot.yaml`` by instance name.
    """
    mass, centre, inertia = whole_body(robot)
    layout = layout_of(robot, bind_effects(actuators, robot.links))
    return {
        "name": robot.name,
        "mass": mass,
        "inertia": inertia,
        "centre_of_gravity": centre,
        **_drives(actuators, layout),
    }


def datasheet_of(folder: str | Path) -> dict[str, Any]:
    """Return the data sheet in a robot's folder; empty where there is none.

    Raises:
        SealsError: the file is damaged, or an entry is of another kind than a log states.
    """
    place = Path(folder) / DATASHEET
    if not os.path.lexists(place):
        return {}
    sheet = read_yaml(place)
    refuse_references(sheet, where=str(place))
    wrong = check_meta(Log(name=DATASHEET, columns={"t": np.zeros(1)}, meta=sheet))
    if wrong:
        reasons = (f"- {one.channel}: {one.message.removeprefix('meta.yaml ')}" for one in wrong)
        raise LogError("\n".join([f"{place} cannot be used:", *reasons]))
    return sheet
