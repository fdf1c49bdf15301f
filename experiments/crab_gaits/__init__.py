"""Gaits of crab and sea spider: speed, cost of transport, falls, footfall patterns."""

from __future__ import annotations

import argparse
import functools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from seals.arrays import true_spans
from seals.experiments.command import folder_of, markdown, parser_of
from seals.experiments.crab_gaits.cases import CASES, GAITS, Case
from seals.experiments.crab_gaits.reaching import TASKS, reach
from seals.experiments.crab_gaits.walks import Walk, walked
from seals.experiments.trials import Outcome, run_trials
from seals.logs.atomic import atomic_path
from seals.report.pictures import figure_class

HEAD = ("gait", "speed [m/s]", "body lengths/s", "cost of transport", "Froude", "on the ground")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the experiment from the command line."""
    given = _parsed(arguments)
    out = folder_of(given, "crab_gaits")
    if given.tune:
        from seals.experiments.crab_gaits.tuning import tune

        tune(given.tune, out, budget=given.budget, seed=given.seed)
    elif given.reach:
        seeds = given.seeds or 20
        for case in given.only or [""]:
            print(reach(given.reach, out, seeds=seeds, more=given.overrides, case=case), flush=True)
    elif given.film is not None:
        from seals.experiments.crab_gaits.filming import film

        code = film(out, given.film, given.overrides)
        if code:
            return code
    elif given.seeds:
        _trials(out, given.seeds, given.only)
    else:
        _gaits(out, given.overrides)
    print(f"written: {out}")
    return 0


def _parsed(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = parser_of("crab_gaits", "as for seals run; seals render for films")
    parser.add_argument("--seeds", type=int, default=0, help="walks of every case, as a table")
    parser.add_argument("--only", nargs="*", default=[], choices=[*CASES], help="some cases")
    parser.add_argument("--tune", choices=sorted(GAITS), help="gait whose parameters to optimise")
    parser.add_argument("--reach", choices=sorted(TASKS), help="targets to go to, --seeds of them")
    parser.add_argument("--budget", type=int, default=300, help="walks of the optimiser")
    parser.add_argument("--seed", type=int, default=0, help="of the optimiser")
    parser.add_argument("--film", nargs="*", metavar="GAIT", help="film gaits, all when none named")
    return parser.parse_args(arguments)


def _gaits(out: Path, overrides: Sequence[str]) -> None:
    """Walk every gait once: a table and the figure of foot-falls."""
    walks: dict[str, Walk] = {}
    for name, words in GAITS.items():
        walks[name] = walked([*words, *overrides])
        print(f"{name}: {walks[name].lengths:.2f} body lengths/s", flush=True)
    out.mkdir(parents=True, exist_ok=True)
    # one row of the table of gaits
    (out / "gaits.md").write_text(
        markdown(
            HEAD,
            [
                [
                    n,
                    f"{w.speed:.3f}",
                    f"{w.lengths:.2f}",
                    f"{w.cost:.2f}",
                    f"{w.froude:.3f}",
                    f"{w.stands.mean():.0%}",
                ]
                for n, w in walks.items()
            ],
        )
    )
    _draw_falls(walks, out / "foot_falls.png")


def _trials(out: Path, seeds: int, only: Sequence[str]) -> None:
    """Walk every case under many seeds: one table each, taken up again where it was cut off."""
    rows = []
    for name, case in CASES.items():
        if only and name not in only:
            continue
        print(name, flush=True)
        found = run_trials(
            out / f"{name}.csv",
            range(seeds),
            functools.partial(_words, case),
            functools.partial(_tried, case),
        )
        good = sum(int(one["success"]) for one in found)
        fell = sum(int(float(one["fell"])) for one in found)
        lengths = [float(one["lengths_per_s"]) for one in found]
        cells = [f"{good} of {seeds}", f"{fell}", f"{min(lengths):.2f} to {max(lengths):.2f}"]
        rows.append([name, f"{case.least:g}", *cells])
    head = ("case", "asked [lengths/s]", "success", "falls", "body lengths/s")
    (out / "cases.md").write_text(markdown(head, rows))


def _words(case: Case, seed: int) -> list[str]:
    """What a walk depends on; its seed stands last."""
    return [*case.words, f"{case.slope}", f"{seed}"]


def _tried(case: Case, words: Sequence[str]) -> Outcome:
    """Walk one case once: a success has not fallen and is as fast as the case asks."""
    walk = walked(case.words, seed=int(words[-1]), slope=case.slope)
    slow = walk.lengths < case.least
    reason = "fell" if walk.fell else "slow" if slow else ""
    return Outcome(
        success=not reason,
        reason=reason,
        measures={
            "lengths_per_s": walk.lengths,
            "cost": walk.cost,
            "froude": walk.froude,
            "upright": walk.upright,
            "beyond_limit_rad": walk.beyond,
            "fell": float(walk.fell),
        },
    )


SPAN = 1.5
"""Time that is shown [s]."""


def _draw_falls(walks: Mapping[str, Walk], path: Path) -> None:
    """Draw the stance phases of all feet, one row of the figure per walk.

    Args:
        walks: by name.
        path: of the picture.
    """
    rows = -(-len(walks) // 2)
    figure = figure_class()(figsize=(10.0, 1.5 * rows), layout="constrained")
    axes: Any = figure.subplots(rows, 2, squeeze=False)
    for panel in axes.flat[len(walks) :]:
        panel.set_visible(False)
    for panel, (name, walk) in zip(axes.flat, walks.items(), strict=False):
        span = SPAN if walk.size < 0.2 else 4.0 * SPAN
        shown = walk.time < walk.time[0] + span
        time = walk.time[shown] - walk.time[0]
        for k in range(len(walk.feet)):
            colour = "#b5541c" if walk.feet[k].startswith("left") else "#2a6f97"
            # start and length of every time that a foot stands [s]
            step = float(time[1] - time[0])
            stands = true_spans(walk.stands[shown, k])
            panel.broken_barh(
                [(float(time[a]), step * float(b - a)) for a, b in stands],
                (k - 0.4, 0.8),
                color=colour,
            )
        panel.set_yticks(range(len(walk.feet)), [foot.replace("_", " ") for foot in walk.feet])
        panel.tick_params(labelsize=6)
        panel.invert_yaxis()
        panel.set_xlim(0.0, span)
        panel.set_title(f"{name}: {walk.lengths:.2f} body lengths/s", fontsize=8)
    axes.flat[len(walks) - 1].set_xlabel("time [s]", fontsize=7)
    with atomic_path(path) as beside:
        figure.savefig(beside, dpi=110, format="png")
