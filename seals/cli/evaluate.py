"""``seals evaluate`` and ``seals record``: score a policy, or record its episodes."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from seals.cli.hydra_app import Application, launch
from seals.config.overrides import key_of, refuse_dangerous, value_of
from seals.errors import ConfigError
from seals.schema import read

COMPARE = "--compare"


def evaluate(arguments: list[str]) -> int:
    """Evaluate a policy, or with ``--compare`` the runs of a study."""
    if COMPARE in arguments:
        words = [word for word in arguments if word != COMPARE]
        return launch("arms", [_arm(word) for word in words], _application("comparison"))
    return _of_card("evaluate", arguments, _application("evaluation"))


def record(arguments: list[str]) -> int:
    """Record the episodes of a policy as demonstrations."""
    return _of_card("record", arguments, _application("demonstrations"))


def with_card(arguments: Sequence[str]) -> list[str]:
    """Return the arguments, preceded by the overrides stated in the policy's metadata.

    A policy is judged in the world of its training, unless the words say otherwise: an override
    of the card goes where a word has the same key, or chooses another plug-in than the card whose
    settings it belongs to: ``backend.slope`` with ``backend=pybullet``.

    Args:
        arguments: overrides and flags; ``policy=FOLDER`` names the card.

    Raises:
        ConfigError: the card cannot be read, or an override in it is none of a world.
    """
    from seals.learn.policy import read_policy_metadata
    from seals.learn.shipped import shipped

    place = value_of(arguments, "policy")
    folder = shipped().get(place, Path(place)) if place is not None else None
    if folder is None or not folder.is_dir():
        return list(arguments)
    card = read_policy_metadata(folder)
    given = read(
        list[str], card.get("overrides", []), where=f"policy={place}: the card's overrides"
    )
    refuse_dangerous(
        given,
        where=f"policy={place}: the card",
        remedy="Use the folder as written by the training, or remove that line from its card.json.",
    )
    taken = {key_of(word) for word in arguments}
    anew = tuple(f"{key_of(word)}." for word in arguments if "=" in word and word not in given)
    kept = [w for w in given if key_of(w) not in taken and not key_of(w).startswith(anew)]
    return [*kept, *arguments]


def _of_card(root: str, arguments: list[str], task: Application) -> int:
    """Start a verb with the words of a policy's card, which set data only."""
    words = with_card(arguments)
    source = "the card of the policy" if words != arguments else ""
    return launch(root, words, task, own=arguments, source=source)


def _arm(word: str) -> str:
    """Turn ``sac='runs/sac/*'`` into an entry of ``arms``, and a folder into ``study``."""
    from seals.learn.comparison.settings import ArmsSettings

    key, sign, value = word.partition("=")
    if word.startswith("-"):
        return word
    if not sign:
        if not Path(word).is_dir():
            raise ConfigError(
                f"{word}: there is no such folder.\n"
                "Give the folder of a study, or ARM='FOLDERS': sac='runs/study/sac/*'"
            )
        return f"study='{word}'"
    known = {field.name for field in dataclasses.fields(ArmsSettings)}
    if key in known or key.partition(".")[0] in {"hydra", "arms"} or not key.isidentifier():
        return word
    plain = value.strip("'\"")
    return f"+arms.{key}={value}" if value.startswith("[") else f"+arms.{key}='{plain}'"


def _application(package: str) -> Application:
    """Return the task of a package."""
    return Application(f"seals.learn.{package}.application")
