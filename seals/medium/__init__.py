"""Air, water, bottom, waves: what surrounds the links."""

from seals.medium.sample import Sample
from seals.medium.surroundings import Surroundings
from seals.medium.wetting import Wetting, WettingExact, WettingTable

__all__ = ["Sample", "Surroundings", "Wetting", "WettingExact", "WettingTable"]
