"""Generator of ``datasheet.yaml``: motors, sensors and tolerances of a robot."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from seals.errors import printable
from seals.file_names import refuse_taken
from seals.logs.atomic import write_text
from seals.logs.log import Log
from seals.logs.motor_curve import motor_curve
from seals.scaffold.flight_facts import FlightFacts, flight_facts, unit_of


class _Assumed(NamedTuple):
    """A tolerance that cannot be estimated from a flight: its size, meaning and reason."""

    sigma: float
    meaning: str
    why: str


_ASSUMED = {
    "mass": _Assumed(0.01, "relative", "a kitchen scale, cables and payload fixed"),
    "inertia": _Assumed(0.1, "relative, each axis", "from a drawing; 0.03 after a swing test"),
    "thrust_coefficient": _Assumed(0.03, "relative, common to all", "propellers of one batch"),
    "thrust_coefficient_each": _Assumed(0.02, "relative, each rotor", "propellers of one batch"),
    "torque_coefficient": _Assumed(0.1, "relative", "seldom measured"),
    "rotor_time_constant": _Assumed(0.01, "s", "data sheets leave it out"),
    "centre_of_gravity": _Assumed(0.003, "m, each axis", "balanced on a finger"),
    "drag_coefficient": _Assumed(
        0.3, "relative, each axis and coefficient", "of a box of the same size"
    ),
    "angular_drag_coefficient": _Assumed(0.5, "relative", "of a box of the same size"),
    "command_delay": _Assumed(0.005, "s", "one cycle of a controller and its protocol"),
    "accelerometer_bias": _Assumed(0.1, "m/s^2, each axis", "a sensor that is not calibrated"),
    "accelerometer_scale": _Assumed(0.005, "relative, each axis", "data sheets of such sensors"),
    "gyroscope_bias": _Assumed(0.005, "rad/s, each axis", "after the calibration at the start"),
    "sensor_misalignment": _Assumed(0.01, "rad, each axis", "mounting error of half a degree"),
    "sensor_delay": _Assumed(0.003, "s", "filters of the sensor"),
}
_OF_MARKERS = {
    "pose_misalignment": _Assumed(0.02, "rad, each axis", "markers levelled by eye"),
}
"""The same of poses so exact that they are of motion capture."""
_NO_LAG = 1e-3
"""Time constant below which a lag is left out of a model [s]."""
_OPTICAL = 0.002
"""Noise of a position up to which it is of motion capture [m]."""
_ASSUMED_IN_WATER = {
    "displaced_volume": _Assumed(0.01, "relative", "trimmed to float, without trapped air"),
    "centre_of_buoyancy": _Assumed(0.005, "m, each axis", "from a drawing"),
    "added_mass": _Assumed(0.3, "relative, each axis", "of an ellipsoid of the same size"),
}
"""The same of hulls, where the log has a depth."""
_LEAST = {"position": 0.005, "orientation": 0.005, "velocity": 0.02}
"""Error of a pose beside its noise [m, rad, m/s]: filters and cameras are smooth, not exact."""
_FILTERED = 0.3
"""Noise, as a share of that error, from which a pose is not smoothed."""
_ONBOARD = ("angular_velocity", "specific_force", "motor_pwm", "battery_voltage")
_GUST = {"air": 0.02, "water": 0.005}
"""Gusts over mass where the flight does not tell them [m/s^2]: still air indoors, still water."""
_LEVER, _USUAL_ARM = 0.065, 0.17
"""Torque of gusts over their force and the motors' arm; that arm where none is stated [m]."""


def write_datasheet(
    log: Log, vehicle: Mapping[str, Any], place: Path, *, replace: bool
) -> list[str]:
    """Write the data sheet of a robot from a flight, and return a summary.

    Args:
        log: of a healthy flight, or of the flight in question.
        vehicle: mass and rotors of the robot, as in ``meta.yaml``.
        place: file to write.
        replace: whether a file already there is replaced.

    Raises:
        ConfigError: the file exists.
        LogError: it cannot be written.
    """
    refuse_taken(place, replace=replace)
    facts = flight_facts(log, vehicle)
    write_text(place, "\n".join(_lines(log, vehicle, facts)) + "\n")
    return list(_told(log, vehicle, facts))


