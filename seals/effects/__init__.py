"""Physical effects: the base class of their plug-ins, and their binding to the links of a robot."""

from seals.effects.effect import Effect, MediumKind
from seals.effects.binding import BoundEffect, EffectSet, bind_effects

__all__ = ["BoundEffect", "Effect", "EffectSet", "MediumKind", "bind_effects"]
