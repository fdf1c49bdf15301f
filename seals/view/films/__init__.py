"""Films of runs: frames rendered from a run folder, and an MP4 of them."""

from seals.view.films.frame import Frame as Frame
from seals.view.films.frame import Photographer as Photographer
from seals.view.films.frame import WaterBody as WaterBody
from seals.view.films.viewpoint import Viewpoint as Viewpoint
