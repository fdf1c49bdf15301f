"""Drop test: the manipulator falls from 1 m into water, motors off, and sinks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from seals.arrays import Floats
from seals.experiments.command import figure_table, folder_of, parser_of, show_table
from seals.experiments.fetching import vertical
from seals.experiments.frames import View, draw_frames, write_sheet
from seals.logs import Log
from seals.report.figures import Mark, lines
from seals.report.pictures import write_picture
from seals.run.application import run_into
from seals.run.build import run_settings

OVERRIDES = (
    "experiment=drop_test",
    "robot=aam",
    "name=drop_test_aam",
    "environment.tank_bottom=-1.5",
    "environment.friction=0.8",
    "initial.joint_position=[0,0,0,-0.6,-0.6,-0.6]",
    "time.duration=8",
    # the peak of the entry is within 3 % of that at 0.5 ms
    "time.step=0.001",
)
"""The drop test of the ball, with the manipulator over deeper water."""

PARTICLES = (
    "experiment=drop_test",
    "robot=aam",
    "water=particles",
    "name=drop_test_particles",
    "environment.tank_bottom=-0.5",
    "environment.friction=0.8",
    "initial.joint_position=[0,0,0,-0.6,-0.6,-0.6]",
    "+effect@effects.load=payload",
    "effects.load.mass=1.5",
    "fluid.spacing=0.03",
    "fluid.size=[0.78,0.78,0.5]",
    "fluid.freeboard=1.0",
    "time.duration=4",
    "time.step=0.004",
)
"""The same, with 1.5 kg on board, over a shallow tank of particles."""

LINKS = (
    "body",
    "upper",
    "fore",
    "palm",
    *(f"{p}_{k}" for p in ("finger", "tip") for k in (1, 2, 3)),
)
"""Links that can touch the floor."""
FELT = tuple(
    word
    for link in LINKS
    for word in (
        f"+sensor@sensors.floor_{link}=contact",
        f"sensors.floor_{link}.link={link}",
        f"sensors.floor_{link}.noise=0",
        f"sensors.floor_{link}.largest=10000",
    )
)
"""Every link feels what presses on it: over the floor, that is the floor."""

SMOOTH = 0.012
"""Time over which the felt force is averaged before its peak is measured [s]."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the experiment from the command line."""
    parser = parser_of("drop_test")
    parser.add_argument("--water", choices=("fossen", "particles"), default="fossen")
    given = parser.parse_args(arguments)
    out = folder_of(given, "drop_test_aam")
    words = [*(PARTICLES if given.water == "particles" else OVERRIDES), *FELT, *given.overrides]
    settings = run_settings(words)
    record = run_into(out, settings, overrides=words)
    bottom = settings.environment.tank_bottom or 0.0
    floor = pressed(record.log)
    flown = record.log.columns
    z = flown["position_z"]
    speed = np.gradient(z, record.log.time)
    wet = int(np.argmax(z < 0.0))
    under = (z < -0.3) & (z > -1.0)
    push = held(flown["specific_force_z"])
    found = (
        {
            "time until the body's origin is under water [s]": float(record.log.time[wet]),
            "largest speed [m/s]": float(-speed.min()),
            "largest specific force along body z [m/s^2]": float(push.max()),
            "mean speed between 0.3 and 1 m under water [m/s]": float(-speed[under].mean())
            if under.any()
            else 0.0,
            "height at the end [m]": float(z[-1]),
            "speed at the end [m/s]": float(abs(speed[-1])),
        }
    ) | landing(record.log, floor)
    if record.fluid:
        figures = record.fluid
        names = {
            "particles": "particles [1]",
            "mean compression [1]": "largest mean compression [1]",
            "momentum balance gap [1]": "largest gap of momentum in a step [1]",
        }
        found |= entry(record.log, record.ledger.of("particles")) | {
            words: float(np.nanmax(figures[name])) for name, words in names.items()
        }
    show_table(out, figure_table(found))
    marks = (Mark(at=0.0, label="water", level=True), Mark(at=bottom, label="bottom", level=True))
    log = record.log
    carried = lines("What the floor carried", "force [N]", log.time, {"floor": floor})
    named = {"x": "specific_force_x", "y": "specific_force_y", "z": "specific_force_z"}
    force = {key: held(log.columns[name]) for key, name in named.items()}
    write_picture(
        out / "figure.png",
        [
            lines("Height", "z [m]", log.time, {"body": log.columns["position_z"]}, marks=marks),
            lines("What the inertial sensor felt", "specific force [m/s²]", log.time, force),
            carried,
        ],
    )
    body = vertical(record.ledger, 0, "body of the manipulator")
    write_picture(out / "ledger.png", [body, carried])
    times = {f"{t:g} s": t for t in (0.0, 0.3, 0.5, 0.8, 1.5, 3.0, 5.0) if t < log.time[-1]}
    times[f"{log.time[-1]:g} s"] = float(log.time[-1])
    pictures = draw_frames(log, settings, list(times.values()), View(pitch=-6.0))
    write_sheet(out / "stages.png", dict(zip(times, pictures, strict=True)))
    return 0


