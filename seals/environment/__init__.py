"""Air, water, bottom, waves: what surrounds the links."""

from seals.environment.sample import Sample
from seals.environment.surroundings import Surroundings
from seals.environment.wetting import Wetting, WettingExact, WettingTable

__all__ = ["Sample", "Surroundings", "Wetting", "WettingExact", "WettingTable"]
