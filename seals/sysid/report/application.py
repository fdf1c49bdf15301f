"""``seals diagnose``: reads a log, names what its model is missing, writes answer and report."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from seals.errors import ConfigError, LogError
from seals.logs.atomic import finite, write_json
from seals.logs.log import Log
from seals.run.hidden import hide
from seals.schema import check_fields
from seals.sound_numbers import sound_numbers
from seals.sysid.data.join import join_logs
from seals.sysid.data.robot_description import RobotDescription, describe_run, described
from seals.sysid.decision.verdict import Verdict
from seals.sysid.diagnosis import Diagnosis, diagnose
from seals.sysid.parallel import cores, spread
from seals.sysid.report.given_logs import make_folder, places_of, read_log, sources
from seals.sysid.report.sentence import sentence
from seals.sysid.report.settings import DiagnoseSettings
from seals.sysid.residual_force import Localisation, locate_residual_force, residual_of
from seals.sysid.residual_force.residual import Residual

ANSWER = "diagnosis.json"
_STEP = 32
"""Ticks of the progress bar a stage."""
STAGES = 6
_ADVICE = "Give a longer log, or look for numbers far from all others."


def execute(config: Any) -> int:
    """Run one composed diagnosis and return its exit code.

    Raises:
        ConfigError: no log is given, or it is not there.
    """
    from hydra.core.hydra_config import HydraConfig

    from seals.run.progress import progress

    if config.log is None:
        raise ConfigError("log is not given.\nSay which: seals diagnose log=FOLDER out=FOLDER")
    places = places_of(config.log, key="log")
    robot = described(config) or describe_run(places[0])
    out = Path(config.out or HydraConfig.get().runtime.output_dir)
    make_folder(out)
    with progress("diagnosing", STAGES * _STEP) as tell:
        try:
            log = join_logs([_without(read_log(config, place), config) for place in places])
            with sound_numbers("a diagnosis", _ADVICE):
                found = _found(config, log, robot, places, lambda stage: tell(stage * _STEP))
                missing, then = _left_over(config, found)
        except LogError as refusal:
            _write(out, _bad(str(refusal)))
            print(f"bad data: {refusal}")
            return Verdict.bad_data.exit_code
        _write(out, answer_of(found, missing))
        tell(STAGES * _STEP - 1)
        pages = [_report(found, log, out, missing, then)] if config.report else []
    print(sentence(found))
    print(_told(found, missing), end="")
    for page in (out / ANSWER, *pages):
        print(f"{page}")
    return found.answer.verdict.exit_code


def _without(log: Log, config: Any) -> Log:
    """Return the log with some effects removed from its nominal model."""
    names = [str(name) for name in config.without]
    if not names:
        return log
    entries, around = log.meta.get("baseline") or [], dict(log.meta.get("environment") or {})
    gone, change = hide(names, entries, around.get("wave"), key="without")
    kept = [e for e in entries if str(e.get("instance", e["name"])) not in gone]
    return replace(log, meta={**log.meta, "baseline": kept, "environment": around | change})


def _found(
    config: Any,
    log: Log,
    robot: RobotDescription | None,
    places: Sequence[Path],
    tell: Callable[[int], None],
) -> Diagnosis:
    """Diagnose a log, and propose a flight for effects that it cannot tell apart."""
    processes = int(config.processes)
    check_fields(DiagnoseSettings, {"processes": processes}, where="")
    found = diagnose(log, robot=robot, processes=processes or cores(), tell=tell)
    logs = ",".join(map(str, places))
    found = replace(
        found,
        source=sources(places),
        given_log=shlex.quote(f"log=[{logs}]" if len(places) > 1 else f"log={logs}"),
        given_robot=shlex.quote(f"robot={config.robot.folder}") if config.robot.folder else "",
    )
    if not config.plan:
        return found
    return replace(found, next_experiment=proposed(found))


def _left_over(config: Any, found: Diagnosis) -> tuple[Localisation, Residual | None]:
    """Return the analysis of what the nominal model lacks, and what the one in the report does."""
    problem = found.problem
    work: list[Callable[[], Any]] = [lambda: locate_residual_force(problem, found.search.nominal)]
    if config.report:
        from seals.sysid.report.report import model_after

        after = model_after(found)
        work += [lambda: residual_of(problem, after)] if after.candidates else []
    missing, *then = spread(lambda job: job(), work, int(config.processes) or cores())
    return missing, then[0] if then else None


def proposed(found: Diagnosis) -> dict[str, Any] | None:
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


def answer_of(found: Diagnosis, missing: Localisation) -> dict[str, Any]:
    """Return the content of ``diagnosis.json``, with the analysis of the residual force."""
    law = missing.formula
    return {
        **found.to_dict(),
        "signature": list(missing.signature.sentences),
        "formula": None if law is None else {**law.to_dict(), "words": str(law)},
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


def _report(
    found: Diagnosis, log: Log, out: Path, missing: Localisation, then: Residual | None
) -> Path:
    from seals.sysid.report.report import write_report

    return write_report(found, log, out, localisation=missing, residual_after=then)


def _bad(words: str) -> dict[str, Any]:
    return {
        "verdict": Verdict.bad_data.value,
        "effects": [],
        "ambiguous_with": [],
        "next_experiment": None,
        "held_out_error": None,
        "reasons": [words],
    }


def _write(out: Path, answer: dict[str, Any]) -> None:
    write_json(out / ANSWER, finite(answer))
