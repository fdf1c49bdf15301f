"""Sampling of solids for particle fluids: boundary points with volumes."""

from seals.plugins.fluids.sampling.faces import PITCH
from seals.plugins.fluids.sampling.pieces import Thin, refuse_coarse, sample_pieces, thickness
from seals.plugins.fluids.sampling.samples import Samples, joined
from seals.plugins.fluids.sampling.shapes import ALL, SEEN
from seals.plugins.fluids.sampling.tank import box_walls, fewest_places

__all__ = [
    "ALL",
    "PITCH",
    "SEEN",
    "Samples",
    "Thin",
    "box_walls",
    "fewest_places",
    "joined",
    "refuse_coarse",
    "sample_pieces",
    "thickness",
]
