"""Hover trim: rotor speeds that balance the weight at the start."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats
from seals.backend import Configuration
from seals.control.allocation import Allocation
from seals.control.mass_properties import MassPropertyEstimator
from seals.control.plant import ROTOR, Plant
from seals.errors import ConfigError


def carrying(plant: Plant, start: Configuration) -> Floats:
    """Return the rotor speeds at which a level robot hovers, shape (1, n).

    Args:
        plant: the robot.
        start: where it starts, and with which angles of its joints.

    Raises:
        ConfigError: it has drives that are not rotors, starts under water, or cannot lift itself.
    """
    layout, level = plant.layout, plant.environment.water_level
    wet = level is not None and float(start.position[2]) < level
    if wet or set(layout.kind) != {ROTOR}:
        raise ConfigError(
            "initial.drives=carrying requires a robot with rotors that starts in the air.\n"
            "Allowed here: initial.drives=rest"
        )
    speeds = carrying_speeds(plant, start.joints)
    mass = MassPropertyEstimator(plant.robot).at(np.asarray(start.joints, dtype=float))
    weight = np.array([mass.mass * plant.gravity, 0.0, 0.0, 0.0])
    lift = float(Allocation(layout).wrench(speeds[0], mass.centre)[0])
    if lift < 0.99 * weight[0]:
        raise ConfigError(
            f"initial.drives=carrying: the rotors lift {lift:.3g} N of {weight[0]:.3g} N.\n"
            "Allowed here: initial.drives=rest"
        )
    return speeds


def carrying_speeds(plant: Plant, joints: Floats) -> Floats:
    """Return rotor speeds that balance the weight without moments, shape (1, n).

    Drives that are not rotors stand still.

    Args:
        plant: the robot.
        joints: joint values [rad or m], shape (J,).
    """
    if set(plant.layout.kind) != {ROTOR}:
        return np.zeros((1, plant.layout.drives))
    mass = MassPropertyEstimator(plant.robot).at(np.asarray(joints, dtype=float))
    weight = np.array([mass.mass * plant.gravity, 0.0, 0.0, 0.0])
    speeds: Floats = Allocation(plant.layout).commands(weight, mass.centre)[None]
    return speeds
