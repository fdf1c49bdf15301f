"""Robot model for guides and controllers: limbs, drives, environment."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.effects.binding import EffectSet
from seals.effects.effect import ActuatorOptions
from seals.environment.settings import EnvironmentSettings
from seals.errors import ConfigError
from seals.multibody.tree import poses_in_base
from seals.plugin_options import options_of
from seals.robot.model import RobotModel

ROTOR, THRUSTER = "rotor", "thruster"

UPWARD = 0.5
"""Vertical part of a rotor's axis from which on it pushes upward [1]."""

NUMBERS = ("thrust", "reaction", "limit", "low", "lag", "fall", "reverse")


class Layout(NamedTuple):
    """All drives of a robot in the order of their commands; body axes about the body origin.

    Args:
        position: of the drives [m], shape (n, 3).
        axis: direction of positive thrust [1], shape (n, 3).
        thrust_coefficient: thrust for the square of a rotor's speed [N/(rad/s)^2], or for a
            thruster's command, which is 1; shape (n,).
        reaction_coefficient: torque about the axis, likewise [N m/(rad/s)^2], shape (n,).
        limit: largest command [rad/s or N], shape (n,).
        low: lowest command, zero for rotors that turn one way only [rad/s or N], shape (n,).
        lag: time constant while the drive speeds up [s], shape (n,).
        fall: time constant while it slows down [s], shape (n,).
        reverse: thrust backwards against that forwards at one size of command [1], shape (n,).
        kind: ``rotor`` (thrust by the square of the command) or ``thruster``, n of them.
        link: index of the link that carries each, n of them.
    """

    position: Floats
    axis: Floats
    thrust_coefficient: Floats
    reaction_coefficient: Floats
    limit: Floats
    low: Floats
    lag: Floats
    fall: Floats
    reverse: Floats
    kind: tuple[str, ...]
    link: tuple[int, ...]

    @property
    def drives(self) -> int:
        """Number of drives."""
        return len(self.kind)


def lifting(layout: Layout) -> Layout:
    """Return a layout in which rotors that do not push upward do nothing.

    A vehicle that takes off upright and flies on wings has a rotor that pushes ahead: in a hover it
    rests.
    """
    up = (layout.axis[:, 2] >= UPWARD).astype(float)
    return layout._replace(
        thrust_coefficient=up * layout.thrust_coefficient,
        reaction_coefficient=up * layout.reaction_coefficient,
    )


class Plant(NamedTuple):
    """Stated model of a robot and its environment, without hidden effects.

    Args:
        robot: links, joints, arms and grippers.
        layout: of all drives.
        environment: gravity, densities, water level.
        effects: the effects of the robot, for controllers that use the model of one.

    Example:
        >>> from seals import make
        >>> with make(["robot=hexacopter", "guide=hover"]) as world:
        ...     plant = world.actors["robot"].pilot.plant
        >>> plant.layout.drives, plant.robot.name
        (6, 'hexacopter')
    """

    robot: RobotModel
    layout: Layout
    environment: EnvironmentSettings
    effects: EffectSet

    @property
    def gravity(self) -> float:
        """Gravity [m/s^2]."""
        return self.environment.gravity


def build_plant(robot: RobotModel, effects: EffectSet, environment: EnvironmentSettings) -> Plant:
    """Return the model of a robot for guides and controllers.

    Raises:
        ConfigError: a drive sits on a link that moves relative to the base.
    """
    return Plant(robot, layout_of(robot, effects), environment, effects)


def layout_of(robot: RobotModel, effects: EffectSet) -> Layout:
    """Return all drives of a robot in body axes, joints at zero.

    Raises:
        ConfigError: a drive sits on a link that moves relative to the base and is no rotor on one
            hinge, or a column has no drive or two.
    """
    bound = effects.actuators
    count = max((b.hooks.first + b.hooks.count for b in bound), default=0)
    table = {key: np.zeros((count, 3)) for key in ("position", "axis")}
    table |= {key: np.zeros(count) for key in NUMBERS}
    kind, link = [""] * count, [0] * count
    origins, turns = poses_in_base(robot.tree)
    for b in bound:
        carrier = b.links[0]
        if robot.tree.joints and np.any(robot.tree.moves[carrier]):
            # refuse a drive on a moving link, but for a rotor that one hinge tilts
            moving = np.flatnonzero(robot.tree.moves[carrier])
            if (
                "reaction_coefficient" not in b.effect.constants()
                or len(moving) > 1
                or robot.tree.slides[moving[0]]
            ):
                raise ConfigError(
                    f"actuators.{b.name}.links: link '{robot.links[carrier]}' moves relative to "
                    "the base.\n"
                    "Drives must be mounted on the base or on links fixed to it; rotors may "
                    "also be on one hinge."
                )
        columns = slice(b.hooks.first, b.hooks.first + b.hooks.count)
        if any(kind[columns]):
            raise ConfigError(
                f"actuators.{b.name}: drive {b.hooks.first} already belongs to another actuator.\n"
                f"Set the column of its first drive: actuators.{b.name}.first=NUMBER; the "
                "columns of all actuators begin at 0 and leave none out."
            )
        constants = b.effect.constants()
        table["position"][columns] = constants["position"] @ turns[carrier].T + origins[carrier]
        table["axis"][columns] = constants["axis"] @ turns[carrier].T
        table["thrust"][columns] = _row(constants, "thrust_coefficient", 1.0)
        table["reaction"][columns] = _row(constants, "reaction_coefficient", 0.0)
        table["limit"][columns], table["lag"][columns] = b.hooks.limit, b.hooks.lag
        word = ROTOR if "reaction_coefficient" in constants else THRUSTER
        backward = -_row(constants, "backward", -1.0)
        table["reverse"][columns] = np.where(backward > 0.0, backward, 1.0)
        own = options_of(b.effect, ActuatorOptions)
        table["fall"][columns] = b.hooks.lag if own.fall is None else own.fall
        lowest = -b.hooks.limit if word == THRUSTER else np.zeros(b.hooks.count)
        table["low"][columns] = lowest if own.low is None else own.low
        for k in range(count)[columns]:
            kind[k], link[k] = word, carrier
    if "" in kind:
        raise ConfigError(
            f"drive {kind.index('')} belongs to no actuator.\n"
            "Set 'first' of the actuators so that their columns follow each other, starting at 0."
        )
    return Layout(
        position=table["position"],
        axis=table["axis"],
        thrust_coefficient=table["thrust"],
        reaction_coefficient=table["reaction"],
        limit=table["limit"],
        low=table["low"],
        lag=table["lag"],
        fall=table["fall"],
        reverse=table["reverse"],
        kind=tuple(kind),
        link=tuple(link),
    )


def _row(constants: dict[str, Any], name: str, default: float) -> Floats | float:
    return np.asarray(constants[name], dtype=float)[0] if name in constants else default
