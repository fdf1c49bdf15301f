"""``seals diagnose``: reads a log, names what its model is missing, writes answer and report."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from seals.config.compose import output_folder
from seals.errors import ConfigError, LogError, refuse_absent
from seals.file_names import DIAGNOSIS
from seals.logs.atomic import finite, write_json
from seals.logs.log import Log
from seals.schema import check_fields
from seals.sound_numbers import sound_numbers, trials
from seals.sysid.data.robot_description import RobotDescription, name_in
from seals.sysid.decision.verdict import Verdict
from seals.sysid.diagnosis import Diagnosis, diagnose
from seals.sysid.parallel import Beside, cores
from seals.sysid.predictors.problem import Problem
from seals.sysid.report.given_logs import (
    GivenLogs,
    bad_data,
    given_logs,
    make_folder,
    sources,
)
from seals.sysid.report.sentence import sentence
from seals.sysid.report.settings import DiagnoseSettings
from seals.sysid.report.words import next_steps
from seals.sysid.residual_force import Localisation, locate_residual_force, residual_of
from seals.sysid.residual_force.residual import Residual
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis
from seals.sysid.selection.search import Search
from seals.sysid.validation.writing import models_of

_STEP = 32
"""Ticks of the progress bar a stage."""
STAGES = 6
_ADVICE = (
    "Give a longer log, or look for extreme values; a log without a pose is simulated from its "
    "stated "
    "initial state: measure pose or velocity, use a shorter span, or state the initial state "
    "with a larger sigma."
)


def execute(config: Any) -> int:
    """Run one composed diagnosis and return its exit code.

    Raises:
        ConfigError: no log is given, or it is not there.
    """
    from seals.run.progress import progress

    refuse_absent(config.log, "log", "seals diagnose log=FOLDER out=FOLDER")
    given = given_logs(config)
    out = output_folder(config.out)
    make_folder(out)
    if config.healthy is not None:
        from seals.sysid.report.healthy_application import compare

        return compare(given, out)
    with progress("diagnosing", STAGES * _STEP) as tell:
        try:
            log, robot = given.read()
            processes = int(config.processes) or cores()
            with sound_numbers("a diagnosis", _ADVICE), trials(), _LeftOver(processes) as beside:
                found = _found(given, log, robot, beside, lambda stage: tell(stage * _STEP))
                missing, then = beside.results(found, report=config.report)
        except LogError as refusal:
            _write(out, bad_data(str(refusal)))
            print(f"bad data: {refusal}")
            return Verdict.bad_data.exit_code
        _write(out, answer_of(found, missing, vehicle=name_in(log.meta)))
        tell(STAGES * _STEP - 1)
        pages = []
        if config.report:
            from seals.sysid.report.report import write_report

            page = write_report(found, log, out, localisation=missing, residual_after=then)
            pages.append(page)
    print(sentence(found))
    print(_told(found, missing), end="")
    print(_commands(found, missing, out), end="")
    for page in (out / DIAGNOSIS, *pages):
        print(f"{page}")
    return found.answer.verdict.exit_code


class _LeftOver:
    """Analysis of what the stated model lacks, beside the decision, and of what is left after.

    Args:
        processes: at once.
    """

    def __init__(self, processes: int) -> None:
        self._processes = processes
        self._job: Beside | None = None

    def __enter__(self) -> _LeftOver:
        return self

    def __exit__(self, *_: object) -> None:
        if self._job is not None:
            self._job.stop()

    def start(self, problem: Problem, search: Search[EvidenceHypothesis]) -> None:
        """Begin with the stated model of a search, in place of that of an earlier one."""
        if self._job is not None:
            self._job.stop()
        nominal = search.nominal
        self._job = Beside(lambda: locate_residual_force(problem, nominal), self._processes)

    def results(self, found: Diagnosis, *, report: bool) -> tuple[Localisation, Residual | None]:
        """Return the analysis of the stated model, and of the one in the report."""
        from seals.sysid.report.report import model_after

        assert self._job is not None
        after = model_after(found) if report else None
        then = residual_of(found.problem, after) if after and after.candidates else None
        return self._job.result(), then


def _found(
    given: GivenLogs,
    log: Log,
    robot: RobotDescription | None,
    beside: _LeftOver,
    tell: Callable[[int], None],
) -> Diagnosis:
    """Diagnose a log, and propose a flight for effects that it cannot tell apart."""
    processes = int(given.config.processes)
    check_fields(DiagnoseSettings, {"processes": processes}, where="")
    found = diagnose(
        log, robot=robot, processes=processes or cores(), tell=tell, searched=beside.start
    )
    found = replace(
        found,
        source=sources(given.places),
        without=given.without,
        given_log=given.log_words,
        given_robot=given.robot_words,
    )
    if not given.config.plan:
        return found
    return replace(found, next_experiment=_proposed(found))


def _proposed(found: Diagnosis) -> dict[str, Any] | None:
    """Return the manoeuvre that would tell the open effects apart, see ``seals plan``, or None."""
    from seals.sysid.experiment_design.ranking import propose

    answer = found.answer
    if answer.verdict is Verdict.ambiguous:
        claim = answer.claims[0]
        names = [claim.name, *claim.rivals]
    elif answer.verdict is Verdict.cannot_tell and answer.blind:
        names = list(answer.blind[:1])
    else:
        return None
    try:
        return propose(found.problem, names, known=found.known()).to_dict()
    except ConfigError as refusal:
        # nothing of the library suits this vehicle: the reason belongs in the answer
        return {"effects": names, "sentence": str(refusal)}


def answer_of(found: Diagnosis, missing: Localisation, *, vehicle: str = "") -> dict[str, Any]:
    """Return the content of ``diagnosis.json``: residual force and models beside the diagnosis.

    Args:
        found: the diagnosis.
        missing: analysis of the residual force.
        vehicle: name that the log gives its vehicle.
    """
    law = missing.formula
    return {
        **found.to_dict(),
        "signature": list(missing.signature.sentences),
        "formula": None if law is None else {**law.to_dict(), "words": str(law)},
        "models": models_of(found, law, vehicle=vehicle),
    }


def _told(found: Diagnosis, missing: Localisation) -> str:
    """Return the text beside the verdict: signature of an unknown effect, next flight."""
    lines = []
    if found.answer.verdict is Verdict.none_of_these:
        lines += [f"  {line}" for line in missing.signature.sentences]
        if missing.formula is not None:
            lines.append(f"  a formula: {missing.formula}")
    if found.next_experiment is not None:
        lines.append(f"Next: {found.next_experiment['sentence']}")
    return "".join(f"{line}\n" for line in lines)


def _commands(found: Diagnosis, missing: Localisation, out: Path) -> str:
    """Return the commands that come next, but for those that the verdict itself names."""
    table = found.to_dict()
    if found.answer.verdict is Verdict.cannot_tell and table["stated_wrong"]:
        return ""
    lines = next_steps(found, table, missing.formula, out)[1].splitlines()
    return "".join(["Next:\n", *(f"  {line}\n" for line in lines)]) if lines else ""


def _write(out: Path, answer: dict[str, Any]) -> None:
    write_json(out / DIAGNOSIS, finite(answer))
