"""Environment of the links: air, water, ground, waves."""

from seals.environment.sample import Sample as Sample
from seals.environment.sampler import EnvironmentSampler as EnvironmentSampler
from seals.environment.wetting import Wetting as Wetting
from seals.environment.wetting import WettingExact as WettingExact
from seals.environment.wetting import WettingTable as WettingTable
