"""Gaits of the experiment, and the conditions in which they are measured."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

LAND, SEABED = "experiment=crab_walk", "experiment=crab_seabed"
TEN_DEGREES = math.radians(10.0)
# a gait of oscillators on a crab, with the values of its scripted one
CPG = [
    "controller=cpg",
    "controller.facing=sideways",
    "controller.stroke=0.036",
    "controller.lift=0.009",
    "controller.lowest=1.5",
    "controller.highest=5.0",
]
GAITS: Mapping[str, Sequence[str]] = {
    "tripod": (LAND,),
    "tetrapod": (LAND, "controller.pattern=tetrapod"),
    "ripple": (LAND, "controller.pattern=ripple"),
    "wave": (LAND, "controller.pattern=wave", "guide.speed=0.06"),
    "forwards": (LAND, "controller.facing=ahead"),
    "fast": (LAND, "guide.speed=0.35"),
    "cpg": (LAND, *CPG),
    "tuned": (LAND, "controller=crab_tuned"),
    "seabed": (SEABED,),
    "seabed_tuned": (SEABED, "controller=crab_tuned_seabed"),
    "sea_spider": ("experiment=sea_spider_seabed",),
    "sea_spider_tuned": ("experiment=sea_spider_seabed", "controller=sea_spider_tuned"),
}
"""Overrides of every gait."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """Circumstances of a walk.

    Args:
        words: overrides.
        least: speed that counts as a success [body lengths/s].
        slope: of the ground, rising to the east [rad].
    """

    words: Sequence[str]
    least: float
    slope: float = 0.0


def _ramp(level: float) -> list[str]:
    """A wide slab that rises to the east through the origin of the ground."""
    half = 0.25
    x, z = half * math.sin(TEN_DEGREES), level - half * math.cos(TEN_DEGREES)
    place, turn = f"[{x:.6f}, 0.0, {z:.6f}]", f"[0.0, {-TEN_DEGREES:.6f}, 0.0]"
    slab = f"{{type: box, size: [6.0, 6.0, {2 * half}], position: {place}, rpy: {turn}}}"
    return [f"+environment.obstacles.ramp={slab}"]


def _pebbles(level: float) -> list[str]:
    """Balls sunk into the ground so that 4 mm stand out, at places of a spiral."""
    words = []
    for k in range(150):
        far, turn = 0.06 + 0.075 * math.sqrt(k), 2.399963 * k
        place = f"[{far * math.cos(turn):.4f}, {far * math.sin(turn):.4f}, {level - 0.026}]"
        stone = f"{{type: sphere, size: [0.03], position: {place}}}"
        words.append(f"+environment.obstacles.pebble_{k}={stone}")
    return words


def _heavier(share: float) -> list[str]:
    """A mass at the crab's middle, or one taken away."""
    return ["+effect@effects.more=payload", f"effects.more.mass={0.1431 * share:.5f}"]


CASES: Mapping[str, Case] = {
    "land": Case(words=(LAND,), least=2.0),
    "seabed": Case(words=(SEABED,), least=0.5),
    "land_friction_05": Case(words=(LAND, "environment.friction=0.5"), least=1.0),
    "land_friction_12": Case(words=(LAND, "environment.friction=1.2"), least=1.0),
    "land_mass_minus_30": Case(words=(LAND, *_heavier(-0.3)), least=1.0),
    "land_mass_plus_30": Case(words=(LAND, *_heavier(0.3)), least=1.0),
    "land_slope_10": Case(
        words=(LAND, "environment.ground_level=-1.0", *_ramp(0.0)), least=1.0, slope=TEN_DEGREES
    ),
    "land_pebbles": Case(words=(LAND, *_pebbles(0.0)), least=1.0),
    "seabed_friction_05": Case(words=(SEABED, "environment.friction=0.5"), least=0.5),
    "seabed_friction_12": Case(words=(SEABED, "environment.friction=1.2"), least=0.5),
    "seabed_mass_minus_10": Case(words=(SEABED, *_heavier(-0.1)), least=0.5),
    "seabed_mass_plus_30": Case(words=(SEABED, *_heavier(0.3)), least=0.5),
    "seabed_slope_10": Case(
        words=(SEABED, "environment.tank_bottom=-2.0", *_ramp(-1.0)),
        least=0.5,
        slope=TEN_DEGREES,
    ),
    "seabed_current_02": Case(
        words=(SEABED, "+effect@effects.current=current", "effects.current.velocity_x=0.2"),
        least=0.5,
    ),
    "seabed_waves": Case(
        words=(SEABED, "wave=airy", "wave.amplitude=0.03", "wave.period=1.6"), least=0.5
    ),
}
"""Circumstances by name."""
