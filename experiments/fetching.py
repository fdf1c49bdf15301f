"""Base of the experiments that fetch an object: one run, success criteria, pictures."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from seals.arrays import Floats
from seals.experiments.command import folder_of, markdown, parser_of
from seals.experiments.frames import View, draw_frames, stage_times, write_sheet
from seals.experiments.trials import Outcome, run_trials, summary
from seals.logs import Log
from seals.report.figures import Chart, Mark, Series, lines
from seals.report.pictures import write_picture
from seals.run.application import run_into
from seals.run.build import run_settings
from seals.run.settings import RunSettings
from seals.run.simulation import Ending, Record, simulate
from seals.world.ledger import Ledger

Judge = Callable[[Record], Outcome]
Vary = Callable[[int], list[str]]


def command_line(
    name: str, vary: Vary, judge: Judge, arguments: Sequence[str] | None = None
) -> int:
    """Run one experiment: one run with pictures, or many seeds with a table.

    Args:
        name: of the experiment.
        vary: overrides of a seed.
        judge: says how a run ended.
        arguments: of the command line.

    Returns:
        An exit code: 0 when a single run, or nine in ten of the seeds, succeeded.
    """
    parser = parser_of(name)
    parser.add_argument("--seeds", type=int, default=0, help="run so many seeds; 0: one run")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    given = parser.parse_args(arguments)
    out = folder_of(given, name)

    def words(seed: int) -> list[str]:
        return [f"experiment={name}", f"seed={seed}", *vary(seed), *given.overrides]

    if given.seeds == 0:
        return _single(out, words(given.first), judge)
    table, seeds = out / "trials.csv", range(given.first, given.first + given.seeds)
    rows = run_trials(table, seeds, words, lambda w: judge(simulate(run_settings(w))))
    good = sum(1 for row in rows if row["success"] == "1")
    print(f"{name}: {summary(rows)}; {table}")
    return 0 if good >= 0.9 * len(rows) else 1


def _single(out: Path, words: list[str], judge: Judge) -> int:
    """Run once with all pictures in the run's folder."""
    settings = run_settings(words)
    record = run_into(out, settings, overrides=words)
    outcome = judge(record)
    _draw(out, record, settings)
    # write the stages and the outcome as a table in Markdown
    starts = [*record.stages.starts, (float(record.log.time[-1]), "")]
    rows = [
        (name, f"{time:.2f}", f"{after - time:.2f}")
        for (time, name), (after, _) in itertools.pairwise(starts)
    ]
    rows += [(key, f"{value:.4g}", "") for key, value in (outcome.measures or {}).items()]
    rows.append(("outcome", "done" if outcome.success else f"failed: {outcome.reason}", ""))
    (out / "table.md").write_text(
        markdown(("stage", "start [s]", "time [s]"), rows), encoding="utf-8"
    )
    word = "done" if outcome.success else f"failed: {outcome.reason}"
    print(f"{settings.name}: {word} after {outcome.seconds:.1f} s; {out / 'stages.png'}")
    return 0 if outcome.success else 1


def outcome_of(record: Record, *, thing: str, missed: Callable[[Log], str]) -> Outcome:
    """Return how a run ended.

    Args:
        record: of the run.
        thing: name of the object.
        missed: says what is wrong with the end of the log, empty when nothing is.
    """
    log, end = record.log, float(record.log.time[-1])
    stages = [name for _, name in record.stages.starts]
    last = stages[-1] if stages else "start"
    tries = max(stages.count("above"), 1)
    reason = ""
    if record.ending is not Ending.done:
        reason = f"{record.ending.value} in {last}: {record.error}".replace("\n", " ")
    elif record.stages.outcome is not True:
        reason = f"{'given up' if record.stages.outcome is False else 'out of time'} in {last}"
    else:
        reason = missed(log)
    measures = {
        "object_height_m": float(object_place(log, thing)[-1, 2]),
        "largest_lean_deg": float(np.degrees(np.arccos(np.clip(upright(log), -1, 1)).max())),
    }
    return Outcome(success=not reason, reason=reason, tries=tries, seconds=end, measures=measures)


def object_place(log: Log, thing: str) -> Floats:
    """Return where an object was, world [m], shape (rows, 3)."""
    return np.stack([log.columns[f"object_{thing}_position_{a}"] for a in "xyz"], axis=1)


def upright(log: Log) -> Floats:
    """Return the cosine of the lean of the body, shape (rows,)."""
    x, y = log.columns["orientation_x"], log.columns["orientation_y"]
    return 1.0 - 2.0 * (x * x + y * y)


def _draw(folder: Path, record: Record, settings: RunSettings) -> None:
    """Write figure, ledger plot and a sheet of pictures into the folder of a run."""
    log, thing = record.log, next(iter(settings.objects))
    starts = record.stages.starts
    end = float(log.time[-1])
    stages, free = [], 0.0
    for time, name in starts:
        fits = time >= free and name != "done"
        stages.append(Mark(at=time, label=name if fits else ""))
        free = time + 0.013 * end * (len(name) + 1) if fits else free
    marks = tuple(stages)
    # the heights of robot and object over time
    e = settings.environment
    levels = {"water": e.water_level, "bottom": e.tank_bottom, "land": e.ground_level}
    at = tuple(Mark(at=z, label=word, level=True) for word, z in levels.items() if z is not None)
    curves = {"robot": log.columns["position_z"], thing: object_place(log, thing)[:, 2]}
    write_picture(
        folder / "figure.png",
        [
            lines("Heights", "height [m]", log.time, curves, marks=(*marks, *at)),
            *_forces(log, marks),
        ],
    )
    write_picture(
        folder / "ledger.png",
        [
            vertical(record.ledger, 0, f"robot {settings.robot.name}, body"),
            vertical(record.objects[thing], 0, f"object {thing}"),
        ],
    )
    times = stage_times(log)
    pictures = draw_frames(log, settings, list(times.values()), View())
    write_sheet(folder / "stages.png", dict(zip(times, pictures, strict=True)))


def _forces(log: Log, marks: tuple[Mark, ...]) -> list[Chart]:
    """Return the forces that the pads read."""
    pads = sorted(name for name in log.columns if name.endswith("_pressing"))
    if not pads:
        return []
    curves = []
    for name in pads:
        there = np.isfinite(log.columns[name])
        label = name.removesuffix("_pressing")
        curves.append(Series(name=label, x=log.time[there], y=log.columns[name][there]))
    return [
        Chart(
            title="Force on the finger-tips, as read",
            y_label="force [N]",
            series=tuple(curves),
            marks=marks,
        )
    ]


def vertical(ledger: Ledger, link: int, title: str) -> Chart:
    """Return the forces along body z of one link by effect, from the ledger."""
    table = ledger.wrenches[:, :, link, 2]
    acting = [k for k in range(len(ledger.effects)) if np.any(table[:, k] != 0.0)]
    series = tuple(Series(name=ledger.effects[k], x=ledger.time, y=table[:, k]) for k in acting)
    return Chart(title=f"Forces along z: {title}", y_label="force [N]", series=series, stacked=True)
