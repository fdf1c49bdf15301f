"""A window of particle water that goes with the robot through an open sea."""

from seals.plugins.fluids.moving_domain.fluid import FluidWindow

__all__ = ["FluidWindow"]
