"""Check of the vehicle's entries in ``meta.yaml``: types and physical ranges."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from seals.logs.channels import CHANNELS
from seals.logs.finding import Finding, Severity
from seals.logs.log import Log


class _Wanted(NamedTuple):
    """Type and range that a key must have."""

    key: str
    shape: tuple[int, ...] = ()
    positive: bool = False
    needed: bool = True
    least: float = -np.inf


_BODY = (
    _Wanted("mass", positive=True),
    _Wanted("inertia", (3, 3)),
    _Wanted("centre_of_gravity", (3,)),
)
_ROTOR = (
    _Wanted("position", (3,)),
    _Wanted("axis", (3,)),
    _Wanted("direction"),
    _Wanted("thrust_coefficient", positive=True),
    _Wanted("torque_coefficient"),
    _Wanted("time_constant", positive=True),
    _Wanted("radius", positive=True),
    _Wanted("max_speed", positive=True),
)
_THRUSTER = (
    _Wanted("position", (3,)),
    _Wanted("axis", (3,)),
    _Wanted("time_constant", positive=True),
    _Wanted("max_force", positive=True),
)
_HULL = (
    _Wanted("displaced_volume", positive=True),
    _Wanted("centre_of_buoyancy", (3,)),
    _Wanted("plan_area", positive=True),
)
_AROUND = (
    _Wanted("gravity", (3,), needed=False),
    _Wanted("air_density", positive=True, needed=False),
    _Wanted("water_density", positive=True, needed=False),
)
_GUSTS = (
    _Wanted("force_sigma", least=0.0),
    _Wanted("torque_sigma", least=0.0),
    _Wanted("correlation_time", positive=True),
)
_SIGMA = (_Wanted("sigma", positive=True),)
_IMU = (_Wanted("position", (3,), needed=False), _Wanted("orientation", (4,), needed=False))
_UNIT = 0.05
"""Largest miss of the square of a quaternion's length."""
_STEP = (_Wanted("step", positive=True, needed=False),)


def check_meta(log: Log) -> list[Finding]:
    """Return the errors in the description of a vehicle; empty when the log has none.

    Example:
        >>> meta = {"vehicle": {"mass": "heavy"}}
        >>> print(check_meta(Log(name="a", columns={"t": [0.0]}, meta=meta))[0])
        [refuse] vehicle.mass: meta.yaml says 'heavy'; give a number above 0
    """
    found = list(_misshapen(log.meta))
    if found:
        return found
    # a log without tolerances is compared with a model given apart: it need not state one
    stated = isinstance(log.meta.get("vehicle"), Mapping)
    whole = stated and "baseline" in log.meta and "tolerance" in log.meta
    return [finding for part in _parts(log.meta) for finding in _wrong(*part, whole=whole)]


_MAPPINGS = (
    "vehicle",
    "environment",
    "sensors",
    "tolerance",
    "disturbance",
    "battery",
    "simulated",
)
_LISTS = ("baseline", "initial_state")


def _misshapen(meta: Mapping[str, Any]) -> Iterator[Finding]:
    """Yield sections that are of another kind than every reader of them takes for granted."""
    for name in _MAPPINGS:
        if meta.get(name) is not None and not isinstance(meta[name], Mapping):
            yield _finding(name, meta[name], "a mapping of names to values")
    sensors = meta.get("sensors")
    channels = sensors.get("channels") if isinstance(sensors, Mapping) else None
    entries = channels.values() if isinstance(channels, Mapping) else [channels or {}]
    if any(not isinstance(entry, Mapping) for entry in entries):
        yield _finding("sensors.channels", channels, "a mapping of channels to mappings")
    gusts = meta.get("disturbance")
    if isinstance(gusts, Mapping):
        yield from _wrong("disturbance", gusts, _GUSTS, whole=False)
    for name in _LISTS:
        listed = meta.get(name)
        if listed is None:
            continue
        if not isinstance(listed, list | tuple) or any(not isinstance(e, Mapping) for e in listed):
            yield _finding(name, listed, "a list of mappings")
        elif name == "baseline" and any(not isinstance(e.get("name"), str) for e in listed):
            yield _finding(name, listed, "a list of effects, each with its name")


def _parts(meta: Mapping[str, Any]) -> Iterator[tuple[str, Any, tuple[_Wanted, ...]]]:
    """Yield the parts of a description, their place in it, and what they must hold."""
    vehicle = meta.get("vehicle") or {}
    armed = isinstance(vehicle.get("arm"), Mapping)
    if armed:
        yield "vehicle.base", vehicle.get("base") or {}, _BODY
    elif vehicle:
        yield "vehicle", vehicle, _BODY
    for name, wanted in (("rotors", _ROTOR), ("thrusters", _THRUSTER)):
        entries = vehicle.get(name) or []
        for k, entry in enumerate(entries if isinstance(entries, list) else [entries]):
            yield f"vehicle.{name}[{k}]", entry, wanted
    if vehicle.get("hull") is not None:
        yield "vehicle.hull", vehicle["hull"], _HULL
    if meta.get("environment") is not None:
        yield "environment", meta["environment"], _AROUND
    sensors = meta.get("sensors") or {}
    channels = sensors.get("channels")
    yield "sensors.imu", sensors.get("imu") or {}, _IMU
    yield "simulated", meta.get("simulated") or {}, _STEP
    for place, table in (("sensors.channels", channels), ("tolerance", meta.get("tolerance"))):
        for name, entry in (table if isinstance(table, Mapping) else {}).items():
            known = CHANNELS.get(str(name))
            if place == "tolerance" or (known is not None and not known.aside):
                yield f"{place}.{name}", entry, _SIGMA


def _wrong(place: str, part: Any, wanted: tuple[_Wanted, ...], *, whole: bool) -> Iterator[Finding]:
    if not isinstance(part, Mapping):
        yield _finding(place, part, "a mapping of names to values")
        return
    for want in wanted:
        value = part.get(want.key)
        if value is None and not (want.needed and whole):
            continue
        try:
            given = np.asarray(value, dtype=float)
            good = given.shape == want.shape and not isinstance(value, bool)
            good = good and bool(np.isfinite(given).all())
            good = (
                good and not (want.positive and given <= 0.0) and bool((given >= want.least).all())
            )
            # turns are quaternions: one far from unit length would scale what is turned
            good = good and (want.shape != (4,) or abs(float(given @ given) - 1.0) < _UNIT)
        except (TypeError, ValueError):
            good = False
        if not good:
            yield _finding(f"{place}.{want.key}", value, _allowed(want))


def _allowed(want: _Wanted) -> str:
    if want.shape == (4,):
        return "4 numbers w, x, y, z of length 1"
    if want.least == 0.0:
        return "a number that is not below 0"
    if want.shape:
        return f"{' x '.join(map(str, want.shape))} numbers"
    return f"a number{' above 0' if want.positive else ''}"


def _finding(place: str, value: Any, allowed: str) -> Finding:
    said = "says nothing" if value is None else f"says {value!r:.60}"
    return Finding(
        severity=Severity.REFUSE,
        code="meta_wrong",
        channel=place,
        message=f"meta.yaml {said}; give {allowed}",
    )