def _lines(log: Log, vehicle: Mapping[str, Any], facts: FlightFacts) -> Iterator[str]:
    mass = float(vehicle["mass"])
    # a name is a stranger's: a new line in it would be an entry of the data sheet
    name, flight = printable(str(vehicle["name"])), printable(log.name)
    yield f"# Data sheet of {name}, from the flight {flight}. Every number says where"
    yield "# it is from: 'measured' in that flight, or 'assumed': a rule of thumb to be replaced."
    yield "environment:"
    yield "  gravity: [0.0, 0.0, -9.81]"
    yield f"  water_level: {'0.0' if log.has('depth') else 'null'}"
    yield "  ground_level: null  # height of the ground [m], for ground effect"
    yield "  air_density: 1.2  # assumed: sea level, 20 degrees"
    yield "baseline: []  # known surroundings, such as waves"
    if facts.full_voltage is not None:
        volts = facts.full_voltage
        yield f"battery: {{full_voltage: {volts.value:.4g}}}  # measured: {volts.how}"
    yield "sensors:"
    yield "  # assumed: at the origin, its axes those of the body"
    yield "  imu: {position: [0.0, 0.0, 0.0], orientation: [1.0, 0.0, 0.0, 0.0]}"
    yield "  channels:"
    for stem, sigma in facts.noise.items():
        yield f"    {_channel(stem, sigma, facts)}"
    yield "tolerance:"
    wet = log.has("depth")
    for name, (sigma, meaning, why) in _tolerances(facts, vehicle, wet).items():
        source = f"source: {why.split(':')[0]}"
        yield f"  {name}: {{sigma: {_figure(sigma)}, meaning: '{meaning}', {source}}}  # {why}"
    medium = "water" if _stays_below(log, vehicle) else "air"
    # how far the motors are from their middle, root mean square
    places = [m["position"] for kind in ("rotors", "thrusters") for m in vehicle.get(kind) or []]
    arm = _USUAL_ARM
    if len(places) >= 2:
        arm = float(np.sqrt(np.var(np.array(places, float), axis=0).sum()))
    yield from _disturbance(facts, mass, medium, _LEVER * arm)
    yield from _motors(log)


def _channel(stem: str, sigma: float, facts: FlightFacts) -> str:
    least = _LEAST.get(stem, 0.0)
    if sigma > _FILTERED * least:
        # noise as large is no filter's: what a sensor shows is its error
        least = 0.0
    source = "measured" if sigma >= least else "assumed: its noise is smaller, but not its error"
    if stem in facts.differing:
        other = "gyroscope" if stem == "orientation" else "pose"
        source = f"measured: differs so much from the {other}; its white noise is {_figure(sigma)}"
    value = _figure(max(facts.differing.get(stem, sigma), least, 1e-6))
    entry = f"sigma: {value}, rate: {_figure(facts.rate[stem])}, unit: {unit_of(stem)}"
    return f"{stem}: {{{entry}}}  # {source}"


def _tolerances(facts: FlightFacts, vehicle: Mapping[str, Any], wet: bool) -> dict[str, _Assumed]:
    noise = facts.noise
    optical = "orientation" in noise and 0.0 < noise.get("position", math.inf) < _OPTICAL
    table = _ASSUMED | (_OF_MARKERS if optical else {}) | (_ASSUMED_IN_WATER if wet else {})
    rotors = vehicle.get("rotors") or []
    if rotors and max(float(r["time_constant"]) for r in rotors) < _NO_LAG:
        # no stated number that may be off a little: a lag is a missing effect
        table = {name: assumed for name, assumed in table.items() if name != "rotor_time_constant"}
    found = {name: a._replace(why=f"assumed: {a.why}") for name, a in table.items()}
    for name, fact in (
        ("gyroscope_bias", facts.gyroscope_bias),
        ("accelerometer_bias", facts.accelerometer_bias),
    ):
        if fact is not None:
            # a larger one than is usual is a fault, which a tolerance would hide
            usual = _ASSUMED[name].sigma
            why = f"measured: {fact.how} {_figure(fact.value)}"
            if fact.value > usual:
                why = f"assumed: {_ASSUMED[name].why}; {why}"
            sigma = min(max(fact.value, 0.2 * usual), usual)
            found[name] = found[name]._replace(sigma=sigma, why=why)
    return found


