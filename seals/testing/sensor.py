"""The executable contract of sensor plug-ins."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from seals.sensor import Felt, Sensor
from seals.testing.contract import class_of, require
from seals.testing.declaration import check_declaration
from seals.testing.inertial import check_inertial, felt

INERTIAL = {"specific_force": 3, "angular_velocity": 3}
"""Channels of a sensor that is checked as an inertial one."""


@dataclass(frozen=True, kw_only=True)
class SensorReport:
    """What `check_sensor` found.

    Args:
        name: of the sensor.
        channels: names and numbers of components.
        figures: measured quantities against what was declared.
    """

    name: str
    channels: Mapping[str, int]
    figures: Mapping[str, float]

    def table(self) -> str:
        """Return the figures as text."""
        lines = [f"{self.name}: channels {', '.join(self.channels)}"]
        return "\n".join(
            [*lines, *(f"  {key:<44}{value:>12.4g}" for key, value in self.figures.items())]
        )


def check_sensor(
    sensor: str | type, *, values: Mapping[str, Any] | None = None, seed: int = 0
) -> SensorReport:
    """Check that a sensor keeps the contract of its kind.

    It must give its declared channels when due and nothing otherwise, repeat itself under one seed,
    draw random numbers only from the state it is given, and leave the memory it is given alone. A
    sensor of specific force and angular velocity must also obey the physics of an inertial unit,
    and its declared noise.

    Args:
        sensor: name of an installed sensor, or its class.
        values: fields of the sensor.
        seed: of its random state.

    Raises:
        ContractError: a promise does not hold; also an AssertionError.
    """
    name, cls = class_of("sensor", sensor)
    check_declaration(name, cls)

    def make(**more: Any) -> Sensor:
        made: Sensor = cls(**{**(values or {}), **more})
        return made

    made = make()
    require(
        isinstance(made, Sensor),
        name,
        "lacks link, rate, channels, start or sense",
        "See seals.sensor.Sensor.",
    )
    require(made.rate > 0.0, name, f"has the rate {made.rate} Hz", "Allowed: above zero.")
    _check_due(name, made, seed)
    _check_seed(name, make, seed)
    channels = made.channels()
    figures = check_inertial(name, make, seed=seed) if channels == INERTIAL else {}
    return SensorReport(name=name, channels=channels, figures=figures)


def _check_due(name: str, sensor: Sensor, seed: int) -> None:
    """Check that readings come when due, complete and finite, and not otherwise."""
    rng = np.random.default_rng(seed)
    memory = sensor.start(rng)
    state = rng.bit_generator.state
    nothing, memory = sensor.sense(_moving(0), memory, rng, due=False)
    require(
        nothing is None,
        name,
        "gives a reading when none is due",
        "Return None; only advance filters.",
    )
    require(
        rng.bit_generator.state == state,
        name,
        "draws noise when no reading is due",
        "Draw when due only.",
    )
    reading, _ = sensor.sense(_moving(1), memory, rng, due=True)
    require(reading is not None, name, "gives no reading when one is due", "Return a reading.")
    shapes = {key: int(np.size(value)) for key, value in (reading or {}).items()}
    require(
        shapes == dict(sensor.channels()),
        name,
        f"reads {shapes}, declares {sensor.channels()}",
        "Make them one.",
    )
    finite = all(bool(np.isfinite(value).all()) for value in (reading or {}).values())
    require(
        finite, name, "gives a reading that is not finite", "Look for a division by a zero step."
    )


def _check_seed(name: str, make: Callable[[], Sensor], seed: int) -> None:
    """Check that the record repeats under one seed, and from one memory."""

    def record() -> list[Any]:
        sensor, rng = make(), np.random.default_rng(seed)
        memory, rows = sensor.start(rng), []
        for k in range(20):
            before = rng.bit_generator.state
            reading, following = sensor.sense(_moving(k), memory, rng, due=True)
            rng.bit_generator.state = before
            again, following = sensor.sense(_moving(k), memory, rng, due=True)
            same = all(np.array_equal(reading[c], again[c]) for c in reading)  # type: ignore[index, union-attr]
            require(
                same,
                name,
                "reads differently from one memory and one random state",
                "Keep no state in the object.",
            )
            memory = following
            rows.append(reading)
        return rows

    pairs = zip(record(), record(), strict=True)
    equal = all(np.array_equal(a[channel], b[channel]) for a, b in pairs for channel in a)
    require(
        equal,
        name,
        "does not repeat itself under one seed",
        "Draw from the random state that is passed in.",
    )


def _moving(k: int) -> Felt:
    """A turning, accelerating instant."""
    return felt(
        force=(0.3 * k, 1.0, 9.0),
        spin=(0.1, -0.2, 0.05 * k),
        spin_rate=(1.0, 0.5, -0.5),
        time=0.004 * k,
    )
