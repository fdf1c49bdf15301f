"""``seals evaluate --compare``: compares the arms of a study from the tables of their runs.

Each arm has a score with an interval, and its difference from the reference.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from seals.config.compose import output_folder
from seals.errors import ConfigError, SealsError, refuse_unlisted
from seals.learn.comparison.page import (
    Arm,
    ArmComparison,
    Band,
    Study,
    arm_rows,
    claims,
    comparison_rows,
    terms_words,
    text_table,
    write_study,
)
from seals.learn.comparison.runs import Run, find_arms, read_run
from seals.learn.comparison.settings import AnalysisPlan, ArmsSettings
from seals.learn.settings import check_own
from seals.learn.statistics.curve import METRICS, Curve, held, metric, on_grid
from seals.learn.statistics.interval import (
    Interval,
    bootstrap,
    bootstrap_band,
    improvement,
    improvement_bootstrap,
    paired,
    rank_test,
)


def compare(arms: Mapping[str, Sequence[Run]], terms: AnalysisPlan) -> Study:
    """Compare variants of a training, called arms, by an analysis plan.

    Args:
        arms: at least two runs each, by name.
        terms: of the comparison.

    Raises:
        ConfigError: the reference is no arm, or two runs of an arm have one seed.
        SealsError: an arm has fewer than two runs, or a run ends before the budget.
    """
    for name, runs in arms.items():
        seeds = [run.seed for run in runs if run.seed is not None]
        twice = sorted({seed for seed in seeds if seeds.count(seed) > 1})
        if twice:
            raise ConfigError(
                f"arm '{name}' has seed {twice[0]} more than once.\n"
                "Runs of one seed are not independent: leave one out."
            )
    lines = {n: [r.curve(terms.value, over=terms.over) for r in runs] for n, runs in arms.items()}
    budget = terms.budget or min(line.x[-1] for every in lines.values() for line in every)
    reference = terms.reference or next(iter(arms))
    refuse_unlisted(reference, arms, f"reference={reference} is not an arm of this study")
    terms = dataclasses.replace(terms, budget=float(budget), reference=reference)
    made = [_arm(name, arms[name], every, terms) for name, every in lines.items()]
    home = next(arm for arm in made if arm.name == reference)
    duels = [
        _compared(a, home, m, terms) for a, m in itertools.product(made, METRICS) if a is not home
    ]
    return Study(terms=terms, arms=made, duels=duels, remarks=_remarks_on(made, lines, terms))


def _remarks_on(
    arms: Sequence[Arm], lines: Mapping[str, Sequence[Curve]], terms: AnalysisPlan
) -> list[str]:
    """Return the limitations of a comparison, as sentences."""
    out = []
    for arm in arms:
        ends = np.array([line.x[-1] for line in lines[arm.name]])
        short, longer = int((ends < terms.budget).sum()), int((ends > terms.budget).sum())
        unfinished = [run.name for run in arm.runs if run.state not in ("", "done")]
        if len(arm.runs) < 5:
            out.append(
                f"{arm.name}: {len(arm.runs)} runs; with fewer than 5 runs no test is conclusive."
            )
        if unfinished:
            out.append(f"Not finished: {', '.join(unfinished)}.")
        if short:
            out.append(f"{arm.name}: {short} runs stopped early and keep their last value.")
        if longer:
            out.append(
                f"{arm.name}: {longer} runs continued; their later evaluations are left out."
            )
    if len(arms) > 2:
        out.append(
            f"{len(arms) - 1} arms are compared with {terms.reference}: the level of an "
            "interval is "
            "that of one comparison, not of all together."
        )
    spent = {arm.name: _updates(arm, terms) for arm in arms}
    known = {name: count for name, count in spent.items() if count is not None}
    if known and max(known.values()) > 1.02 * min(known.values()):
        text = ", ".join(f"{name} {count:.0f}" for name, count in known.items())
        out.append(f"Gradient updates differ: {text}.")
    return out


def _arm(name: str, runs: Sequence[Run], lines: Sequence[Curve], terms: AnalysisPlan) -> Arm:
    ready = [held(line, budget=terms.budget) for line in lines] if terms.hold else list(lines)
    pairs = list(zip(runs, ready, strict=True))
    scores = {key: np.array([_score(key, *pair, terms) for pair in pairs]) for key in METRICS}
    middle = {
        key: bootstrap([v], level=terms.level, resamples=terms.resamples, seed=terms.seed)
        for key, v in scores.items()
    }
    return Arm(
        name=name,
        runs=runs,
        scores=scores,
        middle=middle,
        band=_band(ready, terms.budget, terms),
        clock=_clock(runs, terms),
    )


def _score(key: str, run: Run, line: Curve, terms: AnalysisPlan) -> float:
    """Return a score, or an error that names the run."""
    try:
        return metric(key, line, budget=terms.budget)
    except SealsError as cause:
        raise SealsError(f"{run.name}: {cause}") from cause


def _band(lines: Sequence[Curve], end: float, terms: AnalysisPlan) -> Band:
    x, values = on_grid(list(lines), budget=end)
    line, low, high = bootstrap_band(values, level=terms.level, seed=terms.seed)
    return Band(x=x, line=line, low=low, high=high, runs=values)


def _clock(runs: Sequence[Run], terms: AnalysisPlan) -> Band | None:
    """Return the same curves over the wall time of each run."""
    if terms.over == "seconds" or not all("seconds" in run.columns for run in runs):
        return None
    if not all(np.isfinite(run.columns["seconds"]).all() for run in runs):
        return None
    lines = [run.curve(terms.value, over="seconds") for run in runs]
    return _band(lines, min(line.x[-1] for line in lines), terms)


def _compared(arm: Arm, home: Arm, key: str, terms: AnalysisPlan) -> ArmComparison:
    x, y = arm.scores[key], home.scores[key]
    return ArmComparison(
        arm=arm.name,
        against=home.name,
        metric=key,
        improvement=improvement(x, y, level=terms.level),
        bootstrap=improvement_bootstrap(
            x, y, level=terms.level, resamples=min(terms.resamples, 2000), seed=terms.seed
        ),
        p=rank_test(x, y),
        pairs=_pairs(arm, home, key, terms),
    )


def _pairs(arm: Arm, home: Arm, key: str, terms: AnalysisPlan) -> Interval | None:
    """Return the paired comparison if both arms have the same seeds, else None."""
    ours = {r.seed: s for r, s in zip(arm.runs, arm.scores[key], strict=True)}
    theirs = {r.seed: s for r, s in zip(home.runs, home.scores[key], strict=True)}
    if None in ours or ours.keys() != theirs.keys():
        return None
    x = np.array([ours[seed] for seed in ours])
    y = np.array([theirs[seed] for seed in ours])
    return paired(x, y, level=terms.level) if (x != y).any() else None


def _updates(arm: Arm, terms: AnalysisPlan) -> float | None:
    """Mean number of gradient updates up to the budget."""
    if not all("updates" in run.columns for run in arm.runs):
        return None
    tables = [run.columns for run in arm.runs]
    return float(np.mean([np.interp(terms.budget, t[terms.over], t["updates"]) for t in tables]))


def execute(config: Any) -> int:
    """Compare the arms of a composed configuration and print the claims that the intervals allow.

    Args:
        config: with the keys of ``seals.learn.comparison.settings.ArmsSettings``.

    Raises:
        SealsError: there is nothing to compare, a run cannot be read, or one ends too early.
    """
    out = output_folder(config.out)
    study = _study_of(config)
    made = write_study(study, out, title=str(config.title))
    print(terms_words(study))
    print()
    print(text_table(*arm_rows(study)))
    if study.duels:
        print()
        print(text_table(*comparison_rows(study)))
        print()
    for line in (*claims(study), *study.remarks):
        print(line)
    for path in made:
        print(path)
    return 0


def _study_of(config: Any) -> Study:
    """Read the runs that a configuration names, and compare them.

    Raises:
        SealsError: as for :func:`execute`.
    """
    folders = find_arms(dict(config.arms), config.study)
    arms = {n: [read_run(folder, arm=n) for folder in where] for n, where in folders.items()}
    check_own(config, ArmsSettings)
    terms = {one.name: config[one.name] for one in dataclasses.fields(AnalysisPlan)}
    return compare(arms, AnalysisPlan(**terms))
