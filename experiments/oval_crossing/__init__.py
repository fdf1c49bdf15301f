"""Vertical oval through the water surface, flown with a true and a wrong model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.experiments.command import markdown, show_table
from seals.experiments.flights import deviations, flown, forces, options
from seals.frames import AXES
from seals.logs import Log
from seals.report.figures import Chart, Mark, Series
from seals.report.pictures import write_picture
from seals.run.build import run_settings
from seals.run.simulation import Record

WITHIN = 0.05
"""Root mean square deviation that all flights shall keep [m]."""
LOST = 0.5
"""Deviation from which on control counts as lost [m]."""
INK = "#1b2127"
"""Colour of the course."""
SETTLED = 4.0
"""From here on the course counts: the rotors have spun up [s]."""
WEAK = ("+effect@effects.weak=thrust_coefficient", "effects.weak.relative_change=-0.05")
# 5 % of the mass, at the robot's centre of gravity with the arm stowed
HEAVY = ("+effect@effects.load=payload", "effects.load.mass=0.13", "effects.load.position_z=-0.03")
CASES: dict[str, tuple[str, ...]] = {
    "true_model": (),
    "weak_and_heavy": (*WEAK, *HEAVY),
}


class Score(NamedTuple):
    """Tracking errors of a course.

    Args:
        rms: root mean square deviation [m].
        largest: deviation [m].
        axes: root mean square deviation along x, y and z [m], shape (3,).
        laps: laps flown without losing control.
        jump: largest change of the vertical specific force within 0.1 s near the surface [m/s^2].
    """

    rms: float
    largest: float
    axes: Floats
    laps: int
    jump: float


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the experiment from the command line; 0 when all bounds are kept."""
    out, overrides = options("oval_crossing", arguments)
    records = flown(out, "oval_crossing", {n: [*w, *overrides] for n, w in CASES.items()})
    guide = run_settings(["experiment=oval_crossing", *overrides]).guide
    found = {name: score(record.log, guide) for name, record in records.items()}
    show_table(out, _table(found))
    write_picture(out / "figure.png", _figures(records, guide))
    ledger = records["true_model"].ledger
    write_picture(out / "ledger.png", [forces(ledger, 2, "Forces along z of the body, all laps")])
    good = all(s.rms <= WITHIN and s.laps >= guide.laps for s in found.values())
    return 0 if good else 1


def course(log: Log, guide: Any) -> Floats:
    """Return the reference positions [m], shape (rows, 3)."""
    return np.array([guide.place(float(t)).position for t in log.time])


def score(log: Log, guide: Any) -> Score:
    """Return the tracking errors of a guide's course."""
    away = log.channel("position") - course(log, guide)
    far = np.linalg.norm(away, axis=1)
    counts = log.time >= SETTLED
    lost = log.time[counts & (far > LOST)]
    flown_until = float(lost[0]) if lost.size else float(log.time[-1])
    # a soft start covers half a lap's pace: the last lap ends one soft start early
    laps = int((flown_until - guide.start_time + 1e-6) / guide.period)
    # largest change of the vertical acceleration within 0.1 s while it pierces the surface
    rise, step = _upward(log), float(np.median(np.diff(log.time)))
    span = max(1, round(0.1 / step))
    change = np.abs(rise[span:] - rise[:-span])
    near = np.abs(log.channel("position")[span:, 2]) < 0.15
    near &= log.time[span:] > SETTLED
    return Score(
        rms=float(np.sqrt(np.mean(far[counts] ** 2))),
        largest=float(far[counts].max()),
        axes=np.sqrt(np.mean(away[counts] ** 2, axis=0)),
        laps=min(laps, guide.laps),
        jump=float(change[near].max(initial=0.0)),
    )


def _table(found: dict[str, Score]) -> str:
    """Return the scores as a table in Markdown."""
    head = [
        "case",
        "rms [mm]",
        "largest [mm]",
        *(f"rms {a} [mm]" for a in AXES),
        "laps",
        "jump [m/s²]",
    ]
    rows = []
    for name, s in found.items():
        axes = [f"{1e3 * x:.1f}" for x in s.axes]
        whole = [f"{1e3 * s.rms:.1f}", f"{1e3 * s.largest:.1f}"]
        rows.append([name, *whole, *axes, str(s.laps), f"{s.jump:.2f}"])
    return markdown(head, [*rows, ["bound", f"{1e3 * WITHIN:g}", "", "", "", "", "20", ""]])


def _figures(records: dict[str, Record], guide: Any) -> list[Chart]:
    """Return the path from the side, deviations, and the acceleration through one lap."""
    log = records["true_model"].log
    wanted = course(log, guide)
    path = []
    for name, record in records.items():
        place = record.log.channel("position")
        path.append(Series(name=name.replace("_", " "), x=place[:, 0], y=place[:, 2]))
    # last: the flights would hide it
    path.append(Series(name="course", x=wanted[:, 0], y=wanted[:, 2], dashed=True, colour=INK))
    side = Chart(
        title="From the side",
        x_label="x [m]",
        y_label="z [m]",
        series=tuple(path),
        marks=(Mark(at=0.0, label="water", level=True),),
        equal=True,
    )
    away = []
    for name, record in records.items():
        lap = record.log.select(_one_lap(record.log.time, guide))
        away.append(deviations(lap, course(lap, guide), f"{name}, one lap"))
    return [side, *away, _acceleration(log, guide)]


def _one_lap(time: Floats, guide: Any) -> slice:
    """Return the rows of the second lap, or of the only one."""
    begin = guide.start_time + (guide.period if guide.laps > 1 else 0.0)
    first, last = np.searchsorted(time, [begin, begin + guide.period])
    return slice(int(first), int(last))


def _acceleration(log: Log, guide: Any) -> Chart:
    """Return the vertical acceleration in the world through the same lap."""
    rows = _one_lap(log.time, guide)
    time, height = log.time[rows], log.channel("position")[rows, 2]
    crossing = time[1:][np.diff(np.sign(height)) != 0.0]
    marks = tuple(Mark(at=float(t), label="surface") for t in crossing)
    rise = Series(name="vertical acceleration [m/s²]", x=time, y=_upward(log)[rows])
    wet = Series(name="height of the body [m]", x=time, y=height)
    label = "acceleration [m/s²], height [m]"
    title = "Through the surface and back"
    return Chart(title=title, y_label=label, series=(rise, wet), marks=marks)


def _upward(log: Log) -> Floats:
    """Vertical acceleration of the body's origin from its velocity, smoothed over 20 ms."""
    speed = np.gradient(log.channel("position")[:, 2], log.time)
    rise = np.gradient(speed, log.time)
    return np.convolve(rise, np.ones(5) / 5.0, mode="same")
