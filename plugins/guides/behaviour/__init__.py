"""Behaviours of animals: march, wander, seek, flee, shy, freeze."""

from seals.plugins.guides.behaviour.flee import Flee as Flee
from seals.plugins.guides.behaviour.over_ground import Freeze as Freeze
from seals.plugins.guides.behaviour.over_ground import March as March
from seals.plugins.guides.behaviour.seek import Seek as Seek
from seals.plugins.guides.behaviour.shy import Shy as Shy
from seals.plugins.guides.behaviour.wander import Wander as Wander
