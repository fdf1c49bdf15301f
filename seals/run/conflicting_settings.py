"""Detection of settings that are stated twice with different values."""

from __future__ import annotations

import math

from seals.environment.waves import Orbits, WaveOptions
from seals.plugin_options import options_of
from seals.run.settings import RunSettings

_NEAR = 1e-3
"""Share of a number by which two statements of it may differ [1]."""
_FELT = 0.5
"""Depth in wave lengths from which a wave feels no bottom [1]."""


def find_conflicts(settings: RunSettings) -> list[str]:
    """Return a remark for each quantity stated in two places with different values.

    Args:
        settings: of the run.
    """
    e, wave = settings.environment, settings.wave
    found = []
    own = None if wave is None else options_of(wave, WaveOptions).gravity
    if own is not None and _apart(own, e.gravity):
        found.append(
            f"The wave has a gravity of its own: wave.gravity={own:g}, environment.gravity="
            f"{e.gravity:g}.\nSay wave.gravity={e.gravity:g}, or mean it."
        )
    for name, effect in settings.effects.items():
        for level in ("ground_level", "water_level"):
            mine, ours = getattr(effect, level, None), getattr(e, level)
            if mine is not None and ours is not None and _apart(mine, ours):
                found.append(
                    f"{name} has a level of its own: effects.{name}.{level}={mine:g}, "
                    f"environment.{level}={ours:g}.\n"
                    f"Say effects.{name}.{level}={ours:g}, or mean it."
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
            f"The wave is one of deep water, {length:.3g} m long; the water is {deep:g} m deep.\n"
            f"Say wave=sea wave.depth={deep:g}, or environment.tank_bottom=null."
        ]
    if not _apart(stated, deep):
        return []
    return [
        f"The water has two depths: wave.depth={stated:g}, and {deep:g} m from "
        f"environment.water_level to environment.tank_bottom.\nSay wave.depth={deep:g}, or mean it."
    ]


def _apart(one: float, other: float) -> bool:
    return abs(one - other) > _NEAR * max(abs(one), abs(other))
