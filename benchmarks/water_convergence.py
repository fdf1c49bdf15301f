"""Entry, drag, a dam break and still water in particle water over several spacings.

Both solvers, all cases; of every figure the value at spacing zero with its band. Cases go from the
coarsest spacing to the finest, and the file holds what is done after each, so that a run that is
stopped loses one case only. ``--page`` writes docs/water_convergence.md from the files of runs.

    python benchmarks/water_convergence.py entry tow --across 4,5,6 --out build/convergence.json
    python benchmarks/water_convergence.py entry tow --across 5,7,10,14,20 --device cuda --limit 400
    python benchmarks/water_convergence.py dam --set fluid.physics.wall_friction=0.004
    python benchmarks/water_convergence.py --page build/convergence.json
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from seals.experiments.water_validation import dam_breaks, entry, hydrostatics, tow
from seals.experiments.water_validation.case import Grade
from seals.experiments.water_validation.richardson import Extrapolated
from seals.plugins.fluids.coupling import Device, Method
from seals.plugins.fluids.solvers.device_settings import Kernel
from seals.plugins.fluids.solvers.pbf.settings import PbfSettings
from seals.report.figures import Chart, Series
from seals.report.pictures import write_picture

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "water_convergence.md"
FIGURES_KEPT = PAGE.parent / "water_validation" / "convergence.json"
Row = dict[str, Any]
REFERRED = ("change", "peak")
"""Figures that are compared with drops."""
ERRORS = ("front", "front_moved", "layer", "energy", "carried")
"""Figures that are errors: zero is right."""
HEAD = """\
# Convergence of the particle water

