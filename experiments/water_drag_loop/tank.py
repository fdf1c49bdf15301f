"""Sphere towed through a tank of particles, guided along a straight line."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.experiments.water_drag_loop.textbook import (
    ADDED,
    DENSITY,
    LAG,
    MASS,
    RADIUS,
    Course,
    Steps,
    commanded,
)
from seals.frames import matrix_of
from seals.run.assembly import build_world
from seals.run.build import run_settings
from seals.run.progress import progress
from seals.world import World

REST = 0.3
"""Time for which the sphere is held before the tow, for the water to settle [s]."""
PULL = 12.0
"""Rate of the springs that hold the sphere on its way [rad/s]."""
ROBOT = """\
summary: A sphere that hovers, with lines that pull it along three axes
urdf: sphere.urdf
hulls:
  base: {{shapes: [{{type: sphere, size: [{radius}]}}]}}
actuators:
  lines:
    actuator: thrusters
    position: [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    axis: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    time_constant: [{lag}]
    max_force: [900.0]
"""
URDF = """\
<?xml version="1.0"?>
<robot name="sphere"><link name="base">
  <inertial><mass value="{mass}"/>
    <inertia ixx="{moment}" iyy="{moment}" izz="{moment}" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry><sphere radius="{radius}"/></geometry></collision>
</link></robot>
"""
MOMENT = 0.4 * MASS * RADIUS**2
"""Of inertia, its mass spread evenly [kg m^2]."""


class Tank(NamedTuple):
    """Size of the towing tank.

    Args:
        spacing: of the particles [m].
        size: length, width, depth [m].
        start: of the sphere along the tank [m].
    """

    spacing: float = 1.0 / 30.0
    size: tuple[float, float, float] = (3.2, 0.8, 0.8)
    start: float = -1.3


def towed_in_particles(
    steps: Steps, tank: Tank, *, until: float, more: Sequence[str] = (), label: str = "towing"
) -> Course:
    """Return the course of the sphere in particle water, a row every step of the world.

    Args:
        steps: commands along x from the end of the rest on.
        tank: that it is towed in.
        until: last row [s].
        more: further overrides, such as a drag below the scale of the particles.
        label: words beside the progress bar.
    """
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        text = URDF.format(mass=MASS, moment=MOMENT, radius=RADIUS)
        (place / "sphere.urdf").write_text(text, encoding="utf-8")
        text = ROBOT.format(radius=RADIUS, lag=LAG)
        (place / "robot.yaml").write_text(text, encoding="utf-8")
        length, width, depth = tank.size
        words = [
            f"robot={folder}",
            "water=particles",
            "time.step=0.004",
            f"time.duration={REST + until + 0.1}",
            f"environment.tank_bottom={-depth}",
            f"environment.water_density={DENSITY}",
            f"initial.position=[{tank.start},0,{-0.5 * depth}]",
            f"fluid.spacing={tank.spacing}",
            f"fluid.size=[{length},{width},{depth}]",
            *more,
        ]
        world = build_world(run_settings(words))
    try:
        return _followed(world, steps, until, label)
    finally:
        world.close()


def _followed(world: World, steps: Steps, until: float, label: str) -> Course:
    """Tow, and write down every step."""
    actor, h = world.actors["robot"], world.step_size
    start, rows = actor.body.read().position.copy(), []
    rest, count = round(REST / h), round((REST + until) / h)
    with progress(label, count) as tell:
        for k in range(count + 1):
            seen, time = actor.body.read(), (k - rest) * h
            pull = (
                -(1.0 + ADDED)
                * MASS
                * PULL
                * (PULL * (seen.position - start) + 2.0 * seen.velocity)
            )
            if k >= rest:
                pull[0] = commanded(steps, time)
                rows.append((time, pull[0], seen.position[0] - start[0], seen.velocity[0]))
            # lines pull along axes of the world, drives along those of the sphere
            turn = matrix_of(np.asarray(seen.quaternion)[None])[0]
            actor.command = (turn.T @ pull)[None]
            world.step()
            tell(k + 1)
    time_, command, position, velocity = np.array(rows).T
    acceleration: Floats = np.gradient(velocity, time_)
    return Course(time_, command, position, velocity, acceleration)
