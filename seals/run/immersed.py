"""Coupling of robot and objects to the fluid of a run, and the effects that it replaces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from seals.effects.binding import EffectSet, bind_effects
from seals.effects.effect import Effect, EffectOptions, MediumKind
from seals.environment.ground import solids_of
from seals.environment.settings import EnvironmentSettings
from seals.errors import ConfigError
from seals.fluid import Fluid, FluidOptions, Surrounding
from seals.plugin_options import options_of
from seals.registry import get
from seals.robot.robot_file import read_robot
from seals.run.settings import RunSettings
from seals.world import Actor


def owners(fluid: Fluid | None) -> Mapping[str, Sequence[str]]:
    """Return the phenomena that a fluid computes, for the check for double counting."""
    return {} if fluid is None else {fluid.name: fluid.accounts_for}


def surroundings(settings: RunSettings) -> EnvironmentSettings:
    """Return the environment of a run with the solids that its fluid adds."""
    environment = settings.environment
    if settings.fluid is None:
        return environment
    added = settings.fluid.solids(environment)
    return replace(environment, obstacles={**added, **environment.obstacles})


def sink(settings: RunSettings, actors: Sequence[Actor]) -> None:
    """Open the fluid of a run with the bodies of all actors.

    Raises:
        SealsError: there is no water level, or the fluid does not fit.
    """
    if settings.fluid is None:
        return
    environment = settings.environment
    if environment.water_level is None:
        raise ConfigError(
            f"fluid={settings.fluid.name} has no water level.\n"
            "Choose both together: water=particles; or give environment.water_level=0"
        )
    if environment.terrain.file:
        raise ConfigError(
            f"fluid={settings.fluid.name} knows no height map: environment.terrain.file is given.\n"
            "Use water=fossen with the map, or environment.tank_bottom and shore with particles."
        )
    bodies = [g.body for a in actors if a.immersion is not None for g in a.immersion.groups]
    solids = solids_of(environment)
    around = Surrounding(environment, settings.wave, solids, settings.time.step)
    settings.fluid.open(around, bodies)


def plant_effects(settings: RunSettings, actor: Actor) -> EffectSet:
    """Return the effects in the controller's model of the robot.

    In a simulated fluid a controller still knows drag, added mass and buoyancy by coefficients.
    """
    if settings.fluid is None:
        return actor.effects
    known = {**settings.effects, **settings.actuators}
    if not any("buoyancy" in effect.accounts_for for effect in known.values()):
        known["buoyancy"] = get("effect", "buoyancy").load()()
    return bind_effects(known, actor.robot.links)


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


DRAGS = frozenset({"linear drag", "quadratic drag", "angular drag"})
"""Phenomena of which a fluid may resolve a part only."""


def adds_drag(settings: RunSettings, effects: Mapping[str, Effect]) -> bool:
    """Return whether drag is added to what a fluid resolves, see `seals.world.subgrid`.

    Args:
        settings: of the run. In waves nothing is added: drag is stated for water at rest.
        effects: that the fluid computes, by name.
    """
    if settings.fluid is None or not options_of(settings.fluid, FluidOptions).lacks_drag:
        return False
    if settings.wave.at(np.zeros((1, 3)), np.zeros((1, 1)), 0.0).normal is not None:
        return False
    return any(DRAGS.intersection(e.accounts_for) for e in effects.values())


def stated_drag(
    settings: RunSettings, effects: Mapping[str, Effect], links: Sequence[str]
) -> EffectSet | None:
    """Return what a robot states of its drag, with added mass and buoyancy; None to add no drag.

    Args:
        settings: of the run.
        effects: that the fluid computes, by name.
        links: of the robot.
    """
    wanted = DRAGS | {"added mass"}
    chosen = {n: e for n, e in effects.items() if wanted.issuperset(e.accounts_for)}
    if not adds_drag(settings, chosen):
        return None
    return bind_effects({**chosen, "buoyancy": get("effect", "buoyancy").load()()}, links)


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
            "Use coefficients: water=fossen, or simulate with seals run."
        )
