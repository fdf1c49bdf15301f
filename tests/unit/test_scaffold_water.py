"""Water of a new robot: drag of shapes and the added mass of ellipsoids, derived from a URDF."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy import integrate

from seals.effects.binding import bind_effects
from seals.robot.build import build_robot
from seals.run.build import run_settings
from seals.scaffold.robot import scaffold_robot
from seals.scaffold.shapes import Box
from tests.unit.test_scaffold_robot import BOX, link, made, write, yaml_of


def test_drag_is_that_of_the_box(tmp_path: Path) -> None:
    """1/2 rho times the shadow along each axis, for a straight and for a turned box."""
    effects = yaml_of(made(tmp_path, link("body", 1.0, BOX.format("0.3 0.2 0.1"))))["effects"]
    drag = [effects["hull_drag"][f"coefficient_{axis}"] for axis in "xyz"]
    assert drag == [9.98, 15.0, 29.9]
    sides = [effects["hull_drag"][f"size_{axis}"] for axis in "xyz"]
    assert (effects["hull_drag"]["form"], sides) == ("faces", [0.3, 0.2, 0.1])
    # the faces hold the drag of turning
    assert "hull_turning" not in effects
    half = math.sqrt(0.5)
    turn = np.array([[half, -half, 0.0], [half, half, 0.0], [0.0, 0.0, 1.0]])
    box = Box(np.zeros(3), np.array([0.3, 0.2, 0.1]), turn)
    assert box.areas == pytest.approx([half * 0.05, half * 0.05, 0.06])


WATER = 998.206
"""Density of fresh water at 20 degC and 1 atm (IAPWS) [kg/m^3]."""
SHAPES = {
    # 1/2 rho 0.47 pi r^2; skin friction 0.01 rho r^5
    "sphere": (
        '<sphere radius="0.1"/>',
        {"form": "isotropic", "coefficient_x": 7.37, "coefficient_z": 7.37},
        {"quadratic_x": 9.98e-5, "quadratic_z": 9.98e-5},
    ),
    # 1/2 rho d L across, 1/2 rho pi r^2 along; friction 0.01 pi rho r^4 L about the axis
    "cylinder": (
        '<cylinder radius="0.05" length="1.0"/>',
        {
            **{"form": "cross_flow", "axis": "z", "size_z": 1.0},
            **{"coefficient_x": 49.9, "coefficient_y": 49.9, "coefficient_z": 3.92},
        },
        {"quadratic_x": 0.0, "quadratic_z": 1.96e-4},
    ),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_drag_is_that_of_the_shape(tmp_path: Path, shape: str) -> None:
    """A sphere is isotropic, a cylinder in cross-flow."""
    geometry, drag, turning = SHAPES[shape]
    solid = f"<collision><geometry>{geometry}</geometry></collision>"
    effects = yaml_of(made(tmp_path, link("body", 1.0, solid)))["effects"]
    assert {k: effects["hull_drag"][k] for k in drag} == drag
    assert {k: effects["hull_turning"][k] for k in turning} == turning


def test_links_of_several_shapes_have_drag_per_axis(tmp_path: Path) -> None:
    """Two boxes on one link are no simple shape: their shadows add up, and they resist turning."""
    shape = BOX.format("0.1 0.1 0.1").replace("<geo", '<origin xyz="{} 0 0"/><geo', 1)
    body = link("body", 1.0, shape.format(-0.1) + shape.format(0.1))
    effects = yaml_of(made(tmp_path, body))["effects"]
    assert "form" not in effects["hull_drag"]
    assert effects["hull_drag"]["coefficient_x"] == 9.98
    assert effects["hull_turning"]["quadratic_z"] > 0.0


def test_added_mass_is_that_of_an_ellipsoid(tmp_path: Path) -> None:
    """Lamb's integral by quadrature for semi-axes in the box's ratio and of its volume, to 1e-4."""
    effects = yaml_of(made(tmp_path, link("body", 1.0, BOX.format("0.3 0.2 0.1"))))["effects"]
    axes = np.array([3.0, 2.0, 1.0])
    axes *= (0.006 / (4.0 / 3.0 * np.pi * axes.prod())) ** (1.0 / 3.0)

    def factor(k: int) -> float:
        integral = integrate.quad(
            lambda s: axes.prod() / ((axes[k] ** 2 + s) * np.sqrt(np.prod(axes**2 + s))), 0, np.inf
        )[0]
        return float(integral / (2.0 - integral))

    found = [effects["hull_added_mass"][f"mass_{axis}"] for axis in "xyz"]
    assert found == pytest.approx([0.006 * WATER * factor(k) for k in range(3)], rel=1e-4)
    assert "coupling" not in effects["hull_added_mass"]


@pytest.mark.parametrize("place", ["0.371 0.113 -0.257", "3.17 -1.93 0.61", "2.1 2.7 -4.3"])
def test_a_ball_beside_the_origin_has_an_added_mass_that_is_taken(
    tmp_path: Path, place: str
) -> None:
    """It turns without water: its matrix is singular, and written numbers keep it above zero."""
    shape = '<geometry><sphere radius="0.3"/></geometry>'
    ball = f'<collision><origin xyz="{place}"/>{shape}</collision>'
    made = scaffold_robot("mine", write(tmp_path, link("body", 9.0, ball)), parent=tmp_path)
    run = run_settings([f"robot={made.folder}"])
    robot = build_robot(run.robot)
    bind_effects({**run.effects, **run.actuators}, robot.links)
    entry = yaml.safe_load((made.folder / "robot.yaml").read_text("utf-8"))["effects"]
    half = 0.5 * WATER * 4.0 / 3.0 * np.pi * 0.3**3
    assert entry["hull_added_mass"]["mass_x"] == pytest.approx(half, rel=1e-6)
