"""Moving domain: a box of water particles that follows the robot through an open sea."""

from seals.plugins.fluids.moving_domain.fluid import FluidWindow as FluidWindow
