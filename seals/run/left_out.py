"""Detection of parts of the environment (air, water, waves) that no effect of the robot uses."""

from __future__ import annotations

from seals.effects.effect import EffectOptions, MediumKind
from seals.plugin_options import options_of
from seals.registry import get
from seals.run.settings import RunSettings

_DRAGS = ("linear drag", "quadratic drag")


def find_left_out(settings: RunSettings) -> list[str]:
    """Return a remark for each part of the surroundings that acts on nothing of the robot.

    Args:
        settings: of the run.
    """
    known = {word for effect in settings.effects.values() for word in effect.accounts_for}
    driven = {word for part in settings.actuators.values() for word in part.accounts_for}
    found = []
    if settings.environment.water_level is not None:
        found += _drives(driven, known)
        found += _water(settings, known)
    blows = any("steady wind" in effect.accounts_for for effect in settings.effects.values())
    if blows and not _resists(settings, MediumKind.air):
        found.append(
            "The wind pushes nothing: no drag of the robot acts in air.\n"
            "Add it: +effect@effects.air_drag=quadratic_drag effects.air_drag.medium=air"
        )
    return found


def _drives(driven: set[str], known: set[str]) -> list[str]:
    if "thrust in water" in known:
        return []
    found = []
    if "rotor thrust" in driven:
        found.append(
            "The rotors push under water as in air: no effect changes their thrust there.\n"
            "Add it: +effect@effects.rotor_medium=rotor_medium"
        )
    if "thruster force" in driven:
        found.append(
            "The thrusters push above water as below: no effect changes their force there.\n"
            "Add it: +effect@effects.thruster_medium=thruster_medium"
        )
    return found


def _water(settings: RunSettings, known: set[str]) -> list[str]:
    """Drag in water and waves that a hull makes; simulated water brings both itself."""
    hulls = any(hull.shapes for hull in settings.robot.hulls.values())
    if settings.fluid is not None or not hulls:
        return []
    found = []
    if not _resists(settings, MediumKind.water):
        found.append(
            "The water does not slow the robot: no drag of it acts in water.\n"
            "Add it: +effect@effects.water_drag=quadratic_drag"
        )
    flat = settings.wave is None or type(settings.wave) is get("wave", "still").load()
    if not flat and "radiation damping" not in known:
        found.append(
            "Waves that the robot makes itself are left out: a hull at the surface heaves too long."
            "\nAdd it: +effect@effects.radiation_damping=radiation_damping"
        )
    return found


def _resists(settings: RunSettings, medium: MediumKind) -> bool:
    """Return whether a drag acts in a medium; a third party's law that resists counts."""
    for effect in settings.effects.values():
        acts_in = options_of(effect, EffectOptions).medium
        phenomena = set(effect.accounts_for)
        others = effect.identification.resists and "angular drag" not in phenomena
        if (phenomena & set(_DRAGS) or others) and acts_in in (medium, MediumKind.any):
            return True
    return False
