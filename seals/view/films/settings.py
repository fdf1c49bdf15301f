"""Typed settings of ``seals render``: run, camera, quality."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any

from seals.field_roles import roles
from seals.schema import optional, setting, vector

_CHOSEN = "chosen"


class Quality(Enum):
    """Quality of a frame: preview or print."""

    draft = "draft"
    paper = "paper"


@roles(
    data="name renderer camera follow water_type film",
    read="run",
    write="out",
    permission="replace",
)
@dataclass(kw_only=True)
class RenderSettings:
    """Settings of one film of a run.

    Args:
        name: of the film, part of the folder's name.
        run: folder of the run.
        out: folder of the frames and the film; None for a folder in the run's folder.
        renderer: viewer plug-in that draws.
        quality: size and samples of the frames.
        camera: ``side``, ``three_quarter``, ``split``, ``under_water``, or a place [x, y, z] [m].
        look_at: point that the camera looks at [m]; empty for the middle of the robot's path.
        follow: whether the camera follows the robot; None: a preset follows if the path is long
            compared with the robot.
        fov: horizontal field of view [rad].
        port: radius of the dome in front of the lens [m]: water begins where a line of sight
            leaves it.
        width: width of a frame [pixel]; 0 for that of the quality, 480 or 1280.
        height: height of a frame [pixel]; 0 for that of the quality, 300 or 800.
        fps: frames per second of the film [Hz].
        speed: simulated seconds per second of the film [1]; below one is slow motion.
        start: time of the first frame [s].
        end: time of the last frame [s]; None for the end of the run.
        water_type: Jerlov type of the water; None for that of the run, or ``coastal_1`` if it has
            none.
        exposure: factor for the brightness of the picture [1]; None for 2 with the camera
            ``under_water``, 1.4 with ``split``, else 1.
        ripples: wind speed of small waves that are only drawn, without force [m/s]; None for those
            of the run, usually none.
        film: whether to write the film beside the frames.
        replace: whether frames of another film in the same folder may be removed.
    """

    name: str = "render"
    run: str | None = None
    out: str | None = None
    renderer: Any = None
    quality: Quality = Quality.draft
    camera: Any = "three_quarter"
    look_at: list[float] = vector((), "m", bounds=(-1e5, 1e5), source="the robot's way")
    follow: bool | None = None
    fov: float = setting(0.9, "rad", bounds=(0.05, 2.5), source=_CHOSEN)
    port: float = setting(0.08, "m", bounds=(0.001, 1.0), source=_CHOSEN)
    width: int = 0
    height: int = 0
    fps: float = setting(25.0, "Hz", bounds=(0.1, 240.0), source=_CHOSEN)
    speed: float = setting(1.0, "1", bounds=(1e-3, 1e3), source=_CHOSEN)
    start: float = setting(0.0, "s", bounds=(0.0, 1e6), source=_CHOSEN)
    end: float | None = optional("s", bounds=(0.0, 1e6), source="the end of the run")
    water_type: str | None = None
    exposure: float | None = optional("1", bounds=(1e-3, 1e3), source="the camera's")
    ripples: float | None = optional("m/s", bounds=(0.0, 15.0), source="the run's")
    film: bool = True
    replace: bool = False

    @property
    def light(self) -> float:
        """Factor on the light of the picture [1]: the given one, or that of the camera."""
        if self.exposure is not None:
            return self.exposure
        return _EXPOSURES.get(self.camera, 1.0) if isinstance(self.camera, str) else 1.0


SIZES = {Quality.draft: (480, 300), Quality.paper: (1280, 800)}
"""Width and height of a frame by quality [pixel]."""
_EXPOSURES = {"under_water": 2.0, "split": 1.4}
"""Factors on the light by preset [1]: water takes most of it."""
CAMERAS = ("side", "three_quarter", "split", "under_water")
"""Presets of the camera."""
