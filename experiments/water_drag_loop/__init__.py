"""Diagnosis of the particle water: correction of its drag on a sphere to the textbook's.

A sphere is towed in particles; added mass and drag that this shows are the stated model of a log
that follows the textbook. ``seals diagnose`` names what the model gets wrong, ``seals add`` writes
it down, and tows in particles that nothing was fitted to judge it.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import seals
from seals.arrays import Floats
from seals.child_process import command, environment
from seals.config.overlay import load_overlay, read_overlay
from seals.errors import ConfigError
from seals.experiments.command import figure_table, folder_of, parser_of, show_table
from seals.experiments.water_drag_loop.measured import Nominal, nominal_of, write_measurement
from seals.experiments.water_drag_loop.tank import Tank, towed_in_particles
from seals.experiments.water_drag_loop.textbook import (
    LEARNT,
    QUADRATIC,
    UNSEEN,
    Course,
    Steps,
    towed,
)
from seals.report.figures import Chart, Series
from seals.report.pictures import write_picture

SHOWN: tuple[Steps, ...] = (((0.8, 100.0),), ((0.65, 180.0),))
"""Tows in particle water that the stated model is taken from."""
JUDGED: tuple[Steps, ...] = (((0.35, 140.0), (0.65, 70.0)), ((0.9, 80.0),))
"""Held-out tows in particle water."""
NAMED = 10
"""Exit code of ``seals diagnose`` for a named effect."""
HALF = 0.5
"""Share of the error in speed that may be left with the term."""
POWERS = {"linear_drag": 1.0, "quadratic_drag": 2.0}


class _Judged(NamedTuple):
    """One held-out tow, with and without the correction.

    Args:
        steps: commands.
        textbook: its course, at the rows of the others.
        bare: course in particle water.
        helped: the same with the term that was found.
    """

    steps: Steps
    textbook: Course
    bare: Course
    helped: Course

    def error(self, course: Course) -> float:
        """Root of the mean square of the error in speed [m/s]."""
        return float(np.sqrt(np.mean((course.velocity - self.textbook.velocity) ** 2)))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the loop from the command line."""
    given = parser_of("water_drag_loop", "of the fluid, as for seals run").parse_args(arguments)
    out = folder_of(given, "water_drag_loop")
    out.mkdir(parents=True, exist_ok=True)
    tank = Tank()
    shown = [
        towed_in_particles(s, tank, until=s[-1][0], more=given.overrides, label="stated tow")
        for s in SHOWN
    ]
    nominal = nominal_of(shown)
    for name, steps, seed in (("learnt", LEARNT, 1), ("unseen", UNSEEN, 2)):
        write_measurement(out / name, towed(steps, until=steps[-1][0]), nominal, seed=seed)
    codes = {
        "diagnose": _seals(out, "diagnose", "log=learnt", "out=answer"),
        "add": _seals(out, "add", "diagnosis=answer", "log=learnt", "name=towed", "replace=true"),
        "verify": _seals(out, "verify", "log=unseen", "model=towed", "out=proof"),
    }
    if codes["diagnose"] != NAMED or codes["add"]:
        _write(out, nominal, [], {}, codes)
        return 1
    term = below_the_grid(out / "models" / "towed.yaml")
    judged, more = [], given.overrides
    for s in JUDGED:
        until = s[-1][0]
        bare = towed_in_particles(s, tank, until=until, more=more, label="unseen tow")
        words = [*more, *overrides_of(term)]
        helped = towed_in_particles(s, tank, until=until, more=words, label="with the term")
        judged.append(_Judged(s, towed(s, until=until, row=0.004), bare, helped))
    _write(out, nominal, judged, term, codes)
    _draw(out / "figure.png", judged)
    return 0 if all(j.error(j.helped) <= HALF * j.error(j.bare) for j in judged) else 1


def _seals(folder: Path, *words: str) -> int:
    """Run a verb of ``seals`` in a folder, as a person would; return its exit code."""
    line = command(Path(seals.__file__).parent / "cli" / "__main__.py", *words)
    with (folder / f"{words[0]}.txt").open("w", encoding="utf-8") as said:
        done = subprocess.run(
            line, cwd=folder, env=environment(), stdout=said, stderr=subprocess.STDOUT, check=False,
        )  # fmt: skip
    print((folder / f"{words[0]}.txt").read_text(encoding="utf-8"))
    return done.returncode