Written by `python benchmarks/water_convergence.py --page` from the figures of its runs. Spacings
are counted across the body. The value at spacing zero is that of a fit after Eça and Hoekstra
(2014), with the band that contains the truth in nine cases of ten. If no order between 0.5 and 2 is
clear, the fit is of first order and its band is three times the distance to the finest figure.
"""


def options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="*", help=f"of {', '.join(CASES)}")
    parser.add_argument("--across", default="4,5,6", help="spacings across the body, comma between")
    parser.add_argument("--speeds", default="", help="[m/s]; all of each case when left out")
    parser.add_argument("--solver", default="pbf,dfsph")
    parser.add_argument("--device", choices=[d.value for d in Device], default="cpu")
    parser.add_argument("--threads", type=int, default=0, help="on the cpu; 0 for all")
    parser.add_argument("--limit", type=float, default=1e9, help="no case begins later [s]")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "convergence.json")
    parser.add_argument("--settle", type=float, default=0.6, help="time before an entry [s]")
    parser.add_argument("--set", action="append", default=[], help="fluid.physics.NAME=VALUE")
    parser.add_argument("--page", nargs="+", type=Path, help="files to write the page from")
    return parser.parse_args()


def entry_figures(
    speed: float, across: float, grade: Grade, more: Sequence[str], nose: str = "sphere"
) -> Row:
    """Return the figures of an entry at the speed of its drops."""
    drops = entry.measured(round(speed), nose)
    at = float(np.mean([drop.speed for drop in drops]))
    found = entry.enter(at, across, grade, more, nose=nose)
    return {"change": found.change, "peak": found.peak, "particles": found.particles}


def cone_figures(speed: float, across: float, grade: Grade, more: Sequence[str]) -> Row:
    """Return the figures of an entry with the cone."""
    figures = entry_figures(speed, across, grade, more, nose="150degcone")
    return {f"cone_{name}" if name in REFERRED else name: x for name, x in figures.items()}


def tow_figures(speed: float, across: float, grade: Grade, more: Sequence[str]) -> Row:
    """Return the figures of a tow."""
    found = tow.tow(speed, across, grade, physics_of(more))
    return {"drag": found.steady, "particles": found.particles}


def dam_figures(speed: float, across: float, grade: Grade, more: Sequence[str]) -> Row:
    """Return the figures of a dam break, by the spacings across its width."""
    a, unit = dam_breaks.MARTIN_MOYCE, (dam_breaks.MARTIN_MOYCE / dam_breaks.GRAVITY) ** 0.5
    found = dam_breaks.collapse(
        a, 2.0 * a, 8.0 * a, a / across, 2.5 * unit, grade, physics_of(more)
    )
    line, moved = found.front_errors(a, unit)
    return {"front": line.error, "front_moved": moved.error, "particles": found.particles}


def still_figures(speed: float, across: float, grade: Grade, more: Sequence[str]) -> Row:
    """Return the figures of a column at rest, by the spacings across its height."""
    found = hydrostatics.stand(hydrostatics.HEIGHT / across, grade, physics_of(more))
    return {
        "layer": found.error,
        "energy": found.energy,
        "carried": found.carried - 1.0,
        "particles": found.particles,
    }


def physics_of(more: Sequence[str]) -> PbfSettings:
    """Return options of a solver without a configuration, from its overrides."""
    prefix = "fluid.physics."
    pairs = (word.removeprefix(prefix).split("=") for word in more if word.startswith(prefix))
    whole = {"iterations": int, "kernel": Kernel}
    return PbfSettings(**{name: whole.get(name, float)(value) for name, value in pairs})


CASES: dict[str, tuple[Callable[..., Row], tuple[float, ...]]] = {
    "entry": (entry_figures, (2.0, 4.0, 6.0)),
    "cone": (cone_figures, (4.0, 6.0)),
    "tow": (tow_figures, (1.0, 2.0, 4.0)),
    "dam": (dam_figures, (0.0,)),
    "still": (still_figures, (0.0,)),
}
FIGURES = {
    "change": "change of velocity in 50 ms, hemisphere [m/s]",
    "peak": "peak of means over 1 ms, hemisphere [m/s²]",
    "cone_change": "change of velocity in 50 ms, cone [m/s]",
    "cone_peak": "peak of means over 1 ms, cone [m/s²]",
    "drag": "drag coefficient of a sphere towed [1]",
    "front": "front of a dam break, mean error [1]",
    "front_moved": "the same with the clock fitted [1]",
    "layer": "pressure of a still column, error of the worst layer [1]",
    "energy": "kinetic energy of a still column, of m g H [1]",
    "carried": "load of the floor under a still column, of the weight, less one [1]",
}
ELSEWHERE = (
    "[Why lines are missed](water_misses.md), and [where targets stand](water_targets.md).\n"
)
PICTURED = ("change", "cone_change", "drag", "front")
"""Figures of the picture; the others are in the tables."""


def run(args: argparse.Namespace) -> None:
    """Run all cases, from the coarsest spacing to the finest."""
    rows: list[Row] = []
    begin = time.perf_counter()
    for across in sorted(float(x) for x in args.across.split(",")):
        for name in args.cases or list(CASES):
            figures, speeds = CASES[name]
            wanted = [float(v) for v in args.speeds.split(",")] if args.speeds else speeds
            for solver in args.solver.split(","):
                for speed in wanted:
                    row: Row = {"case": name, "solver": solver, "speed": speed, "across": across}
                    row |= {"set": args.set} if args.set else {}
                    grade = Grade(False, Device(args.device), args.threads, Method(solver))
                    spent = time.perf_counter() - begin
                    if spent > args.limit:
                        row["left_out_at_s"] = round(spent, 1)
                    else:
                        row |= _timed(
                            figures,
                            speed,
                            across,
                            grade,
                            (f"fluid.settle={args.settle}", *args.set),
                        )
                    rows.append(row | {"device": args.device})
                    print(json.dumps(rows[-1]), flush=True)
                    args.out.parent.mkdir(parents=True, exist_ok=True)
                    args.out.write_text(json.dumps(rows, indent=1))


def _timed(
    figures: Callable[..., Row], speed: float, across: float, grade: Grade, more: Sequence[str]
) -> Row:
    """Return the figures of one case, and its wall time; an error is a figure, too."""
    start = time.perf_counter()
    try:
        found = figures(speed, across, grade, more)
    except Exception as error:  # the other cases count as well
        return {"error": repr(error)}
    return found | {"seconds": round(time.perf_counter() - start, 1)}


def write_page(files: Sequence[Path]) -> None:
    """Write table and picture of all figures in some files."""
    rows = [row for path in files for row in json.loads(path.read_text(encoding="utf-8"))]
    references = {("drag", v): tow.DRAG for v in CASES["tow"][1]}
    for case, nose, prefix in (("entry", "sphere", ""), ("cone", "150degcone", "cone_")):
        for speed in CASES[case][1]:
            found = entry.references(entry.measured(round(speed), nose))
            references |= {
                (prefix + name, speed): x for name, x in zip(REFERRED, found, strict=True)
            }
    references |= {(name, 0.0): 0.0 for name in ERRORS}
    parts, charts = [HEAD], []
    for figure, title in FIGURES.items():
        if not any(figure in row for row in rows):
            continue
        table, chart = _section(figure, title, rows, references)
        parts.append(table)
        if figure in PICTURED:
            charts.append(chart)
    write_picture(PAGE.parent / "water_validation" / "convergence.webp", charts)
    parts.append("![Convergence](water_validation/convergence.webp)\n")
    parts.append(
        "[Why lines are missed](water_misses.md), and [where targets stand](water_targets.md).\n"
    )
    FIGURES_KEPT.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    PAGE.write_text("\n".join(parts), encoding="utf-8")
    print(f"page: {PAGE}")


def _section(
    figure: str, title: str, rows: Sequence[Row], references: dict[tuple[str, float], float]
) -> tuple[str, Chart]:
    """Table and chart of one figure."""
    have = [row for row in rows if figure in row]
    across = sorted({row["across"] for row in have})
    names = [f"{a:g}" for a in across]
    lines = [f"## {title[0].upper()}{title[1:]}\n"]
    lines.append(f"| solver | speed [m/s] | {' | '.join(names)} | at zero | order | reference | |")
    lines.append("|" + "---|" * (len(across) + 6))
    series = []
    for solver, speed in sorted({(_method(row), row["speed"]) for row in have}, reverse=True):
        own = [row for row in have if (_method(row), row["speed"]) == (solver, speed)]
        part = {row["across"]: row[figure] for row in sorted(own, key=lambda row: row["across"])}
        known = references[figure, speed]
        cells = [f"{part[a]:.3g}" if a in part else "" for a in across]
        at, order, off = "", "", ""
        if len(part) >= 3:
            e = Extrapolated.of([1.0 / a for a in part], list(part.values()))
            at, order = f"{e.value:.3g} ± {e.band:.2g}", f"{e.order:.2g}" if e.clear else "unclear"
            off = f"{e.value / known - 1.0:+.0%}" if known else ""
        cells = [solver, f"{speed:g}" if speed else "", *cells, at, order, f"{known:.3g}", off]
        lines.append(f"| {' | '.join(cells)} |")
        x = np.array([1.0 / a for a in part])
        y = np.array([v / known if known else v for v in part.values()])
        name = f"{solver} {speed:g} m/s" if speed else solver
        shown = name.replace("fluid.physics.", "").replace("`", "")
        if len(part) > 1:
            series.append(Series(name=shown, x=x, y=y))
    label = "error [1]" if figure in ERRORS else "over the reference [1]"
    chart = Chart(
        title=title, y_label=label, x_label="spacing over body [1]",
        series=tuple(series),
    )  # fmt: skip
    return "\n".join(lines) + "\n", chart


def _method(row: Row) -> str:
    """Solver of a row, with what was set besides."""
    return " ".join(f"`{word}`" for word in (row["solver"], *row.get("set", ())))


def main() -> int:
    """Run, or write the page."""
    args = options()
    for name in args.cases:
        if name not in CASES:
            print(f"{name!r} is unknown.\nAllowed: {', '.join(CASES)}")
            return 2
    if args.page:
        write_page(args.page)
    else:
        run(args)
    return 0


if __name__ == "__main__":
    sys.exit(main())
