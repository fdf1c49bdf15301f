"""``seals plan``: proposes the manoeuvre that tells effects apart, as text, picture and file."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from seals.errors import ConfigError
from seals.logs.atomic import write_json
from seals.sound_numbers import refuse_undefined, trials
from seals.sysid.candidates.parameters import CandidateSet
from seals.sysid.experiment_design.plan import Plan, proposal, table
from seals.sysid.experiment_design.ranking import STAGES, propose
from seals.sysid.experiment_design.supposed import variants_of
from seals.sysid.predictors.problem import prepare
from seals.sysid.report.given_logs import GivenLogs, given_logs, make_folder, robot_name
from seals.sysid.validation.answer import Answer, load_answer, noted_logs

ANSWER, PICTURE, EXPERIMENT = "plan.json", "plan.png", "experiment.yaml"


def execute(config: Any) -> int:
    """Run one composed plan and return its exit code.

    Raises:
        ConfigError: no log or no effects are given, or they do not go together.
        LogError: the log cannot be used.
    """
    from hydra.core.hydra_config import HydraConfig

    from seals.run.progress import progress

    answer = Answer() if config.diagnosis is None else load_answer(str(config.diagnosis))[1]
    names = [str(n) for n in config.between] or _open_question(answer, str(config.diagnosis))
    places = config.log if config.log is not None else noted_logs(answer.tables)
    if not places:
        raise ConfigError(
            "log is not given.\nSay of which vehicle: seals plan effects=[NAME,NAME] log=FOLDER"
        )
    given = given_logs(config, places, noted=answer.without)
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


def _open_question(given: Answer, place: str) -> list[str]:
    """Return the effects that a diagnosis could not tell apart."""
    if not given.verdict:
        raise ConfigError(
            "effects is not given.\nSay which: seals plan effects=[payload,thrust_coefficient]"
            " log=FOLDER, or diagnosis=FOLDER"
        )
    if not given.ambiguous_with:
        raise ConfigError(
            f"diagnosis={place}: the verdict is '{given.verdict}', with nothing left open.\n"
            "Name the effects yourself: effects=[payload,thrust_coefficient]"
        )
    return list(dict.fromkeys(given.ambiguous_with[0]))


def _known(
    candidate_set: CandidateSet, given: Answer, names: list[str]
) -> dict[str, dict[str, float]]:
    """Fitted values of the effects of a diagnosis, by parameter key."""
    out: dict[str, dict[str, float]] = {}
    for effect in given.effects:
        name, told = effect.name, {key: one.value for key, one in effect.parameters.items()}
        if name not in names:
            continue
        for candidate in variants_of(candidate_set, name):
            if candidate.identification.guessed:
                continue
            variant = {k: v for k, v in candidate.variant.items() if k in ("rotor", "joint")}
            if any(told.get(k) != v for k, v in variant.items()):
                continue
            pairs = zip(candidate.keys, candidate.reported, strict=True)
            shown = {k: told.get(r) for k, r in pairs}
            found = {k: v for k, v in shown.items() if isinstance(v, float)}
            if len(found) == len(candidate.keys) and any(found.values()):
                out[name] = found
                break
    return out
