"""What logs and readers know of a robot: mass, drives, the data sheet in its folder."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from seals.control.plant import ROTOR, Layout, layout_of
from seals.effects.binding import bind_effects
from seals.errors import LogError
from seals.logs.check_meta import check_meta
from seals.logs.log import Log
from seals.robot.model import RobotModel
from seals.robot.whole_body import whole_body
from seals.untrusted_io import read_yaml, refuse_references

ROTORS, THRUSTERS, SERVOS = "rotor_thrust", "thruster_force", "arm"
"""Names of drives and servos in the list of what the model holds."""


def held(actuators: Mapping[str, Any], robot: RobotModel, layout: Layout) -> list[dict[str, str]]:
    """Return the entries of the stated model that stand for drives and servos under command."""
    names = [ROTORS if kind == ROTOR else THRUSTERS for kind in layout.kind]
    if robot.tree.joints and any(hasattr(a, "of_joints") for a in actuators.values()):
        names.append(SERVOS)
    return [{"name": name} for name in dict.fromkeys(names)]


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
    drives = [
        {
            "position": layout.position[k],
            "axis": layout.axis[k],
            "time_constant": layout.lag[k],
            "spin_down": layout.fall[k],
            "max_speed" if kind == ROTOR else "max_force": layout.limit[k],
            "thrust_coefficient": layout.thrust_coefficient[k],
            # turning counter-clockwise pushes the body clockwise
            "direction": -1.0 if layout.reaction_coefficient[k] > 0.0 else 1.0,
            "torque_coefficient": abs(layout.reaction_coefficient[k]),
        }
        for k, kind in enumerate(layout.kind)
    ]
    return {
        "name": robot.name,
        "mass": mass,
        "inertia": inertia,
        "centre_of_gravity": centre,
        "rotors": [drive for drive in drives if "max_speed" in drive],
        "thrusters": [drive for drive in drives if "max_force" in drive],
    }


def datasheet_of(folder: str | Path) -> dict[str, Any]:
    """Return the data sheet in a robot's folder; empty if there is none.

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
