"""``seals train``: sets up environments and agent, trains, and writes the folder of the policy."""

from __future__ import annotations

import contextlib
import datetime
import re
import shlex
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from seals.config.build import build
from seals.config.compose import job_overrides, output_folder
from seals.config.overrides import key_of, typed
from seals.errors import ConfigError, SealsError
from seals.learn.devices import usable_device
from seals.learn.learner import Agent, Spaces, need_torch
from seals.learn.metadata import config_hash, world_hash
from seals.learn.policy import read_policy_metadata
from seals.learn.settings import check_own
from seals.learn.starts import training_seed
from seals.learn.training.checkpoint import FILE
from seals.learn.training.loop import POLICY, Outcome, Training, stopping, take_up
from seals.learn.training.schedule import TrainingSchedule
from seals.learn.training.settings import OWN, TrainSettings
from seals.learn.training.tracking import tracker_of
from seals.logs.atomic import write_json
from seals.robot.build import build_robot
from seals.run.progress import progress, spoken


@contextlib.contextmanager
def environments(config: Any) -> Iterator[tuple[Any, Any]]:
    """Build the environment of the training and that of the evaluations."""
    from seals.learn.environments import batched_of

    device = usable_device(str(config.device))
    count, episodes = int(config.count), int(config.course.episodes)
    judges = int(config.judges) or (episodes if "interval" in config.backend else 1)
    seed = training_seed(int(config.seed))
    values = _randomised_parameters(config, count, seed)
    environment = batched_of(
        config, count=count, device=device, seed=seed, values=values, coded=True
    )
    try:
        # an accelerator takes as long for a hundred robots as for thousands, pictures set apart
        where = "cpu" if environment.pixels is None else device
        few = min(judges, episodes)
        eval_env = batched_of(config, count=few, device=where, seed=seed, coded=True)
        try:
            yield environment, eval_env
        finally:
            eval_env.close()
    finally:
        environment.close()


def _randomised_parameters(config: Any, count: int, seed: int) -> dict[str, Any] | None:
    """Return the randomised effect parameters of the training's environments.

    Raises:
        ConfigError: an engine holds one robot a world, whose parameters are those configured.
    """
    share = float(config.varied)
    diagnosis = config.varied_from
    if share == 0.0 and diagnosis is None:
        return None
    if not {"interval", "touching"} & set(config.backend):
        said = f"varied={share:g}" if diagnosis is None else f"varied_from={diagnosis}"
        raise ConfigError(
            f"{said}: only the robots of a batch can differ from each other.\n"
            "Use backend=twin, or leave varied and varied_from out"
        )
    from seals.learn.environments.build import build_learning
    from seals.learn.environments.posterior import drawn_parameters, posterior_of

    settings = build_learning(config)[0]
    effects = settings.effects
    known = None
    if diagnosis is not None:
        root = build_robot(settings.robot).links[0]
        known = posterior_of(str(diagnosis), effects, config.model, root=root)
    rng = np.random.default_rng(seed)
    return dict(drawn_parameters(effects, count, share=share, rng=rng, known=known))


def _agent_of(config: Any, environment: Any) -> tuple[Agent, list[str]]:
    """Create the agent and give it demonstrations where configured; return it with remarks."""
    if config.get("learner") is None:
        raise ConfigError("learner is not given.\nChoose one: learner=sac; see seals list learner")
    learner = build(config.learner, where="learner")
    spaces = Spaces(
        observation_size=environment.observation_size,
        action_size=environment.action_size,
        count=environment.count,
        pixels=environment.pixels,
        names=tuple(environment.task.observation_names),
    )
    agent: Agent = learner.start(spaces, device=str(config.device), seed=int(config.seed))
    if agent.wants == "must" and config.demonstrations is None:
        raise ConfigError(
            "this learner needs demonstrations, and none are given.\n"
            "Record some with seals record and give demonstrations=FOLDER; learners that do not "
            "require them accept learner.demonstrations=none"
        )
    if agent.wants == "no" and config.demonstrations is not None:
        raise ConfigError(
            f"demonstrations={config.demonstrations}: this learner does not use them.\n"
            "Choose learner=sacfd, rlpd or bc, or learner.demonstrations=buffer with sac"
        )
    if config.demonstrations is None:
        return agent, []
    columns, remarks = _read_demonstrations(config, environment)
    agent.add_demonstrations(columns)
    return agent, remarks


def _read_demonstrations(config: Any, environment: Any) -> tuple[dict[str, Any], list[str]]:
    """Read the demonstrations and check that they belong to this environment."""
    from seals.learn.demonstrations.folder import read
    from seals.learn.shipped import demonstrations_folder

    found = read(demonstrations_folder(str(config.demonstrations)))
    if config.shown:
        found = found.first(int(config.shown))
    if config.shuffled:
        found = found.shuffled(seed=int(config.seed))
    columns: dict[str, Any] = dict(found.transitions())
    sizes = columns["observation"].shape[1], columns["action"].shape[1]
    wanted = environment.observation_size, environment.action_size
    if sizes != wanted:
        raise ConfigError(
            f"demonstrations={config.demonstrations}: observations of {sizes[0]} numbers and "
            f"actions of {sizes[1]}.\nThis environment has {wanted[0]} and {wanted[1]}: "
            "record them in it."
        )
    if environment.pixels is not None:
        if "pixels" not in columns:
            raise ConfigError(
                f"demonstrations={config.demonstrations}: they contain no pictures.\n"
                "Record them in this environment."
            )
        for name, pixels in (("observation", "pixels"), ("next_observation", "next_pixels")):
            columns[name] = {"state": columns[name], "pixels": columns.pop(pixels)}
    remarks = []
    if found.origin.config_hash != world_hash(config):
        remarks.append(
            "the demonstrations were recorded in another world than that of the training"
        )
    return {k: value for k, value in columns.items() if not k.endswith("pixels")}, remarks


