"""Library of manoeuvres: motion, duration, and the vehicles that can perform it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.sysid.experiment_design.motions import Path, sine, smooth, sweep, visits
from seals.sysid.experiment_design.scene import AIR, ARM, CROSSING, DROP, WATER, Scene

LONGEST = 30.0
"""Longest manoeuvre [s]."""
_FLYING = (AIR, ARM)
_MOVING = (AIR, ARM, WATER, CROSSING)


@dataclass(frozen=True, kw_only=True)
class Manoeuvre:
    """Manoeuvre that excites effects: a reference motion, or a free release.

    Args:
        name: short, in plain words.
        words: what is done.
        kinds: of vehicles that it suits.
        seconds: duration [s].
        path: where to be, as a function of the scene and time; None for drops.
        releases: height above the water [m], tilt [rad] and spin [rad/s] of each drop.
        batteries: share of the full voltage of each run.
        loads: known extra mass of each log as a share of the vehicle's.
    """

    name: str
    words: str
    kinds: tuple[str, ...]
    seconds: float
    path: Callable[[Scene, Floats], Path] | None = None
    releases: tuple[tuple[float, float, float], ...] = ()
    batteries: tuple[float, ...] = (0.96,)
    loads: tuple[float, ...] = field(default=(0.0,))

    @property
    def logs(self) -> int:
        """Number of logs that it gives: one for each known load."""
        return len(self.loads)


def manoeuvres(kind: str) -> tuple[Manoeuvre, ...]:
    """Return the manoeuvres for a kind of vehicle, simplest first."""
    return tuple(m for m in LIBRARY if kind in m.kinds)


def _path(scene: Scene, time: Floats, **moved: Floats) -> Path:
    """Path from displacements x, y, z [m] from home, heading yaw [rad] and joints [rad]."""
    still = np.zeros(len(time))
    place = scene.home + np.stack([moved.get(a, still) for a in "xyz"], axis=1)
    place[:, 2] = np.clip(place[:, 2], scene.low + 0.03, scene.high - 0.03)
    joints = np.tile(scene.joints, (len(time), 1)) + moved.get("joints", np.zeros((len(time), 1)))
    return Path(place=place, yaw=moved.get("yaw", still), joints=joints)


def hover(scene: Scene, time: Floats) -> Path:
    """Hover in place."""
    return _path(scene, time)


def _two_speeds(scene: Scene, time: Floats) -> Path:
    """Forward slowly, backward fast, forward at medium speed."""
    far = min(5.0, 2.6 * scene.speed)
    # a smooth step is at most 1.875 times as fast as an even one
    width = 1.875 * far / scene.speed
    legs = ((0.5, 11.5), (12.5, width), (13.2 + width, 1.7 * width))
    x = np.zeros(len(time))
    for sign, (begin, wide) in zip((1.0, -1.0, 1.0), legs, strict=True):
        x = x + sign * far * smooth(time, begin, wide)
    return _path(scene, time, x=x - 0.5 * far)


def circle(scene: Scene, time: Floats) -> Path:
    """Circle with a fixed heading, slowly and then faster."""
    size = min(1.5, scene.speed**2 / scene.push)
    fast = min(0.75 * scene.speed / size, 1.5)
    angle = 0.4 * fast * time + 0.6 * fast * 20.0 * (np.clip(time / 20.0, 0.0, 1.0) ** 2) / 2.0
    fade = smooth(time, 0.0, 3.0) * (1.0 - smooth(time, 17.0, 3.0))
    return _path(scene, time, x=fade * size * np.cos(angle), y=fade * size * np.sin(angle))


def steps(scene: Scene, time: Floats) -> Path:
    """Quick position steps forward, sideways and backward."""
    size = 0.8 if scene.kind in _FLYING else 0.4
    quick = 1.5 * scene.slowness
    x = visits(time, [0.0, size, 0.0, 0.0, 0.0, size, 0.0], stay=0.5 * scene.slowness, move=quick)
    y = visits(time, [0.0, 0.0, 0.0, size, 0.0, size, 0.0], stay=0.5 * scene.slowness, move=quick)
    return _path(scene, time, x=x, y=y)


def _chirp(scene: Scene, time: Floats) -> Path:
    """Vertical motion with rising frequency."""
    low, high = _band(scene)
    return _path(scene, time, z=sweep(time, push=scene.lift, low=low, high=high, seconds=15.0))


def _sideways_chirp(scene: Scene, time: Floats) -> Path:
    """Motion along x and y with rising frequency."""
    low, high = _band(scene)
    x = sweep(time, push=0.8 * scene.push, low=low, high=0.6 * high, seconds=15.0)
    y = sweep(time, push=0.8 * scene.push, low=1.15 * low, high=0.7 * high, seconds=15.0)
    return _path(scene, time, x=x, y=y)


def _band(scene: Scene) -> tuple[float, float]:
    return (0.35, 4.0) if scene.kind in _FLYING else (0.12, 1.0)


def _yaw_turn(scene: Scene, time: Floats) -> Path:
    """Yaw in place, at the start and at a second position."""
    yaw = 2.0 * np.pi * (smooth(time, 1.0, 5.0) - smooth(time, 11.0, 5.0))
    return _path(scene, time, yaw=yaw, x=0.6 * scene.speed * smooth(time, 7.0, 4.0))


def heave(scene: Scene, time: Floats) -> Path:
    """Vertical motion with high acceleration."""
    period = 1.8 * scene.slowness
    size = scene.lift / (2.0 * np.pi / period) ** 2
    return _path(scene, time, z=sine(time, size=size, period=period, seconds=14.0))


def heights(scene: Scene, time: Floats) -> Path:
    """Hover near the ground (or the surface), in the middle and high up."""
    if scene.kind == WATER:
        top = scene.high - 0.25 - scene.home[2]
        stops = [top, 0.5 * top, 0.0]
    else:
        low = scene.low + 0.05 - scene.home[2]
        stops = [low, low + 0.25, 0.0]
    z = visits(time, [0.0, *stops, stops[0]], stay=3.5, move=1.5 * scene.slowness)
    return _path(scene, time, z=z)


def _all_axes(scene: Scene, time: Floats) -> Path:
    """Slow sines in all three axes and in the heading at once."""
    period, seconds = 4.5 * scene.slowness**0.7, 18.0
    room = {CROSSING: 2.6, ARM: 2.2}.get(scene.kind, 1.6)
    size = min(0.75, scene.speed * period / (2.0 * np.pi * room))
    parts = {
        a: sine(time, size=s * size, period=period * f, seconds=seconds, phase=p)
        + sine(time, size=0.3 * s * size, period=0.62 * period * f, seconds=seconds, phase=2.0 * p)
        for a, s, f, p in (("x", 1.0, 1.0, 0.3), ("y", 1.0, 1.17, 1.9), ("z", 0.5, 0.83, 4.1))
    }
    yaw = sine(time, size=0.9, period=1.3 * period, seconds=seconds)
    return _path(scene, time, yaw=yaw, **parts)


def places(scene: Scene, time: Floats) -> Path:
    """Hover at three places with three headings."""
    far = 1.2 if scene.kind in _FLYING else 0.6
    turn = [0.0, 0.5 * np.pi, np.pi, 1.5 * np.pi]
    move = 2.0 * scene.slowness**0.5
    x = visits(time, [0.0, far, far, 0.0], stay=3.0, move=move)
    y = visits(time, [0.0, 0.0, far, far], stay=3.0, move=move)
    return _path(scene, time, x=x, y=y, yaw=visits(time, turn, stay=3.0, move=move))


def _dips(scene: Scene, time: Floats) -> Path:
    """Dives through the water surface and back, slowly, then faster."""
    level = 0.0 if scene.level is None else scene.level
    up, down = scene.home[2], level - 0.55
    z = (down - up) * (smooth(time, 2.5, 4.0) - smooth(time, 9.5, 3.0))
    z = z + (down - up) * (smooth(time, 14.0, 2.4) - smooth(time, 18.5, 2.4))
    return _path(scene, time, z=z)


def under_water(scene: Scene, time: Floats) -> Path:
    """Dive once and move about below the surface."""
    level = 0.0 if scene.level is None else scene.level
    z = (level - 0.9 - scene.home[2]) * (smooth(time, 0.5, 4.0) - smooth(time, 18.0, 3.5))
    under = np.maximum(time - 5.0, 0.0)
    x = sine(under, size=0.5, period=5.0, seconds=12.0, last=2.5)
    y = sine(under, size=0.4, period=6.0, seconds=12.0, last=2.5)
    bob = sine(under, size=0.15, period=3.5, seconds=12.0)
    return _path(scene, time, x=x, y=y, z=z + bob)


_SWINGS = ((2.6, 0.0), (3.4, 1.0), (2.1, 2.0), (3.0, 3.0))
"""Period [s] and phase [rad] at which each joint of an arm swings."""


def _arm_swing(scene: Scene, time: Floats) -> Path:
    """Hover while the joints swing one after the other, quickly and slowly."""
    swing = np.zeros((len(time), len(scene.joints)))
    # further joints, those of fingers, stay
    for k, (p, f) in enumerate(_SWINGS[: len(scene.joints)]):
        swing[:, k] = sine(time, size=0.35, period=p, seconds=17.0, phase=f)
    return _path(scene, time, joints=swing)


def _made(
    path: Callable[[Scene, Floats], Path],
    name: str,
    seconds: float,
    words: str,
    kinds: tuple[str, ...] = _MOVING,
    **more: Any,
) -> Manoeuvre:
    return Manoeuvre(name=name, words=words, kinds=kinds, seconds=seconds, path=path, **more)


def _drops(name: str, words: str, *releases: tuple[float, float, float]) -> Manoeuvre:
    return Manoeuvre(name=name, words=words, kinds=(DROP,), seconds=2.5, releases=releases)


LIBRARY = (
    _made(hover, "hover", 12.0, "hold place and heading"),
    _made(steps, "steps", 18.0, "fast steps forwards, sideways and backwards", _MOVING),
    _made(
        _two_speeds,
        "two speeds",
        26.0,
        "straight ahead slowly, back fast, and once at medium speed",
    ),
    _made(heave, "heave", 14.0, "up and down as fast as is safe"),
    _made(_chirp, "vertical chirp", 15.0, "up and down, from slow and large to fast and small"),
    _made(_sideways_chirp, "sideways chirp", 15.0, "back and forth, from slow and large to fast"),
    _made(circle, "circle", 20.0, "circles with a fixed heading, increasingly fast"),
    _made(_yaw_turn, "yaw turn", 17.0, "a full rotation at constant position, at two positions"),
    _made(places, "three places", 19.0, "hover at several positions with different headings"),
    _made(_all_axes, "all axes", 18.0, "slow sine motions in all axes and in heading at once"),
    _made(
        heights,
        "climbs at three heights",
        24.0,
        "hover near the ground, slightly higher, high, and low again",
        _FLYING,
    ),
    _made(heights, "three depths", 28.0, "hold near the surface, deeper, and deep", (WATER,)),
    _made(
        _dips,
        "dips",
        23.0,
        "through the surface and out again, slowly and then faster",
        (CROSSING,),
    ),
    _made(under_water, "dive", 23.0, "dive and move below the surface", (CROSSING,)),
    _made(_arm_swing, "arm swing", 17.0, "hover while the joints of the arm swing", (ARM,)),
    _made(
        hover,
        "fresh and low battery",
        12.0,
        "hover with a full battery, and once more with a nearly empty one",
        (*_FLYING, CROSSING),
        batteries=(0.98, 0.86),
    ),
    _made(
        heave,
        "with and without a known weight",
        14.0,
        "up and down, and once more with a known weight of a tenth of the mass at the middle",
        loads=(0.0, 0.1),
    ),
    _drops("one drop", "one drop from 0.4 m", (0.4, 0.05, 0.0)),
    _drops(
        "drops from two heights",
        "four level drops, two from 0.2 m and two from 0.8 m",
        *((h, t, 0.1) for h in (0.2, 0.8) for t in (0.03, -0.03)),
    ),
    _drops(
        "tilted drops",
        "four drops from 0.4 m, tilted by 20 degrees to each side",
        *((0.4, t, 0.2) for t in (0.35, -0.35, 0.2, -0.2)),
    ),
    _drops(
        "spinning drops",
        "four drops from 0.4 m and 0.7 m, turning slowly",
        *((h, 0.1, s) for h in (0.4, 0.7) for s in (0.8, -0.8)),
    ),
)
"""All manoeuvres."""