def _stays_below(log: Log, vehicle: Mapping[str, Any]) -> bool:
    """Return whether a vehicle never comes out of the water, by its depth or its place.

    A place below zero says so of a vehicle with thrusters alone: others may fly down into a valley.
    """
    if log.has("depth"):
        return not bool((log.columns["depth"] <= 0.0).any())
    dives = bool(vehicle.get("thrusters")) and not vehicle.get("rotors")
    return dives and log.has("position") and bool((log.channel("position")[:, 2] < 0.0).all())


def _disturbance(facts: FlightFacts, mass: float, medium: str, lever: float) -> Iterator[str]:
    gust = facts.gust
    level = max(gust.value, 0.005) if gust is not None else _GUST[medium]
    yield "disturbance:"
    yield f"  force_sigma: {_figure(level * mass)}  # " + (
        f"measured: {gust.how}" if gust is not None else f"assumed: still {medium}"
    )
    torque, of_gusts = facts.torque, level * mass * lever
    if torque is not None and torque.clear and torque.sigma > of_gusts:
        note = "measured: in addition to the commanded torque"
        yield f"  torque_sigma: {_figure(torque.sigma)}  # {note}"
        yield f"  correlation_time: {_figure(torque.time)}  # measured: of that torque"
    else:
        yield f"  torque_sigma: {_figure(of_gusts)}  # assumed: an arm of {lever * 1e3:.2g} mm"
        yield "  correlation_time: 0.35  # assumed"


def _motors(log: Log) -> Iterator[str]:
    stated = log.meta.get("motors")
    known = [
        # sequences as YAML writes them
        (key, json.dumps(value))
        for key, value in vars(motor_curve(stated)).items()
        if key in (stated or ())
    ]
    yield "# Motor curve, if commands are not speeds: see docs/logs.md"
    if known:
        inside = ", ".join(f"{key}: {value}" for key, value in known)
        yield f"motors: {{{inside}}}"
    else:
        yield "# motors: {command: pwm, range: [1000, 2000], full_voltage: 16.8, order: [1, 2, 3]}"


def _told(log: Log, vehicle: Mapping[str, Any], facts: FlightFacts) -> Iterator[str]:
    """Yield messages about what was estimated from the flight, and what could not be."""
    for stem, sigma in facts.noise.items():
        rate = f"{facts.rate[stem]:.4g} Hz"
        yield f"measured: noise of {stem} {_figure(sigma)} {unit_of(stem)} at {rate}"
    for stem, sigma in facts.differing.items():
        other = "the gyroscope" if stem == "orientation" else "the pose"
        words = f"{stem} differs from {other} like noise of {_figure(sigma)} {unit_of(stem)}"
        yield f"measured: {words}: filters, interpolated samples or a jittering clock"
    ratio = facts.hover_ratio
    if ratio is not None:
        words = f"measured: thrust is {ratio.value:.3f} of mass times specific force in flight"
        both = math.hypot(_ASSUMED["mass"].sigma, _ASSUMED["thrust_coefficient"].sigma)
        if abs(ratio.value - 1.0) > 3.0 * both:
            words += (
                ", more than three tolerances from 1: if the vehicle is healthy, "
                f"thrust_coefficient is {1.0 / ratio.value:.3f} of what robot.yaml states"
            )
        yield words
    response = facts.response
    if response is not None:
        stated = [float(r["time_constant"]) for r in vehicle.get("rotors") or []]
        yield (
            f"measured: lag of the rotors {response.value * 1e3:.0f} ms ({response.how}); "
            f"robot.yaml states a lag of {max(stated, default=0.0) * 1e3:.0f} ms"
        )
    if facts.late is not None:
        # adding zero turns -0 into 0
        words = f"inertial channels {round(facts.late.value * 1e3) + 0:d} ms late against the pose"
        if abs(facts.late.value) > _ASSUMED["sensor_delay"].sigma:
            stems = ", ".join(f"{k}: {facts.late.value:.3f}" for k in _ONBOARD if log.has(k))
            words += (
                f"; if one recorder wrote these and the motor commands: convert 'late={{{stems}}}'"
            )
        yield f"measured: {words}"
    if facts.gyroscope_bias is None:
        yield "assumed: biases, because the vehicle was never at rest"
    table = _tolerances(facts, vehicle, log.has("depth"))
    guesses = [name for name, each in table.items() if "assumed" in each.why]
    yield f"assumed tolerances: {', '.join(guesses)}"


def _figure(value: float) -> str:
    return f"{value:.3g}"
