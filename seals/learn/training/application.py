"""``seals train``: trains a policy and writes its folder with learning curves."""

from __future__ import annotations

import contextlib
import datetime
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from seals.config.overrides import typed
from seals.errors import SealsError
from seals.learn.learner import need_torch
from seals.learn.metadata import config_hash
from seals.learn.training.checkpoint import FILE
from seals.learn.training.loop import POLICY, Outcome, Training
from seals.learn.training.resumption import stopping, take_up
from seals.learn.training.schedule import TrainingSchedule
from seals.learn.training.settings import OWN
from seals.learn.training.setup import agent_of, environments
from seals.learn.training.tracking import tracker_of
from seals.learn.world_hash import world_hash
from seals.logs.atomic import write_json

FREE = ("course", "resume", "threads", "name", "film", "track")
"""Keys that do not make another training."""


def execute(config: Any) -> int:
    """Run the training of a composed configuration; results go to Hydra's run folder.

    Args:
        config: with the keys of `seals.learn.training.settings.TrainSettings`.

    Raises:
        SealsError: something cannot be used, or the training failed; what there is stays.
        KeyboardInterrupt: it was interrupted; a checkpoint was written.
    """
    from hydra.core.hydra_config import HydraConfig

    need_torch()
    hydra = HydraConfig.get()
    folder, overrides = Path(hydra.runtime.output_dir), list(hydra.overrides.task)
    resume, config.resume = config.resume is not None, None
    try:
        outcome = _train_into(folder, config, overrides=overrides, resume=resume)
    except KeyboardInterrupt:
        if (folder / FILE).exists():
            print(f"To go on: seals train {typed('resume', str(folder))}", file=sys.stderr)
        raise
    ended = "good enough early" if outcome.early else "done"
    success = "" if outcome.success is None else f", success {outcome.success:.0%}"
    print(
        f"{ended}: {outcome.step} control steps, {outcome.updates} updates, "
        f"{outcome.seconds:.0f} s{success}"
    )
    print(folder / POLICY)
    return 0


def _train_into(
    folder: Path, config: Any, *, overrides: list[str] | None = None, resume: bool = False
) -> Outcome:
    """Train and write a folder: curves, policy, ``run.json``.

    Args:
        folder: where to.
        config: composed from the root ``train``.
        overrides: what the user wrote, for the policy's metadata.
        resume: whether to take up the checkpoint in the folder.

    Raises:
        SealsError: something cannot be used.
    """
    import torch

    from seals.run.progress import progress

    torch.set_num_threads(max(1, int(config.threads)))
    course = _schedule(config)
    facts = _facts(config, overrides or [])
    if config.film:
        from seals.learn.film import refuse_unfilmed

        refuse_unfilmed(config)
    with contextlib.ExitStack() as stack:
        environment, eval_env = stack.enter_context(environments(config))
        agent, remarks = agent_of(config, environment)
        if config.backend.get("fused"):
            remarks.append("the first step compiles the twins, which takes some minutes")
        total = course.steps if agent.interactive else max(1, agent.due())
        metrics = {"success": "-"}
        tracker = tracker_of(config.track, folder, facts)
        if tracker is not None:
            stack.callback(tracker.close)
        with progress("training", total, lambda: f"success {metrics['success']}") as tell:
            training = Training(
                environment,
                agent,
                course=course,
                folder=folder,
                eval_env=eval_env,
                metadata=_metadata(facts, environment),
                seed=int(config.seed),
                tell=tell,
                heard=lambda success: metrics.update(success=f"{success:.0%}"),
                tracker=tracker,
            )
            if resume:
                remarks += take_up(training, device=str(config.device))
            outcome = _run(training, folder, facts, remarks)
        if config.film:
            _film(folder, eval_env, config)
        return outcome


def _film(folder: Path, eval_env: Any, config: Any) -> None:
    """Film the policy; an error in it does not lose a completed training."""
    from seals.learn.film import FILM, film
    from seals.learn.policy import load_policy
    from seals.learn.starts import validation_seeds

    policy = load_policy(folder / POLICY, device=eval_env.device)
    try:
        print(film(eval_env, policy, validation_seeds(1)[0], config=config, path=folder / FILM))
    except SealsError as cause:
        print(f"note: there is no film of the policy. {cause}", file=sys.stderr)


def _run(training: Training, folder: Path, facts: Mapping[str, Any], remarks: list[str]) -> Outcome:
    """Run a training and record its progress in ``run.json``."""

    def note(state: str, **more: Any) -> None:
        place = {
            "step": training.step,
            "updates": training.updates,
            "seconds": round(training.seconds, 3),
            "success": training.success,
        }
        write_json(folder / "run.json", {"state": state, **facts, **place, **more})

    for remark in remarks:
        print(f"note: {remark}", file=sys.stderr)
    note("running", remarks=remarks)
    try:
        with stopping(training):
            outcome = training.run()
    except KeyboardInterrupt:
        note("interrupted", remarks=remarks)
        raise
    except Exception as cause:  # whatever it was, the folder says that it was not finished
        note("failed", remarks=remarks, message=f"{type(cause).__name__}: {cause}")
        raise
    note("done", remarks=remarks, early=outcome.early)
    return outcome


def _schedule(config: Any) -> TrainingSchedule:
    from omegaconf import OmegaConf

    from seals.schema import check_tree

    values: Any = OmegaConf.to_container(config.course, resolve=True)
    values.pop("_target_", None)
    course = TrainingSchedule(**values)
    check_tree(course, where="course")
    return course


def _facts(config: Any, overrides: Sequence[str]) -> dict[str, Any]:
    """Return the run's metadata besides its learning curve."""
    from omegaconf import OmegaConf

    from seals.run.provenance import revision, versions

    plain: Any = OmegaConf.to_container(config, resolve=True, enum_to_str=True)
    # the name by which the learner was chosen, else that of its class
    chosen = [word.partition("=")[2] for word in overrides if word.startswith("learner=")]
    target = str(config.learner.get("_target_", "")) if config.get("learner") else ""
    return {
        "learner": chosen[-1] if chosen else target.rpartition(".")[2].lower(),
        "seed": int(config.seed),
        "env": str(config.name),
        "config_hash": config_hash({k: v for k, v in plain.items() if k not in FREE}),
        "world_hash": world_hash(config),
        "count": int(config.count),
        "device": str(config.device),
        "versions": versions(),
        "git": revision(Path(__file__).resolve().parent),
        "overrides": list(overrides),
        "started": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"),
    }


def _metadata(facts: Mapping[str, Any], environment: Any) -> dict[str, Any]:
    keys = ("learner", "seed", "env", "config_hash", "world_hash")
    # the first part of the key of an override decides
    roots = [re.split("[=.@]", word.lstrip("+~"), maxsplit=1)[0] for word in facts["overrides"]]
    pairs = zip(facts["overrides"], roots, strict=True)
    own = [word for word, root in pairs if root not in (*OWN, *FREE, "seed")]
    task = environment.task
    names = {"observation": list(task.observation_names), "action": list(task.action_names)}
    return {**{key: facts[key] for key in keys}, "overrides": own, **names}
