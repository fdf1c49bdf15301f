"""The folder of a robot as the package reads it: the URDF and robot.yaml."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tests.validation.hidden.rotation import Array
from tests.validation.hidden.vehicles import six
from tests.validation.hidden.wild.robots import Robot
from tests.validation.hidden.writing import _plain, _xyz, dump

Lines = list[str]


def _text(values: Any) -> str:
    return " ".join(f"{float(x):.9g}" for x in values)


def _inertial(place: Array, mass: float, inertia: Array) -> str:
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    numbers = (inertia[0, 0], inertia[0, 1], inertia[0, 2])
    numbers += (inertia[1, 1], inertia[1, 2], inertia[2, 2])
    words = " ".join(f'{k}="{v:.9g}"' for k, v in zip(names, numbers, strict=True))
    return (
        f'    <inertial><origin xyz="{_text(place)}" rpy="0 0 0"/><mass value="{mass:.9g}"/>'
        f"<inertia {words}/></inertial>"
    )


def _solid(kind: str, place: Any, rpy: Any, size: Any, *, seen: bool) -> Lines:
    if kind == "box":
        shape = f'<box size="{_text(size)}"/>'
    elif kind == "sphere":
        shape = f'<sphere radius="{size[0]:.6g}"/>'
    else:
        long = size[1] + (2.0 * size[0] if kind == "capsule" else 0.0)
        shape = f'<cylinder radius="{size[0]:.6g}" length="{long:.6g}"/>'
    where = f'<origin xyz="{_text(place)}" rpy="{_text(rpy)}"/>'
    words = ["visual", "collision"] if seen else ["collision"]
    return [f"    <{w}>{where}<geometry>{shape}</geometry></{w}>" for w in words]


def _fixed(name: str, place: Array, parent: str = "body") -> str:
    return (
        f'  <joint name="{name}_mount" type="fixed"><parent link="{parent}"/>'
        f'<child link="{name}"/><origin xyz="{_text(place)}" rpy="0 0 0"/></joint>'
    )


def steiner(mass: float, r: Array) -> Array:
    """Inertia of a point mass at r, (3, 3)."""
    return mass * (float(r @ r) * np.eye(3) - np.outer(r, r))


def body_link(robot: Robot) -> tuple[float, Array, Array]:
    """Mass, centre and inertia (3, 3) of the body link: the whole without its fixed parts."""
    v, tree = robot.vehicle, robot.tree
    if tree is not None:
        return tree.base_mass, tree.base_centre, np.diag(tree.base_inertia)
    inertia = np.diag(v.inertia)
    for value, (i, j) in zip(v.products, ((0, 1), (0, 2), (1, 2)), strict=True):
        inertia[i, j] = inertia[j, i] = value
    mass = v.mass - sum(p.mass for p in robot.parts)
    moment = v.mass * v.centre - sum((p.mass * p.place for p in robot.parts), np.zeros(3))
    centre = moment / mass
    for p in robot.parts:
        inertia = inertia - np.diag(p.inertia) - steiner(p.mass, p.place - v.centre)
    return mass, centre, inertia - steiner(mass, centre - v.centre)


def urdf(robot: Robot) -> str:
    """The model file."""
    v, tree = robot.vehicle, robot.tree
    mass, centre, inertia = body_link(robot)
    lines = ['<?xml version="1.0"?>', f'<robot name="{robot.family}">', '  <link name="body">']
    lines.append(_inertial(centre, mass, inertia))
    if v.primitives:
        for part in v.primitives:
            lines += _solid(part["type"], part["position"], part["rpy"], part["size"], seen=True)
    else:
        lines += _solid("box", [0, 0, 0], [0, 0, 0], robot.box, seen=True)
    lines.append("  </link>")
    for p in robot.parts:
        lines += [f'  <link name="{p.name}">', _inertial(np.zeros(3), p.mass, np.diag(p.inertia))]
        lines += ["  </link>", _fixed(p.name, p.place)]
    if tree is not None:
        lines += _links(robot)
    lines += [
        '  <link name="imu_link"><inertial><mass value="0"/>'
        '<inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>',
        _fixed("imu_link", v.imu),
    ]
    return "\n".join([*lines, "</robot>", ""])


def _links(robot: Robot) -> Lines:
    tree, lines = robot.tree, []
    assert tree is not None
    for i, name in enumerate(tree.names):
        above = "body" if tree.parents[i] < 0 else tree.names[tree.parents[i]]
        box = tree.box[:, i]
        lines += [
            f'  <link name="{name}">',
            _inertial(tree.com[:, i], tree.mass[i], np.diag(tree.inertia[:, i])),
            *_solid("box", [0, 0, -0.5 * box[2]], [0, 0, 0], box, seen=False),
            "  </link>",
            f'  <joint name="{tree.joint_names[i]}" type="revolute"><parent link="{above}"/>'
            f'<child link="{name}"/><origin xyz="{_text(tree.origin[:, i])}" rpy="0 0 0"/>'
            f'<axis xyz="{_text(tree.axis[:, i])}"/><limit lower="{tree.lower[i]:g}" '
            f'upper="{tree.upper[i]:g}" effort="{tree.limit[i]:g}" velocity="8"/></joint>',
        ]
    return lines


def _effects(robot: Robot) -> dict[str, Any]:
    v = robot.vehicle
    out: dict[str, Any] = {}
    for name, effect, medium, value in (
        ("air_drag", "linear_drag", "air", v.air_linear),
        ("air_drag_fast", "quadratic_drag", "air", v.air_quadratic),
        ("water_drag", "quadratic_drag", "water", v.water_quadratic),
    ):
        if value.any():
            out[name] = {"effect": effect, "medium": medium} | _xyz("coefficient", value)
    if v.angular_linear.any():
        out["spin_drag"] = {"effect": "angular_drag", "medium": "water"}
        out["spin_drag"] |= _xyz("coefficient", v.angular_linear)
        out["spin_drag"] |= _xyz("quadratic", v.angular_quadratic)
    if v.added.any():
        out["added_mass"] = {"effect": "added_mass"}
        out["added_mass"] |= _xyz("mass", v.added[:3]) | _xyz("inertia", v.added[3:])
    if v.mooring is not None:
        out["mooring"] = {"effect": "tether"} | v.mooring
    return out


def _actuators(robot: Robot) -> dict[str, Any]:
    v, tree = robot.vehicle, robot.tree
    out: dict[str, Any] = {}
    if v.rotor:
        out["rotors"] = {
            "actuator": "rotors",
            "position": v.positions.T,
            "direction": v.directions,
            "thrust_coefficient": [v.thrust],
            "torque_coefficient": [v.torque],
            "time_constant": [v.lag],
            "radius": [v.radius],
            "max_speed": [v.limit],
        }
    elif v.count:
        out["thrusters"] = {
            "actuator": "thrusters",
            "position": v.positions.T,
            "axis": v.axes.T,
            "time_constant": [v.lag],
            "max_force": [v.limit],
        }
    if tree is not None:
        out["servos"] = {
            "actuator": "servos",
            "kp_each": tree.stiff,
            "kd_each": tree.damp,
            "torque_limit_each": tree.limit,
            "armature_each": tree.armature,
        }
    return out


def content(robot: Robot) -> dict[str, Any]:
    """What robot.yaml says."""
    v, tree = robot.vehicle, robot.tree
    out: dict[str, Any] = {"summary": robot.summary, "urdf": f"{robot.family}.urdf"}
    if tree is not None:
        out |= tree.blocks
    if v.primitives:
        out["hulls"] = {
            "body": {
                "shapes": v.primitives,
                "displaced_volume": six(v.volume),
                "centre_of_buoyancy": v.centre_of_buoyancy,
                "plan_area": v.plan_area,
            }
        }
    out["effects"] = _effects(robot)
    if v.count:
        out["actuators"] = _actuators(robot)
    out["sensors"] = {"imu": {"sensor": "imu", "link": "imu_link"}}
    return _plain(out)


def write(folder: Path, robot: Robot) -> None:
    """Write the robot folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{robot.family}.urdf").write_text(urdf(robot), encoding="utf-8")
    dump(folder / "robot.yaml", content(robot))