def below_the_grid(path: Path) -> dict[str, float]:
    """Return the drag coefficients along x that a model adds, by effect; they may be negative.

    Args:
        path: file that ``seals add`` wrote.

    Raises:
        ConfigError: it adds something else than drag.
    """
    overlay = read_overlay(load_overlay(path))
    out: dict[str, float] = {}
    parts: list[tuple[str, float]] = [
        (c.effect, c.values.get("coefficient_x", 0.0)) for c in overlay.changes.values()
    ]
    for effect in overlay.effects.values():
        kind = {"DragLinear": "linear_drag", "DragQuadratic": "quadratic_drag"}
        parts.append((kind.get(type(effect).__name__, ""), getattr(effect, "coefficient_x", 0.0)))
    for name, value in parts:
        if name not in POWERS:
            raise ConfigError(
                f"{path}: {name or 'an effect'} is no drag, so it is no term of the water.\n"
                "Look at the report of the diagnosis."
            )
        out[name] = out.get(name, 0.0) + value
    return out


def overrides_of(term: dict[str, float]) -> list[str]:
    """Return the overrides of a run that add the drag as a force beside the particles.

    The plug-ins of drag allow no coefficient below zero; the effect ``formula`` does.
    """
    words = []
    for name, value in term.items():
        at = f"effects.subgrid_{name}"
        words += [f"+effect@{at}=formula", f"{at}.medium=water", f"{at}.correction=true"]
        words += [f"{at}.drag_x={value}", f"{at}.drag_power={POWERS[name]}"]
    return words


def _write(
    out: Path,
    nominal: Nominal,
    judged: list[_Judged],
    term: dict[str, float],
    codes: dict[str, int],
) -> None:
    """Write figures and table."""
    answer = json.loads((out / "answer" / "diagnosis.json").read_text(encoding="utf-8"))
    found: dict[str, Any] = {
        "particle water: added mass [kg]": nominal.added,
        "particle water: quadratic drag [N s^2/m^2]": nominal.quadratic,
        "force that the two leave over, rms [N]": nominal.left,
        "textbook: quadratic drag [N s^2/m^2]": QUADRATIC,
        "verdict": answer["verdict"],
        "exit codes": ", ".join(f"{verb} {code}" for verb, code in codes.items()),
    }
    for entry in answer["effects"]:
        for name, p in entry["parameters"].items():
            found[f"{entry['name']} {name} ({entry['confidence']:.0%})"] = (
                f"{p['value']:.3g} ({p['low90']:.3g} to {p['high90']:.3g}) {p['unit']}"
            )
    for name, value in term.items():
        found[f"term taken over: {name} along x"] = value
    for j in judged:
        words = ", then ".join(f"{force:g} N to {until:g} s" for until, force in j.steps)
        bare, helped = j.error(j.bare), j.error(j.helped)
        found[f"unseen tow, {words}: error in speed, rms [m/s]"] = (
            f"{bare:.3g} -> {helped:.3g} ({helped / bare - 1.0:+.0%})"
        )
    show_table(out, figure_table(found))


def _draw(path: Path, judged: list[_Judged]) -> None:
    """Draw the unseen tows."""
    charts = []
    for j in judged:
        words = ", then ".join(f"{force:g} N" for _, force in j.steps)
        kinds: list[tuple[str, Course, bool]] = [
            ("textbook", j.textbook, True),
            ("particles", j.bare, False),
            ("particles and term", j.helped, False),
        ]
        series = tuple(
            Series(name=name, x=c.time, y=_smooth(c.velocity), dashed=dashed)
            for name, c, dashed in kinds
        )
        charts.append(
            Chart(title=f"Sphere towed with {words}", y_label="speed [m/s]", series=series)
        )
    write_picture(path, charts)


def _smooth(values: Floats) -> Floats:
    """Mean over five rows, for the eye."""
    wide = np.concatenate([values[:1].repeat(2), values, values[-1:].repeat(2)])
    return np.convolve(wide, np.full(5, 0.2), mode="valid")
