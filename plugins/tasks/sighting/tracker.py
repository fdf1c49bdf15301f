"""Kalman filter of a point that moves at nearly constant velocity."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seals.arrays import Floats

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
