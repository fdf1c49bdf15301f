"""Environment of the links: air, water, ground, waves."""

from seals.environment.sample import Sample
from seals.environment.sampler import EnvironmentSampler
from seals.environment.wetting import Wetting, WettingExact, WettingTable

__all__ = ["EnvironmentSampler", "Sample", "Wetting", "WettingExact", "WettingTable"]
