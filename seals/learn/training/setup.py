"""Set-up of a training: environments, agent and demonstrations."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

import numpy as np

from seals.config.build import build
from seals.errors import ConfigError
from seals.learn.devices import usable_device
from seals.learn.learner import Agent, Spaces
from seals.learn.starts import training_seed
from seals.learn.training.settings import TrainSettings
from seals.learn.world_hash import world_hash
from seals.robot.build import build_robot
from seals.schema import check_value, parameters_of


@contextlib.contextmanager
def environments(config: Any) -> Iterator[tuple[Any, Any]]:
    """Build the environment of the training and that of the evaluations."""
    from seals.learn.environments import batched_of

    device = usable_device(str(config.device))
    count, episodes = int(config.count), int(config.course.episodes)
    if count < 1 or config.judges < 0:
        raise ConfigError(
            f"count={count}, judges={config.judges} is not allowed.\n"
            "Allowed: count=1 or more, judges=0 or more."
        )
    judges = int(config.judges) or (episodes if "interval" in config.backend else 1)
    seed = training_seed(int(config.seed))
    values = _randomised_parameters(config, count, seed)
    environment = batched_of(config, count=count, device=device, seed=seed, values=values)
    try:
        # an accelerator takes as long for a hundred robots as for thousands, pictures set apart
        where = "cpu" if environment.pixels is None else device
        few = min(judges, episodes)
        eval_env = batched_of(config, count=few, device=where, seed=seed, fused=False)
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
    check_value("varied", share, parameters_of(TrainSettings)["varied"])
    diagnosis = config.varied_from
    if share == 0.0 and diagnosis is None:
        return None
    if not {"interval", "touching"} & set(config.backend):
        said = f"varied={share:g}" if diagnosis is None else f"varied_from={diagnosis}"
        raise ConfigError(
            f"{said}: only twins differ from one another, and batches of worlds.\n"
            "Say backend=twin, or leave varied and varied_from out"
        )
    from seals.learn.environments.build import build_learning
    from seals.learn.environments.domain_randomisation import drawn_parameters
    from seals.learn.environments.posterior import posterior_of

    settings = build_learning(config)[0]
    effects = settings.effects
    known = None
    if diagnosis is not None:
        root = build_robot(settings.robot).links[0]
        known = posterior_of(str(diagnosis), effects, config.model, root=root)
    rng = np.random.default_rng(seed)
    return dict(drawn_parameters(effects, count, share=share, rng=rng, known=known))


def agent_of(config: Any, environment: Any) -> tuple[Agent, list[str]]:
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
            "Record some with seals record and give demonstrations=FOLDER; learners that can "
            "do without take learner.demonstrations=none"
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
                f"demonstrations={config.demonstrations}: they hold no pictures.\n"
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
