"""Watcher of a diver's prey: what its cameras find of an animal, kept over time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from seals.arrays import Floats
from seals.learn.task import Instant
from seals.plugins.tasks.sighting.detector import Detector
from seals.plugins.tasks.sighting.tracker import Track, begun, corrected, predicted
from seals.rendering.camera_view import CameraView, Shot

PATIENCE = 1.0
"""Time for which an animal that is not seen is followed where it must be [s]."""


class Watcher:
    """What turns pictures into the place and velocity of an animal.

    Detections of all cameras correct one Kalman filter (`tracker`). One that fits nothing that is
    known is kept only where nothing is. What is between two fingers that feel it goes where the
    hand goes, seen or not. The robot knows its own state; of the animal nothing but the pictures
    is used.

    Args:
        detector: of the animal.
        firm: force on a finger-tip that is felt [N].
        black: whether all pictures are made black, as a control.
    """

    def __init__(self, detector: Detector, *, firm: float, black: bool = False) -> None:
        self.detector, self.firm, self.black = detector, firm, black
        self.begin()

    def begin(self) -> None:
        """Forget everything."""
        self._track: Track | None = None
        self._time = self._seen = 0.0
        self._tool: Floats | None = None
        self._numbers: dict[str, int] = {}

    def perceive(self, now: Instant, cameras: Mapping[str, CameraView]) -> Instant:
        """Return the state with the seen animal, and the fact ``seen``; see `seals.learn.task`."""
        time, tool = float(now.time[0, 0]), np.asarray(now.tool[0])
        held = float(np.sum(now.facts["touch"] > self.firm)) > 1.5
        if self._track is not None:
            self._track = predicted(self._track, time - self._time)
            if held and self._tool is not None:
                self._track = _carried(self._track, tool - self._tool, time - self._time)
        self._time, self._tool = time, tool
        fresh = self._fresh(cameras)
        if held and self._track is not None:
            self._seen = time
        else:
            self._correct(fresh, now)
        if self._track is not None and time - self._seen > PATIENCE:
            self._track = None
        # the state with what the track says; without one the animal is nowhere
        track = self._track
        seen = np.array([[float(track is not None)]])
        place = now.position if track is None else track.place[None]
        drift = 0.0 * now.position if track is None else track.velocity[None]
        facts = {**now.facts, "seen": seen}
        return now._replace(target=place, target_velocity=drift, facts=facts)

    def _fresh(self, cameras: Mapping[str, CameraView]) -> list[CameraView]:
        """Return the cameras whose pictures are new."""
        found = []
        for name, camera in cameras.items():
            shot = camera.shot
            if isinstance(shot, Shot) and self._numbers.get(name) != shot.number:
                self._numbers[name] = shot.number
                found.append(_blackened(camera, shot) if self.black else camera)
        return found

    def _correct(self, cameras: list[CameraView], now: Instant) -> None:
        """Take all detections of this instant into the track."""
        for place, noise in self.detector.find(cameras, now) if cameras else ():
            if self._track is None:
                self._track, self._seen = begun(place, noise), self._time
                continue
            better = corrected(self._track, place, noise)
            if better is not None:
                self._track, self._seen = better, self._time


def _carried(track: Track, way: Floats, step: float) -> Track:
    """Return the state of what goes with the hand in place of its own way.

    Args:
        track: predicted over the step.
        way: of the hand in the step [m], shape (3,).
        step: [s].
    """
    place = track.place - step * track.velocity + way
    return track._replace(mean=np.concatenate((place, way / step)))


def _blackened(camera: CameraView, shot: Shot) -> CameraView:
    """Return a camera with a black picture in which nothing is near."""
    picture = shot.picture
    dark = picture._replace(
        colour=0.0 * np.asarray(picture.colour),
        depth=np.zeros_like(picture.depth),
        parts=np.zeros_like(picture.parts),
    )
    found = CameraView(camera.view)
    found.keep(shot._replace(picture=dark))
    return found
