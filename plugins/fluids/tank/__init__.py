"""Particle water for the world: basin, boundaries, waves, and the hand-over to bodies."""

from seals.plugins.fluids.tank.fluid import FluidParticles

__all__ = ["FluidParticles"]
