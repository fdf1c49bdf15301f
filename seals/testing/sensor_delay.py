"""Checks of a sensor's latency and dropout."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields
from typing import Any

import numpy as np

from seals.sensors.delivery import NEW, Delivery, Values
from seals.sensors.protocol import Sensor, SensorInput
from seals.testing.contract import require

COUNT = 600
SIGMAS = 4.5
STEP = 0.004


def check_delivery(
    name: str, make: Callable[..., Sensor], instant: Callable[[int], SensorInput], *, seed: int
) -> dict[str, float]:
    """Check latency and dropouts of a sensor that declares them; return the measured values.

    Args:
        name: of the sensor.
        make: builds it with further fields.
        instant: the k-th instant, one step after the last.
        seed: of its random state.

    Raises:
        ContractError: a reading is late, lost or changed other than declared.
    """
    known = {field.name for field in fields(make())}  # type: ignore[arg-type]
    if not known >= {"latency", "dropout", "outage"}:
        return {}
    rate = 1.0 / STEP
    prompt, _ = _record(make(rate=rate), instant, seed, 40)
    late, heard = _record(make(rate=rate, latency=5 * STEP), instant, seed, 40)
    same = all(
        a is b
        if a is None or b is None
        else a.keys() == b.keys() and all(np.array_equal(a[c], b[c], equal_nan=True) for c in a)
        for a, b in zip(prompt, late, strict=True)
    )
    require(same, name, "reads differently when its readings are late", "Leave latency alone.")
    on_time = [(k, round(taken / STEP)) for k, taken, _ in heard]
    require(
        bool(on_time) and all(k - taken == 5 for k, taken in on_time),
        name,
        f"with a latency of five steps its readings arrive at (step, taken) {on_time[:3]}",
        "Leave latency to the world.",
    )
    share, length = 0.25, 5.0
    rows, _ = _record(make(rate=rate, dropout=share, outage=length * STEP), instant, seed, COUNT)
    lost = float(np.mean([row is None for row in rows]))
    # losses come in runs: the share is as sure as that of COUNT / (2 length) free draws
    error = SIGMAS * math.sqrt(share * (1.0 - share) * 2.0 * length / COUNT)
    require(
        abs(lost - share) < error,
        name,
        f"loses {lost:.2f} of its readings with dropout={share}",
        "Return a reading whenever one is due; leave dropout to the world.",
    )
    return {"share lost, of 0.25 declared": lost}


def _record(
    sensor: Any, instant: Callable[[int], SensorInput], seed: int, count: int
) -> tuple[list[Values | None], list[tuple[int, float, Values]]]:
    """Record logged and delivered readings: step, sample time, reading."""
    rng, way, line = np.random.default_rng(seed), Delivery(sensor), NEW
    memory = sensor.start(rng)
    rows: list[Values | None] = []
    heard: list[tuple[int, float, Values]] = []
    for k in range(count):
        time = k * STEP
        reading, memory = sensor.sense(instant(k), memory, rng, due=True)
        reading, line = way.report(time, STEP, reading, line, rng)
        arrived, line = way.arrivals(time, reading, line)
        rows.append(reading)
        heard += [(k, taken, values) for taken, values in arrived]
    return rows, heard
