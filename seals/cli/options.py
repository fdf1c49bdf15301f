"""Keys of a verb and fields of a plug-in in words: meaning, default with unit, allowed values."""

from __future__ import annotations

import dataclasses
import enum
import inspect
import re
import textwrap
import types
import typing
from collections.abc import Iterator
from typing import Any, NamedTuple

from seals import registry
from seals.config.roots import root_schema
from seals.schema import parameters_of, whole_numbers_of

_ENTRY = re.compile(r"^    (\w+): ", re.MULTILINE)
"""Name of a field under ``Args``."""
_WIDTH, _KEYS = 100, 24
"""Width of the help, and of its column of keys [signs]."""
_CLOSED = ("robot", "optics", "sight", "naming", "hil", "shore")
"""Sections of which the help does not show the keys."""


class Key(NamedTuple):
    """One key of a verb.

    Args:
        name: as it is typed, in front of ``=``.
        meaning: first sentence about it.
        facts: allowed values with their unit, and the default.
        choices: names that it may have; empty where others are allowed.
    """

    name: str
    meaning: str
    facts: str
    choices: tuple[str, ...]


def help_of(root: str) -> str:
    """Return the keys of a verb, one a line; those of a run are told by ``seals run`` alone.

    Args:
        root: name of the root configuration.
    """
    every = list(keys_of(root))
    told = {key.name for key in keys_of("run")} if root != "run" else set()
    of_run = "time.step" in told & {key.name for key in every}
    own = [key for key in every if not (of_run and key.name in told)]
    more = ["  and the keys of seals run (--cfg job lists all)"] if of_run else []
    return "\n".join([*(line for key in own for line in _lines(key)), *more])


def keys_of(root: str) -> Iterator[Key]:
    """Yield the keys of a verb; sections are opened one level deep.

    Args:
        root: name of the root configuration.
    """
    from seals.robot.settings import LogRobotSettings

    cls, hidden = root_schema(root), {"name"}
    if issubclass(cls, LogRobotSettings):
        hidden |= {*LogRobotSettings.__dataclass_fields__} - {"robot"}
    yield from _keys(cls, "", hidden)


def _keys(cls: type, stem: str, hidden: set[str]) -> Iterator[Key]:
    hints, told = typing.get_type_hints(cls), dict[str, str]()
    for base in reversed(cls.__mro__[:-1]):
        for entry, text in entries(base).items():
            told[entry] = re.split(r"\.(?:\s|$)", text.replace("``", ""))[0]
    for field in dataclasses.fields(cls):
        name = field.name
        if name in hidden:
            continue
        inner, section = hints[name], dataclasses.is_dataclass(hints[name])
        if section and name not in _CLOSED:
            yield from _keys(typing.cast(type, inner), f"{name}.", set())
            continue
        values, default = allowed(cls, name), "" if section else default_of(field)
        if inner is Any and name in registry.GROUPS:
            values = f"see: seals list {name}"
        stated = f"default {default}" if default else ""
        facts = stated if values == "true|false" else ", ".join(filter(None, (values, stated)))
        declared = parameters_of(cls).get(name)
        unit = re.escape(declared.unit if declared else "1")
        idle = rf" \[{unit}\]|, or None(?=;|$)|; None for none$|(?<=\W)None for "
        meaning = re.sub(idle, "", told.get(name, ""))
        full = f"{stem}{name}" + (".KEY" if section and name != "robot" else "")
        yield Key(full, meaning, facts, tuple(choices(inner)))


def _lines(key: Key) -> Iterator[str]:
    """Yield a key with its meaning, as long as a line holds, and its facts."""
    meaning, told = key.meaning, f" ({key.facts})" if key.facts else ""
    width = _WIDTH - max(_KEYS, len(key.name)) - 4
    for mark in ("; ", ": ", ", so that ", ", "):
        if len(meaning) > width - len(told) and len(meaning.partition(mark)[0]) > 8:
            meaning = meaning.partition(mark)[0]
    first, *rest = textwrap.wrap(f"{meaning}{told}", width) or [""]
    yield f"  {key.name:{_KEYS}}  {first}"
    yield from (f"  {'':{_KEYS}}  {row}" for row in rest)


def default_of(field: Any) -> str:
    """Return the default of a dataclass field as it is typed; empty if there is none."""
    value = field.default
    if field.default_factory is not dataclasses.MISSING:
        value = field.default_factory()
    value = value.value if isinstance(value, enum.Enum) else value
    if value is None or value is dataclasses.MISSING or (not value and value != 0):
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list):
        return f"[{','.join(f'{x:g}' if isinstance(x, float) else str(x) for x in value)}]"
    return f"{value:g}" if isinstance(value, float) else str(value)


def allowed(cls: type, name: str) -> str:
    """Return the values that a field may have: a span with its unit, or the names of a choice.

    Args:
        cls: dataclass of the field.
        name: of the field.

    Returns:
        Words, empty where only the type is known.
    """
    meta = parameters_of(cls).get(name)
    if meta is not None:
        return meta.span.removeprefix("from ")
    span = whole_numbers_of(cls).get(name)
    if span is not None:
        return f"{span[0]} to {span[1]:.3g}"
    return "|".join(choices(typing.get_type_hints(cls)[name]))


def choices(hint: Any) -> list[str]:
    """Return the names that a type allows; empty for one that is no choice.

    Example:
        >>> choices(bool)
        ['true', 'false']
    """
    if typing.get_origin(hint) in (typing.Union, types.UnionType, list):
        return [name for one in typing.get_args(hint) for name in choices(one)]
    if typing.get_origin(hint) is typing.Literal:
        return [str(value) for value in typing.get_args(hint)]
    if hint is bool:
        return ["true", "false"]
    is_enum = isinstance(hint, type) and issubclass(hint, enum.Enum)
    return [str(one.value) for one in hint] if is_enum else []


def entries(cls: type) -> dict[str, str]:
    """Return the entries under ``Args`` of one class's own docstring, each in one line."""
    text = inspect.cleandoc(cls.__dict__.get("__doc__") or "")
    block = re.split(r"\n\n|\n(?=\S)", text.partition("Args:\n")[2])[0]
    parts = re.split(r"\n(?=    \w)", "\n" + block)
    named = [(_ENTRY.match(part), part) for part in parts]
    return {m.group(1): " ".join(part[m.end() :].split()) for m, part in named if m}
