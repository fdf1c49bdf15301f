"""``seals compare``: fit model variants to measurements and report their errors."""

from __future__ import annotations

import dataclasses
import fnmatch
import sys
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.compare.case import Case
from seals.compare.cases import matching
from seals.compare.prediction_methods import cases_of, step_of
from seals.compare.result import Comparison, Group
from seals.compare.score import unit_words
from seals.compare.settings import CompareOptions, CompareSettings, PredictionMethod
from seals.compare.variants import ModelVariant, fit_variants
from seals.config.compose import output_folder
from seals.errors import ConfigError
from seals.file_names import short_path
from seals.logs import Log, refuse_if_bad
from seals.logs.datasets import OfDataset
from seals.logs.reader import logs_by
from seals.logs.shipped import find_log
from seals.logs.time_offset import delay_between
from seals.robot.build import build_robot
from seals.run.build import build_run

# settings of the comparison itself; the others are those of a run
OWN = (
    *("log", "only", "fit", "train", "held_out", "ladder", "per_log", "out", "compare"),
    *("rivals", "naming"),
)


def compare_logs(settings: CompareSettings, logs: Sequence[Log]) -> Comparison:
    """Compare a model with measurements.

    Args:
        settings: model, reader, fit and variants.
        logs: the measurements.

    Raises:
        LogError: a log fails the data check, or holds nothing that can be predicted.
        ConfigError: a name or a key does not fit.
    """
    began = time.perf_counter()
    findings = {log.name: refuse_if_bad(log) for log in logs}
    robot = build_robot(settings.robot)
    groups = [[log] for log in logs] if settings.per_log else [list(logs)]
    found = []
    for chosen in groups:
        cases = cases_of(settings)(chosen, settings, robot)
        step = settings.compare.step or step_of(cases)
        variants = fit_variants(settings, robot, cases, step=step)
        found.append(
            Group(
                name=chosen[0].name if settings.per_log else settings.name,
                cases=cases,
                variants=variants,
                offsets={
                    c.name: _offsets(c, variants[-1], k, settings.compare)
                    for k, c in enumerate(cases)
                },
            )
        )
    return Comparison(
        name=settings.name,
        model=f"{robot.name} with {', '.join(settings.effects)}",
        groups=found,
        findings=findings,
        sources={
            log.name: f"{log.source} ({log.licence})" if log.licence else log.source for log in logs
        },
        seconds=time.perf_counter() - began,
    )


def _offsets(
    case: Case, variant: ModelVariant, k: int, options: CompareOptions
) -> dict[str, tuple[float, float]]:
    """Return the clock offset of every channel against the model, by its largest component."""
    out = {}
    for channel, measured in case.measured.items():
        if options.offset <= 0.0 or channel == "orientation":
            continue
        columns = (c[np.isfinite(c)] for c in measured.T)
        axis = int(np.argmax([c.std() if c.size else 0.0 for c in columns]))
        out[channel] = clock_offset(
            case.time,
            measured[:, axis],
            variant.predicted[k][channel][:, axis],
            most=options.offset,
        )
    return out


def execute(cfg: Any) -> int | None:
    """Run the verb on a composed configuration."""
    settings = settings_of(cfg)
    logs = read_logs(settings)
    comparison = compare_logs(settings, logs)
    folder = output_folder(settings.out)
    from seals.compare.report import write_report

    paths = write_report(comparison, comparison.as_data(), folder)
    print_variants(comparison)
    print(f"report: {short_path(paths['report'])}")
    return None


def settings_of(cfg: Any) -> CompareSettings:
    """Build the typed settings of a composed configuration."""
    from omegaconf import OmegaConf

    from seals.config.build import build

    run = build_run(cfg)
    own: dict[str, Any] = {
        key: OmegaConf.to_object(cfg[key]) if OmegaConf.is_config(cfg[key]) else cfg[key]
        for key in OWN
    }
    own["reader"] = None if cfg.reader is None else build(cfg.reader, where="reader")
    model: dict[str, Any] = {f.name: getattr(run, f.name) for f in dataclasses.fields(run)}
    return CompareSettings(**model, **own)


