"""Conversion of a state to JSON data and a list of arrays, and back.

A state is a nest of tuples, lists, mappings, arrays, numbers, text, None, and records
(`seals.state_records`). What JSON knows stands for itself; all else is an object of one entry::

    {"a": 3}   array 3               {"s": 3}   array 3 of one number, as a NumPy scalar
    {"t": []}  tuple                 {"f": ""}  number that is not finite
    {"d": {}}  mapping by text       {"m": []}  mapping by other keys: pairs
    {"p": ...} read-only mapping     {"x": []}  frozenset
    {"r": "module:Class", "v": {}}   record
"""

from __future__ import annotations

import math
import struct
from collections.abc import Collection, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from seals.state_records import fields_of, is_record, name_of, rebuilt

DEEPEST = 64
"""Most levels of a state."""
MOST_KEYS = 256
"""Most entries of a set, or of a mapping by other keys than text: whoever chooses such keys can
choose them with one hash, and the time to sort them in grows with their square."""
KINDS = "biufc"
"""Kinds of NumPy numbers that are kept."""
_NUMBERS = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}


def packed(state: Any) -> tuple[Any, list[np.ndarray]]:
    """Return a state as plain data, and the arrays to which it refers by number.

    One array in two places stays one. The order of the axes in memory is left as it is.

    Raises:
        TypeError: a part is no data, or of a class that is not registered.

    Example:
        >>> data, arrays = packed({"speed": np.zeros(3), "stage": ("dive", 2.0)})
        >>> data
        {'d': {'speed': {'a': 0}, 'stage': {'t': ['dive', 2.0]}}}
        >>> unpacked(data, arrays)["stage"]
        ('dive', 2.0)
    """
    packer = _Packer()
    return packer.pack(state, 0), packer.arrays


class _Packer:
    """Collector of the arrays of a state."""

    def __init__(self) -> None:
        self.arrays: list[np.ndarray] = []
        self._numbers: dict[int, int] = {}

    def pack(self, value: Any, depth: int) -> Any:
        if depth > DEEPEST:
            raise TypeError(f"it is nested deeper than {DEEPEST} levels, or contains itself")
        kind = type(value)
        if value is None or kind in (bool, int, str):
            return value
        if kind is float:
            if not math.isfinite(value):
                return {"f": repr(value)}
            raw = struct.pack(">d", value)
            # libraries of kernels make the processor flush subnormal numbers, as text is read too
            return {"b": raw.hex()} if _is_subnormal(raw) else value
        if kind is np.ndarray or isinstance(value, np.generic):
            return {"a" if kind is np.ndarray else "s": self._number(value)}
        return self._packed(value, kind, depth + 1)

    def _packed(self, value: Any, kind: type, depth: int) -> Any:
        others = kind is frozenset or (kind is dict and any(type(key) is not str for key in value))
        if others and len(value) > MOST_KEYS:
            raise TypeError(f"it holds {len(value)} keys that are not text, at most {MOST_KEYS}")
        if kind in (list, tuple, frozenset):
            parts = [self.pack(part, depth) for part in value]
            tags = {list: parts, tuple: {"t": parts}, frozenset: {"x": parts}}
            return tags[kind]
        if kind is MappingProxyType:
            return {"p": self.pack(dict(value), depth)}
        if kind is dict:
            if not others:
                return {"d": {key: self.pack(part, depth) for key, part in value.items()}}
            return {"m": [[self.pack(k, depth), self.pack(v, depth)] for k, v in value.items()]}
        if is_record(value):
            fields = {name: self.pack(part, depth) for name, part in fields_of(value).items()}
            return {"r": name_of(kind), "v": fields}
        raise TypeError(
            f"it holds a {name_of(kind)}, which is not a registered record "
            "(a NamedTuple or dataclass of data becomes one by seals.state_records.state_record)"
        )

    def _number(self, value: Any) -> int:
        array = np.asarray(value)
        if array.dtype.kind not in KINDS:
            raise TypeError(f"it holds an array of {array.dtype}, which is not a numeric type")
        found = self._numbers.get(id(value))
        if found is None:
            # the list holds the array, so that its identity is not given to another
            self.arrays.append(array if array is value else array.copy())
            found = len(self.arrays) - 1
            if array is value:
                self._numbers[id(value)] = found
        return found


def _is_subnormal(raw: bytes) -> bool:
    """Return whether the bits of a number are subnormal, without arithmetic that may flush it."""
    magnitude = int.from_bytes(raw, "big") & ((1 << 63) - 1)
    return 0 < magnitude < 1 << 52


def _number_of(bits: str) -> float:
    """Return the float given by sixteen hexadecimal digits."""
    raw = bytes.fromhex(bits)
    if len(raw) != 8:
        raise ValueError(f"a number of {len(raw)} bytes")
    return float(struct.unpack(">d", raw)[0])


