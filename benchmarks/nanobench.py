"""Healthy Crazyflies and a simple model: ``python -m benchmarks.nanobench DATA OUT [NAME ...]``.

DATA holds ``flights.csv`` and ``flights/``; OUT gets ``answers.csv``. Quality and clocks of every
flight come from the checks of a log; the flights that are named are converted, given a data sheet
of their own, and diagnosed (a few minutes each).
"""

from __future__ import annotations

import csv
import json
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from seals.cli.main import main as seals
from seals.errors import SealsError
from seals.logs.check import check_log
from seals.logs.check_motion import hover_ratio
from seals.logs.finding import Severity
from seals.logs.log import Log
from seals.logs.time_offset import time_offset
from seals.plugins.readers.nanobench import ReaderNanobench
from seals.robots import crazyflie

_MASS, _GRAVITY = 0.027, 9.81
_FULL = 3053.0
_SECONDS = 12.0
"""Of flight that are diagnosed."""
_ALOFT = 0.5
"""Height of flight, beyond the cushion of the ground [m]."""
_ONBOARD = ("angular_velocity", "specific_force", "motor_pwm", "battery_voltage")
_DRAG = ("linear_drag", "rotor_drag")
_LAG = ("rotor_lag", "command_delay")

Answer = tuple[str, str, str]
"""Flight, quantity, value."""


@dataclass(frozen=True, kw_only=True)
class Flight:
    """A log and what its checks say.

    Args:
        log: as read.
        bad: whether it is refused.
        late: onboard channels against the pose [s]; None where nothing tells.
    """

    log: Log
    bad: bool
    late: float | None

    @classmethod
    def of(cls, log: Log) -> Flight:
        """Return a flight with the findings of the checks of any log."""
        bad = any(one.severity is Severity.REFUSE for one in check_log(log, {}))
        offset = time_offset(log)
        return cls(log=log, bad=bad, late=None if offset is None else offset.late)

    def answers(self) -> Iterator[Answer]:
        """Yield what needs no model."""
        yield self.log.name, "log_quality", "bad" if self.bad else "good"
        if not self.bad and self.late is not None:
            yield self.log.name, "time_offset_s", f"{self.late:.4f}"


def span_of(log: Log) -> tuple[float, float]:
    """Return first and last second of the stretch of flight that is diagnosed."""
    aloft = np.flatnonzero(log.channel("position")[:, 2] > _ALOFT)
    if not aloft.size:
        return float(log.time[0]), float(log.time[-1])
    # a second after the climb
    start = float(log.time[aloft[0]]) + 2.0
    return start, min(start + _SECONDS, float(log.time[aloft[-1]]) - 1.0)


def robot_for(log: Log, place: Path) -> Path:
    """Write the simple model: the shipped Crazyflie whose thrust carries this flight.

    Mass and thrust coefficient are not asked: thrust is a constant times the squared pulse widths.
    """
    source = Path(crazyflie.__path__[0])
    stated: dict[str, Any] = yaml.safe_load((source / "robot.yaml").read_text(encoding="utf-8"))
    rotors = stated["actuators"]["rotors"]
    speeds = {f"rotor_speed_cmd_{k}": _FULL * log.columns[f"motor_pwm_{k}"] for k in (1, 2, 3, 4)}
    first, last = span_of(log)
    inside = (log.time >= first) & (log.time <= last)
    driven = Log(name=log.name, columns={**log.columns, **speeds}).select(inside)
    axes = [{"thrust_coefficient": c, "axis": [0.0, 0.0, 1.0]} for c in _each(rotors)]
    ratio = float(np.median(hover_ratio(driven, {"mass": _MASS, "rotors": axes})))
    for name in ("thrust_coefficient", "torque_coefficient"):
        rotors[name] = [float(value) / ratio for value in rotors[name]]
    place.mkdir(parents=True, exist_ok=True)
    (place / "crazyflie.urdf").write_bytes((source / stated["urdf"]).read_bytes())
    (place / "robot.yaml").write_text(yaml.safe_dump(stated), encoding="utf-8")
    return place


