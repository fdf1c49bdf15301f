"""``seals evaluate``: evaluates policies from held-out starts, in the training world and others.

Other worlds have names: overrides of the configuration, and factors on its numbers.
"""

from __future__ import annotations

import dataclasses
import fnmatch
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from seals.config.build import typed_entries
from seals.config.compose import compose, job_overrides, output_folder
from seals.config.overrides import key_of
from seals.errors import ConfigError, suggestion
from seals.field_roles import roles
from seals.learn.devices import usable_device
from seals.learn.evaluation.page import (
    EvaluationResult,
    rows_of,
    sentences,
    summarise,
    write_results,
)
from seals.learn.evaluation.policies import policy_of
from seals.learn.evaluation.settings import EvaluateSettings
from seals.learn.film import FILM, film, refuse_unfilmed
from seals.learn.learner import need_torch
from seals.learn.metadata import world_hash
from seals.learn.settings import check_own
from seals.learn.starts import held_out_seeds


@roles(data="scale", permission="overrides")
@dataclass(kw_only=True)
class Variant:
    """Variant of a world.

    Args:
        overrides: of the configuration, as on the command line.
        scale: factors on numbers, by shell patterns of their full keys such as
            ``effects.*drag*.coefficient_*``; each pattern must meet a number that is not zero.
        episodes: number of starts; 0 for that of the evaluation.
        count: number of parallel environments; 0 for that of the evaluation.
    """

    overrides: list[str] = field(default_factory=list)
    scale: dict[str, float] = field(default_factory=dict)
    episodes: int = 0
    count: int = 0

    def world(self, *, base: Sequence[str], root: str, where: str) -> Any:
        """Compose the configuration of a variant.

        Args:
            base: overrides that are in force already.
            root: name of the root configuration.
            where: full key of the variant, for the words of a refusal.

        Raises:
            ConfigError: an override is wrong, or a pattern meets no number.
        """
        kept = [word for word in base if key_of(word) not in map(key_of, self.overrides)]
        try:
            config = compose([*kept, *self.overrides], root=root)
        except ConfigError as cause:
            raise ConfigError(f"{where}: {cause}") from cause
        for pattern, factor in self.scale.items():
            _scale(config, pattern, factor, where)
        return config


def variants_of(node: Any) -> dict[str, Variant]:
    """Return the variants of a configuration's ``grid``.

    Raises:
        ConfigError: an entry has an unknown key, or a value of another type.
    """
    return typed_entries(Variant, node, where="grid")


def _scale(config: Any, pattern: str, factor: float, where: str) -> None:
    from omegaconf import OmegaConf

    touched = 0
    keys = []
    for key, value in _numbers(config):
        keys.append(key)
        if fnmatch.fnmatchcase(key, pattern) and value != 0.0:
            OmegaConf.update(config, key, value * factor)
            touched += 1
    if not touched:
        near = suggestion(pattern, keys, label="Numbers there", most=8)
        raise ConfigError(f"{where}.scale: '{pattern}' matches no number except zero.\n{near}")


def _numbers(node: Any, prefix: str = "") -> Iterator[tuple[str, float]]:
    """Yield the real numbers of a configuration with their full keys, in order.

    Example:
        >>> from omegaconf import OmegaConf
        >>> config = OmegaConf.create({"a": {"b": 2.0, "c": 1}, "d": "x"})
        >>> list(_numbers(config))
        [('a.b', 2.0)]
    """
    from omegaconf import DictConfig

    # a list of numbers, and a count, are left alone: a factor means nothing to half of them
    for key in node:
        full = f"{prefix}{key}"
        value = node._get_node(key)
        if isinstance(value, DictConfig) and not value._is_none():
            yield from _numbers(value, f"{full}.")
        elif not isinstance(value, DictConfig) and isinstance(
            value._value() if hasattr(value, "_value") else value, float
        ):
            yield full, float(value._value())


