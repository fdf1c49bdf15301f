"""Towing experiment: a moving domain with or without a ball, on a straight path at a set speed."""

from __future__ import annotations

import math
import time as clock
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError
from seals.fluid import BodyStates, FluidBody, Surrounding
from seals.plugins.fluids.moving_domain import FluidWindow
from seals.plugins.waves.sea import WaveSea
from seals.robot.pieces import Piece
from seals.run.settings import RunSettings

DIP = 2.0
"""Depth of the ball's middle under the mean level, in radii."""
START = 1.0
"""Time in which the ball comes up to speed [s]."""
SHORTEST = 4.0
"""Least time of the tow, in times of the start: figures count after twice that time."""
POINTS = 9
"""Points along the window at which the surface is read."""
TWINS = 24
"""Shifts whose water also goes on without the shift."""
APART = 10
"""Steps after a shift over which the two are compared."""


class Tow(NamedTuple):
    """Recorded series of a tow, one row per step.

    Args:
        time: at the end of the step [s], shape (rows,).
        place: of the ball along its way [m], shape (rows,).
        force: on the ball by the water [N], shape (rows, 3).
        inside: surface of the particles at the points [m], shape (rows, POINTS).
        tops: the same by the highest particles alone [m], shape (rows, POINTS).
        outside: surface of the outer sea at the points [m], shape (rows, POINTS).
        shifted: whether the window moved in this step, shape (rows,).
        cost: processor time of the step [s], shape (rows,).
        gap: part of the exchanged momentum that the balance lacks [1], shape (rows,).
        particles: of water, shape (rows,).
        twins: force with the shift less force without it, over the steps after it [N], shape
            (TWINS, APART, 3).
        come: particles that came over the whole way.
        gone: particles that went.
        shot: places of the particles at the end [m], shape (n, 3).
        sea: east and height of the outer surface around them [m], shape (2, m).
        radius: of the ball [m].
        depth: of the ball's middle under the mean level [m].
        amplitude: half the height of the waves [m].
        encounter: angular frequency at which the ball meets the waves, their mean one [rad/s].
        spacing: of the particles [m].
        samples: of the boundary.
        step: of time [s].
    """

    time: Floats
    place: Floats
    force: Floats
    inside: Floats
    tops: Floats
    outside: Floats
    shifted: Floats
    cost: Floats
    gap: Floats
    particles: Floats
    twins: Floats
    come: float
    gone: float
    shot: Floats
    sea: Floats
    radius: float
    depth: float
    amplitude: float
    encounter: float
    spacing: float
    samples: int
    step: float


class _Way(NamedTuple):
    """Straight path with a smooth start.

    Args:
        speed: at last [m/s].
        depth: of the ball's middle [m].
    """

    speed: float
    depth: float

    def at(self, time: float) -> BodyStates:
        """Return the prescribed state of the ball at ``time`` [s]."""
        rising = min(time, START)
        place = self.speed * (0.5 * rising * rising / START + max(time - START, 0.0))
        velocity = np.array([[self.speed * rising / START, 0.0, 0.0]])
        still = np.zeros((1, 3))
        return BodyStates(
            np.array([[place, 0.0, -self.depth]]),
            np.eye(3)[None],
            velocity,
            still,
            np.zeros(1),
            np.zeros((1, 3, 3)),
            still,
        )