def _each(rotors: Mapping[str, Any]) -> list[float]:
    given = [float(value) for value in rotors["thrust_coefficient"]]
    return given * 4 if len(given) == 1 else given


def diagnosed(flight: Flight, source: Path, out: Path) -> Mapping[str, Any]:
    """Return ``diagnosis.json`` of a flight, by the commands of the own-flight tutorial.

    Raises:
        SealsError: a command refuses the flight.
    """
    name = flight.log.name
    robot, folder, answer = robot_for(flight.log, out / name / "robot"), out / name / "log", out
    first, last = span_of(flight.log)
    late = ", ".join(f"{stem}: {flight.late or 0.0:.4f}" for stem in _ONBOARD)
    answer = out / name / "answer"
    _command(
        "convert", f"log={source}", "reader=nanobench", f"robot={robot}", f"out={folder}",
        "replace=true", "rate=100", f"span=[{first:.2f},{last:.2f}]", f"late={{{late}}}",
    )  # fmt: skip
    _command("new", "datasheet", f"log={folder}", f"robot={robot}", "replace=true")
    _command("diagnose", f"log={folder}", f"robot={robot}", f"out={answer}")
    return json.loads((answer / "diagnosis.json").read_text(encoding="utf-8"))


def _command(*words: str) -> None:
    if seals(list(words)) == 2:
        raise SealsError(f"refused: seals {' '.join(words)}")


def engine_answers(name: str, found: Mapping[str, Any]) -> Iterator[Answer]:
    """Yield what a diagnosis says, effects that were fitted but not named included."""
    effects = {one["name"]: one for one in found["fitted"]}

    def value(effect: str, *parts: str) -> float:
        given = effects[effect]["parameters"]
        return float(np.mean([given[part]["value"] for part in parts]))

    if "linear_drag" in effects:
        rate = value("linear_drag", "coefficient_x", "coefficient_y") / _MASS
        yield name, "drag_rate_1_s", f"{rate:.3f}"
    elif "rotor_drag" in effects:
        # thrust stays near the weight
        yield name, "drag_rate_1_s", f"{value('rotor_drag', 'coefficient') * _GRAVITY:.3f}"
    if "battery_sag" in effects:
        yield name, "sag_k", f"{value('battery_sag', 'sensitivity'):.2f}"
    # named or not, the lag is a number of the model that was fitted
    parts = dict(zip(_LAG, ("time_constant_change", "delay"), strict=True))
    keys = (f"{e}.{p}" for e, p in parts.items() if e not in effects)
    lag = sum(value(e, p) for e, p in parts.items() if e in effects)
    lag += sum(found["nominal"][k]["value"] for k in keys if k in found["nominal"])
    yield name, "lag_s", f"{lag:.4f}"
    known = {*_DRAG, *_LAG, "battery_sag"}
    named = [one["name"] for one in found["effects"]]
    yield name, "verdict", str(found["verdict"])
    yield name, "effects", " ".join(named) or "none"
    yield name, "other_effects", " ".join(n for n in named if n not in known) or "none"


def main() -> int:
    """Print and write the answers."""
    if len(sys.argv) < 3:
        print(__doc__, file=sys.stderr)
        return 2
    folder, out, asked = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:]
    out.mkdir(parents=True, exist_ok=True)
    try:
        with (folder / "flights.csv").open(encoding="utf-8", newline="") as file:
            tables = [folder / "flights" / row["file"] for row in csv.DictReader(file)]
        rows: list[Answer] = []
        for table in tables:
            (log,) = ReaderNanobench().read(table)
            flight = Flight.of(log)
            rows += flight.answers()
            if log.name in asked and not flight.bad:
                rows += engine_answers(log.name, diagnosed(flight, table, out))
    except (SealsError, OSError, KeyError) as error:
        print(error, file=sys.stderr)
        return 2
    with (out / "answers.csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([("id", "quantity", "value"), *rows])
    for row in rows:
        print(*row, sep="  ")
    return 0


if __name__ == "__main__":
    sys.exit(main())
