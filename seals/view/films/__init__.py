"""Films of runs: frames rendered from a run folder, and an MP4 of them."""

from seals.view.films.frame import Frame, Photographer, WaterBody
from seals.view.films.viewpoint import Viewpoint, looking

__all__ = ["Frame", "Photographer", "Viewpoint", "WaterBody", "looking"]
