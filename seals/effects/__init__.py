"""Physical effects: the base class of their plug-ins, and their binding to the links of a robot."""

from seals.effects.binding import BoundEffect, EffectSet, bind_effects
from seals.effects.effect import Effect, MediumKind
from seals.effects.identification import Addition, Freed, Identification, Subject

__all__ = [
    "Addition",
    "BoundEffect",
    "Effect",
    "EffectSet",
    "Freed",
    "Identification",
    "MediumKind",
    "Subject",
    "bind_effects",
]