FREE = ("course", "resume", "threads", "name", "film", "track")
"""Keys that do not make another training."""
ROW = 5
"""Width of the first column of the learning curve; one row for each per cent is enough."""


def execute(config: Any) -> int:
    """Run the training of a composed configuration; results go to Hydra's run folder.

    Args:
        config: with the keys of `seals.learn.training.settings.TrainSettings`.

    Raises:
        SealsError: something cannot be used, or the training failed; what there is stays.
        KeyboardInterrupt: it was interrupted; a checkpoint was written.
    """
    need_torch()
    folder, overrides = output_folder(), job_overrides()
    resume, config.resume = config.resume is not None, None
    try:
        outcome = _train_into(folder, config, overrides=overrides, resume=resume)
    except KeyboardInterrupt:
        if (folder / FILE).exists():
            print(f"To continue: seals train {typed('resume', str(folder))}", file=sys.stderr)
        raise
    ended = "good enough early" if outcome.early else "done"
    success = "" if outcome.success is None else f", success {outcome.success:.0%}"
    print(
        f"{ended}: {outcome.step} control steps, {outcome.updates} updates, "
        f"{outcome.seconds:.0f} s{success}"
    )
    print(folder / POLICY)
    print(f"To fly it from held-out starts: {_flight(config, folder, overrides)}")
    return 0


def _flight(config: Any, folder: Path, overrides: Sequence[str]) -> str:
    """Return the command that flies a policy; that of twins in the quickest engine.

    One that looks at pictures stays in twins: other environments have none.
    """
    words = [typed("policy", str(folder / POLICY)), *map(shlex.quote, _of_environment(overrides))]
    if "interval" in config.backend:
        sees = read_policy_metadata(folder / POLICY)["network"].get("pixels", {}).get("use_pixels")
        words = [word for word in words if key_of(word).partition(".")[0] != "backend"]
        words.append(f"backend={'twin' if sees else 'mujoco'}")
    return f"seals evaluate {' '.join([*words, 'beside=[]'])}"


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

    torch.set_num_threads(max(1, int(config.threads)))
    check_own(config, TrainSettings)
    course = _schedule(config)
    facts = _facts(config, overrides or [])
    if config.film:
        from seals.learn.film import refuse_unfilmed

        refuse_unfilmed(config)
    with contextlib.ExitStack() as stack:
        environment, eval_env = stack.enter_context(environments(config))
        agent, remarks = _agent_of(config, environment)
        total = course.steps if agent.interactive else max(1, agent.due())
        metrics = {"success": "-", "row": ""}

        def heard(success: float, gained: float) -> None:
            row = _curve_row(training, total, success, gained)
            if row[:ROW] != metrics["row"][:ROW]:
                print(row, file=sys.stderr, flush=True)
            metrics.update(success=f"{success:.0%}", row=row)

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
                heard=heard,
                tracker=tracker,
            )
            if resume:
                remarks += take_up(training, device=str(config.device))
            outcome = _run(training, folder, facts, remarks)
        if config.film:
            _film(folder, eval_env, config)
        return outcome


def _curve_row(training: Training, total: int, success: float, gained: float) -> str:
    """Return a row of the learning curve: share of the course, times, success, mean return."""
    done = training.step if training.agent.interactive else training.updates
    spent, bar = training.seconds, "#" * round(20 * success)
    left = f"{spoken(spent * max(total - done, 0) / done)} left" if done else "-"
    place = f"{done / max(total, 1):.0%}".rjust(ROW) + f" {spoken(spent):>8} {left:>14}"
    return f"{place}  |{bar:<20}| {success:>4.0%}, return {gained:.4g}"


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

    words = [word for word in facts["overrides"] if key_of(word) != "resume"]
    print(f"seals train {' '.join(map(shlex.quote, words))}", file=sys.stderr)
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
    task = environment.task
    names = {"observation": list(task.observation_names), "action": list(task.action_names)}
    own = _of_environment(facts["overrides"])
    return {**{key: facts[key] for key in keys}, "overrides": own, **names}


def _of_environment(overrides: Sequence[str]) -> list[str]:
    """Return the overrides that make the environment: the first part of a key decides."""
    roots = [re.split("[=.@]", word.lstrip("+~"), maxsplit=1)[0] for word in overrides]
    pairs = zip(overrides, roots, strict=True)
    return [word for word, root in pairs if root not in (*OWN, *FREE, "seed")]
