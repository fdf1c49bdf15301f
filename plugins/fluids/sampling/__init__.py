"""Sampling of solids for particle fluids: boundary points with volumes."""

from seals.plugins.fluids.sampling.pieces import Thin as Thin
from seals.plugins.fluids.sampling.pieces import reach_of as reach_of
from seals.plugins.fluids.sampling.pieces import refuse_coarse as refuse_coarse
from seals.plugins.fluids.sampling.pieces import sample_pieces as sample_pieces
from seals.plugins.fluids.sampling.pieces import thickness as thickness
from seals.plugins.fluids.sampling.pieces import volume_of as volume_of
from seals.plugins.fluids.sampling.shapes import ALL as ALL
from seals.plugins.fluids.sampling.shapes import PITCH as PITCH
from seals.plugins.fluids.sampling.shapes import SEEN as SEEN
from seals.plugins.fluids.sampling.shapes import Samples as Samples
from seals.plugins.fluids.sampling.shapes import joined as joined
from seals.plugins.fluids.sampling.tank import box_walls as box_walls
from seals.plugins.fluids.sampling.tank import fewest_places as fewest_places
