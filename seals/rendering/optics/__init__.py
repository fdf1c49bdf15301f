"""Underwater image formation: attenuation, backscatter, blur, caustics, water surface.

Pure functions of arrays, a batch of views at a time, for NumPy and PyTorch alike.
"""

from seals.rendering.optics.grid import SurfaceGrid
from seals.rendering.optics.optics import Optics, Sight
from seals.rendering.optics.srgb import from_bytes, to_bytes, to_linear, to_srgb
from seals.rendering.optics.surface import (
    Surface,
    SurfaceAiry,
    SurfaceSmooth,
    SurfaceStill,
    SurfaceSum,
    SurfaceWaves,
    ripples,
)
from seals.rendering.optics.waters import WATERS, Water, water_of

__all__ = [
    "WATERS",
    "Optics",
    "Sight",
    "Surface",
    "SurfaceAiry",
    "SurfaceGrid",
    "SurfaceSmooth",
    "SurfaceStill",
    "SurfaceSum",
    "SurfaceWaves",
    "Water",
    "from_bytes",
    "ripples",
    "to_bytes",
    "to_linear",
    "to_srgb",
    "water_of",
]
