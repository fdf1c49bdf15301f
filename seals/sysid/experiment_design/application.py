"""``seals plan``: proposes the manoeuvre that tells effects apart, as text, picture and file."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from seals.errors import ConfigError, LogError
from seals.logs.atomic import write_json
from seals.sound_numbers import refuse_undefined, trials
from seals.sysid.candidates.parameters import CandidateSet
from seals.sysid.experiment_design.plan import Plan, proposal, table
from seals.sysid.experiment_design.ranking import STAGES, propose
from seals.sysid.experiment_design.supposed import variants_of
from seals.sysid.predictors.problem import prepare
from seals.sysid.report.given_logs import GivenLogs, given_logs, make_folder, robot_name
from seals.sysid.validation.answer import logs_of, noted_logs
from seals.sysid.validation.answer_form import refuse_damaged
from seals.untrusted_io import read_json

ANSWER, PICTURE, EXPERIMENT = "plan.json", "plan.png", "experiment.yaml"
_DIAGNOSIS = "diagnosis.json"


def execute(config: Any) -> int:
    """Run one composed plan and return its exit code.

    Raises:
        ConfigError: no log or no effects are given, or they do not go together.
        LogError: the log cannot be used.
    """
    from hydra.core.hydra_config import HydraConfig

    from seals.run.progress import progress

    answer = {} if config.diagnosis is None else read_diagnosis(Path(str(config.diagnosis)))
    names = [str(n) for n in config.between] or _open_question(answer, str(config.diagnosis))
    noted = [str(name) for name in answer.get("without") or ()]
    places = config.log if config.log is not None else noted_logs(logs_of(answer))
    if not places:
        raise ConfigError(
            "log is not given.\nSay of which vehicle: seals plan effects=[NAME,NAME] log=FOLDER"
        )
    given = given_logs(config, places, noted=noted)
    out = Path(config.out or HydraConfig.get().runtime.output_dir)
    with progress("planning", STAGES + 2) as tell, trials():
        log, robot = given.read()
        problem = prepare(log, robot=robot)
        tell(1)
        known = _known(problem.plant.candidate_set, answer, names)
        found = propose(
            problem,
            names,
            known=known,
            quick=False,
            seed=config.seed,
            tell=lambda done: tell(1 + done),
        )
    refuse_undefined("plan", [found.best.separation])
    words = [f"robot={robot_name(config)}"] if config.robot.folder else []
    command = shlex.join(["seals", "run", f"experiment={out / EXPERIMENT}", *words])
    write_plan(found, out, given=given, meta=log.meta, command=command)
    print(f"{proposal(found)}\n\n{table(found)}\n\n{out / ANSWER}")
    print(f"Next, to fly it in the simulator:\n  {command} out=ANOTHER_LOG")
    return 0


def write_plan(
    plan: Plan, out: Path, *, given: GivenLogs, meta: Mapping[str, Any], command: str
) -> None:
    """Write the plan's numbers, picture and experiment into a folder.

    Args:
        plan: to be written.
        out: folder, made where it is not there.
        given: logs for which it was made.
        meta: description of the vehicle, as the log has it.
        command: that flies the manoeuvre.

    Raises:
        ConfigError: the folder cannot be made.
    """
    from seals.sysid.experiment_design.experiment import write_experiment
    from seals.sysid.experiment_design.picture import write_pictures

    make_folder(out)
    logs = [str(place) for place in given.places]
    write_json(out / ANSWER, {**plan.to_dict(), "log": logs[0] if len(logs) == 1 else logs})
    write_experiment(
        out / EXPERIMENT, plan, meta, without=given.without if given.robot else (), command=command
    )
    write_pictures(out / PICTURE, plan)


def read_diagnosis(place: Path) -> dict[str, Any]:
    """Read the answer of an earlier diagnosis.

    Raises:
        ConfigError: there is none.
    """
    path = place / _DIAGNOSIS if place.is_dir() else place
    try:
        answer = read_json(path)
    except LogError as error:
        fault = str(error).partition("\n")[0].rstrip(".")
        raise ConfigError(
            f"diagnosis={place}: {fault}.\n"
            "Give the folder of an answer: seals diagnose log=FOLDER out=FOLDER writes one."
        ) from error
    if not isinstance(answer, dict) or "verdict" not in answer:
        raise ConfigError(
            f"diagnosis={place} holds no verdict.\nGive what seals diagnose wrote, {_DIAGNOSIS}."
        )
    try:
        refuse_damaged(answer)
    except ValueError as cause:
        raise ConfigError(f"{path} is damaged: {cause}.\nDiagnose the log again.") from cause
    return answer


def _open_question(given: Mapping[str, Any], place: str) -> list[str]:
    """Return the effects that a diagnosis could not tell apart."""
    if not given:
        raise ConfigError(
            "effects is not given.\nSay which: seals plan effects=[payload,thrust_coefficient]"
            " log=FOLDER, or diagnosis=FOLDER"
        )
    sets = [list(map(str, s)) for s in given.get("ambiguous_with") or []]
    if not sets:
        raise ConfigError(
            f"diagnosis={place}: the verdict is '{given['verdict']}', with nothing left open.\n"
            "Name the effects yourself: effects=[payload,thrust_coefficient]"
        )
    return list(dict.fromkeys(sets[0]))


def _known(
    candidate_set: CandidateSet, given: Mapping[str, Any], names: list[str]
) -> dict[str, dict[str, float]]:
    """Fitted values of the effects of a diagnosis, by parameter key."""
    out: dict[str, dict[str, float]] = {}
    for effect in given.get("effects", []):
        name, parameters = str(effect.get("name")), effect.get("parameters") or {}
        if name not in names:
            continue
        for candidate in variants_of(candidate_set, name):
            if candidate.identification.guessed:
                continue
            variant = {k: v for k, v in candidate.variant.items() if k in ("rotor", "joint")}
            if any(parameters.get(k, {}).get("value") != v for k, v in variant.items()):
                continue
            pairs = zip(candidate.keys, candidate.reported, strict=True)
            shown = {k: parameters[r]["value"] for k, r in pairs if r in parameters}
            found = {k: float(v) for k, v in shown.items() if not isinstance(v, str)}
            if len(found) == len(candidate.keys) and any(found.values()):
                out[name] = found
                break
    return out
