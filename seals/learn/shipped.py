"""Shipped policies and demonstrations: ``crab/walk`` is the crab's ``policies/walk``.

Likewise ``aam/reach`` is the folder ``demonstrations/reach`` of the manipulator.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from seals import registry
from seals.errors import BrokenPlugin, ConfigError, suggestion
from seals.learn.metadata import CARD
from seals.schema import read

POLICIES = "policies"
"""Folder of a robot in which its policies lie."""
DEMONSTRATIONS = "demonstrations"
"""Folder of a robot in which what was shown with it lies."""
DETECTORS = "detectors"
"""Folder of a robot in which its detectors of animals lie."""
_KINDS = ("robot", "animal")


def policy_folder(name: str, *, besides: Sequence[str] = (), key: str = "policy") -> Path:
    """Return the folder of a policy: its path, or ``ROBOT/POLICY`` of one that is shipped.

    Args:
        name: of the policy.
        besides: names that are allowed where it is asked for, for the words of a refusal.
        key: by which it was asked for, likewise.

    Raises:
        ConfigError: there is neither.
    """
    return _shipped_folder(name, POLICIES, besides, key, "training wrote")


def demonstrations_folder(name: str) -> Path:
    """Return the folder of demonstrations: its path, or ``ROBOT/NAME`` of a shipped one.

    Args:
        name: of the demonstrations.

    Raises:
        ConfigError: there is neither.
    """
    return _shipped_folder(name, DEMONSTRATIONS, (), "demonstrations", "seals record wrote")


def detector_folder(name: str, *, besides: Sequence[str] = ()) -> Path:
    """Return the folder of a detector: its path, or ``ROBOT/NAME`` of a shipped one.

    Args:
        name: of the detector.
        besides: names that are allowed as well, for the words of a refusal.

    Raises:
        ConfigError: there is neither.
    """
    return _shipped_folder(name, DETECTORS, besides, "task.detector", "training wrote")


def _shipped_folder(name: str, what: str, besides: Sequence[str], key: str, by: str) -> Path:
    if Path(name).exists():
        return Path(name)
    known = shipped(what)
    if name not in known:
        label = f"Give a folder that {by}, or one of"
        raise ConfigError(
            f"{key}={name or '(nothing)'}: there is no such folder.\n"
            f"{suggestion(name, [*besides, *known], label=label)}"
        )
    return known[name]


def shipped(what: str = POLICIES) -> dict[str, Path]:
    """Return the policy or demonstration folders of installed robots and animals, by name.

    Args:
        what: ``POLICIES`` or ``DEMONSTRATIONS``.
    """
    found = {}
    for kind in _KINDS:
        for robot in registry.names(kind):
            try:
                folder = registry.get(kind, robot).folder() / what
            except BrokenPlugin:
                # its own refusal comes when it is chosen; others must not suffer for it
                continue
            for metadata in sorted(folder.glob(f"*/{CARD}")):
                found[f"{robot}/{metadata.parent.name}"] = metadata.parent
    return found


def task_of(metadata: Mapping[str, Any], *, where: str) -> Any:
    """Build the task that a policy was trained for, not yet bound to a robot.

    Args:
        metadata: of the policy; of its overrides those of environment and task are taken.
        where: what brought the metadata, for the words of a refusal.

    Raises:
        ConfigError: an override is none of a task, or makes more than values.
    """
    from seals.config.build import build
    from seals.config.compose import compose
    from seals.config.foreign_values import refuse_values
    from seals.config.overrides import refuse_dangerous

    given = read(list[str], metadata.get("overrides"), where=f"{where}: overrides")
    words = [word for word in given if _of_task(word)]
    refuse_dangerous(
        words, where=f"{where}: the card", remedy="Use the folder as written by the training."
    )
    config = compose(words, root="learn")
    refuse_values(config, root="learn", words=(), where=f"{where}: the card")
    return build(config.task, where=f"{where}: task")


def _of_task(word: str) -> bool:
    from seals.config.overrides import key_of

    key = key_of(word)
    return key == "env" or key.partition(".")[0] == "task"