ROOT = "evaluate"
_BATCH = 100
"""Twins that step at once, unless said otherwise."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Trial:
    """One policy in one world.

    Args:
        policy: name or folder.
        world: name of the variant, empty for the configuration's own.
        config: of the world.
        episodes: number of starts.
        count: number of parallel environments.
        device: where networks and twins compute.
    """

    policy: str
    world: str
    config: Any
    episodes: int
    count: int
    device: str

    @classmethod
    def of(cls, policy: str, world: str, config: Any, variant: Variant, settings: Any) -> _Trial:
        batch = "interval" in config.backend
        count = variant.count or settings.count or (_BATCH if batch else 1)
        episodes = variant.episodes or settings.episodes
        return cls(
            policy=policy,
            world=world,
            config=config,
            episodes=episodes,
            count=min(count, episodes),
            device=usable_device(str(settings.device)),
        )


def execute(config: Any) -> int:
    """Evaluate the policies of a composed configuration and write tables and a page.

    Args:
        config: with the keys of `seals.learn.evaluation.settings.EvaluateSettings`.

    Raises:
        SealsError: a policy or a world cannot be used.
        MissingExtra: the packages for learning are not installed.
    """
    from seals.learn.comparison.page import text_table
    from seals.run.progress import progress

    need_torch()
    out = output_folder(config.out)
    trials = _trials_of(config, base=job_overrides())
    found: list[EvaluationResult] = []
    facts = {
        "env": str(config.name),
        "world_hash": world_hash(config),
        "policy": str(config.policy),
    }
    if config.film:
        refuse_unfilmed(config)
    try:
        with progress("judging", sum(trial.episodes for trial in trials)) as tell:
            for trial in trials:
                done = sum(judged.episodes for judged in found)
                found.append(_evaluate_policy(trial, tell=lambda n, done=done: tell(done + n)))  # type: ignore[misc]
    finally:
        # one world that cannot be built must not cost what was judged before
        made = write_results(found, out, facts=facts) if found else []
    if config.film:
        made.append(_filmed(trials[0], out))
    print(text_table(*rows_of(found)))
    print()
    for line in sentences(found):
        print(line)
    remark = _world_mismatch(config)
    if remark:
        print(remark)
    for path in made:
        print(path)
    return 0


def _trials_of(config: Any, *, base: Sequence[str]) -> list[_Trial]:
    """Return the trials: the policy, its baselines, then the policy in other worlds.

    Args:
        config: composed.
        base: overrides that made it.

    Raises:
        ConfigError: a number makes no sense, or a variant cannot be composed.
    """
    check_own(config, EvaluateSettings)
    policy = str(config.policy)
    names = list(dict.fromkeys([policy, *map(str, config.beside)]))
    trials = [_Trial.of(name, "", config, Variant(), config) for name in names]
    for name, variant in variants_of(config.grid).items():
        world = variant.world(base=base, root=ROOT, where=f"grid.{name}")
        trials.append(_Trial.of(policy, name, world, variant, config))
    return trials


def _evaluate_policy(
    trial: _Trial, *, tell: Callable[[int], None] | None = None
) -> EvaluationResult:
    """Run a policy from the held-out starts.

    Args:
        trial: policy and world.
        tell: takes the number of episodes done.

    Raises:
        SealsError: policy or world cannot be used.
    """
    from seals.learn.environments import batched_of
    from seals.learn.training.scoring import score

    environment = batched_of(trial.config, count=trial.count, device=trial.device)
    began = time.perf_counter()
    try:
        policy = policy_of(trial.policy, environment, device=trial.device)
        scores = score(environment, policy, held_out_seeds(trial.episodes), tell=tell)
    finally:
        environment.close()
    took = time.perf_counter() - began
    return summarise(scores, policy=trial.policy, world=trial.world, seconds=took)


def _filmed(trial: _Trial, out: Path) -> Path:
    """Film the first episode of a trial; return the file.

    Raises:
        SealsError: the film cannot be drawn or written; what was judged is kept.
    """
    from seals.learn.environments import batched_of

    environment = batched_of(trial.config, count=1, device=trial.device)
    try:
        policy = policy_of(trial.policy, environment, device=trial.device)
        seed = held_out_seeds(1)[0]
        film(environment, policy, seed, config=trial.config, path=out / FILM)
    finally:
        environment.close()
    return out / FILM


def _world_mismatch(config: Any) -> str:
    """Return a warning if the world differs from that of the policy's training."""
    from seals.learn.metadata import CARD
    from seals.learn.policy import read_policy_metadata
    from seals.learn.shipped import shipped

    name = str(config.policy)
    place = shipped().get(name, Path(name))
    trained = read_policy_metadata(place).get("world_hash") if (place / CARD).is_file() else None
    if trained in (None, world_hash(config)):
        return ""
    return (
        "This is not the world of its training: the loss of success shows the gap between the two."
    )