def unpacked(data: Any, arrays: Sequence[np.ndarray], depth: int = 0) -> Any:
    """Rebuild the state from the result of `packed`.

    Raises:
        ValueError: the data are none that `packed` makes.
        TypeError: a key of a mapping is no key.
    """
    if depth > DEEPEST:
        raise ValueError(f"it is nested deeper than {DEEPEST} levels")
    if isinstance(data, list):
        return [unpacked(part, arrays, depth + 1) for part in data]
    if not isinstance(data, dict):
        return data
    if set(data) == {"r", "v"}:
        fields = _all_of(dict, data["v"])
        values = {name: unpacked(part, arrays, depth + 1) for name, part in fields.items()}
        return rebuilt(_all_of(str, data["r"]), values)
    if len(data) != 1:
        raise ValueError(f"an entry with the marks {sorted(data)[:5]}")
    ((mark, content),) = data.items()
    if mark in ("a", "s"):
        if type(content) is not int or not 0 <= content < len(arrays):
            raise ValueError(f"it refers to array {content}; there are {len(arrays)}")
        found = arrays[content]
        if mark == "s" and found.shape:
            raise ValueError(f"array {content} of shape {found.shape} stands for one number")
        return found[()] if mark == "s" else found
    if mark in ("f", "b"):
        return _NUMBERS[content] if mark == "f" else _number_of(_all_of(str, content))
    return _container(mark, content, arrays, depth + 1)


def _container(mark: str, content: Any, arrays: Sequence[np.ndarray], depth: int) -> Any:
    if mark == "d":
        items = _all_of(dict, content).items()
        return {key: unpacked(part, arrays, depth) for key, part in items}
    if mark == "p":
        return MappingProxyType(_all_of(dict, unpacked(content, arrays, depth)))
    if mark not in ("t", "x", "m"):
        raise ValueError(f"an entry with the mark '{mark[:20]}'")
    if mark != "t" and len(_all_of(list, content)) > MOST_KEYS:
        raise ValueError(f"{len(content)} keys that are not text; the limit is {MOST_KEYS}")
    parts = [unpacked(part, arrays, depth) for part in _all_of(list, content)]
    if mark == "m":
        return {key: value for key, value in parts}  # noqa: C416  pairs, or a ValueError
    return tuple(parts) if mark == "t" else frozenset(parts)


def _all_of(kind: type, value: Any) -> Any:
    if type(value) is not kind:
        raise ValueError(f"a {type(value).__name__} is found instead of a {kind.__name__}")
    return value


def conform(
    found: Any,
    like: Any,
    where: str = "state",
    *,
    tables: Collection[str] = (),
    table: bool = False,
) -> None:
    """Refuse a state whose structure differs from that of the same simulation.

    What is None in the other may be anything; lists, sets and plain tuples of another length and
    further entries of a mapping are let pass, because they come and go.

    Args:
        found: state to check.
        like: state of the simulation at hand.
        where: path of ``found``, for the message.
        tables: names of entries below which arrays grow: their first lengths may differ.
        table: whether this is below such an entry.

    Raises:
        ValueError: says where kind, shape or entries differ.

    Example:
        >>> conform({"speed": np.zeros(3)}, {"speed": np.ones(3)})
        >>> conform({"speed": np.zeros(4)}, {"speed": np.ones(3)})
        Traceback (most recent call last):
        ValueError: state.speed is an array float64 (4,); this simulation has array float64 (3,)
    """
    if like is None:
        return
    if _form(found, table=table) != _form(like, table=table):
        raise ValueError(f"{where} is an {_form(found)}; this simulation has {_form(like)}")
    if isinstance(like, Mapping) or is_record(like):
        mine, other = _entries(like), _entries(found)
        for name, part in mine.items():
            if name not in other:
                raise ValueError(f"{where} has no entry '{name}'")
            below = table or name in tables
            conform(other[name], part, f"{where}.{name}", tables=tables, table=below)
    elif isinstance(like, list | tuple) and len(like) == len(found):
        for k, (part, other_part) in enumerate(zip(like, found, strict=True)):
            conform(other_part, part, f"{where}[{k}]", tables=tables, table=table)


def _entries(value: Any) -> Mapping[Any, Any]:
    return value if isinstance(value, Mapping) else fields_of(value)


def _form(value: Any, *, table: bool = False) -> str:
    """Describe the type of a part; parts of equal structure have equal descriptions."""
    if isinstance(value, np.ndarray):
        return f"array {value.dtype} {value.shape[1:] if table else value.shape}"
    if is_record(value):
        return f"entry {name_of(type(value))}"
    if isinstance(value, bool | np.bool_):
        return "entry true or false"
    if isinstance(value, int | float | np.generic):
        return "entry number"
    return "entry mapping" if isinstance(value, Mapping) else f"entry {type(value).__name__}"


def checked_generator(state: Any) -> dict[str, Any]:
    """Return the state of a PCG64 generator, checked.

    Raises:
        ValueError: it is none.

    Example:
        >>> state = np.random.default_rng(3).bit_generator.state
        >>> checked_generator(state) == state
        True
    """
    fields = {"bit_generator", "state", "has_uint32", "uinteger"}
    inner = state.get("state") if isinstance(state, dict) else None
    if not isinstance(inner, dict) or set(state) != fields or set(inner) != {"state", "inc"}:
        raise ValueError("its random generator is unknown to this version")
    bits = ((inner, "state", 128), (inner, "inc", 128), (state, "has_uint32", 1))
    whole = all(
        type(part[name]) is int and 0 <= part[name] < 1 << most
        for part, name, most in (*bits, (state, "uinteger", 32))
    )
    # the increment of this generator is odd: an even one shortens its period
    if state["bit_generator"] != "PCG64" or not whole or inner["inc"] % 2 == 0:
        raise ValueError("the numbers of its random generator cannot be those of a PCG64")
    return dict(state)
