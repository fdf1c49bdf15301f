"""Effects of a robot that are omitted because the simulated fluid computes them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from seals.effects.effect import Effect, EffectOptions, MediumKind
from seals.errors import ConfigError
from seals.fluid import Fluid
from seals.plugin_options import options_of
from seals.robot.robot_file import read_robot
from seals.run.settings import RunSettings


def resting_effects(settings: RunSettings) -> tuple[str, ...]:
    """Return the names of the robot's effects that its fluid computes.

    A robot folder describes drag, added mass and slamming by coefficients; a simulated fluid makes
    them from the robot's shape. An effect that the user added beside the folder's is not among
    them: two owners of one phenomenon are refused.
    """
    if settings.fluid is None or not settings.robot.folder:
        return ()
    own = read_robot(Path(settings.robot.folder)).parts.get("effects", {})
    return tuple(
        name for name, e in settings.effects.items() if name in own and owned(e, settings.fluid)
    )


def owned(effect: Effect, fluid: Fluid) -> bool:
    """Return whether a fluid computes an effect."""
    in_water = options_of(effect, EffectOptions).medium in (MediumKind.water, None)
    shared = set(effect.accounts_for) & set(fluid.accounts_for)
    return in_water and bool(shared) and not effect.correction


def without(effects: Mapping[str, Any], names: tuple[str, ...]) -> dict[str, Any]:
    """Return the effects without those named."""
    return {name: effect for name, effect in effects.items() if name not in names}


def refuse_fluid(settings: RunSettings, purpose: str) -> None:
    """Refuse a simulated fluid where only effects with coefficients are possible.

    Raises:
        ConfigError: there is one.
    """
    if settings.fluid is not None:
        raise ConfigError(
            f"{purpose} cannot follow fluid={settings.fluid.name}: "
            "it needs a law for every force.\n"
            "Take the coefficients: water=fossen, or simulate with seals run."
        )
