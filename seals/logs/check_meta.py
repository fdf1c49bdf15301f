"""Check of the vehicle's entries in ``meta.yaml``: types and physical ranges."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, NamedTuple

from seals.errors import ConfigError
from seals.logs.channels import CHANNELS
from seals.logs.finding import Finding, Severity
from seals.logs.log import Log
from seals.schema import Within, plain, read, words

_Positive = Annotated[float, Within(0.0, math.inf, above=True)]
_Level = Annotated[float, Within(0.0, math.inf)]
_Three = tuple[float, float, float]
_Matrix = tuple[_Three, _Three, _Three]
_Turn = tuple[float, float, float, float]
_Part = Mapping[str, Any]


class _Named(NamedTuple):
    """Entry of a list in which each has its name."""

    name: str


_BODY = {"mass": _Positive, "inertia": _Matrix, "centre_of_gravity": _Three}
_ROTOR = {
    "position": _Three,
    "axis": _Three,
    "direction": float,
    "thrust_coefficient": _Positive,
    "torque_coefficient": float,
    "time_constant": _Positive,
    "radius": _Positive,
    "max_speed": _Positive,
}
_THRUSTER = {
    "position": _Three,
    "axis": _Three,
    "time_constant": _Positive,
    "max_force": _Positive,
}
_HULL = {"displaced_volume": _Positive, "centre_of_buoyancy": _Three, "plan_area": _Positive}
_SIGMA = {"sigma": _Positive}
_GUSTS = {"force_sigma": _Level, "torque_sigma": _Level, "correlation_time": _Positive}
_AROUND = {"gravity": _Three, "air_density": _Positive, "water_density": _Positive}
_IMU = {"position": _Three, "orientation": _Turn}
_STEP = {"step": _Positive}
_MAY_LACK = (_AROUND, _IMU, _STEP)
"""Parts whose entries may be left out of a whole description, too."""
_UNIT = 0.05
"""Largest miss of the square of a quaternion's length."""
_SECTIONS = {
    **dict.fromkeys(("vehicle", "environment", "sensors", "tolerance"), _Part),
    **dict.fromkeys(("disturbance", "battery", "simulated"), _Part),
    "baseline": Sequence[_Named],
    "initial_state": Sequence[_Part],
}
"""Kinds that every reader of the sections takes for granted."""


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


def _misshapen(meta: Mapping[str, Any]) -> Iterator[Finding]:
    """Yield sections that are of another kind than every reader of them takes for granted."""
    sensors, gusts = meta.get("sensors"), meta.get("disturbance")
    channels = sensors.get("channels") if isinstance(sensors, Mapping) else None
    given = [(name, kind, meta.get(name)) for name, kind in _SECTIONS.items()]
    for place, kind, value in (*given, ("sensors.channels", Mapping[str, _Part], channels)):
        if value is not None:
            yield from _refused(place, value, kind)
    if isinstance(gusts, Mapping):
        yield from _wrong("disturbance", gusts, _GUSTS, whole=False)


def _parts(meta: Mapping[str, Any]) -> Iterator[tuple[str, Any, dict[str, Any]]]:
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


def _wrong(place: str, part: Any, wanted: dict[str, Any], *, whole: bool) -> Iterator[Finding]:
    if not isinstance(part, Mapping):
        yield _finding(place, part, words(_Part))
        return
    for key, kind in wanted.items():
        value = part.get(key)
        if value is not None or (whole and wanted not in _MAY_LACK):
            yield from _refused(f"{place}.{key}", value, kind)


def _refused(place: str, value: Any, kind: Any) -> Iterator[Finding]:
    """Yield a value that is not of its kind; turns are quaternions of length 1."""
    try:
        found = read(kind, plain(value), where=place, extra=True)
    except ConfigError:
        yield _finding(place, value, words(kind))
        return
    # one far from unit length would scale what is turned
    if kind is _Turn and not abs(sum(x * x for x in found) - 1.0) < _UNIT:
        yield _finding(place, value, "4 numbers w, x, y, z of length 1")


def _finding(place: str, value: Any, allowed: str) -> Finding:
    said = "says nothing" if value is None else f"says {value!r:.60}"
    return Finding(
        severity=Severity.REFUSE,
        code="meta_wrong",
        channel=place,
        message=f"meta.yaml {said}; give {allowed}",
    )
