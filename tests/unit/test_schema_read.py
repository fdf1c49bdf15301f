"""The one reader of plain data: what it builds, what it refuses, and that writing gives it back."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
import pytest

from seals.errors import ConfigError, LogError
from seals.registry import get
from seals.schema import Within, count, param, plain, read


class Medium(enum.Enum):
    """Of a part."""

    air = 1
    water = 2


class Place(NamedTuple):
    """A place."""

    x: float
    y: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Part:
    """A part of a file."""

    name: str
    mass: float = param(1.0, "kg", bounds=(0.0, 10.0), tolerance=0.0, source="chosen")
    copies: int = count(1, bounds=(1, 9))
    medium: Medium | None = None
    place: Place = field(default_factory=lambda: Place(0.0))
    size: tuple[float, float] = (0.0, 0.0)
    kind: Literal["box", "sphere"] = "box"
    loose: Any = None


@dataclass(frozen=True, kw_only=True)
class File:
    """A file of parts."""

    parts: Mapping[str, Part] = field(default_factory=dict)
    seeds: Annotated[Sequence[Annotated[int, Within(0, 99)]], Within(0, 2)] = ()
    note: str | float = ""
    hidden: int = field(init=False, default=3)


RAW = {
    "parts": {"a": {"name": "a", "mass": 2, "medium": "water", "place": {"x": 1}, "size": [1, 2]}},
    "seeds": [1, 2],
    "note": 3,
}


def test_a_dataclass_is_a_format() -> None:
    """Nested records, whole numbers for floats, lists for tuples, names for enumerations."""
    found = read(File, RAW, where="a.yaml:")
    part = Part(name="a", mass=2.0, medium=Medium.water, place=Place(1.0), size=(1.0, 2.0))
    assert found == File(parts={"a": part}, seeds=[1, 2], note=3)
    assert isinstance(found.parts["a"].size, tuple)
    assert isinstance(found.parts["a"].mass, float)


def test_what_is_written_is_read_again() -> None:
    """`plain` is `read` backwards."""
    found = read(File, RAW, where="a")
    written = plain(found)
    assert written["parts"]["a"]["medium"] == "water"
    written.pop("hidden")
    assert read(File, written, where="a") == found
    assert plain({1: np.float64(2.0), "b": {3, 1}}) == {"1": 2.0, "b": [1, 3]}


def test_null_counts_as_left_out() -> None:
    """Where there is a default; nothing may stand for what is needed."""
    assert read(Part, {"name": "a", "mass": None, "medium": None}, where="p").mass == 1.0
    with pytest.raises(ConfigError, match=r"p\.name=None is not allowed"):
        read(Part, {"name": None}, where="p")


def test_instances_stay_as_they_are() -> None:
    """Plug-ins hold parts that were built already."""
    part = Part(name="a")
    assert read(File, {"parts": {"a": part}}, where="f").parts["a"] is part


ODD: dict[str, tuple[Any, Any, str]] = {
    "key": (Part, {"name": "a", "mas": 1}, "p: 'mas' is not allowed here.\nDid you mean 'mass'"),
    "missing": (Part, {"nam": "a"}, "p: 'nam' is not allowed here.\nDid you mean 'name'"),
    "nothing": (Part, {}, r"p has no 'name'\.\n"),
    "no mapping": (Part, [1], "p=\\[1\\] is not allowed.\nAllowed: a mapping of names to values"),
    "bounds": (Part, {"name": "a", "mass": 11}, "p.mass=11.0 .*\n.* from 0 to 10 kg"),
    "count": (Part, {"name": "a", "copies": 10}, "p.copies=10 .*\n.*from 1 to 9"),
    "text": (Part, {"name": 5}, "p.name=5 is not allowed.\nAllowed: text"),
    "enumeration": (Part, {"name": "a", "medium": "watr"}, "p.medium=watr .*\n.*'water'"),
    "literal": (Part, {"name": "a", "kind": "bos"}, "p.kind=bos .*\n.*'box'"),
    "length": (Part, {"name": "a", "size": [1]}, "p.size.* has 1 entries.\nAllowed: 2"),
    "inner": (Part, {"name": "a", "place": {"x": "far"}}, "p.place.x=far .*\n.*a finite number"),
    "true": (float, True, "p=True"),
    "true as number": (int, True, "p=True"),
    "whole": (int, 1.5, "p=1.5 is not allowed.\nAllowed: a whole number"),
    "endless": (float, math.inf, "p=inf"),
    "nan": (float, "nan", "p=nan"),
    "long": (float, 10**400, "p=1000"),
    "list as text": (list[float], "abc", "p=abc is not allowed.\nAllowed: a list"),
    "entry": (list[float], [1, "b"], r"p\[1\]=b"),
    "several": (float | str, [1], "Allowed: a finite number or text"),
    "many": (File, {"seeds": [1, 2, 3]}, "p.seeds has 3 entries.\nAllowed: from 0 to 2"),
    "span": (File, {"seeds": [100]}, r"p.seeds\[0\]=100 is not allowed.\nAllowed: from 0 to 99"),
}


@pytest.mark.parametrize("name", ODD)
def test_what_does_not_fit_is_refused(name: str) -> None:
    """Two lines: what was given with its full key, and what is allowed."""
    kind, raw, words = ODD[name]
    with pytest.raises(ConfigError, match=words) as told:
        read(kind, raw, where="p")
    assert len(str(told.value).splitlines()) == 2


def test_words_of_a_file() -> None:
    """The name of a file stands before the key; numbers in text count; more keys may pass."""
    with pytest.raises(LogError, match=r"a.json: rate=x is not allowed"):
        read(dict[str, float], {"rate": "x"}, where="a.json:", error=LogError)
    assert read(float, "1e-3", where="a") == 1e-3
    assert read(Part, {"name": "a", "more": 1}, where="a", extra=True) == Part(name="a")
    with pytest.raises(ConfigError, match="p=a b"):
        read(float, "a\nb", where="p")


@pytest.mark.parametrize(
    ("kind", "name", "given"),
    [
        ("effect", "weak_rotor", {"rotor": 0}),
        ("guide", "seek", {"place": [1.0]}),
        ("guide", "seek", {"place": [1.0, math.nan]}),
        ("guide", "learned", {"place": [1.0]}),
        ("guide", "oval", {"laps": 0}),
        ("sensor", "gps", {"bias": [0.0, math.inf, 0.0]}),
        ("reader", "betaflight", {"poles": 1}),
        ("reader", "csv", {"skip_lines": -1}),
        ("viewer", "mitsuba", {"samples": -1}),
        ("sensor", "magnetometer", {"hard_iron": [0.0, math.nan, 0.0]}),
        ("wave", "sea", {"components": 0}),
        ("live", "foxglove", {"port": 70_000}),
        ("live", "ros2", {"domain": 999}),
    ],
)
def test_constructors_refuse_what_a_configuration_refuses(
    kind: str, name: str, given: Mapping[str, Any]
) -> None:
    """A class that is called in Python keeps its bounds, too."""
    with pytest.raises(ConfigError, match=rf"{next(iter(given))}.*\nAllowed"):
        get(kind, name).load()(**given)
