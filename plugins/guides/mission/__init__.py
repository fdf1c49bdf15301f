"""Missions: stages in order, such as rise, reach, close, carry and land."""

from seals.plugins.guides.mission.guide import Grasp as Grasp
from seals.plugins.guides.mission.guide import Mission as Mission
