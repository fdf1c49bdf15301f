"""Gaits: controllers that walk on legs of three joints."""

from seals.plugins.controllers.walking.gait import Gait
from seals.plugins.controllers.walking.oscillators import Oscillators
from seals.plugins.controllers.walking.pattern import Pattern
from seals.plugins.controllers.walking.walker import Facing

__all__ = ["Facing", "Gait", "Oscillators", "Pattern"]
