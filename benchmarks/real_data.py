"""Acceptance test on real measurements: ``python -m benchmarks.real_data [NAME ...]``."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from seals.arrays import Floats
from seals.compare.application import read_logs, settings_of
from seals.compare.case import Case
from seals.compare.predict import Job
from seals.config.compose import compose
from seals.errors import SealsError
from seals.logs.datasets import OFFLINE
from seals.sysid.predictors.batch import prepare
from seals.sysid.runs import RunsDiagnosis, diagnose_runs

Samples = dict[str, Floats]
BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data"
"""Measurements beside the checkout, where the environment names none."""
LIGHT = (
    *("blue_basketball", "green_basketball", "volleyball", "tennis_ball"),
    *("whiffle_ball_1", "whiffle_ball_2", "yellow_whiffle_ball", "orange_whiffle_ball"),
)
ONE_SPEED = ("train=[4mps_sphere_*]", "held_out=[2mps_sphere_1]")


@dataclass(frozen=True, kw_only=True)
class Line:
    """One acceptance criterion with its result."""

    of: str
    what: str
    figure: str
    reached: bool


def named(one: RunsDiagnosis) -> set[str]:
    """Return effects that are named and could not be another."""
    return {c.candidate.label for c in one.answer.claims if not c.rivals}


def run(*overrides: str) -> list[RunsDiagnosis]:
    """Diagnose an experiment."""
    settings = settings_of(compose(list(overrides), root="compare"))
    return diagnose_runs(settings, read_logs(settings))


def _line(of: str, what: str, reached: bool, figure: object) -> Line:
    """Return a line; lists become words."""
    words = ", ".join(map(str, figure)) or "-" if isinstance(figure, list) else str(figure)
    return Line(of=of, what=what, figure=words, reached=bool(reached))


def balls(names: tuple[str, ...] = (*LIGHT, "bowling_ball")) -> list[Line]:
    """A drag-like effect for every light ball, nothing for the bowling ball."""
    out = []
    for one in run("experiment=falling_balls", f"only=[{','.join(names)}]"):
        drags = {"linear_drag", "quadratic_drag"}
        claimed = {c.candidate.label for c in one.answer.claims}
        claimed |= {c.candidate.label for c in one.answer.others}
        verdict = one.answer.verdict.value
        figure = f"{verdict}: {', '.join(sorted(claimed)) or '-'}"
        if one.name == "bowling_ball":
            out.append(_line("falling balls", "bowling_ball: nothing", not claimed, figure))
        else:
            undecided = verdict == "ambiguous" and claimed == drags
            out.append(
                _line("falling balls", f"{one.name}: drag, law undecided", undecided, figure)
            )
    return out


def at_full_rate(one: RunsDiagnosis, variant: int, *overrides: str) -> list[tuple[Case, Samples]]:
    """Return all rows of the runs with a variant's prediction, also those that the fit skips."""
    settings = settings_of(compose(list(overrides), root="compare"))
    experiment = prepare(settings, read_logs(settings))
    values = experiment.nominal()
    for value in one.variants[variant].fitted:
        values[experiment.names.index(value.key)] = value.value
    jobs = [Job(k, np.zeros_like(c.start.sigma), values) for k, c in enumerate(experiment.cases)]
    return list(zip(experiment.cases, experiment.predictor.run(jobs), strict=True))


def error_of(pairs: list[tuple[Case, Samples]], channel: str) -> float:
    """Root mean square of one channel over runs."""
    rows = [(c.measured[channel] - p[channel]).ravel() for c, p in pairs]
    return float(np.sqrt(np.nanmean(np.concatenate(rows) ** 2)))


def impack() -> list[Line]:
    """Slamming and quadratic drag from two speeds; what one speed cannot tell.

    An added mass that follows its waterline holds the slam: one of the two is missing.
    """
    one = run("experiment=impack_entry")[0]
    fine = ("naming.step=0.0005", "naming.stride=1")
    pairs = at_full_rate(one, -1, "experiment=impack_entry", *fine)
    error = error_of([p for p in pairs if p[0].held_out], "specific_force")
    twins = "slamming and added_mass cannot be told apart" in " ".join(one.answer.reasons)
    both = "quadratic_drag" in named(one) and ("slamming" in named(one) or twins)
    found = [*sorted(named(one)), *(["slamming or added_mass"] if twins else [])]
    alone = run("experiment=impack_entry", *ONE_SPEED)[0]
    words = "; ".join(alone.answer.reasons)
    told = all(w in words for w in ("buoyancy", "drag", "drop at another speed"))
    return [
        _line("impack", "quadratic drag, and slamming or its twin", both, found),
        _line("impack", "error at 4 m/s <= 2.8 m/s^2", error <= 2.8, f"{error:.3f}"),
        _line("impack", "one speed: drag and buoyancy cannot be told apart", told, words),
    ]


