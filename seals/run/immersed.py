"""Coupling of the robot and the objects of a run to its fluid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from seals.effects.binding import EffectSet, bind_effects
from seals.environment.ground import solids_of
from seals.environment.settings import EnvironmentSettings
from seals.errors import ConfigError
from seals.fluid import Fluid, Surrounding
from seals.registry import get
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
            f"fluid={settings.fluid.name} has no water level to fill up to.\n"
            "Choose both at once: water=particles; or say environment.water_level=0"
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
