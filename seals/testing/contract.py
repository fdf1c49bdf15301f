"""Error of a plug-in that breaks its contract."""

from __future__ import annotations

from typing import Any

from seals import registry
from seals.errors import SealsError
from seals.state_tree import packed


class ContractError(SealsError, AssertionError):
    """Violation of a plug-in contract, with its remedy in the message."""


def require(kept: bool, subject: str, broken: str, remedy: str) -> None:
    """Raise a ContractError unless a condition holds.

    Args:
        kept: whether the promise holds.
        subject: name of the plug-in.
        broken: what is wrong, with figures.
        remedy: what to do about it.

    Raises:
        ContractError: the promise does not hold.

    Example:
        >>> require(True, "gravity", "pulls upward", "Turn the sign round.")
    """
    if not kept:
        raise ContractError(f"{subject}: {broken}.\n{remedy}")


def require_storable(subject: str, memory: Any) -> None:
    """Refuse a state that a checkpoint cannot store.

    Args:
        subject: name of the plug-in.
        memory: arrays, numbers, text, containers and registered records pass.

    Raises:
        ContractError: it holds something else.

    Example:
        >>> require_storable("hover", {"since": 2.5})
    """
    try:
        packed(memory)
    except TypeError as cause:
        raise ContractError(
            f"{subject}: its memory stands in no checkpoint: {cause}.\n"
            "Put @state_record (seals.state_records) before the class of the memory."
        ) from cause


def class_of(kind: str, subject: str | type) -> tuple[str, Any]:
    """Return the name and the class of a plug-in given by name or as a class.

    Raises:
        UnknownPlugin: nothing of that name is installed.

    Example:
        >>> class_of("wave", "still")[1].__name__
        'WaveStill'
    """
    if isinstance(subject, str):
        return subject, registry.get(kind, subject).load()
    return subject.__name__, subject
