"""Reader of Crazyflie micro-SD logs, the published flights among them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError, suggestion
from seals.field_roles import roles
from seals.logs.datasets import Dataset, read_dataset
from seals.logs.log import Log
from seals.logs.units import STANDARD_GRAVITY, to_si
from seals.plugins.readers.crazyflie_log import parse
from seals.plugins.readers.published import ReaderPublished
from seals.untrusted_io import read_bytes

DATASET = read_dataset("seals.plugins.readers", "crazyflie-sysid")
_FULL_PWM = 65535.0
_MOST_BYTES = 1 << 25
_COLUMNS = {
    **{f"acc.{axis}": (f"specific_force_{axis}", "g") for axis in "xyz"},
    **{f"gyro.{axis}": (f"angular_velocity_{axis}", "deg/s") for axis in "xyz"},
    **{f"motor.m{k}": (f"motor_pwm_{k}", "pwm") for k in (1, 2, 3, 4)},
}


@roles(data="event allow_truncated")
@dataclass(kw_only=True)
class ReaderCrazyflie(ReaderPublished):
    """Flights of a 27 g quadrotor, recorded on board; one log for each file.

    Channels:
        ``specific_force_x/y/z``, ``angular_velocity_x/y/z``, ``motor_pwm_1..4``.
    Units:
        g -> m/s^2 with 9.80665, deg/s -> rad/s, 16-bit pulse width -> share of full.
    Source:
        https://github.com/arplaboratory/data-driven-system-identification, 3 flights of 47 to 62 s
        at about 1.01 kHz with rest, take-off, landing and crashes.
    Licence:
        MIT.
    Limitations:
        No position, no attitude, no battery voltage: thrust at one pulse width falls as the battery
        empties, and nothing in the log tells. Rotor speeds are not measured.

    Args:
        path: a log file, a folder that holds the published ones, or the name of one of them.
        event: the event block to read; empty takes the one with the accelerometer.
        allow_truncated: whether a file that was cut short is read up to the cut.
    """

    dataset: ClassVar[Dataset] = DATASET

    event: str = ""
    allow_truncated: bool = False

    def log_of(self, path: Path) -> Log:
        """Return one flight."""
        content = read_bytes(path, most=_MOST_BYTES)
        events = parse(content, where=str(path), allow_truncated=self.allow_truncated)
        found = {name: event for name, event in events.items() if "acc.z" in event}
        name = self.event or next(iter(found), "")
        if name not in events:
            what = f"event '{name}'" if name else "event with an accelerometer (acc.z)"
            raise LogError(f"'{path}' has no {what}.\n" + suggestion(name, events, label="Events"))
        time = events[name]["t"]
        rate = float(1.0 / np.median(np.diff(time))) if time.size > 1 else 0.0
        # standard deviations at rest with the motors off; in flight vibration adds to them
        force = {"sigma": 0.0011 * STANDARD_GRAVITY, "rate": rate, "unit": "m/s^2"}
        turn = {"sigma": 0.0021, "rate": rate, "unit": "rad/s"}
        channels = {"specific_force": force, "angular_velocity": turn}
        meta = {"sensors": {"channels": channels}}
        return self.described(path.name, _columns(events[name]), of=path, meta=meta)


def _columns(event: dict[str, Floats]) -> dict[str, Floats]:
    columns = {"t": event["t"]}
    for theirs, values in event.items():
        ours, unit = _COLUMNS.get(theirs, (theirs.replace(".", "_"), ""))
        if unit == "pwm":
            columns[ours] = values / _FULL_PWM
        elif theirs != "t":
            columns[ours] = to_si(values, unit) if unit else values
    return columns