def read_logs(settings: CompareSettings) -> list[Log]:
    """Read all logs that the settings name.

    Raises:
        ConfigError: neither a log nor a reader with data of its own is given.
    """
    if settings.reader is None:
        raise ConfigError(
            "reader is null: no reader is selected for the log.\nChoose one: seals list reader"
        )
    sources = settings.log if isinstance(settings.log, list | tuple) else [settings.log]
    reader = settings.reader
    if isinstance(reader, OfDataset) and reader.dataset.logs and not (any(sources) or reader.path):
        # an unknown name is refused before anything is fetched
        matching("only", settings.only, reader.dataset.logs, what="log")
    logs: list[Log] = []
    for source in sources:
        # the reader of a data set takes names of its own
        own = not source or isinstance(reader, OfDataset)
        logs += logs_by(reader, source if own else find_log(source))
    names = matching("only", settings.only, [log.name for log in logs], what="log")
    kept = [log for log in logs if log.name in names or not settings.only]
    if settings.compare.course is not PredictionMethod.simulated:
        return kept
    return _judged(kept, settings)


def _judged(logs: list[Log], settings: CompareSettings) -> list[Log]:
    """Logs of which a segment is named by ``train`` or ``held_out``, or all."""
    patterns = [str(p) for p in (*settings.train, *settings.held_out)]

    def named(log: Log) -> bool:
        names = [log.name, *(f"{log.name}/{int(n)}" for n in np.unique(log.segment))]
        return any(fnmatch.fnmatch(name, p) for name in names for p in patterns)

    kept = [log for log in logs if named(log)] or logs
    left = [log.name for log in logs if not any(log is one for one in kept)]
    if left:
        words = f"not used, because neither train nor held_out names them: {', '.join(left)}"
        print(words, file=sys.stderr, flush=True)
    return kept


def print_variants(comparison: Comparison) -> None:
    """Print the errors of the model variants of every group."""
    for group in comparison.groups:
        print(f"\n{group.name}")
        for variant in group.variants:
            for channel in sorted({c for s in variant.scores for c in s.channels}):
                train, rest = (variant.rms(channel, held_out=h) for h in (False, True))
                unit = unit_words(channel)
                line = f"  {variant.name:28s} {channel:18s} train {train:9.4g}"
                line += f"   held out {rest:9.4g} {unit}" if np.isfinite(rest) else f" {unit}"
                print(line)
        for value in group.variants[-1].fitted:
            bound = "  (at its bound)" if value.at_bound else ""
            unit = "" if value.unit == "1" else f" {value.unit}"
            print(f"  {value.key} = {value.value:.4g} +- {value.sigma:.2g}{unit}{bound}")


def clock_offset(
    time: Floats, measured: Floats, predicted: Floats, *, most: float
) -> tuple[float, float]:
    """Estimate the delay of a measurement against its prediction.

    Args:
        time: [s], shape (rows,).
        measured: one component, shape (rows,); NaN is skipped.
        predicted: the same of the model, shape (rows,).
        most: largest offset looked for [s].

    Returns:
        Lag [s], positive when the measurement is late, and the correlation at that lag [1]; (0,
        correlation) when the channel does not move enough to tell.
    """
    good = np.isfinite(measured)
    if good.sum() < 16:
        return 0.0, 0.0
    step = float(np.median(np.diff(time)))
    grid = np.arange(time[0], time[-1], step)
    y = np.interp(grid, time[good], measured[good])
    x = np.interp(grid, time, predicted)
    if not np.ptp(y) or not np.ptp(x):
        return 0.0, 0.0
    reach = min(int(most / step), len(grid) // 3)
    rows = np.ones(len(grid), dtype=bool)
    return delay_between(x[:, None], y[:, None], rows, step=step, most=reach)
