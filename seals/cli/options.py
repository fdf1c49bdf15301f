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
from typing import Any

from seals import registry
from seals.config.roots import root_schema
from seals.schema import parameters_of, whole_numbers_of

_ENTRY = re.compile(r"^    (\w+): ", re.MULTILINE)
"""Name of a field under ``Args``."""
_WIDTH, _KEYS = 100, 24
"""Width of the help, and of its column of keys [signs]."""
_CLOSED = ("robot", "optics", "sight", "naming", "hil", "shore")
"""Sections of which the help does not show the keys."""


def keys_of(root: str) -> str:
    """Return the keys of a verb, one a line: meaning, default, allowed values with their unit.

    Keys of a run are told by ``seals run`` alone; sections are opened one level deep.

    Args:
        root: name of the root configuration.
    """
    from seals.robot.settings import LogRobotSettings
    from seals.run.settings import RunSettings

    cls = root_schema(root)
    of_run = cls is not RunSettings and issubclass(cls, RunSettings)
    hidden = {"name", *(RunSettings.__dataclass_fields__ if of_run else ())}
    if issubclass(cls, LogRobotSettings):
        hidden |= {*LogRobotSettings.__dataclass_fields__} - {"robot"}
    rows = _rows(cls, "", hidden)
    more = ["  and the keys of seals run; all of them: --cfg job"] if of_run else []
    return "\n".join([*(line for row in rows for line in _lines(*row)), *more])


def _rows(cls: type, stem: str, hidden: set[str]) -> Iterator[tuple[str, str, str]]:
    """Yield keys with their meaning and their facts."""
    hints, told = typing.get_type_hints(cls), meanings(cls)
    for name, field in typing.cast(Any, cls).__dataclass_fields__.items():
        if name in hidden:
            continue
        inner, section = hints[name], dataclasses.is_dataclass(hints[name])
        if section and name not in _CLOSED:
            yield from _rows(typing.cast(type, inner), f"{name}.", set())
            continue
        values, default = allowed(cls, name), "" if section else default_of(field)
        if inner is Any and name in registry.GROUPS:
            values = f"see: seals list {name}"
        stated = f"default {default}" if default else ""
        facts = stated if values == "true or false" else ", ".join(filter(None, (values, stated)))
        unit = re.escape(getattr(parameters_of(cls).get(name), "unit", "1"))
        meaning = re.sub(rf" \[{unit}\]|, or None$|(?<=\W)None for ", "", told.get(name, ""))
        yield f"{stem}{name}" + (".KEY" if section and name != "robot" else ""), meaning, facts


def _lines(key: str, meaning: str, facts: str) -> Iterator[str]:
    """Yield a key with its meaning, as long as a line holds, and its facts."""
    told = f" ({facts})" if facts else ""
    room = _WIDTH - max(_KEYS, len(key)) - 4 - len(told)
    for mark in ("; ", ": ", ", so that ", ", "):
        if len(meaning) > room and len(meaning.partition(mark)[0]) > 8:
            meaning = meaning.partition(mark)[0]
    first, *rest = textwrap.wrap(f"{meaning}{told}", _WIDTH - max(_KEYS, len(key)) - 4) or [""]
    yield f"  {key:{_KEYS}}  {first}"
    yield from (f"  {'':{_KEYS}}  {row}" for row in rest)


def default_of(field: Any) -> str:
    """Return the default of a dataclass field as it is typed; empty where there is none."""
    value = field.default
    if field.default_factory is not dataclasses.MISSING:
        value = field.default_factory()
    value = getattr(value, "value", value)
    if value is None or value is dataclasses.MISSING or (not value and value != 0):
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return re.sub(r"(?<=\d)\.0\b", "", text.replace(", ", ","))


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
    return " or ".join(choices(typing.get_type_hints(cls)[name]))


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


def meanings(cls: type) -> dict[str, str]:
    """Return the first sentence about each field, from the docstrings of a class and its bases."""
    found: dict[str, str] = {}
    for base in reversed(cls.__mro__[:-1]):
        for name, text in entries(base).items():
            found[name] = re.split(r"\.(?:\s|$)", text.replace("``", ""))[0]
    return found


def entries(cls: type) -> dict[str, str]:
    """Return the entries under ``Args`` of one class's own docstring, each in one line."""
    text = inspect.cleandoc(cls.__dict__.get("__doc__") or "")
    block = re.split(r"\n\n|\n(?=\S)", text.partition("Args:\n")[2])[0]
    parts = re.split(r"\n(?=    \w)", "\n" + block)
    named = [(_ENTRY.match(part), part) for part in parts]
    return {m.group(1): " ".join(part[m.end() :].split()) for m, part in named if m}
