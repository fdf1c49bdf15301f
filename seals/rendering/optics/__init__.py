"""Underwater image formation: attenuation, backscatter, blur, caustics, water surface.

Pure functions of arrays, a batch of views at a time, for NumPy and PyTorch alike.
"""

from seals.rendering.optics.optics import Optics as Optics
from seals.rendering.optics.optics import Sight as Sight
from seals.rendering.optics.srgb import from_bytes as from_bytes
from seals.rendering.optics.srgb import to_bytes as to_bytes
from seals.rendering.optics.srgb import to_linear as to_linear
from seals.rendering.optics.srgb import to_srgb as to_srgb
from seals.rendering.optics.surface import Surface as Surface
from seals.rendering.optics.surface import SurfaceAiry as SurfaceAiry
from seals.rendering.optics.surface import SurfaceGrid as SurfaceGrid
from seals.rendering.optics.surface import SurfaceSmooth as SurfaceSmooth
from seals.rendering.optics.surface import SurfaceStill as SurfaceStill
from seals.rendering.optics.surface import SurfaceSum as SurfaceSum
from seals.rendering.optics.surface import SurfaceWaves as SurfaceWaves
from seals.rendering.optics.surface import ripples as ripples
from seals.rendering.optics.waters import WATERS as WATERS
from seals.rendering.optics.waters import Water as Water
from seals.rendering.optics.waters import water_of as water_of
