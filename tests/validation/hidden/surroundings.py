"""Water surface and orbital motion: an Airy wave in deep water, and a fine ripple."""

from __future__ import annotations

import numpy as np

from tests.validation.hidden.plant import Plant
from tests.validation.hidden.rotation import Array


def _train(plant: Plant, x: Array, y: Array, t: Array) -> tuple[Array, Array, Array]:
    """Phase, wave number and rate of the wave."""
    _, period, heading, phase, _ = plant["wave"]
    rate = 2.0 * np.pi / period
    number = rate**2 / plant["gravity"]
    angle = number * (x * np.cos(heading) + y * np.sin(heading)) - rate * t + phase
    return angle, number, rate


def orbital(plant: Plant, place: Array, t: Array) -> tuple[Array, Array]:
    """Velocity and acceleration of the water (3, n) at places (3, n), world axes.

    The second harmonic is a bound wave of the share that the parameters give.
    """
    amplitude, _, heading, _, crest = plant["wave"]
    angle, number, rate = _train(plant, place[0], place[1], t)
    fade = np.exp(number * np.minimum(place[2], 0.0))
    flat = np.stack((np.cos(heading), np.sin(heading)))
    speed, second = amplitude * rate * fade, crest * amplitude * rate * fade**2
    along = speed * np.cos(angle) + second * np.cos(2.0 * angle)
    up = speed * np.sin(angle) + second * np.sin(2.0 * angle)
    along_rate = rate * (speed * np.sin(angle) + 2.0 * second * np.sin(2.0 * angle))
    up_rate = -rate * (speed * np.cos(angle) + 2.0 * second * np.cos(2.0 * angle))
    velocity = np.concatenate((flat * along, up[None]))
    return velocity, np.concatenate((flat * along_rate, up_rate[None]))


def elevation(plant: Plant, x: Array, y: Array, t: Array) -> Array:
    """Height of the surface above still water at x, y of shape (k, n)."""
    out = np.zeros_like(x)
    if plant["wave"][0].any():
        angle, number, _ = _train(plant, x, y, t)
        amplitude = plant["wave"][0]
        out = amplitude * np.cos(angle) + 0.5 * number * amplitude**2 * np.cos(2.0 * angle)
    height, kx, ky, rate, phase = plant["ripple"]
    if height.any():
        for i in range(height.shape[0]):
            out = out + height[i] * np.cos(kx[i] * x + ky[i] * y - rate[i] * t + phase[i])
    return out
