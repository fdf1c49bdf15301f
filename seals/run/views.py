"""Charts of one run: motion, loads, inertial readings, joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from seals.arrays import Floats
from seals.effects.effect import EffectOptions, MediumKind
from seals.frames import AXES, rotation_vector
from seals.logs import Log
from seals.plugin_options import options_of
from seals.report.figures import ROUNDING, Chart, Mark, Series, lines, without_rounding
from seals.report.style import colours_of
from seals.run.settings import RunSettings
from seals.run.simulation import Record
from seals.world.ledger import COMPONENTS

_SMALL = 1e-6
"""Share of the largest load below which an axis is not worth a chart."""
STILL_DEGREES, STILL_METRES = 0.05, 0.01
"""Changes of attitude and of place below which there is nothing to show."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Views:
    """Charts of a run by subject; empty where the run lacks a subject."""

    motion: list[Chart]
    loads: list[Chart]
    further_loads: dict[str, list[Chart]]
    imu: list[Chart]
    joints: list[Chart]


def views_of(record: Record, settings: RunSettings) -> Views:
    """Return all charts of a run."""
    touch = first_touch(record, settings)
    marks = () if touch is None else (Mark(at=touch, label="touches water"),)
    colours = colours_of(list(record.ledger.effects))
    loads = {
        name: _loads(record, link, colours, marks) for link, name in enumerate(record.robot.links)
    }
    base = record.robot.links[0]
    return Views(
        motion=_motion(record.log, settings, marks),
        loads=loads.pop(base),
        further_loads={name: charts for name, charts in loads.items() if charts},
        imu=_imu(record.log, marks),
        joints=_joints(record, marks),
    )


def first_touch(record: Record, settings: RunSettings) -> float | None:
    """Return the time at which an effect of the water first acts [s], or None."""
    ledger = record.ledger
    wet = [
        name
        for name in ledger.effects
        if name in settings.effects
        and options_of(settings.effects[name], EffectOptions).medium is MediumKind.water
    ]
    acting = np.zeros(ledger.rows, dtype=bool)
    for name in wet:
        acting |= np.any(ledger.of(name) != 0.0, axis=(1, 2))
    return float(ledger.time[int(np.argmax(acting))]) if acting.any() else None


def _motion(log: Log, settings: RunSettings, marks: tuple[Mark, ...]) -> list[Chart]:
    e = settings.environment
    level_words = {"water": e.water_level, "ground": e.ground_level, "bottom": e.tank_bottom}
    position = _named(log, "position")
    # a level far from the motion would press the curves flat
    z = position["z"][np.isfinite(position["z"])]
    low, high = (float(z.min()), float(z.max())) if z.size else (0.0, 0.0)
    reach = 2.0 * (high - low) + 0.1
    levels = tuple(
        Mark(at=at, label=word, level=True)
        for word, at in level_words.items()
        if at is not None and low - reach < at < high + reach
    )
    place = log.channel("position")
    above: list[Chart] = []
    if np.nanmax(np.ptp(place[:, :2], axis=0)) > STILL_METRES:
        path = Series(name="path", x=place[:, 0], y=place[:, 1])
        start = Series(name="start", x=place[:1, 0], y=place[:1, 1], points=True)
        above += [
            Chart(
                title="Path from above",
                x_label="x, east [m]",
                y_label="y, north [m]",
                series=(path, start),
                equal=True,
            )
        ]
    names = list(log.meta.get("objects", {}))
    columns = {name: log.columns[f"object_{name}_position_z"] for name in names}
    around, title = (*marks, *levels), "Heights of the objects"
    heights = [lines(title, "height [m]", log.time, columns, marks=around)] if columns else []
    return [
        lines("Position in the world", "position [m]", log.time, position, marks=(*marks, *levels)),
        lines(
            "Velocity, body axes", "velocity [m/s]", log.time, _named(log, "velocity"), marks=marks
        ),
        *_attitude(log, marks),
        *above,
        *heights,
    ]


def _attitude(log: Log, marks: tuple[Mark, ...]) -> list[Chart]:
    """Attitude over time; empty where it does not change."""
    turn = log.channel("orientation")[:, [1, 2, 3, 0]]
    angle = np.degrees(rotation_vector(np.nan_to_num(turn)))
    if np.ptp(angle, axis=0).max() < STILL_DEGREES:
        return []
    # the shorter way round changes sides at half a turn: a gap is truer than a vertical line
    angle[1:][np.abs(np.diff(angle, axis=0)).max(axis=1) > 90.0] = np.nan
    note = "Rotation vector (axis times angle) from world to body axes, by the smaller angle."
    label = "rotation vector [deg]"
    return [lines("Attitude", label, log.time, _columns(angle), marks=marks, note=note)]


def _loads(
    record: Record, link: int, colours: dict[str, str], marks: tuple[Mark, ...]
) -> list[Chart]:
    """One stacked chart for each component of force and torque that matters on a link."""
    ledger, name = record.ledger, record.robot.links[link]
    if not ledger.rows:
        return []
    table = ledger.wrenches[:, :, link]
    with np.errstate(invalid="ignore"):
        peaks = np.nanmax(np.abs(table), axis=(0, 1), initial=0.0)
    largest = np.array([peaks[:3].max()] * 3 + [peaks[3:].max()] * 3)
    charts = []
    for c, component in enumerate(COMPONENTS):
        if not peaks[c] > max(_SMALL * largest[c], ROUNDING):
            continue
        kind, axis = component.split("_")
        acting = tuple(
            Series(name=effect, x=ledger.time, y=table[:, e, c], colour=colours[effect])
            for e, effect in enumerate(ledger.effects)
            if np.any(table[:, e, c] != 0.0)
        )
        unit = "N" if kind == "force" else "N m"
        title = (
            f"{kind.capitalize()} along {axis} of {name}"
            if kind == "force"
            else f"Torque about {axis} of {name}"
        )
        charts.append(
            Chart(title=title, y_label=f"{kind} [{unit}]", series=acting, stacked=True, marks=marks)
        )
    return charts


def _imu(log: Log, marks: tuple[Mark, ...]) -> list[Chart]:
    charts = []
    for stem, unit in (("specific_force", "m/s²"), ("angular_velocity", "rad/s")):
        values, words = log.channel(stem), stem.replace("_", " ")
        # rows without a sample are left out: a slow sensor's readings are joined by lines
        there = np.isfinite(values).any(axis=1)
        exact = stem in log.meta.get("known_exactly", [])
        charts.append(
            lines(
                f"{words.capitalize()}, body axes",
                f"{words} [{unit}]",
                log.time[there],
                _columns(values[there]),
                marks=marks,
                note="Exact values: no sensor measures it." if exact else "Sensor readings.",
            )
        )
    return charts


def _joints(record: Record, marks: tuple[Mark, ...]) -> list[Chart]:
    log, names = record.log, record.robot.joints
    if not names:
        return []
    charts = []
    for stem, title, unit in (
        ("joint_position", "Joint positions", "rad or m"),
        ("joint_velocity", "Joint rates", "rad/s or m/s"),
    ):
        columns = dict(zip(names, log.channel(stem).T, strict=True))
        charts.append(lines(title, f"{title.lower()} [{unit}]", log.time, columns, marks=marks))
    return charts


def _named(log: Log, stem: str) -> dict[str, Floats]:
    return _columns(log.channel(stem))


def _columns(values: Floats) -> dict[str, Floats]:
    return {axis: without_rounding(values[:, k]) for k, axis in enumerate(AXES)}
