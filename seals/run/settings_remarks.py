"""Remarks on settings without effect, stated twice, or left out where the medium needs them."""

from __future__ import annotations

import math
from collections.abc import Sequence

from seals.effects.effect import EffectOptions, MediumKind
from seals.environment.waves import Orbits, WaveOptions
from seals.errors import suggestion
from seals.plugin_options import options_of
from seals.registry import get, names
from seals.run.immersed import adds_drag, resting_effects
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
            "The controller is idle: no guide gives it a reference, so the drives stay off.\n"
            f"Choose one: guide=NAME.  {guides}"
        )
    elif settings.robot.legs and settings.guide is None:
        found.append(
            f"The legs of {settings.robot.name} are idle: no guide commands their servos, so its "
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
            "controller=station requires a robot supported by water, but there is no water.\n"
            "Add it: water=fossen"
        )
    resting = resting_effects(settings)
    if resting:
        more = adds_drag(settings, {name: settings.effects[name] for name in resting})
        found.append(
            f"{', '.join(resting)} of {settings.robot.name} are disabled: the water "
            f"of the {settings.fluid.name} simulates these forces."
            + (" Drag that it does not resolve is added as subgrid_drag." if more else "")
        )
    return found


_NEAR = 1e-3
"""Share of a number by which two statements of it may differ [1]."""
_FELT = 0.5
"""Depth in wave lengths from which a wave feels no bottom [1]."""


def find_conflicts(settings: RunSettings) -> list[str]:
    """Return a remark for each quantity stated in two places with different values."""
    e, wave = settings.environment, settings.wave
    found = []
    own = None if wave is None else options_of(wave, WaveOptions).gravity
    if own is not None and _apart(own, e.gravity):
        found.append(
            f"The wave uses a different gravity: wave.gravity={own:g}, environment.gravity="
            f"{e.gravity:g}.\nUse wave.gravity={e.gravity:g}, unless this is intended."
        )
    for name, effect in settings.effects.items():
        for level in ("ground_level", "water_level"):
            mine, ours = getattr(effect, level, None), getattr(e, level)
            if mine is not None and ours is not None and _apart(mine, ours):
                found.append(
                    f"{name} has a different level: effects.{name}.{level}={mine:g}, "
                    f"environment.{level}={ours:g}.\n"
                    f"Use effects.{name}.{level}={ours:g}, unless this is intended."
                )
    return [*found, *_bottoms(settings)]


def _bottoms(settings: RunSettings) -> list[str]:
    """Return a remark where the wave's water is not as deep as that of the run."""
    e, wave = settings.environment, settings.wave
    if not isinstance(wave, Orbits) or e.water_level is None or e.tank_bottom is None:
        return []
    own = options_of(wave, WaveOptions)
    deep, stated = e.water_level - e.tank_bottom, own.depth
    if stated is None:
        # the longest that matters: of an irregular sea the one at its peak
        length = max(wave.shortest, e.gravity * own.period**2 / (2.0 * math.pi))
        if deep > _FELT * length:
            return []
        return [
            f"The wave is a deep-water wave, {length:.3g} m long; the water is {deep:g} m deep.\n"
            f"Use wave=sea wave.depth={deep:g}, or environment.tank_bottom=null."
        ]
    if not _apart(stated, deep):
        return []
    return [
        f"The water has two depths: wave.depth={stated:g}, and {deep:g} m from "
        f"environment.water_level to environment.tank_bottom.\nUse wave.depth={deep:g}, unless "
        "this is intended."
    ]


def _apart(one: float, other: float) -> bool:
    return abs(one - other) > _NEAR * max(abs(one), abs(other))


_DRAGS = ("linear drag", "quadratic drag")


def find_left_out(settings: RunSettings) -> list[str]:
    """Return a remark for each part of the surroundings that acts on nothing of the robot."""
    known = {word for effect in settings.effects.values() for word in effect.accounts_for}
    driven = {word for part in settings.actuators.values() for word in part.accounts_for}
    found = []
    if settings.environment.water_level is not None:
        found += _drives(driven, known)
        found += _water(settings, known)
    blows = any("steady wind" in effect.accounts_for for effect in settings.effects.values())
    if blows and not _resists(settings, MediumKind.air):
        found.append(
            "The wind has no effect: no drag of the robot acts in air.\n"
            "Add it: +effect@effects.air_drag=quadratic_drag effects.air_drag.medium=air"
        )
    return found


def _drives(driven: set[str], known: set[str]) -> list[str]:
    if "thrust in water" in known:
        return []
    found = []
    if "rotor thrust" in driven:
        found.append(
            "The rotors have the same thrust under water as in air: no effect changes it there.\n"
            "Add it: +effect@effects.rotor_medium=rotor_medium"
        )
    if "thruster force" in driven:
        found.append(
            "The thrusters have the same force above water as below: no effect changes it there.\n"
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
            "The water does not slow down the robot: no drag acts in water.\n"
            "Add it: +effect@effects.water_drag=quadratic_drag"
        )
    flat = settings.wave is None or type(settings.wave) is get("wave", "still").load()
    if not flat and "radiation damping" not in known:
        found.append(
            "Waves radiated by the robot are not modelled: a hull at the surface heaves too long."
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
