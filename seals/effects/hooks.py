"""Arguments of hooks, matched by their names."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from operator import itemgetter
from typing import Any, Literal, TypeAlias, get_args

from seals.errors import ConfigError, nearest

Hook: TypeAlias = Literal[
    "loads", "inertia", "flow", "joint_loads", "joint_drive", "joint_resistance", "drives",
    "drive_loads", "actuation", "battery_update", "inertia_change", "measure", "axis_misalignment",
    "pose_turn", "timing", "command",
]  # fmt: skip
"""Names of the hooks; what each takes and returns is told by `seals.effects.Effect`."""
HOOKS: tuple[Hook, ...] = get_args(Hook)
Pick: TypeAlias = Callable[[tuple[Any, ...]], tuple[Any, ...]]
"""Picks the arguments of one hook out of all that are offered, in the order of `ARGUMENTS`."""

_LINKS = ("motion", "medium", "joints", "inputs", "memory", "params")
ARGUMENTS: dict[str, tuple[str, ...]] = {
    "flow": (*_LINKS, "scene"),
    "inertia": _LINKS,
    "loads": (*_LINKS, "scene"),
    "joint_loads": _LINKS,
    "drive_loads": ("drives", *_LINKS),
}
"""What a hook may name among its arguments, in any order."""

_PLAIN = ("motion", "medium", "inputs", "memory", "params")
POSITIONAL: dict[str, tuple[str, ...]] = {
    "flow": _PLAIN,
    "inertia": _PLAIN,
    "loads": _PLAIN,
    "joint_loads": ("joints", "inputs", "memory", "params"),
    "drive_loads": ("drives", *_PLAIN),
}
"""What a hook gets whose arguments have other names, by their order.

An offered name out of its place, or one that resembles an offered name of another place, is an
error of the author: such a hook is refused.
"""


def arguments_of(effect: object, hook: str) -> tuple[str, ...]:
    """Return the arguments that a hook declares, in its order.

    Args:
        effect: that defines the hook.
        hook: one of `ARGUMENTS`.

    Raises:
        ConfigError: the hook names something else, and its arguments are not those of `POSITIONAL`
            in their order under other names.

    Example:
        >>> class Shaft:
        ...     @staticmethod
        ...     def joint_loads(joints, medium, memory, params): ...
        >>> arguments_of(Shaft(), "joint_loads")
        ('joints', 'medium', 'memory', 'params')
    """
    return arguments_of_class(type(effect), hook)


def arguments_of_class(cls: type, hook: str) -> tuple[str, ...]:
    """Return the arguments of the hook of a class, see `arguments_of`."""
    owner: Any = cls
    return _arguments(owner, hook)


@functools.cache
def _arguments(cls: type, hook: str) -> tuple[str, ...]:
    law = inspect.getattr_static(cls, hook)
    own = 0 if isinstance(law, staticmethod) else 1
    given = inspect.signature(getattr(cls, hook), follow_wrapped=True).parameters.values()
    if any(p.kind is p.VAR_POSITIONAL for p in given):
        return POSITIONAL[hook]
    names = tuple(p.name for p in given if p.kind is not p.VAR_KEYWORD)
    if isinstance(law, classmethod):
        own = 0
    names = names[own:]
    if set(names) <= set(ARGUMENTS[hook]):
        return names
    plain = POSITIONAL[hook]
    if len(names) == len(plain) and all(
        _may_stand_for(name, meant, hook) for name, meant in zip(names, plain, strict=True)
    ):
        return plain
    strange = next(n for n in names if n not in ARGUMENTS[hook])
    meant = nearest(strange, ARGUMENTS[hook])
    raise ConfigError(
        f"{cls.__name__}.{hook} takes '{strange}', which is not an argument of hooks.\n"
        + (f"Did you mean '{meant}'?  " if meant else "")
        + f"Allowed, in any order: {', '.join(ARGUMENTS[hook])}."
    )


def _may_stand_for(name: str, plain: str, hook: str) -> bool:
    """Return true if a name is the plain argument's, or resembles no other argument."""
    meant = name if name in ARGUMENTS[hook] else nearest(name, ARGUMENTS[hook])
    return meant in (None, plain)


def pick_of(effect: object, hook: str) -> Pick:
    """Return a selector of a hook's arguments from a tuple in the order of `ARGUMENTS`."""
    names = arguments_of(effect, hook)
    places = [ARGUMENTS[hook].index(name) for name in names]
    if len(places) > 1:
        return itemgetter(*places)
    return lambda given: tuple(given[k] for k in places)


def names_any(effect: object, hook: str, words: tuple[str, ...]) -> bool:
    """Return true if a hook declares one of some arguments."""
    return not set(words).isdisjoint(arguments_of(effect, hook))
