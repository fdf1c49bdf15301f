"""Scene of a log's vehicle in the rigid-body simulator: URDF and world."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from seals.arrays import Floats
from seals.frames import rpy_of
from seals.registry import default_backend, get
from seals.robot.model import RobotModel
from seals.sysid.validation.model import Model
from seals.world import Actor, World

VEHICLE = "vehicle"
"""Name of the vehicle among the actors of its world."""
_FAR = 1e6
"""Limit of a joint that has none [rad or m]."""
_UPPER = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


def build_scene(model: Model, *, step: float, rows: int) -> World:
    """Build a world that contains only the vehicle of a log.

    The ground is left out: a log's vehicle has no shape that could touch it. Effects still know
    its height.

    Args:
        model: what acts.
        step: of the world [s].
        rows: to reserve in the ledger.
    """
    vehicle = model.vehicle
    engine = get("backend", default_backend()).load()()
    bare = replace(vehicle.environment, ground_level=None, tank_bottom=None)
    engine.open(bare, step)
    waves = get("wave", "still").load()() if model.waves is None else model.waves
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "vehicle.urdf"
        path.write_text(urdf_of(vehicle.robot), encoding="utf-8")
        robot = replace(vehicle.robot, urdf=str(path))
        actor = Actor(robot, model.bound, {}, engine, vehicle.environment, waves=waves, steps=rows)
    return World(engine, {VEHICLE: actor}, vehicle.environment, step=step, seed=0)


def urdf_of(robot: RobotModel) -> str:
    """Return links, masses and joints of a robot as URDF text without shapes."""
    parts = [f'<robot name="{robot.name}">']
    for k, link in enumerate(robot.links):
        matrix = robot.inertia[k]
        table = " ".join(f'i{"xyz"[i]}{"xyz"[j]}="{float(matrix[i, j])!r}"' for i, j in _UPPER)
        parts.append(
            f'<link name="{link}"><inertial><origin xyz="{_numbers(robot.centre[k])}"/>'
            f'<mass value="{float(robot.mass[k])!r}"/><inertia {table}/></inertial></link>'
        )
    tree = robot.tree
    for k in range(1, len(robot.links)):
        j = tree.joint[k]
        place = (
            f'<parent link="{robot.links[tree.parent[k]]}"/><child link="{robot.links[k]}"/>'
            f'<origin xyz="{_numbers(tree.origin[k])}" rpy="{_numbers(rpy_of(tree.rotation[k]))}"/>'
        )
        if j < 0:
            parts.append(f'<joint name="{robot.links[k]}_mount" type="fixed">{place}</joint>')
            continue
        limits = np.clip([robot.lower[j], robot.upper[j]], -_FAR, _FAR).tolist()
        turns = "revolute" if max(map(abs, limits)) < _FAR else "continuous"
        kind = "prismatic" if tree.prismatic[j] else turns
        limit = f'lower="{limits[0]!r}" upper="{limits[1]!r}"'
        parts.append(
            f'<joint name="{robot.joints[j]}" type="{kind}">{place}'
            f'<axis xyz="{_numbers(tree.axis[j])}"/>'
            f'<limit {limit} effort="1e9" velocity="1e3"/></joint>'
        )
    return "\n".join([*parts, "</robot>\n"])


def _numbers(values: Sequence[float] | Floats) -> str:
    return " ".join(repr(float(x)) for x in values)
