"""Coupling of fluid particles with rigid bodies, shared by tank and moving domain."""

from seals.plugins.fluids.coupling.bodies import Immersed, add_samples, clear_of
from seals.plugins.fluids.coupling.fluid import Device, Method, ParticleFluid
from seals.plugins.fluids.coupling.heights import HeightField
from seals.plugins.fluids.coupling.simulation import Simulation, refuse_large

__all__ = [
    "Device",
    "HeightField",
    "Immersed",
    "Method",
    "ParticleFluid",
    "Simulation",
    "add_samples",
    "clear_of",
    "refuse_large",
]
