"""Generator of the beetle: a body of 0.2 m and 0.9 kg on six legs, of primitive shapes."""

from __future__ import annotations

import math
from pathlib import Path

BODY, BODY_MASS = (0.20, 0.09, 0.05), 0.60
"""Edges [m] and mass [kg]."""
LENGTHS, RADII, MASSES = (0.025, 0.075, 0.110), (0.012, 0.010, 0.007), (0.010, 0.022, 0.018)
"""Of coxa, femur and tibia [m, kg]."""
TILTS = (0.0, -0.60, 1.75)
"""Of the three joints at zero: the stance [rad]."""
LIMITS = ((-0.6, 0.6), (-0.7, 0.9), (-1.0, 0.7))
"""Of the three joints [rad]."""
WORDS = ("yaw", "swing", "knee")


def beetle() -> str:
    """Return the URDF as text."""
    body = f'<geometry><box size="{_row(BODY)}"/></geometry>'
    a, b, c = (BODY_MASS * edge**2 / 12.0 for edge in BODY)
    links, joints = [_link("thorax", BODY_MASS, (b + c, a + c, a + b), "0 0 0", (body, body))], []
    for side, sign in (("l", 1.0), ("r", -1.0)):
        for k, x in enumerate((0.07, 0.0, -0.07)):
            yaw = sign * (0.5 * math.pi - (0.5, 0.0, -0.5)[k])
            joints += _joints(f"{side}{k + 1}", (x, sign * 0.045, 0.0), yaw)
            links += _segments(f"{side}{k + 1}")
    return "\n".join(
        ['<?xml version="1.0"?>', '<robot name="beetle">', *links, *joints, "</robot>"]
    )


def _segments(leg: str) -> list[str]:
    """Three rods along x, the last with a ball to stand on."""
    out = []
    for part in range(3):
        length, radius, mass = LENGTHS[part], RADII[part], MASSES[part]
        across, along = mass * length**2 / 12.0 + mass * radius**2 / 4.0, mass * radius**2 / 2.0
        rod = f'<geometry><cylinder radius="{radius}" length="{length}"/></geometry>'
        rod = f'<origin xyz="{length / 2} 0 0" rpy="0 1.570796 0"/>{rod}'
        ball = f'<origin xyz="{length} 0 0"/><geometry><sphere radius="0.007"/></geometry>'
        name = f"{leg}_{('coxa', 'femur', 'tibia')[part]}"
        shapes = (rod, ball if part == 2 else rod)
        out.append(_link(name, mass, (along, across, across), f"{length / 2} 0 0", shapes))
    return out


def _joints(leg: str, at: tuple[float, float, float], yaw: float) -> list[str]:
    """A hip that turns about z, and two hinges about y."""
    parents = ("thorax", f"{leg}_coxa", f"{leg}_femur")
    places = (at, (LENGTHS[0], 0.0, 0.0), (LENGTHS[1], 0.0, 0.0))
    out = []
    for k, part in enumerate(("coxa", "femur", "tibia")):
        low, high = LIMITS[k]
        turn = (0.0, 0.0, yaw) if k == 0 else (0.0, TILTS[k], 0.0)
        axis = "0 0 1" if k == 0 else "0 1 0"
        out.append(
            f'<joint name="{leg}_{WORDS[k]}" type="revolute"><parent link="{parents[k]}"/>'
            f'<child link="{leg}_{part}"/><origin xyz="{_row(places[k])}" rpy="{_row(turn)}"/>'
            f'<axis xyz="{axis}"/><limit lower="{low}" upper="{high}" effort="2" velocity="15"/>'
            "</joint>"
        )
    return out


def _link(
    name: str,
    mass: float,
    inertia: tuple[float, float, float],
    centre: str,
    shapes: tuple[str, str],
) -> str:
    """A link with what is seen and what touches."""
    x, y, z = inertia
    return (
        f'<link name="{name}"><inertial><origin xyz="{centre}"/><mass value="{mass}"/>'
        f'<inertia ixx="{x:.3e}" ixy="0" ixz="0" iyy="{y:.3e}" iyz="0" izz="{z:.3e}"/></inertial>'
        f"<visual>{shapes[0]}</visual><collision>{shapes[1]}</collision></link>"
    )


def _row(values: tuple[float, ...]) -> str:
    return " ".join(f"{value:.6g}" for value in values)


if __name__ == "__main__":
    folder = Path(__file__).parent / "beetle_description" / "urdf"
    (folder / "beetle.urdf").write_text(beetle() + "\n", encoding="utf-8")
