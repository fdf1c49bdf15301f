"""Measured walk of an animal: speed, cost of transport, falls and footfall pattern."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.run.assembly import ROBOT, build_world
from seals.run.build import run_settings
from seals.run.settings import RunSettings
from seals.world import Actor

SETTLED = 2.0
"""Time after which a walk is steady: the animal has turned and taken up its pace [s]."""
FALLEN = 0.5
"""Cosine of the tilt against the ground beyond which an animal has fallen [1]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Walk:
    """Measurements of a walk.

    Args:
        speed: along the wanted way, steady [m/s].
        size: length that speeds are counted in [m].
        cost: mechanical cost of transport, sum |torque x rate| / (m g v) [1].
        froude: v^2 / (g h), h the height of the body origin [1].
        upright: smallest cosine of the tilt against the ground [1].
        beyond: largest excess of a joint over its limit [rad].
        rate: steps a second of processor time.
        time: of the rows, steady part [s], shape (T,).
        stands: whether each foot carries, shape (T, N).
        feet: names of the legs.
    """

    speed: float
    size: float
    cost: float
    froude: float
    upright: float
    beyond: float
    rate: float
    time: Floats
    stands: Any
    feet: tuple[str, ...]

    @property
    def lengths(self) -> float:
        """Speed in body lengths a second [1/s]."""
        return self.speed / self.size

    @property
    def fell(self) -> bool:
        """Return whether the animal fell."""
        return self.upright < FALLEN


SIZES = {"crab": 0.080, "sea_spider": 0.30}
"""Width of the carapace, span of the legs [m]."""


def walked(
    overrides: Sequence[str], *, seed: int | None = None, slope: float = 0.0, step: float = 0.0
) -> Walk:
    """Run one walk of the guide ``march`` and measure it.

    Args:
        overrides: of the run.
        seed: draws heading at the start, direction and pause; None for those of the overrides.
        slope: of the ground, rising to the east [rad].
        step: time step in place of that of the run [s]; 0 to leave it.
    """
    words = [*overrides, *(_drawn(seed, slope) if seed is not None else ())]
    words += [f"time.step={step}"] if step else []
    settings = run_settings(words)
    world = build_world(settings)
    try:
        return _measured(world, settings, slope)
    finally:
        world.close()


def _drawn(seed: int, slope: float) -> list[str]:
    """Return heading, direction and pause of a seed; on a slope it begins in the slope's plane."""
    rng = np.random.default_rng(seed)
    yaw, way, pause = rng.uniform(-math.pi, math.pi), rng.uniform(-math.pi, math.pi), rng.uniform()
    turn = f"initial.rpy={standing(yaw, slope)}"
    return [turn, f"guide.way={way:.5f}", f"guide.delay={0.1 + pause:.5f}"]


def standing(yaw: float, slope: float) -> str:
    """Return roll, pitch and yaw of a body that stands on a slope, as a word [rad].

    Args:
        yaw: by which it is turned about the normal of the slope [rad].
        slope: of the ground, rising to the east [rad].
    """
    c, s = math.cos(yaw), math.sin(yaw)
    cp, sp = math.cos(slope), math.sin(slope)
    turn = np.array([[cp * c, -cp * s, -sp], [s, c, 0.0], [sp * c, -sp * s, cp]])
    pitch = math.asin(-turn[2, 0])
    rpy = (math.atan2(turn[2, 1], turn[2, 2]), pitch, math.atan2(turn[1, 0], turn[0, 0]))
    return f"[{','.join(f'{angle:.5f}' for angle in rpy)}]"


def _measured(world: Any, settings: RunSettings, slope: float) -> Walk:
    actor: Actor = world.actors[ROBOT]
    body: Any = actor.body
    robot, guide, gravity = actor.robot, settings.guide, settings.environment.gravity
    feet = [leg.foot for leg in robot.legs.values()]
    steps = round(settings.time.duration / settings.time.step)
    normal = np.array([-math.sin(slope), 0.0, math.cos(slope)])
    way = np.array([math.cos(guide.way), math.sin(guide.way), 0.0])
    times, places, stands, energy = [], [], [], 0.0
    upright, beyond, used = 1.0, -math.inf, 0.0
    for _ in range(steps):
        before, began = body.read().joint_velocity, time.process_time()
        world.step()
        used += time.process_time() - began
        state = body.read()
        q = state.joints
        beyond = max(beyond, float(np.max(q - robot.upper)), float(np.max(robot.lower - q)))
        upright = min(upright, float(body.poses().rotations[0, 0, :, 2] @ normal))
        if world.time >= SETTLED:
            times.append(world.time)
            places.append(state.position)
            stands.append(body.contact_normals()[feet] > 0.0)
            forces: Floats = body.joint_forces()
            # a force held over a step does its work at the mean rate
            rates = 0.5 * (before + state.joint_velocity)
            energy += float(np.abs(forces * rates).sum()) * settings.time.step
    gone = float((places[-1] - places[0]) @ way)
    speed = gone / (times[-1] - times[0])
    mass = float(robot.mass.sum())
    bottom = settings.environment.tank_bottom
    ground = settings.environment.ground_level if bottom is None else bottom
    height = float(np.mean(np.array(places) @ normal)) - normal[2] * float(ground or 0.0)
    return Walk(
        speed=speed,
        size=SIZES.get(settings.robot.name, 1.0),
        cost=energy / max(mass * gravity * gone, 1e-12),
        froude=speed**2 / (gravity * height),
        upright=upright,
        beyond=beyond,
        rate=steps / used,
        time=np.array(times),
        stands=np.array(stands),
        feet=tuple(robot.legs),
    )
