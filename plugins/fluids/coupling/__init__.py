"""Coupling of fluid particles with rigid bodies, shared by tank and moving domain."""

from seals.plugins.fluids.coupling.bodies import Immersed as Immersed
from seals.plugins.fluids.coupling.bodies import add_samples as add_samples
from seals.plugins.fluids.coupling.bodies import clear_of as clear_of
from seals.plugins.fluids.coupling.fluid import Device as Device
from seals.plugins.fluids.coupling.fluid import Method as Method
from seals.plugins.fluids.coupling.fluid import ParticleFluid as ParticleFluid
from seals.plugins.fluids.coupling.heights import HeightField as HeightField
from seals.plugins.fluids.coupling.simulation import Simulation as Simulation
from seals.plugins.fluids.coupling.simulation import refuse_large as refuse_large
