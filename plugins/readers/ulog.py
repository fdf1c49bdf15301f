"""Reader of ULog files, the flight logs of PX4."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import LogError, refuse_unlisted
from seals.logs.log import Log
from seals.logs.merge import Stream
from seals.plugins.readers.ned import enu, flu, flu_in_enu, in_body, orientation
from seals.plugins.readers.streams import ReaderTopics, vector
from seals.plugins.readers.ulog_file import Samples, parse
from seals.untrusted_io import read_bytes

_GAUSS = 1e-4
_NO_OFFSET = 0x7FFFFFFF
_RPM = 2.0 * np.pi / 60.0


@dataclass(kw_only=True)
class ReaderUlog(ReaderTopics):
    """Flight logs of PX4 (``.ulg``): known topics automatically, other fields by a map.

    Channels:
        ``sensor_combined`` (else ``vehicle_angular_velocity``, ``vehicle_acceleration``),
        ``vehicle_attitude``, ``vehicle_local_position``, ``battery_status``, ``actuator_motors``,
        ``actuator_outputs``, ``esc_status``, ``vehicle_magnetometer``; others by ``columns``.
    Units:
        Body forward-right-down and world north-east-down become FLU and ENU; gauss, rpm and
        microseconds become SI. The velocity is turned into body axes with the attitude of the log.
    Limitations:
        ``motor_pwm`` is the wanted share of thrust that ``actuator_motors`` holds; of firmware
        before 1.13 the pulse widths of ``actuator_outputs``. A robot's rotors make speeds of them.
        Pose and velocity are those of the autopilot's own filter, with its lag. The body origin is
        that of the autopilot's frame: state the centre of gravity in ``meta``.

    Args:
        topics: known topics to read; empty for all.
        columns: ``TOPIC/FIELD`` (``esc_status/esc[0].esc_rpm``; ``TOPIC:1/FIELD`` for a second
            instance) -> column of the log.
    """

    kind: ClassVar[str] = "ULog"

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return the one log of the file.

        Raises:
            LogError: nothing was given, or the file cannot be used.
        """
        given, chosen = self.given(source), self.chosen()
        where = str(given)
        samples = {
            (topic if instance == 0 else f"{topic}:{instance}"): found
            for (topic, instance), found in parse(read_bytes(given), where=where).items()
        }
        shares = {"motor_command": "thrust_share"} if "actuator_motors" in samples else {}
        return [
            self.log_of(
                given,
                samples,
                chosen,
                field_of=lambda topic, name: _column(samples[topic], name, topic),
                stamps_of=lambda topic: _stamps(samples[topic]),
                known={
                    topic: partial(make, all_samples=samples) for topic, make in _TOPICS.items()
                },
                meta=shares,
            )
        ]


def _stamps(samples: Samples) -> NDArray[np.int64]:
    return samples["timestamp"].astype(np.int64)


def _column(samples: Samples, name: str, topic: str) -> Floats:
    names = samples.dtype.names or ()
    refuse_unlisted(name, names, f"'{topic}' has no field '{name}'", error=LogError)
    return samples[name].astype(np.float64)


def _triple(samples: Samples, name: str, topic: str) -> Floats:
    """Return a body vector of three fields, from FRD to FLU."""
    return flu(*(_column(samples, f"{name}[{k}]", topic) for k in range(3)))


def _combined(topic: str, all_samples: dict[str, Samples]) -> list[Stream]:
    samples = all_samples[topic]
    stamps = _stamps(samples)
    gyro = _triple(samples, "gyro_rad", topic)
    streams = [Stream(name=topic, stamps=stamps, columns=vector("angular_velocity", gyro))]
    later = np.zeros(stamps.size, dtype=np.int64)
    there = np.ones(stamps.size, dtype=bool)
    if "accelerometer_timestamp_relative" in (samples.dtype.names or ()):
        later = samples["accelerometer_timestamp_relative"].astype(np.int64)
        there = later != _NO_OFFSET
    force = _triple(samples, "accelerometer_m_s2", topic)[there]
    columns = vector("specific_force", force)
    return [*streams, Stream(name=f"{topic} ", stamps=(stamps + later)[there], columns=columns)]


