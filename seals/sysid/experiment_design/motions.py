"""Reference motions to combine: smooth steps, holds, frequency sweeps, sines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from seals.arrays import Floats


@dataclass(frozen=True, kw_only=True)
class Path:
    """Reference positions and headings of a manoeuvre; T rows.

    Args:
        place: position of the origin [m], shape (T, 3).
        yaw: heading [rad], shape (T,).
        joints: [rad], shape (T, J).
    """

    place: Floats
    yaw: Floats
    joints: Floats


def smooth(time: Floats, start: float, width: float) -> Floats:
    """Smooth step from 0 to 1 with zero acceleration at both ends.

    Example:
        >>> smooth(np.array([0.0, 1.0, 2.0]), 0.0, 2.0).tolist()
        [0.0, 0.5, 1.0]
    """
    x = np.clip((time - start) / width, 0.0, 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x**2)


def visits(time: Floats, stops: Sequence[float], *, stay: float, move: float) -> Floats:
    """Piecewise constant reference with smooth transitions.

    Args:
        time: [s], shape (T,).
        stops: values, the first held from the start.
        stay: time at each [s].
        move: time between two [s].
    """
    out = np.full(len(time), float(stops[0]))
    for k in range(1, len(stops)):
        begin = k * stay + (k - 1) * move
        out += (stops[k] - stops[k - 1]) * smooth(time, begin, move)
    return out


def sweep(time: Floats, *, push: float, low: float, high: float, seconds: float) -> Floats:
    """Sine of rising frequency and constant acceleration amplitude, at rest at both ends.

    Args:
        time: [s], shape (T,).
        push: amplitude of the acceleration.
        low: first frequency [Hz].
        high: last frequency [Hz].
        seconds: duration [s].
    """
    rise = np.log(high / low)
    share = np.clip(time / seconds, 0.0, 1.0)
    frequency = low * np.exp(rise * share)
    phase = 2.0 * np.pi * low * seconds / rise * np.expm1(rise * share)
    fade = smooth(time, 0.0, 0.5 / low) * (1.0 - smooth(time, seconds - 0.7, 0.7))
    wave: Floats = fade * push / (2.0 * np.pi * frequency) ** 2 * np.sin(phase)
    return wave


def sine(
    time: Floats,
    *,
    size: float,
    period: float,
    seconds: float,
    phase: float = 0.0,
    last: float = 1.0,
) -> Floats:
    """Sine that fades in over half a period, and out over the ``last`` seconds.

    The end asks for an acceleration of up to 5.8 times its size over ``last`` squared.
    """
    fade = smooth(time, 0.0, 0.5 * period) * (1.0 - smooth(time, seconds - last, last))
    return fade * size * np.sin(2.0 * np.pi * time / period + phase)
