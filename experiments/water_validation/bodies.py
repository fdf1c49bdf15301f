"""Bodies of one shape and any mass, free in a tank of particles."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.run.assembly import build_world
from seals.run.build import run_settings
from seals.world import World

_URDF = """<?xml version="1.0"?>
<robot name="body"><link name="base">
  <inertial><mass value="{mass}"/>
    <inertia ixx="{i[0]}" iyy="{i[1]}" izz="{i[2]}" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry>{shape}</geometry></collision>
</link></robot>
"""


class Shape(NamedTuple):
    """A shape as the robot folder and the URDF spell it.

    Args:
        kind: sphere, box, cylinder, capsule or mesh.
        size: as in ``robot.yaml`` [m].
        volume: [m^3].
        height: along z [m].
        outline: of a mesh: radius and height about its middle [m], from the axis below to the axis
            above, turned about z.
    """

    kind: str
    size: tuple[float, ...]
    volume: float
    height: float
    outline: tuple[tuple[float, float], ...] = ()


SETTLE = 0.6
"""Time for which bodies are held until the water around them rests [s]."""

SHAPES = {
    "sphere": Shape("sphere", (0.1,), 4.0 / 3.0 * np.pi * 0.1**3, 0.2),
    "box": Shape("box", (0.24, 0.24, 0.2), 0.24 * 0.24 * 0.2, 0.2),
    "cylinder": Shape("cylinder", (0.13, 0.2), np.pi * 0.13**2 * 0.2, 0.2),
}
"""Flat enough to float upright."""


class Drift(NamedTuple):
    """A body's way through the water.

    Args:
        time: [s], shape (rows,).
        height: of its middle above the mean level of the water [m], shape (rows,).
        felt: acceleration of each step and g, along z [m/s^2], shape (rows,); zero in the first.
        gap: largest gap in a step's momentum [1].
        particles: of water.
        spacing: of them [m].
    """

    time: Floats
    height: Floats
    felt: Floats
    gap: float
    particles: int
    spacing: float


def drift(
    shape: Shape,
    mass: float,
    *,
    spacing: float,
    tank: Sequence[float],
    start: float,
    until: float,
    step: float = 0.004,
    speed: float = 0.0,
    more: Sequence[str] = (),
) -> Drift:
    """Follow a body that is let go at a height over still water.

    Args:
        shape: of the body.
        mass: [kg].
        spacing: of the particles [m].
        tank: length, width, depth [m].
        start: height of its middle [m].
        until: time [s].
        step: of the world [s].
        speed: at the start, upwards [m/s].
        more: further overrides.
    """
    with tempfile.TemporaryDirectory() as folder:
        write_body(Path(folder), shape, mass)
        words = [
            f"robot={folder}",
            "backend=free",
            "water=particles",
            f"time.step={step}",
            f"environment.tank_bottom={-tank[2]}",
            "environment.water_density=1000",
            f"initial.position=[0,0,{start}]",
            f"initial.velocity=[0,0,{speed}]",
            f"fluid.spacing={spacing}",
            f"fluid.size={list(tank)}",
            f"fluid.settle={SETTLE}",
            *more,
        ]
        world = build_world(run_settings(words))
        return _followed(world, round(until / step))


def write_body(folder: Path, shape: Shape, mass: float) -> None:
    """Write a robot folder for a body, its mass spread evenly.

    Args:
        folder: where it is written.
        shape: of the body.
        mass: [kg].
    """
    size = shape.size
    if shape.kind == "sphere":
        moments = [0.4 * size[0] ** 2] * 3
        geometry = f'<sphere radius="{size[0]}"/>'
    elif shape.kind == "box":
        squares = [x * x for x in size]
        moments = [(sum(squares) - x) / 12.0 for x in squares]
        geometry = f'<box size="{size[0]} {size[1]} {size[2]}"/>'
    else:
        across = size[0] ** 2 / 4.0 + size[1] ** 2 / 12.0
        moments = [across, across, 0.5 * size[0] ** 2]
        geometry = f'<cylinder radius="{size[0]}" length="{size[1]}"/>'
    text = _URDF.format(mass=mass, i=[mass * m for m in moments], shape=geometry)
    (folder / "body.urdf").write_text(text, encoding="utf-8")
    hull = f"{{shapes: [{{type: {shape.kind}, size: {list(size)}}}]}}"
    if shape.outline:
        import trimesh

        trimesh.creation.revolve(np.array(shape.outline)).export(folder / "turned.obj")
        hull = "{shapes: [{type: mesh, file: turned.obj}]}"
    summary = "summary: A body of one shape\nurdf: body.urdf\nhulls:\n"
    (folder / "robot.yaml").write_text(f"{summary}  base: {hull}\n", encoding="utf-8")


def _followed(world: World, steps: int) -> Drift:
    body, fluid, step = world.actors["robot"].body, world.fluid, world.step_size
    assert fluid is not None
    level = float(world.environment.water_level or 0.0)
    start = body.read()
    heights, gaps = [start.position[2]], []
    velocity = [float(start.velocity[2])]
    for _ in range(steps):
        world.step()
        now = body.read()
        heights.append(now.position[2])
        velocity.append(float(now.velocity[2]))
        balance = fluid.momentum_balance()
        assert balance is not None
        gaps.append(float(np.abs(balance.gap).max()) / max(balance.gross, 1e-12))
    figures = fluid.diagnostics()
    world.close()
    time = np.asarray(step * np.arange(steps + 1), dtype=np.float64)
    height = np.asarray(heights, dtype=np.float64)
    felt = np.zeros(steps + 1)
    # velocities hold half of the last kick more than the way of a step, see `seals.world.felt`
    felt[1] = (velocity[1] - velocity[0]) / step
    felt[2:] = np.diff(height, 2) / step**2
    felt[1:] += world.environment.gravity
    count, spacing = int(figures["particles"]), float(figures["spacing [m]"])
    return Drift(time, height - level, felt, max(gaps), count, spacing)
