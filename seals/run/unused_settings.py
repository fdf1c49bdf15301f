"""Detection of settings that have no effect on a run."""

from __future__ import annotations

from collections.abc import Sequence

from seals.errors import suggestion
from seals.registry import get, names
from seals.run.effects_owned_by_fluid import resting_effects
from seals.run.settings import RunSettings


def find_unused(settings: RunSettings, overrides: Sequence[str]) -> list[str]:
    """Return a remark for each setting without effect.

    Args:
        settings: of the run.
        overrides: what the user wrote; a controller that the robot brings may rest unremarked.
    """
    found = []
    asked = any(word.lstrip("+").startswith(("controller=", "controller.")) for word in overrides)
    if asked and settings.controller is not None and settings.guide is None:
        guides = suggestion("", names("guide"), label="Installed")
        found.append(
            "The controller rests: there is no guide that it could follow.\n"
            f"Choose one: guide=NAME.  {guides}"
        )
    elif settings.robot.legs and settings.guide is None:
        found.append(
            f"The legs of {settings.robot.name} rest: no guide commands their servos, so its "
            "joints turn freely.\n"
            "Choose one: guide=march guide.speed=0 stands"
        )
    flat = settings.wave is None or type(settings.wave) is get("wave", "still").load()
    if not flat and settings.environment.water_level is None:
        found.append(
            "The wave has no effect: there is no water.\n"
            "Add it: water=fossen, or environment.water_level=0 for water without buoyancy."
        )
    station = type(settings.controller) is get("controller", "station").load()
    if station and settings.guide is not None and settings.environment.water_level is None:
        found.append(
            "controller=station holds a robot that its water carries: there is no water.\n"
            "Add it: water=fossen"
        )
    resting = resting_effects(settings)
    if resting:
        found.append(
            f"{', '.join(resting)} of {settings.robot.name} rest: the water of the "
            f"{settings.fluid.name} makes these forces itself."
        )
    return found