def glider() -> list[Line]:
    """Lift named; speed through water that was never fitted."""
    one = run("experiment=slocum_glider")[0]
    # both halves of the flight: no fit has seen this channel
    was, error = (
        error_of(
            at_full_rate(one, k, "experiment=slocum_glider", "compare.stride=1"),
            "speed_through_water",
        )
        for k in (0, -1)
    )
    return [
        _line("slocum glider", "lift named", "lift" in named(one), sorted(named(one))),
        _line(
            "slocum glider",
            "unfitted speed <= 0.030 m/s",
            error <= 0.030,
            f"{error:.4f} (before {was:.4f})",
        ),
    ]


def crazyflie() -> list[Line]:
    """Rotor lag named and sized."""
    one = run("experiment=crazyflie_thrust")[0]
    error = one.rms("specific_force", after=True)
    effects = {e["name"]: e["parameters"] for e in one.to_dict()["effects"]}
    lag = effects.get("rotor_lag", {}).get("time_constant_change", {}).get("value", float("nan"))
    words = [*sorted(named(one)), *one.answer.reasons]
    return [
        _line("crazyflie", "rotor lag named", "rotor_lag" in named(one), words),
        _line("crazyflie", "lag 0.05-0.08 s", 0.05 <= lag <= 0.08, f"{lag:.4f}"),
        _line("crazyflie", "test <= 0.65 m/s^2", error <= 0.65, f"{error:.3f}"),
    ]


def pendulum() -> list[Line]:
    """Viscous friction accepted, Coulomb friction rejected."""
    one = run("experiment=single_pendulum")[0]
    error = one.rms("joint_position", after=True)
    only = {c.candidate.label for c in one.answer.claims} == {"joint_friction (viscous)"}
    return [
        _line("single pendulum", "viscous accepted, Coulomb rejected", only, sorted(named(one))),
        _line("single pendulum", "test <= 0.013 rad", error <= 0.013, f"{error:.5f}"),
    ]


def flume() -> list[Line]:
    """Added mass and radiation damping as a pair."""
    one = run("experiment=flume_heave")[0]
    experiment = one.search.validator.experiment
    errors = [
        abs(
            float(
                experiment.cases[k].measured["heave_response"][0, 0]
                - one.variants[-1].predicted[k]["heave_response"][0, 0]
            )
        )
        for k in experiment.unseen
    ]
    pair = named(one) == {"added_mass", "radiation_damping"}
    median = float(np.median(errors))
    return [
        _line("wave flume", "added mass and radiation damping as a pair", pair, sorted(named(one))),
        _line("wave flume", "median response error <= 0.06", median <= 0.06, f"{median:.4f}"),
    ]


SETS: dict[str, Callable[[], list[Line]]] = {
    "balls": balls,
    "impack": impack,
    "glider": glider,
    "crazyflie": crazyflie,
    "pendulum": pendulum,
    "flume": flume,
}


def table(lines: list[Line]) -> str:
    """Return table rows: data set, criterion, result, met or missed."""
    head = Line(of="set", what="line to reach", figure="figure", reached=True)
    rows = [head, *lines]
    first, second = (max(len(getattr(r, k)) for r in rows) for k in ("of", "what"))
    out = []
    for row in rows:
        mark = "" if row is head else "met" if row.reached else "MISSED"
        out.append(f"{row.of:{first}}  {row.what:{second}}  {mark:6}  {row.figure}")
    return "\n".join(out)


def main() -> int:
    """Print every criterion with its result; the exit code counts those missed."""
    chosen = sys.argv[1:] or list(SETS)
    unknown = [name for name in chosen if name not in SETS]
    if unknown:
        print(f"there is no set '{unknown[0]}'.\nAllowed: {', '.join(SETS)}", file=sys.stderr)
        return 2
    if BESIDE.is_dir():
        os.environ.setdefault(OFFLINE, str(BESIDE))
    lines = []
    for name in chosen:
        print(f"{name} ...", file=sys.stderr, flush=True)
        try:
            lines += SETS[name]()
        except SealsError as error:
            # one set that is not available does not take the others with it
            lines.append(_line(name, "could be run", False, str(error).partition("\n")[0]))
    print(table(lines))
    return sum(not line.reached for line in lines)


if __name__ == "__main__":
    sys.exit(main())
