"""``seals record``: records the episodes of a policy as demonstrations."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from seals.config.compose import output_folder
from seals.errors import ConfigError, refuse_unlisted
from seals.file_names import refuse_taken
from seals.learn.demonstrations.episode import Demonstrations, Episode, Origin, Who
from seals.learn.demonstrations.exchange import write_hdf5
from seals.learn.demonstrations.folder import read, write
from seals.learn.demonstrations.recording import record
from seals.learn.demonstrations.settings import RecordSettings
from seals.learn.devices import usable_device
from seals.learn.learner import need_torch
from seals.learn.metadata import world_config, world_hash
from seals.learn.settings import check_own
from seals.learn.shipped import demonstrations_folder
from seals.learn.starts import training_seed

FOLDER = "demonstrations"
KEEP = ("successes", "all")
_BATCH = 50
"""Twins that step at once."""


def execute(config: Any) -> int:
    """Record the episodes of a composed configuration and write them.

    Args:
        config: with the keys of `seals.learn.demonstrations.settings.RecordSettings`.

    Raises:
        SealsError: the policy or the world cannot be used, or too few episodes succeed.
        MissingExtra: the packages for learning are not installed.
    """
    need_torch()
    _refuse(config)
    out = output_folder(config.out)
    target = out if config.out else out / FOLDER
    demos, tried = _recorded(config)
    made = [write(demos, target)]
    if config.hdf5:
        made.append(write_hdf5(demos, Path(str(config.hdf5))))
    if config.minari:
        from seals.learn.demonstrations.exchange import write_minari

        made.append(write_minari(demos, str(config.minari)))
    good = sum(episode.success for episode in demos.episodes)
    kept = len(demos.episodes)
    print(f"{kept} episodes kept of {tried} tried, {good} successes, {demos.steps} steps")
    for path in made:
        print(path)
    return 0


def _recorded(config: Any) -> tuple[Demonstrations, int]:
    """Run the policy until enough episodes are kept.

    Args:
        config: with the keys of `seals.learn.demonstrations.settings.RecordSettings`.

    Returns:
        The demonstrations, and how many episodes were tried for them.

    Raises:
        ConfigError: too few episodes succeed.
    """
    from seals.learn.environments import batched_of

    wanted, before = int(config.episodes), _before(config)
    count = min(wanted, _BATCH) if "interval" in config.backend else 1
    environment: Any = batched_of(config, count=count, device=usable_device(str(config.device)))
    try:
        kept, tried = _kept(environment, config)
    finally:
        environment.close()
    if len(kept) < wanted:
        raise ConfigError(
            f"only {len(kept)} of {tried} episodes succeeded, and {wanted} are requested.\n"
            "Give keep=all, request fewer, or use a better policy."
        )
    task = environment.task
    origin = Origin(
        env=str(config.name),
        config_hash=world_hash(config),
        who=Who(str(config.who)),
        by=str(config.labels or config.policy),
        observation=tuple(task.observation_names),
        action=tuple(task.action_names),
        rate=task.rate,
        config=world_config(config),
        tried=tried,
    )
    if before is not None:
        origin = dataclasses.replace(origin, tried=before.origin.tried + tried)
        kept = [*before.episodes, *kept]
    return Demonstrations(origin=origin, episodes=kept), origin.tried


def _kept(environment: Any, config: Any) -> tuple[list[Episode], int]:
    """Run the policy; return the kept episodes and the number of episodes tried."""
    from seals.learn.evaluation.policies import policy_of
    from seals.run.progress import progress

    wanted, most = int(config.episodes), int(config.episodes) * int(config.most)
    policy = policy_of(str(config.policy), environment, device=config.device)
    labels = None
    if config.labels:
        labels = policy_of(str(config.labels), environment, device=config.device, key="labels")
    kept: list[Episode] = []
    tried = 0
    with progress("recording", wanted) as tell:
        while len(kept) < wanted and tried < most:
            first = config.first + tried
            seeds = [training_seed(first + k) for k in range(environment.count)]
            for episode in record(environment, policy, seeds, noise=config.noise, labels=labels):
                # what a batch did beyond the last one that is kept was not tried for
                if len(kept) < wanted:
                    tried += 1
                    kept += [episode] if episode.success or config.keep == "all" else []
            tell(len(kept))
    return kept, tried


def _before(config: Any) -> Demonstrations | None:
    """Return the demonstrations to extend, or None.

    Raises:
        ConfigError: they are of another world.
    """
    if not config.after:
        return None
    found = read(demonstrations_folder(str(config.after)))
    if found.origin.config_hash != world_hash(config):
        raise ConfigError(
            f"after={config.after}: they were recorded in another world.\n"
            "Record both with the same arguments, or leave after= out."
        )
    return found


def _refuse(config: Any) -> None:
    """Refuse invalid numbers and words of a recording, and paths that are taken."""
    check_own(config, RecordSettings)
    for key, allowed in (("keep", KEEP), ("who", [who.value for who in Who])):
        refuse_unlisted(str(config[key]), allowed, f"{key}={config[key]} is unknown")
    for key in ("out", "hdf5"):
        if config[key]:
            refuse_taken(str(config[key]), key=key)
    training_seed(config.first)
