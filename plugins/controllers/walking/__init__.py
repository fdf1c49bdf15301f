"""Gaits: controllers that walk on legs of three joints."""

from seals.plugins.controllers.walking.pattern import Gait as Gait
from seals.plugins.controllers.walking.pattern import Oscillators as Oscillators
from seals.plugins.controllers.walking.pattern import Pattern as Pattern
from seals.plugins.controllers.walking.walker import Facing as Facing
