"""Check of the time step against instability."""

from __future__ import annotations

import math

from seals.errors import ConfigError
from seals.robot.model import RobotModel
from seals.run.settings import RunSettings

PERIODS = 2.0
"""Longest step, in periods of the controller.

A controller that is called half as often as its gains were made for still holds the robot; called a
third as often, it no longer does (the manipulator's at 125 Hz: 16 ms is calm, 30 ms swings).
"""


def check_step(settings: RunSettings, robot: RobotModel) -> None:
    """Refuse a step that is too long for the controller or for a spring.

    What these bounds do not see, such as steep drag, is refused while it runs, when the motion
    leaves what a backend can follow.

    Args:
        settings: of the run.
        robot: as built.

    Raises:
        ConfigError: the step is beyond a bound; the bound is printed.
    """
    step = settings.time.step
    if settings.guide is not None:
        rate = float(settings.controller.rate)
        longest = PERIODS / rate
        # a step that was computed may miss the bound by a rounding
        if step > longest * (1.0 + 1e-9):
            raise ConfigError(
                f"time.step={step:g} is too long for controller.rate={rate:g}: called so seldom, "
                "the controller does not hold the robot.\n"
                f"Allowed: time.step up to {longest:.3g}; or controller.rate={1.0 / step:.3g} with "
                "gains made for it."
            )
    _check_springs(settings, robot)


def _check_springs(settings: RunSettings, robot: RobotModel) -> None:
    """Refuse springs to the world that are too stiff for the step: h sqrt(K / m) > 2."""
    step, mass = settings.time.step, float(robot.mass.sum())
    for name, effect in settings.effects.items():
        stiffness = float(effect.spring())
        if stiffness <= 0.0 or step * math.sqrt(stiffness / mass) <= 2.0:
            continue
        longest = 2.0 * math.sqrt(mass / stiffness)
        raise ConfigError(
            f"effects.{name}: a spring of {stiffness:.4g} N/m on {mass:.4g} kg is too stiff for "
            f"time.step={step:g}.\n"
            f"Allowed: time.step up to {longest:.3g}, or up to {4.0 * mass / step**2:.3g} N/m."
        )
