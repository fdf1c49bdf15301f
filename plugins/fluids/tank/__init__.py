"""Tank of water particles: basin, boundaries, wave maker, two-way coupling with bodies."""

from seals.plugins.fluids.tank.fluid import FluidParticles as FluidParticles
