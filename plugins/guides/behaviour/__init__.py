"""Behaviours of animals: march, wander, seek, flee, freeze."""

from seals.plugins.guides.behaviour.flee import Flee as Flee
from seals.plugins.guides.behaviour.freeze import Freeze as Freeze
from seals.plugins.guides.behaviour.march import March as March
from seals.plugins.guides.behaviour.seek import Seek as Seek
from seals.plugins.guides.behaviour.wander import Wander as Wander
