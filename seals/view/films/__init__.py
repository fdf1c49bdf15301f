"""Films of runs: frames from a run folder, drawn by any viewer, and an MP4 of them."""

from seals.view.films.frame import Frame, Photographer, WaterBody
from seals.view.films.viewpoint import Viewpoint, looking

__all__ = ["Frame", "Photographer", "Viewpoint", "WaterBody", "looking"]