def _body(stem: str, name: str, scale: float = 1.0) -> Callable[..., list[Stream]]:
    def make(topic: str, all_samples: dict[str, Samples]) -> list[Stream]:
        samples = all_samples[topic]
        columns = vector(stem, scale * _triple(samples, name, topic))
        return [Stream(name=topic, stamps=_stamps(samples), columns=columns)]

    return make


def _attitude(topic: str, all_samples: dict[str, Samples]) -> list[Stream]:
    samples = all_samples[topic]
    columns = orientation(_turned(samples, topic))
    return [Stream(name=topic, stamps=_stamps(samples), columns=columns)]


def _turned(samples: Samples, topic: str) -> Floats:
    return flu_in_enu(*(_column(samples, f"q[{k}]", topic) for k in range(4)))


def _place(topic: str, all_samples: dict[str, Samples]) -> list[Stream]:
    samples = all_samples[topic]
    stamps = _stamps(samples)
    x, y, z, vx, vy, vz = (
        np.where(_valid(samples, flag), _column(samples, name, topic), np.nan)
        for name, flag in (
            ("x", "xy_valid"), ("y", "xy_valid"), ("z", "z_valid"),
            ("vx", "v_xy_valid"), ("vy", "v_xy_valid"), ("vz", "v_z_valid"),
        )
    )  # fmt: skip
    columns = vector("position", enu(x, y, z))
    attitude = all_samples.get("vehicle_attitude")
    if attitude is not None:
        q = _turned(attitude, "vehicle_attitude")
        columns |= vector("velocity", in_body(enu(vx, vy, vz), stamps, _stamps(attitude), q))
    return [Stream(name=topic, stamps=stamps, columns=columns)]


def _valid(samples: Samples, flag: str) -> Any:
    return samples[flag] != 0 if flag in (samples.dtype.names or ()) else True


def _battery(topic: str, all_samples: dict[str, Samples]) -> list[Stream]:
    samples = all_samples[topic]
    columns = {}
    for column, name in (
        ("battery_voltage", "voltage_v"),
        ("battery_current", "current_a"),
        ("battery_charge", "remaining"),
    ):
        if name in (samples.dtype.names or ()):
            values = _column(samples, name, topic)
            # -1 stands for unknown
            columns[column] = np.where(values >= 0.0, values, np.nan)
    return [Stream(name=topic, stamps=_stamps(samples), columns=columns)]


def _numbered(stem: str, pattern: str, scale: float = 1.0) -> Callable[..., list[Stream]]:
    def make(topic: str, all_samples: dict[str, Samples]) -> list[Stream]:
        samples = all_samples[topic]
        names = samples.dtype.names or ()
        there = [k for k in range(16) if pattern.format(k) in names]
        found = {k: scale * _column(samples, pattern.format(k), topic) for k in there}
        # slots that nothing is connected to hold zero or NaN throughout
        used = [k for k, values in found.items() if np.any(np.nan_to_num(values) != 0.0)]
        columns = {f"{stem}_{k + 1}": found[k] for k in used}
        return [Stream(name=topic, stamps=_stamps(samples), columns=columns)]

    return make


def _outputs(topic: str, all_samples: dict[str, Samples]) -> list[Stream]:
    """Pulse widths of the motors, unless newer firmware logs the motors' thrust fractions."""
    if "actuator_motors" in all_samples:
        return []
    return _numbered("motor_pwm", "output[{}]")(topic, all_samples)


_TOPICS: dict[str, Callable[..., list[Stream]]] = {
    "sensor_combined": _combined,
    "vehicle_angular_velocity": _body("angular_velocity", "xyz"),
    "vehicle_acceleration": _body("specific_force", "xyz"),
    "vehicle_attitude": _attitude,
    "vehicle_local_position": _place,
    "battery_status": _battery,
    "actuator_motors": _numbered("motor_pwm", "control[{}]"),
    "actuator_outputs": _outputs,
    "esc_status": _numbered("rotor_speed", "esc[{}].esc_rpm", _RPM),
    "vehicle_magnetometer": _body("magnetic_field", "magnetometer_ga", _GAUSS),
}
"""Known topics, the preferred one first where two give the same channel."""
