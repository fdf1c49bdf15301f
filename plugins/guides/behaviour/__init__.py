"""Behaviours of animals: march, wander, seek, flee, freeze."""

from seals.plugins.guides.behaviour.flee import Flee
from seals.plugins.guides.behaviour.freeze import Freeze
from seals.plugins.guides.behaviour.march import March
from seals.plugins.guides.behaviour.seek import Seek
from seals.plugins.guides.behaviour.wander import Wander

__all__ = ["Flee", "Freeze", "March", "Seek", "Wander"]
