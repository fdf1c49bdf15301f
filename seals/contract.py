"""Promises of plug-ins: conditions to require, and the error of one that breaks them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

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
            f"{subject}: its memory cannot be stored in a checkpoint: {cause}.\n"
            "Put @state_record (seals.state_records) before the class of the memory."
        ) from cause


def call_twice(subject: str, law: str, call: Callable[..., Any], *given: Any) -> Any:
    """Call a law twice; it must repeat itself and leave its inputs as they are.

    Args:
        subject: name of the plug-in.
        law: name of the call.
        call: the law.
        *given: its inputs.

    Returns:
        The answer.

    Raises:
        ContractError: the answers differ, or an input has changed.

    Example:
        >>> call_twice("hover", "aim", lambda x: x + 1, 2)
        3
    """
    before = _text(given)
    first, second = call(*given), call(*given)
    same = _text(first) == _text(second)
    require(
        same,
        subject,
        f"{law} gives different results for equal inputs",
        "Keep no state in the plug-in.",
    )
    left = _text(given) == before
    require(left, subject, f"{law} modifies its input", "Return new values instead.")
    return first


def _text(thing: Any) -> str:
    """Return the values as text: equal states may share their parts differently, and NaN is NaN."""
    if isinstance(thing, np.ndarray):
        return repr(thing.tolist())
    if isinstance(thing, Mapping):
        return repr({str(key): _text(value) for key, value in thing.items()})
    if isinstance(thing, tuple | list):
        return repr([_text(part) for part in thing])
    return repr(thing)


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
