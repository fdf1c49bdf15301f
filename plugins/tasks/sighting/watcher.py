"""Watcher of a diver's prey: what its cameras find of an animal, kept over time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.learn.task import Instant
from seals.plugins.tasks.sighting.detector import Detector
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


AGILITY = (0.05, 0.05, 0.01)
"""Root of the spectral density of the acceleration of an animal along x, y and z [m/s^1.5].

It takes up its pace, or turns, within some seconds, and stays on the ground: strides are not
followed."""
PACE = 0.1
"""Standard deviation of the velocity of what was just found [m/s]."""
GATE = 16.0
"""Largest square of a deviation over its variance: a point four deviations away is another [1]."""


class Track(NamedTuple):
    """State of the filter.

    Args:
        mean: place [m] and velocity [m/s], world, shape (6,).
        covariance: shape (6, 6).
    """

    mean: Floats
    covariance: Floats

    @property
    def place(self) -> Floats:
        """Place, world [m], shape (3,)."""
        return self.mean[:3]

    @property
    def velocity(self) -> Floats:
        """Velocity, world [m/s], shape (3,)."""
        return self.mean[3:]


def begun(place: Floats, noise: Floats) -> Track:
    """Return the state after a first measurement.

    Args:
        place: measured, world [m], shape (3,).
        noise: its covariance [m^2], shape (3, 3).
    """
    covariance = np.zeros((6, 6))
    covariance[:3, :3], covariance[3:, 3:] = noise, PACE**2 * np.eye(3)
    return Track(np.concatenate((place, np.zeros(3))), covariance)


def predicted(track: Track, step: float) -> Track:
    """Return the state after a time, under white acceleration.

    Equation:
        x' = x + v dt; Q = q [[dt^3/3, dt^2/2], [dt^2/2, dt]] for each axis, q the square of
        its `AGILITY`

    Args:
        track: before.
        step: dt [s].

    References:
        Bar-Shalom, Li and Kirubarajan 2001, Estimation with Applications to Tracking and
        Navigation, sec. 6.2.2.
    """
    change = np.eye(6)
    change[:3, 3:] = step * np.eye(3)
    grown = np.array([[step**3 / 3.0, step**2 / 2.0], [step**2 / 2.0, step]])
    noise = np.kron(grown, np.diag(np.square(AGILITY)))
    return Track(change @ track.mean, change @ track.covariance @ change.T + noise)


def corrected(track: Track, place: Floats, noise: Floats) -> Track | None:
    """Return the state after a measurement, or None where the place must be that of another.

    Args:
        track: before, at the time of the measurement.
        place: measured, world [m], shape (3,).
        noise: its covariance [m^2], shape (3, 3).
    """
    away = place - track.place
    spread = track.covariance[:3, :3] + noise
    if away @ np.linalg.solve(spread, away) > GATE:
        return None
    gain = np.linalg.solve(spread, track.covariance[:3]).T
    mean = track.mean + gain @ away
    # the form that keeps it symmetric and positive whatever the rounding
    left = np.eye(6)
    left[:, :3] -= gain
    covariance = left @ track.covariance @ left.T + gain @ noise @ gain.T
    return Track(mean, covariance)