def towed(settings: RunSettings, *, way: float, speed: float, radius: float) -> Tow:
    """Tow a ball through the sea of a run, or move the window alone.

    Args:
        settings: of the run; its robot is not used.
        way: length of the tow [m].
        speed: [m/s].
        radius: of the ball [m]; 0 for none.

    Raises:
        ConfigError: the fluid is no window, there are no waves, or the way is too short.
    """
    fluid, wave = settings.fluid, settings.wave
    height = wave.height if isinstance(wave, WaveSea) else 0.0
    if not isinstance(fluid, FluidWindow) or not height:
        raise ConfigError("The tow goes through waves in a window.\nUse water=window wave=sea")
    if way < SHORTEST * speed * START:
        raise ConfigError(
            f"a way of {way:g} m is too short for figures at {speed:g} m/s.\n"
            f"Allowed: {SHORTEST * speed * START:g} m or more."
        )
    ball = Piece("sphere", (radius,), np.zeros(3), np.eye(3))
    body = FluidBody("robot/ball", (ball,) if radius else ())
    fluid.open(Surrounding(settings.environment, settings.wave, (), settings.time.step), [body])
    course = _Way(speed, DIP * radius)
    fluid.initialise(course.at(0.0))
    rows, twins = _followed(fluid, course, settings.time.step, way, ball=radius > 0.0)
    columns: Any = [np.array(column) for column in zip(*rows, strict=True)]
    domain, figures, end = fluid.simulation, fluid.diagnostics(), float(columns[0][-1])
    shot = fluid.particles()[0]
    east = np.linspace(shot[:, 0].min() - 2.0, shot[:, 0].max() + 2.0, 400)
    sea = np.stack([east, domain.outer.elevation(np.stack([east, 0.0 * east], 1), end)])
    samples = domain.water.boundary_count
    spacing = domain.box.spacing
    fluid.close()
    # frequency of encounter from upward zero crossings
    outer = domain.outer
    time = np.arange(START, end, 0.01)
    level = [outer.elevation(course.at(t).position, t)[0] - outer.level for t in time]
    ups = time[1:][(np.array(level[:-1]) < 0.0) & (np.array(level[1:]) >= 0.0)]
    return Tow(
        **dict(zip(Tow._fields, columns, strict=False)),
        twins=np.array(twins).reshape(-1, APART, 3),
        come=figures["particles come"],
        gone=figures["particles gone"],
        shot=shot,
        sea=sea,
        radius=radius,
        depth=course.depth,
        amplitude=0.5 * height,
        encounter=float("nan")
        if len(ups) < 2
        else float(2.0 * math.pi * (len(ups) - 1) / (ups[-1] - ups[0])),
        spacing=spacing,
        samples=samples,
        step=settings.time.step,
    )


def _followed(
    fluid: FluidWindow, course: _Way, step: float, way: float, *, ball: bool
) -> tuple[list[tuple[object, ...]], list[Floats]]:
    """Record every step; repeat a few steps with and without a shift of the domain."""
    rows: list[tuple[object, ...]] = []
    twins: list[Floats] = []
    steps = round((way / course.speed + 0.5 * START) / step)
    due = np.linspace(0.2, 0.95, TWINS) * steps
    domain = fluid.simulation
    for k in range(steps):
        time = k * step
        state = course.at(time)
        if ball and len(twins) < TWINS and k >= due[len(twins)] and _moves(fluid, state, time):
            twins.append(_twin(fluid, course, time, step))
        shifts, begin = domain.shifts, clock.process_time()
        force = fluid.exchange(state, time, step)[0, :3] / step
        cost = clock.process_time() - begin
        balance = fluid.momentum_balance()
        assert balance is not None
        gap = float(np.abs(balance.gap).max()) / max(balance.gross, 1e-12)
        points = _line_of(fluid, time + step)
        rows.append(
            (
                time + step,
                float(state.position[0, 0]),
                force,
                np.asarray(fluid.surface(points).elevation)[:, 0],
                domain.heights.at(points),
                domain.outer.elevation(points, time + step),
                domain.shifts > shifts,
                cost,
                gap,
                domain.water.count,
            )
        )
        if k % max(1, steps // 20) == 0:
            print(f"{rows[-1][1]:5.1f} m, {domain.water.count:,} particles", flush=True)
    return rows, twins


def _line_of(fluid: FluidWindow, time: float) -> Floats:
    """Points along the window beside the ball, inside of the ring [m], shape (POINTS, 3)."""
    domain = fluid.simulation
    box, rim = domain.box, (domain.box.ring + 1) * domain.box.spacing
    rest = np.zeros((POINTS, 3))
    rest[:, 0] = np.linspace(box.lower[0] + rim, box.upper[0] - rim, POINTS)
    rest[:, 1] = box.upper[1] - rim
    rest[:, 2] = domain.outer.level
    places: Floats = domain.outer.places(rest, time)
    return places


def _moves(fluid: FluidWindow, state: BodyStates, time: float) -> bool:
    """Return whether the domain shifts in the next step."""
    domain = fluid.simulation
    rest = domain.outer.rest(state.position[:1], time)[0]
    return bool(domain.box.cells_to(rest) != (0, 0))


def _twin(fluid: FluidWindow, course: _Way, time: float, step: float) -> Floats:
    """Return the force change by a shift, from the same fluid state [N], (APART, 3)."""
    kept, domain = fluid.snapshot(), fluid.simulation
    forces = []
    for still in (False, True):
        # a window that is told to stay: one large cell
        if still:
            domain.box = domain.box._replace(cell=math.ceil(1e3 / domain.box.spacing))
        found = [
            fluid.exchange(course.at(t), t, step)[0, :3] / step
            for t in time + step * np.arange(APART)
        ]
        forces.append(np.array(found))
        fluid.restore(kept)
    return forces[0] - forces[1]
