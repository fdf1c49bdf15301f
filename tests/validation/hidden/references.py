"""Patterns of motion that a vehicle is asked to fly: sums of sines, smooth steps and lines."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.validation.hidden.rotation import Array

Wanted = dict[str, Array]


def _sines(
    rng: np.random.Generator, size: list[float], period: tuple[float, float]
) -> dict[str, Array]:
    """Two sines for each of x, y, z, yaw with about the given sizes; shapes (4, 2)."""
    split = rng.uniform(0.35, 0.65, 4)
    amplitude = np.asarray(size)[:, None] * np.stack((split, 1.0 - split), axis=1)
    amplitude = amplitude * rng.uniform(0.85, 1.15, (4, 2))
    periods = rng.uniform(*period, (4, 2))
    periods[:, 1] *= rng.uniform(0.55, 0.75, 4)
    return {
        "amplitude": amplitude,
        "rate": 2.0 * np.pi / periods,
        "phase": rng.uniform(0.0, 2.0 * np.pi, (4, 2)),
    }


def _steps(
    rng: np.random.Generator, size: list[float], count: int, last: float
) -> dict[str, Array]:
    """Smooth steps that go and come back, (4, 3)."""
    out = {"step": np.zeros((4, 3)), "step_time": np.full((4, 3), -9.0)}
    for i in range(count):
        out["step"][:, i] = np.asarray(size) * rng.choice([-1.0, 1.0], 4)
        out["step_time"][:, i] = rng.uniform(1.0, last) + rng.uniform(-0.2, 0.2, 4)
    return out


# sizes of x, y, z [m] and yaw [rad]; periods [s]; middle height; line speed; step sizes; steps
SHAPES: dict[tuple[str, str], dict[str, Any]] = {
    ("quad", "sines"): {"size": [1.05, 1.05, 0.45, 0.75], "period": (4.0, 6.0), "steps": 2},
    ("quad", "hover"): {"size": [0.0] * 4},
    ("quad", "low"): {"size": [0.5, 0.45, 0.14, 0.6], "period": (4.5, 8.0), "middle": 0.32},
    ("quad", "line"): {"size": [0.0] * 4, "speed": 1.5},
    ("quad", "slow"): {"size": [0.12, 0.12, 0.06, 0.05], "period": (9.0, 14.0)},
    ("aam", "sines"): {"size": [0.8, 0.8, 0.42, 1.0], "period": (4.0, 6.0), "steps": 1},
    ("aam", "hover"): {"size": [0.0] * 4},
    ("aam", "wading"): {"size": [0.3, 0.3, 0.22, 0.5], "period": (6.0, 9.0)},
    ("auv", "sines"): {"size": [0.58, 0.58, 0.46, 0.92], "period": (6.0, 9.0), "steps": 1},
    ("auv", "shallow"): {"size": [0.5, 0.5, 0.08, 0.6], "period": (6.5, 10.0), "middle": -0.33},
    ("auv", "line"): {"size": [0.0] * 4, "speed": 0.36},
    ("auv", "slow"): {"size": [0.08, 0.0, 0.03, 0.0], "period": (10.0, 16.0)},
    ("auv", "hold"): {"size": [0.0] * 4},
    ("crossing", "sines"): {"size": [0.3, 0.3, 0.65, 0.55], "period": (5.0, 8.0), "middle": -0.1},
}


def draw(kind: str, pattern: str, rng: np.random.Generator, seconds: float) -> Wanted:
    """Numbers of one reference of a vehicle kind and a pattern."""
    shape = SHAPES[(kind, pattern)]
    out = _sines(rng, shape["size"], shape.get("period", (6.0, 9.0)))
    if kind == "crossing":
        # one slow heave with long stays above and below, so that entries are few and clean
        period = rng.uniform(8.5, 11.0)
        out["rate"][2] = 2.0 * np.pi / period * np.array([1.0, 3.0])
        out["amplitude"][2] = np.array([0.72, 0.08])
        out["phase"][2] = rng.uniform(0.0, 6.28) * np.array([1.0, 3.0])
    step = [0.25, 0.25, 0.2, 0.4] if kind in {"quad", "aam"} else [0.12, 0.12, 0.15, 0.3]
    out.update(_steps(rng, step, shape.get("steps", 0), seconds - 1.5))
    out["step_width"] = np.array(0.3 if kind in {"quad", "aam"} else 0.6)
    if pattern == "wading":
        shape = shape | {"middle": rng.uniform(0.0, 0.04)}
    middle = {"quad": rng.uniform(1.3, 1.7), "aam": 1.35, "auv": -2.0, "crossing": -0.1}[kind]
    out["middle"] = np.array([0.0, 0.0, shape.get("middle", middle), 0.0])
    speed = shape.get("speed", 0.0) * rng.uniform(0.85, 1.15)
    out["line"] = np.array([speed, 0.0, 0.0, 0.0])
    if kind == "aam":
        moving = 0.0 if pattern == "hover" else 1.0
        periods = rng.uniform(2.2, 4.5, (3, 2))
        out["joint_rate"] = 2.0 * np.pi / periods
        out["joint_size"] = moving * rng.uniform(0.24, 0.4, (3, 2))
        out["joint_phase"] = rng.uniform(0.0, 2.0 * np.pi, (3, 2))
        out["joint_middle"] = np.array([0.3, -0.95, -0.25]) + rng.uniform(-0.15, 0.15, 3)
    return out


def joints(wanted: Wanted, t: float) -> Array:
    """Joint angles (3, n) asked for at a time."""
    swing = wanted["joint_size"] * np.sin(wanted["joint_rate"] * t + wanted["joint_phase"])
    return wanted["joint_middle"] + swing.sum(1)


def at(wanted: Wanted, t: float) -> tuple[Array, Array, Array]:
    """Reference (x, y, z, yaw), its rate and its second rate at a time, (4, n) each."""
    angle = wanted["rate"] * t + wanted["phase"]
    sine, cosine = wanted["amplitude"] * np.sin(angle), wanted["amplitude"] * np.cos(angle)
    rate = wanted["rate"]
    width = wanted["step_width"]
    bend = np.tanh((t - wanted["step_time"]) / width)
    slope = (1.0 - bend**2) / width
    bump = wanted["step"]
    place = sine.sum(1) + (0.5 * bump * (1.0 + bend)).sum(1) + wanted["middle"]
    speed = (cosine * rate).sum(1) + (0.5 * bump * slope).sum(1) + wanted["line"]
    accel = -(sine * rate**2).sum(1) - (bump * bend * slope / width).sum(1)
    return place + wanted["line"] * t, speed, accel


def typical_speed(wanted: Wanted, seconds: float) -> Array:
    """Root mean square speed of each axis (3, n), at least a few centimetres per second."""
    rows = [at(wanted, t)[1][:3] for t in np.arange(0.0, seconds, 0.1)]
    mean = np.sqrt(np.mean([(r**2).mean(0) for r in rows], axis=0))
    return np.maximum(np.tile(1.2 * mean, (3, 1)), 0.05)
