"""``seals calibrate``: estimates parameters from logs, writes result, diff and report."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from math import sqrt
from pathlib import Path
from typing import Any

from seals.config.compose import output_folder
from seals.errors import ConfigError, printable, refuse_absent
from seals.logs.atomic import finite, write_json, write_text
from seals.logs.shipped import find_log
from seals.report import Chart, Choice, write_picture
from seals.schema import check_value, parameters_of
from seals.sysid.calibration.applying import DIFF, Edited, edited, write_robot
from seals.sysid.calibration.calibration import STAGES, Calibration, calibrated
from seals.sysid.calibration.report import overlays
from seals.sysid.calibration.settings import CalibrateSettings
from seals.sysid.calibration.stated import StatedNumber
from seals.sysid.calibration.words import HEAD, error_sentence, remarks, row
from seals.sysid.candidates.parameters import Candidate, CandidateSet
from seals.sysid.predictors.problem import Problem, linearise_model
from seals.sysid.report.given_logs import GivenLogs, given_logs, make_folder, sources
from seals.sysid.report.naming import figure
from seals.terminal import drawing


@dataclass(frozen=True, kw_only=True)
class NextFlight:
    """Manoeuvre proposed for one number, or the reason why none is proposed.

    Args:
        number: that the logs do not determine.
        manoeuvre: in words; empty for none.
        seconds: that it takes.
        sigma: expected 1-sigma of the number after it.
        reason: why none is proposed.
    """

    number: StatedNumber
    manoeuvre: str = ""
    seconds: float = 0.0
    sigma: float = 0.0
    reason: str = ""

    @property
    def sentence(self) -> str:
        """The proposal in a sentence."""
        if not self.manoeuvre:
            return f"No manoeuvre is proposed for {self.number.name}: {self.reason}"
        return (
            f"To determine {self.number.name}, record {self.seconds:.0f} s of this: "
            f"{self.manoeuvre} Expected 1-sigma: {figure(self.sigma, self.number.unit)}."
        )

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "parameter": self.number.name,
            "manoeuvre": self.manoeuvre,
            "seconds": self.seconds,
            "expected_sigma": self.sigma,
            "sentence": self.sentence,
        }


def _next_flight(found: Calibration) -> NextFlight | None:
    """Return the best manoeuvre for the first undetermined number; None if there is none.

    The other numbers count as known as well as the logs tell them.
    """
    from seals.sysid.experiment_design.ranking import propose

    open_ones = (n for n in found.numbers if not (found.determined(n) or found.at_bound(n)))
    number = next(open_ones, None)
    if number is None:
        return None
    prior = found.prior(number)
    try:
        known = {number.name: {number.key: prior / abs(number.slope)}}
        plan = propose(_problem(found, number), [number.name], known=known)
        best = plan.best
    except ConfigError as refusal:
        return NextFlight(number=number, reason=str(refusal).partition("\n")[0])
    # one chi-square is what one sigma leaves over
    sigma = prior / sqrt(1.0 + max(best.separation, 0.0))
    if sigma > found.problem.policy.undetermined * prior:
        reason = "no manoeuvre of the library would determine it; measure it on the ground."
        return NextFlight(number=number, reason=reason)
    manoeuvre = best.manoeuvre
    return NextFlight(
        number=number, manoeuvre=manoeuvre.words, seconds=manoeuvre.seconds, sigma=sigma
    )


def _problem(found: Calibration, number: StatedNumber) -> Problem:
    """Problem with one number as a candidate and the others within their uncertainty."""
    problem, fit = found.problem, found.solution.fit
    held: CandidateSet = problem.plant.candidate_set
    parameters = dict(held.parameters)
    for other in found.numbers:
        if other is not number:
            own = parameters[other.key]
            parameters[other.key] = replace(own, tolerance=fit.spread(other.key))
    field = number.key.partition(".")[2]
    candidate = Candidate(name=number.name, keys=(number.key,), reported=(field,))
    candidate_set = replace(held, parameters=parameters, candidates=(*held.candidates, candidate))
    plant = problem.plant.of(candidate_set)
    fitter = linearise_model(plant, found.solution.fitter.trajectory, {})
    return replace(problem, plant=plant, fitter=fitter)


ANSWER, ROBOT = "calibration.json", "robot"
_WIDTH = 160
"""Columns of the printed table, so that no name is cut."""


@dataclass(frozen=True, kw_only=True)
class _Outcome:
    """Result of ``seals calibrate``: the calibration and the results derived from it.

    Args:
        found: the calibration.
        edit: of the robot's folder; None without one.
        flight: that would show what the logs do not; None where they show all.
    """

    found: Calibration
    edit: Edited | None
    flight: NextFlight | None


def execute(config: Any) -> int:
    """Run one composed calibration and return its exit code.

    Raises:
        ConfigError: no log is given, a name means no number, or a folder cannot be used.
        LogError: a log cannot be used.
    """
    from seals.run.progress import progress

    refuse_absent(config.log, "log", "seals calibrate log=FOLDER parameters=[mass] out=FOLDER")
    given = given_logs(config)
    check_value("prior", config.prior, parameters_of(CalibrateSettings)["prior"])
    if config.apply and not config.robot.folder:
        raise ConfigError(
            "apply=true needs the robot's folder.\nGive it: robot=FOLDER, or leave apply out."
        )
    out = output_folder(config.out)
    if config.apply and (out / ROBOT).exists():
        raise ConfigError(f"{out / ROBOT} already exists.\nGive another folder: out=FOLDER")
    make_folder(out)
    with progress("calibrating", STAGES + 2) as tell:
        outcome = _outcome(given, tell)
        tell(STAGES + 1)
        pages = _write(config, outcome, out)
    _print(outcome)
    for page in pages:
        print(f"{page}")
    return 0


def _outcome(given: GivenLogs, tell: Any) -> _Outcome:
    """Calibrate, derive the edited robot files, and propose the next flight."""
    config = given.config
    held = config.held_out
    unseen = None if held is None else find_log(str(held), key="held_out")
    log, robot = given.read()
    found = calibrated(
        log,
        [str(name) for name in config.parameters],
        robot=robot,
        held_out=None if unseen is None else replace(given, places=(unseen,)).read()[0],
        prior=float(config.prior),
        tell=tell,
    )
    words = f"{given.log_words}{given.robot_words}"
    found = replace(found, source=sources(given.places), given=words)
    folder = Path(config.robot.folder) if config.robot.folder else None
    edit = None if folder is None or robot is None else edited(found, folder, robot.robot)
    return _Outcome(found=found, edit=edit, flight=_next_flight(found) if config.plan else None)


def _write(config: Any, outcome: _Outcome, out: Path) -> list[Path]:
    """Write all files of a calibration; return their paths."""
    found, edit, flight = outcome.found, outcome.edit, outcome.flight
    answer = {**found.to_dict(), "next_experiment": None if flight is None else flight.to_dict()}
    write_json(out / ANSWER, finite(answer))
    pages = [out / ANSWER]
    if edit is not None and edit.diff:
        write_text(out / DIFF, edit.diff)
        pages.append(out / DIFF)
    if config.report:
        from seals.sysid.calibration.report import write_report

        diff, notes = ("", ()) if edit is None else (edit.diff, edit.notes)
        more = [] if flight is None else [flight.sentence]
        pages.append(write_report(found, out, diff=diff, notes=notes, more=more))
        choice = next(block for block in overlays(found) if isinstance(block, Choice))
        worst = next(iter(choice.options.values()))
        charts = [replace(chart, note="") for chart in worst if isinstance(chart, Chart)]
        pages.append(write_picture(out / PICTURE, charts))
    if config.apply and edit is not None:
        pages.append(write_robot(edit, out / ROBOT))
    return pages


def _print(outcome: _Outcome) -> None:
    """Print the table of numbers with remarks."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    found = outcome.found
    table = Table(box=None, pad_edge=False, header_style="bold")
    for k, name in enumerate(HEAD):
        table.add_column(name, justify="left" if k == 0 else "right", no_wrap=True)
    for number in found.numbers:
        table.add_row(*(escape(printable(cell)) for cell in row(found, number)))
    Console(file=drawing(sys.stdout), highlight=False, width=_WIDTH).print(table)
    flight = [] if outcome.flight is None else [outcome.flight.sentence]
    notes = () if outcome.edit is None else outcome.edit.notes
    print("\n".join([error_sentence(found), *remarks(found), *flight, *notes]))


PICTURE = "calibration.png"
