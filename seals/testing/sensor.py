"""Contract tests of sensor plug-ins."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from seals.contract import class_of, require, require_storable
from seals.environment.settings import EnvironmentSettings, ObstacleSettings
from seals.plugin_options import options_of
from seals.sensors.delivery import NEW, Delivery, Values
from seals.sensors.options import SensorOptions
from seals.sensors.protocol import OnboardState, RobotEquipment, Sensor, SensorInput
from seals.sensors.surroundings import Surroundings
from seals.testing.declaration import check_declaration
from seals.testing.inertial import check_inertial, felt

INERTIAL = {"specific_force": 3, "angular_velocity": 3}
"""Channels of a sensor that is checked as an inertial one."""

OUTFIT = RobotEquipment(joints=("first", "second", "third"), rotors=4, battery=True)
"""What the robot has that a sensor is checked on."""
HEIGHTS = {"under water": -3.0, "in the air": 2.0}
"""Height of the sensor above the water surface [m]; the bottom lies at -5 m, a wall ahead."""


@dataclass(frozen=True, kw_only=True)
class SensorReport:
    """Result of `check_sensor`.

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
    """Check the contract of a sensor.

    It must give its declared channels when due, under water or in the air above it, and nothing
    otherwise, repeat itself under one seed, draw random numbers only from the state it is given,
    and leave the memory it is given alone. Where it declares them, its readings must come as late,
    and be lost as often, as it says. A sensor of specific force and angular velocity must also obey
    the physics of an inertial unit, and its declared noise.

    Args:
        sensor: name of an installed sensor, or its class.
        values: fields of the sensor.
        seed: of its random state.

    Raises:
        ContractError: a promise does not hold; also an AssertionError.

    Example:
        >>> check_sensor("pressure").name
        'pressure'
    """
    name, cls = class_of("sensor", sensor)
    check_declaration(name, cls)

    def make(**more: Any) -> Sensor:
        made: Sensor = cls(**{**(values or {}), **more})
        options_of(made, SensorOptions).bind(OUTFIT)
        return made

    made = make()
    require(
        isinstance(made, Sensor),
        name,
        "lacks link, rate, channels, start or sense",
        "See seals.sensors.protocol.Sensor.",
    )
    require(made.rate > 0.0, name, f"has the rate {made.rate} Hz", "Allowed: above zero.")
    if options_of(made, SensorOptions).travels:
        _check_travel(name, make, seed)
        return SensorReport(name=name, channels=made.channels(), figures={})
    place = _check_due(name, made, seed)
    _check_seed(name, make, place, seed)
    channels = made.channels()
    figures = check_inertial(name, make, seed=seed) if channels == INERTIAL else {}
    figures |= _check_delivery(name, make, lambda k: _moving(k, place), seed=seed)
    return SensorReport(name=name, channels=channels, figures=figures)


def _check_due(name: str, sensor: Sensor, seed: int) -> str:
    """Check that readings come only when due; return the steps with a complete reading."""
    rng = np.random.default_rng(seed)
    memory = sensor.start(rng)
    state = rng.bit_generator.state
    nothing, after = sensor.sense(_moving(0, "in the air"), memory, rng, due=False)
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
    require(
        not options_of(sensor, SensorOptions).idles or after is memory,
        name,
        "declares idles, but changes its memory when no reading is due",
        "Return the memory as it is, or leave 'idles' false.",
    )
    whole = [place for place in HEIGHTS if _complete(name, sensor, place, after, seed)]
    require(
        bool(whole),
        name,
        f"gives some of {list(sensor.channels())} neither under water nor in the air",
        "Return all channels in one of the two.",
    )
    return whole[0]


TRAVEL = 500
"""Steps within which a reading arrives that travels."""


