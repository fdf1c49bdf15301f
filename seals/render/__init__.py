"""Films of runs: frames from a run folder, drawn by any viewer, and an MP4 of them."""

from seals.render.frame import Frame, Photographer, WaterBody
from seals.render.viewpoint import Viewpoint, looking

__all__ = ["Frame", "Photographer", "Viewpoint", "WaterBody", "looking"]
