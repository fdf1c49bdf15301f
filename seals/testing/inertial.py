"""Checks of inertial measurement units: physics and noise."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.contract import require
from seals.sensors.protocol import Sensor, SensorInput

STEP = 0.001
COUNT = 3000
"""Readings of a noise record; its deviation is then known to 0.75 %."""
SIGMAS = 4.5
"""Statistical errors a record may be off: one sound sensor in a hundred thousand is refused."""
SIDES = {"accelerometer": "specific_force", "gyroscope": "angular_velocity"}

Make = Callable[..., Sensor]


def felt(
    *,
    force: Any = (0.0, 0.0, 0.0),
    angular_velocity: Any = (0.0, 0.0, 0.0),
    angular_acceleration: Any = (0.0, 0.0, 0.0),
    time: float = 0.0,
    step: float = STEP,
) -> SensorInput:
    """Return sensor inputs of a level link with given acceleration and angular velocity."""
    force, turning, rise = (
        np.asarray(x, dtype=float) for x in (force, angular_velocity, angular_acceleration)
    )
    return SensorInput(time, step, np.zeros(3), np.eye(3), np.zeros(3), turning, force, rise)


def check_inertial(name: str, make: Make, *, seed: int) -> dict[str, float]:
    """Check an inertial unit and return the measured figures.

    Args:
        name: of the sensor.
        make: builds it with further fields.
        seed: of its random state.

    Raises:
        ContractError: a reading is not what physics, or the declared noise, asks for.
    """
    known = {f.name for f in fields(make())}  # type: ignore[arg-type]
    quiet = {
        key: 0.0
        for key in known
        if key.endswith(("_noise", "_walk", "_step")) or key == "bandwidth"
    }
    check = _Inertial(name, make, quiet, known, seed)
    check.physics()
    for side, channel in SIDES.items():
        check.noise(side, channel)
        check.walk(side, channel)
        check.limits(side, channel)
    check.bandwidth()
    return check.figures


class _Inertial:
    """A sensor without noise, and with one imperfection at a time."""

    def __init__(
        self, name: str, make: Make, quiet: Mapping[str, float], known: set[str], seed: int
    ) -> None:
        self.name, self.make, self.quiet, self.known, self.seed = name, make, quiet, known, seed
        self.figures: dict[str, float] = {}

    def record(self, channel: str, instants: list[SensorInput], **options: Any) -> Floats:
        """Readings of one channel at every due instant, shape (len(instants), 3)."""
        sensor, rng = self.make(**{**self.quiet, **options}), np.random.default_rng(self.seed)
        memory, rows = sensor.start(rng), []
        for instant in instants:
            reading, memory = sensor.sense(instant, memory, rng, due=True)
            rows.append((reading or {})[channel])
        return np.array(rows)

    def physics(self) -> None:
        """Check rest, free fall, and the accelerations at a mount off the origin."""
        self._equal("at rest", "specific_force", felt(force=(0.0, 0.0, 9.81)), (0.0, 0.0, 9.81))
        self._equal("in free fall", "specific_force", felt(), (0.0, 0.0, 0.0))
        self._equal(
            "while turning",
            "angular_velocity",
            felt(angular_velocity=(0.3, -0.2, 0.1)),
            (0.3, -0.2, 0.1),
        )
        if "position" not in self.known:
            return
        arm = {"position": [0.2, 0.0, 0.1]}
        turning = felt(angular_velocity=(0.0, 0.0, 3.0))
        self._equal(
            "turning at 3 rad/s, 0.2 m off", "specific_force", turning, (-1.8, 0.0, 0.0), **arm
        )
        starting = felt(angular_acceleration=(0.0, 0.0, 5.0))
        self._equal(
            "starting to turn, 0.2 m off", "specific_force", starting, (0.0, 1.0, 0.0), **arm
        )
        if "rpy" in self.known:
            quarter = {"rpy": [0.0, 0.0, math.pi / 2.0]}
            self._equal(
                "turned by 90 deg",
                "specific_force",
                felt(force=(1.0, 0.0, 0.0)),
                (0.0, -1.0, 0.0),
                **quarter,
            )

    def noise(self, side: str, channel: str) -> None:
        """Compare the deviation of a long record with density times the root of the rate."""
        if f"{side}_noise" not in self.known:
            return
        density, rate = 0.01, 200.0
        rows = self.record(channel, [felt()] * COUNT, **{f"{side}_noise": density, "rate": rate})
        self._ratio(f"{side} noise", float(rows.std()), density * math.sqrt(rate), rows.size)
        lag = float(np.mean(rows[1:] * rows[:-1]) / rows.var())
        whiteness = SIGMAS / math.sqrt(rows.size)
        require(
            abs(lag) < whiteness,
            self.name,
            f"its {side} noise repeats itself by {lag:.2g}",
            "Draw it anew.",
        )

    def walk(self, side: str, channel: str) -> None:
        """Compare the increments of the bias with the declared random walk."""
        if f"{side}_walk" not in self.known:
            return
        walk, rate = 0.02, 50.0
        rows = self.record(channel, [felt()] * COUNT, **{f"{side}_walk": walk, "rate": rate})
        steps = np.diff(rows, axis=0)
        self._ratio(f"{side} walk", float(steps.std()), walk / math.sqrt(rate), steps.size)
        block = rows[::25]
        self._ratio(
            f"{side} walk over 0.5 s",
            float(np.diff(block, axis=0).std()),
            walk * math.sqrt(0.5),
            block.size,
        )

    def limits(self, side: str, channel: str) -> None:
        """Check the largest reading and the steps between readings."""
        vectors = {"specific_force": "force", "angular_velocity": "angular_velocity"}
        if f"{side}_range" in self.known:
            strong = felt(**{vectors[channel]: (1e3, -1e3, 0.5)})  # type: ignore[arg-type]
            found = self.record(channel, [strong], **{f"{side}_range": 20.0})[0]
            good = bool(np.allclose(found, [20.0, -20.0, 0.5], atol=1e-12))
            require(
                good,
                self.name,
                f"reads {found} above its {side} range of 20",
                "Clip both signs to the range.",
            )
        if f"{side}_step" in self.known:
            fine = felt(**{vectors[channel]: (0.13, -0.26, 0.31)})  # type: ignore[arg-type]
            found = self.record(channel, [fine], **{f"{side}_step": 0.1})[0]
            good = bool(np.allclose(found, [0.1, -0.3, 0.3], atol=1e-12))
            require(
                good,
                self.name,
                f"reads {found} with a {side} step of 0.1",
                "Round to the nearest step.",
            )

    def bandwidth(self) -> None:
        """Compare the response to a jump with that of a first-order low-pass."""
        if "bandwidth" not in self.known:
            return
        instants = [felt()] * 5 + [felt(force=(1.0, 0.0, 0.0))] * 60
        found = self.record("specific_force", instants, bandwidth=10.0)[5:, 0]
        expected = 1.0 - np.exp(-2.0 * math.pi * 10.0 * STEP * np.arange(1, 61))
        off = float(np.abs(found - expected).max())
        # where inside a step the jump happened is not known to the filter
        self.figures["response at 10 Hz, largest difference"] = off
        require(
            off < 2.0 * math.pi * 10.0 * STEP,
            self.name,
            f"answers a jump {off:.2g} off",
            "First order, -3 dB there.",
        )

    def _equal(
        self,
        where: str,
        channel: str,
        instant: SensorInput,
        expected: tuple[float, ...],
        **options: Any,
    ) -> None:
        found = self.record(channel, [instant], **options)[0]
        off = float(np.abs(found - np.array(expected)).max())
        require(
            off < 1e-9, self.name, f"reads the {channel} {found} {where}", f"Expected: {expected}."
        )

    def _ratio(self, what: str, found: float, expected: float, count: int) -> None:
        """Compare a standard deviation within its statistical error."""
        ratio, error = found / expected, SIGMAS / math.sqrt(2.0 * count)
        self.figures[f"{what}, measured / declared (+- {error:.3f})"] = ratio
        require(
            abs(ratio - 1.0) < error,
            self.name,
            f"its {what} is {ratio:.3f} times the declared value",
            "Consider the square root of the rate.",
        )