def pressed(log: Log) -> Floats:
    """Return the normal force of the floor on the whole robot [N], shape (rows,)."""
    # the sensor of the base has the log's own names
    names = [n for n in log.columns if n.endswith("pressing")]
    rows = [held(log.columns[n]) for n in names]
    return np.sum(rows, axis=0) if rows else np.zeros(len(log.time))


def held(readings: Floats) -> Floats:
    """Return readings held until the next one, zero before the first, shape (rows,).

    Example:
        >>> held(np.array([np.nan, 2.0, np.nan, 3.0])).tolist()
        [0.0, 2.0, 2.0, 3.0]
    """
    last = np.maximum.accumulate(np.where(np.isfinite(readings), np.arange(len(readings)), -1))
    return np.where(last >= 0, readings[last], 0.0)


def landing(log: Log, floor: Floats) -> dict[str, float]:
    """Return time and force of the impact on the floor, and the final load; empty if none.

    Fingers press on each other, too: a contact counts as the floor's once it holds for 20 ms.

    Args:
        log: of the drop.
        floor: normal force [N], shape (rows,).
    """
    step = float(log.time[1] - log.time[0])
    width = max(1, round(0.02 / step))
    holds = np.convolve(floor > 0.5, np.ones(width), mode="full")[width - 1 :] >= width
    if not holds.any():
        return {}
    met = int(np.argmax(holds))
    late = log.time > log.time[-1] - 0.2
    return {
        "first contact with the floor [s]": float(log.time[met]),
        "largest force of the floor [N]": float(floor.max()),
        "carried by the floor in the last 0.2 s, mean [N]": float(floor[late].mean()),
    }


def entry(log: Log, pushed: Floats) -> dict[str, float]:
    """Return the times of contact with water and floor, and the length of the entry spike.

    Args:
        log: of the drop.
        pushed: wrenches of the water on all links, shape (rows, links, 6).
    """
    rows = len(log.time)
    force = np.linalg.norm(pushed[:rows, :, :3].sum(axis=1), axis=1)
    touch = int(np.argmax(force > 1.0))
    step = float(log.time[1] - log.time[0])
    felt = np.linalg.norm([held(log.columns[f"specific_force_{a}"]) for a in "xyz"], axis=0)
    width = max(1, round(SMOOTH / step))
    smooth = np.convolve(felt, np.full(width, 1.0 / width), mode="same")
    window = slice(touch, touch + round(0.6 / step))
    peak = touch + int(np.argmax(smooth[window]))
    above = smooth > 0.5 * smooth[peak]
    first, last = peak, peak
    while first > 0 and above[first - 1]:
        first -= 1
    while last + 1 < rows and above[last + 1]:
        last += 1
    return {
        "first touch of the water [s]": float(log.time[touch]),
        "peak of the entry [s]": float(log.time[peak]),
        "peak of the felt force [m/s^2]": float(smooth[peak]),
        "duration of the spike at half height [s]": float(log.time[last] - log.time[first]),
    }
