"""Physical effects: the base class of their plug-ins, and their binding to the links of a robot."""

from seals.effects.binding import BoundEffect, EffectSet, bind_effects
from seals.effects.effect import Effect, MediumKind

__all__ = ["BoundEffect", "Effect", "EffectSet", "MediumKind", "bind_effects"]
