"""Sphere towed through still water by textbook formulas, without the simulator.

(m + rho V / 2) v' = f - rho C_d A v abs(v) / 2, f' = (command - f) / lag. The drag of a smooth
sphere below its crisis is C_d = 0.47 (Hoerner 1965, Fluid-Dynamic Drag, ch. 3), its added mass is
half of what it displaces (Lamb 1932, art. 92). Classic Runge-Kutta steps of a millisecond.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seals.arrays import Floats

RADIUS = 0.1
"""Of the sphere [m]."""
DENSITY = 1000.0
"""Of the water, and of the sphere: it hovers [kg/m^3]."""
DRAG, ADDED = 0.47, 0.5
"""Coefficients of drag and of added mass [1]."""
LAG = 0.02
"""Of the towing force behind its command [s]."""
VOLUME = 4.0 / 3.0 * np.pi * RADIUS**3
MASS = DENSITY * VOLUME
QUADRATIC = 0.5 * DENSITY * DRAG * np.pi * RADIUS**2
"""Drag at 1 m/s [N s^2/m^2]."""

Steps = tuple[tuple[float, float], ...]
"""Commands: (until [s], force [N])."""

LEARNT: Steps = (
    (1.8, 80.0),
    (3.4, 110.0),
    (5.0, 50.0),
    (6.8, -90.0),
    (8.4, -50.0),
    (10.2, 100.0),
    (11.8, 40.0),
    (13.4, -110.0),
    (15.0, -70.0),
    (16.6, 90.0),
    (18.2, 60.0),
    (20.0, -80.0),
)
"""Of the measurement that is diagnosed, in a tank without end: 2 to 4 m/s."""
UNSEEN: Steps = ((2.0, 95.0), (3.6, 65.0), (5.4, -105.0), (7.0, -45.0), (8.6, 85.0), (10.0, 55.0))
"""Of the measurement that judges the found model."""


class Course(NamedTuple):
    """A tow, row by row.

    Args:
        time: [s], shape (rows,).
        command: held from its row on [N], shape (rows,).
        position: along the tow [m], shape (rows,).
        velocity: [m/s], shape (rows,).
        acceleration: [m/s^2], shape (rows,).
    """

    time: Floats
    command: Floats
    position: Floats
    velocity: Floats
    acceleration: Floats


def commanded(steps: Steps, time: float) -> float:
    """Return the command at a time; zero after the last one [N]."""
    return next((force for until, force in steps if time < until - 1e-9), 0.0)


def towed(steps: Steps, *, until: float, row: float = 0.01) -> Course:
    """Return the course of the sphere from rest.

    Args:
        steps: commands.
        until: last row [s].
        row: time between rows, whole milliseconds [s].
    """
    fine = 1e-3
    state, rows = np.zeros(3), []
    for k in range(round(until / fine) + 1):
        command = commanded(steps, k * fine)
        if k % round(row / fine) == 0:
            rows.append((k * fine, command, *state[:2], _rates(state, command)[1]))
        a = _rates(state, command)
        b = _rates(state + 0.5 * fine * a, command)
        c = _rates(state + 0.5 * fine * b, command)
        d = _rates(state + fine * c, command)
        out: Floats = state + fine / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        state = out
    return Course(*np.array(rows).T)


def _rates(state: Floats, command: float) -> Floats:
    """Rates of place, speed and force."""
    _, v, force = state
    drag = QUADRATIC * v * abs(v)
    return np.array([v, (force - drag) / (MASS * (1.0 + ADDED)), (command - force) / LAG])