def _check_travel(name: str, make: Callable[[], Sensor], seed: int) -> None:
    """Check readings that arrive later than due: complete, repeatable, noise drawn when due."""
    records = []
    for place in (*HEIGHTS, *HEIGHTS):
        sensor, rng, rows = make(), np.random.default_rng(seed), []
        memory = sensor.start(rng)
        for k in range(TRAVEL):
            state, due = rng.bit_generator.state, k == 0
            reading, memory = sensor.sense(_moving(k, place), memory, rng, due=due)
            quiet = due or rng.bit_generator.state == state
            require(quiet, name, "draws noise when no reading is due", "Draw when due only.")
            require_storable(name, memory)
            rows += [] if reading is None else [(k, reading)]
        records.append(rows)
    half = len(HEIGHTS)
    require(
        any(records),
        name,
        f"gives nothing within {TRAVEL} steps, neither under water nor in the air",
        "Return what arrived.",
    )
    for rows, again in zip(records[:half], records[half:], strict=True):
        steps = [k for k, _ in rows] == [k for k, _ in again]
        same = steps and all(
            set(a) == set(make().channels()) and all(np.array_equal(a[c], b[c]) for c in a)
            for (_, a), (_, b) in zip(rows, again, strict=True)
        )
        require(
            same, name, "lacks a channel, or reads differently under one seed", "Draw from rng."
        )


def _complete(name: str, sensor: Sensor, place: str, memory: Any, seed: int) -> bool:
    """Return whether a reading has every channel; check its values."""
    reading, _ = sensor.sense(_moving(1, place), memory, np.random.default_rng(seed), due=True)
    shapes = {key: int(np.size(value)) for key, value in (reading or {}).items()}
    declared = sensor.channels()
    right = {key: width for key, width in declared.items() if key in shapes}
    require(shapes == right, name, f"reads {shapes}, declares {declared}", "Make them one.")
    infinite = any(bool(np.isinf(value).any()) for value in (reading or {}).values())
    require(
        not infinite,
        name,
        f"gives an infinite reading {place}",
        "Leave out a channel without a reading.",
    )
    finite = all(bool(np.isfinite(value).all()) for value in (reading or {}).values())
    return finite and shapes == dict(declared)


def _check_seed(name: str, make: Callable[[], Sensor], place: str, seed: int) -> None:
    """Check that the record repeats under one seed, and from one state."""

    def record() -> list[Any]:
        sensor, rng = make(), np.random.default_rng(seed)
        memory, rows = sensor.start(rng), []
        for k in range(20):
            before = rng.bit_generator.state
            reading, following = sensor.sense(_moving(k, place), memory, rng, due=True)
            rng.bit_generator.state = before
            again, following = sensor.sense(_moving(k, place), memory, rng, due=True)
            same = all(np.array_equal(reading[c], again[c]) for c in reading)  # type: ignore[index, union-attr]
            require(
                same,
                name,
                "reads differently from one memory and one random state",
                "Keep no state in the object.",
            )
            memory = following
            require_storable(name, memory)
            rows.append(reading)
        return rows

    pairs = zip(record(), record(), strict=True)
    equal = all(np.array_equal(a[channel], b[channel]) for a, b in pairs for channel in a)
    require(
        equal,
        name,
        "is not reproducible with the same seed",
        "Draw from the random state that is passed in.",
    )


def _moving(k: int, place: str) -> SensorInput:
    """Sensor input of a turning, accelerating robot with joints at rest."""
    here = felt(
        force=(0.3 * k, 1.0, 9.0),
        angular_velocity=(0.1, -0.2, 0.05 * k),
        angular_acceleration=(1.0, 0.5, -0.5),
        time=0.004 * k,
    )
    wall = ObstacleSettings(size=[1.0, 20.0, 20.0], position=[6.0, 0.0, 0.0])
    around = Surroundings(
        EnvironmentSettings(water_level=0.0, tank_bottom=-5.0, obstacles={"wall": wall})
    )
    joints, speeds = np.array([0.1, -0.2, 0.3]), np.array([500.0, 510.0, 520.0, 530.0])
    return here._replace(
        position=np.array([0.0, 0.0, HEIGHTS[place]]),
        velocity=np.array([0.5, 0.1, -0.05]),
        around=around,
        board=OnboardState(lambda: joints, lambda: speeds, lambda: (15.2, 8.0, 0.9)),
    )


COUNT = 600
SIGMAS = 4.5
STEP = 0.004


def _check_delivery(
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
    return {"share of readings lost (declared: 0.25)": lost}


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
