"""Underwater vehicles of one body with four to eight thrusters, as robot folders."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

HALF = float(np.sqrt(0.5))
VECTORED = [
    [0.156, -0.111, -0.06, HALF, HALF, 0.0],
    [0.156, 0.111, -0.06, HALF, -HALF, 0.0],
    [-0.156, -0.111, -0.06, HALF, -HALF, 0.0],
    [-0.156, 0.111, -0.06, HALF, HALF, 0.0],
]
"""Four thrusters at 45 degrees in one level plane: position [m], axis."""
ALONG = [[-0.15, 0.18, -0.02, 1.0, 0.0, 0.0], [-0.15, -0.18, -0.02, 1.0, 0.0, 0.0]]
UP = [0.0, 0.0, 1.0]
LAYOUTS: dict[str, list[list[float]]] = {
    "four": [*ALONG, [0.0, 0.0, -0.02, 0.0, 1.0, 0.0], [0.0, 0.0, 0.05, *UP]],
    "five": [*VECTORED, [0.0, 0.0, 0.05, *UP]],
    "six": [*VECTORED, [0.0, 0.218, 0.0, *UP], [0.0, -0.218, 0.0, *UP]],
    "eight": [*VECTORED, *([x, y, 0.0, *UP] for x in (0.12, -0.12) for y in (0.218, -0.218))],
}
"""Thrusters by layout: the small inspection ROV, vectored with one, two and four upright ones."""
PASSIVE = {"four": {"roll", "pitch"}, "five": {"roll", "pitch"}, "six": {"pitch"}, "eight": set()}

URDF = """<robot name="rov"><link name="body">
<inertial><origin xyz="0 0 {low}"/><mass value="{mass}"/>
<inertia ixx="0.16" ixy="0" ixz="0" iyy="0.16" iyz="0" izz="0.16"/></inertial>
<collision><geometry><box size="0.4 0.3 {height}"/></geometry></collision></link></robot>
"""
YAML = """summary: A vehicle of {count} thrusters
urdf: rov.urdf
hulls:
  body: {{shapes: [{{type: box, size: [0.4, 0.3, {height}]}}]}}
effects:
  linear_drag:
    {{effect: linear_drag, medium: water, coefficient_x: 4, coefficient_y: 6.2, coefficient_z: 5.2}}
  water_drag:
    effect: quadratic_drag
    medium: water
    coefficient_x: 18.2
    coefficient_y: 21.7
    coefficient_z: 37.0
  turning:
    effect: angular_drag
    medium: water
    coefficient_x: 0.07
    coefficient_y: 0.07
    coefficient_z: 0.07
    quadratic_x: 1.55
    quadratic_y: 1.55
    quadratic_z: 1.55
  added_mass:
    effect: added_mass
    mass_x: 5.5
    mass_y: 12.7
    mass_z: 14.6
    inertia_x: 0.12
    inertia_y: 0.12
    inertia_z: 0.12
actuators:
  thrusters:
    actuator: thrusters
    position: {position}
    axis: {axis}
    time_constant: [0.1]
    max_force: [{force}]
"""


def rov_folder(
    place: Path,
    thrusters: Sequence[Sequence[float]],
    *,
    volume: float = 0.0117,
    force: float = 40.0,
    low: float = -0.03,
) -> str:
    """Write the folder of a vehicle of 11.5 kg and return its path.

    Args:
        place: folder to make.
        thrusters: rows of position [m] and axis.
        volume: of its hull [m^3].
        force: largest of a thruster [N].
        low: height of the centre of gravity above that of buoyancy [m].
    """
    place.mkdir(parents=True, exist_ok=True)
    height = round(volume / 0.12, 6)
    rows = np.asarray(thrusters)
    facts = {"height": height, "low": low, "mass": 11.5, "count": len(rows), "force": force}
    facts |= {"position": rows[:, :3].tolist(), "axis": rows[:, 3:].tolist()}
    (place / "rov.urdf").write_text(URDF.format(**facts), encoding="utf-8")
    (place / "robot.yaml").write_text(YAML.format(**facts), encoding="utf-8")
    return str(place)
