"""A window of particle water that goes with the robot through an open sea."""

from seals.plugins.fluids.window.fluid import FluidWindow

__all__ = ["FluidWindow"]
