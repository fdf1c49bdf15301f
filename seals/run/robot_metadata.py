"""Metadata of a robot in the form of ``meta.yaml``, without a simulation."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from seals.control.plant import layout_of
from seals.effects.binding import bind_effects
from seals.robot.model import RobotModel
from seals.robot.whole_body import whole_body
from seals.run.equipment_metadata import describe_drives
from seals.untrusted_io import read_yaml

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
        **describe_drives(actuators, layout),
    }


def datasheet_of(folder: str | Path) -> dict[str, Any]:
    """Return the data sheet in a robot's folder; empty where there is none.

    Raises:
        SealsError: the file is damaged.
    """
    place = Path(folder) / DATASHEET
    return read_yaml(place) if place.is_file() else {}
