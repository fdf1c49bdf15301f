"""States on disk: what goes in comes out bit for bit, and a forged file is refused in words."""

from __future__ import annotations

import os
import pickle
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pytest

from seals.state_file import StateError, read_state, write_state
from seals.state_records import state_record
from seals.state_tree import checked_generator, conform, packed, unpacked
from tests.unit.stored_states import closed, forged, opened


@state_record
class Level(NamedTuple):
    """A record of the tests: height [m], names, and what came before."""

    height: float
    names: tuple[str, ...] = ()
    before: Level | None = None


class Stranger(NamedTuple):
    """A class that nobody registered."""

    height: float


def whole() -> dict[str, Any]:
    """Return a state with something of every kind."""
    turned = np.arange(12.0).reshape(3, 4).T
    return {
        "arrays": [turned, np.arange(3, dtype=np.int32), np.zeros((0, 5)), np.array(2.5)],
        "numbers": (1, -0.0, float("inf"), float("-inf"), 1e-310, np.float32(0.1), np.True_, True),
        "records": Level(1.5, ("a",), Level(np.float64(2.0))),
        "others": {("imu", 1): None, 5: frozenset({3, 1})},
        "shown": MappingProxyType({"a": [1]}),
        "random": np.random.default_rng(4).bit_generator.state,
    }


def same(one: Any, other: Any) -> bool:
    """Whether two states are of the same kinds and bits."""
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray | np.generic):
        orders = [x.flags.f_contiguous for x in (one, other)]
        like = one.shape == other.shape and one.dtype == other.dtype and orders[0] == orders[1]
        return like and one.tobytes() == other.tobytes()
    if isinstance(one, dict | MappingProxyType):
        return list(one) == list(other) and all(same(one[key], other[key]) for key in one)
    if isinstance(one, tuple | list):
        return len(one) == len(other) and all(map(same, one, other))
    return repr(one) == repr(other)


def test_subnormal_numbers_are_kept_as_bits() -> None:
    """Their text is never read, since a processor that flushes such numbers would read zero."""
    tiny = (1e-310, -5e-324, 2.2250738585072014e-308, 0.0, -0.0)
    data, arrays = packed(tiny)
    assert [type(part) for part in data["t"]] == [dict, dict, float, float, float]
    assert repr(unpacked(data, arrays)) == repr(tiny)
    with pytest.raises(ValueError, match="1 bytes"):
        unpacked({"b": "00"}, [])


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Write a whole state."""
    write_state(tmp_path / "state.bin", "test", whole())
    return tmp_path / "state.bin"


def test_a_state_comes_back_bit_for_bit(file: Path) -> None:
    """Kinds, order in memory, numbers that are not finite, records, and keys of any kind."""
    assert same(read_state(file, "test"), whole())


def test_one_array_in_two_places_stays_one() -> None:
    """It is written once, and is one again."""
    speed = np.arange(3.0)
    data, arrays = packed((speed, {"again": speed}))
    assert len(arrays) == 1
    back = unpacked(data, arrays)
    assert back[0] is back[1]["again"]


def nested(levels: int) -> Any:
    """Return lists in lists."""
    out: Any = None
    for _ in range(levels):
        out = [out]
    return out


@pytest.mark.parametrize(
    ("thing", "words"),
    [
        (Stranger(1.0), "not a registered record"),
        (print, "not a registered record"),
        (np.array([{}], dtype=object), "not a numeric type"),
        (nested(70), "deeper than 64"),
        (frozenset(range(300)), "300 keys"),
        (dict.fromkeys(range(300)), "300 keys"),
    ],
)
def test_no_state_is_said_when_it_is_written(thing: Any, words: str, tmp_path: Path) -> None:
    """Functions, foreign classes, arrays of objects, and what contains itself."""
    with pytest.raises(TypeError, match=words):
        write_state(tmp_path / "state.bin", "test", {"a": thing})


def test_only_data_become_records() -> None:
    """A class that does something when it is made cannot be registered."""
    with pytest.raises(TypeError, match="cannot be a record"):
        state_record(Path)


MODULUS = 2**61 - 1
"""Its multiples have one hash in Python."""
Forgery = Callable[[dict[str, Any]], Any]


def table(row: list[Any]) -> Forgery:
    """Return a forgery: another declaration of the first array."""
    return lambda about: about["arrays"].__setitem__(0, row)


def state(data: Any) -> Forgery:
    """Return a forgery: another state."""
    return lambda about: about.update(state=data)


def text(old: str, new: str) -> Forgery:
    """Return a forgery: text in place of other text, whatever becomes of the JSON."""
    import json

    def change(about: dict[str, Any]) -> str:
        whole = json.dumps(about)
        assert old in whole
        return whole.replace(old, new, 1)

    return change


FORGERIES: dict[str, tuple[Forgery, str]] = {
    "huge shape": (table(["<f8", "C", [1 << 30]]), "arrays declare"),
    "huge product": (table(["<f8", "C", [1 << 31, 1 << 31, 1 << 31]]), "arrays declare"),
    "negative shape": (table(["<f8", "C", [-3, -4]]), "an array of shape"),
    "broken shape": (table(["<f8", "C", [3.5, 4]]), "an array of shape"),
    "objects": (table(["|O", "C", [12]]), "not a numeric type"),
    "texts": (table(["<U3", "C", [8]]), "not a numeric type"),
    "structure": (table([[["a", "<f8"]], "C", [12]]), "not a numeric type"),
    "strange order": (table(["<f8", "K", [4, 3]]), "not a numeric type"),
    "not a number": (text("-0.0", "NaN"), "holds NaN"),
    "infinite": (text("-0.0", "1e999"), "not a finite number"),
    "long number": (text("-0.0", "1" * 4000), "4000 digits"),
    "twice": (text('"kind":', '"kind": 1, "kind":'), "occurs twice"),
    "other entries": (lambda about: about.update(more=1), "other entries"),
    "other kind": (lambda about: about.update(kind="run"), "of the kind 'run'"),
    "foreign class": (
        state({"r": "seals.learn.training.loop:Rows", "v": {"path": "x", "names": []}}),
        "not a registered record",
    ),
    "function": (state({"r": "os:system", "v": {}}), "not a registered record"),
    "other fields": (state({"r": f"{__name__}:Level", "v": {"height": 1.0}}), "different fields"),
    "wrong kind": (
        state({"r": f"{__name__}:Level", "v": {"height": "a", "names": {"t": []}, "before": None}}),
        "field 'height'",
    ),
    "wrong kind inside": (
        state({"r": f"{__name__}:Level", "v": {"height": 1, "names": {"t": [1]}, "before": None}}),
        "field 'names'",
    ),
    "strange mark": (state({"import": "os"}), "the mark 'import'"),
    "no such array": (state({"a": 99}), "refers to array 99"),
    "array before the first": (state({"a": -1}), "refers to array -1"),
    "many for one": (state({"s": 0}), "stands for one number"),
    "deep": (state(nested(70)), "deeper than 64"),
    "very deep": (text('"kind"', '"x": ' + "[" * 100_000 + ', "kind"'), "nested too deeply"),
    "unhashable key": (state({"m": [[[1], 2]]}), "unhashable"),
    "one hash for all of a set": (state({"x": [k * MODULUS for k in range(300)]}), "300 keys"),
    "one hash for all keys": (state({"m": [[k * MODULUS, 0] for k in range(300)]}), "300 keys"),
    "one hash, of tuples": (state({"x": [{"t": [k * MODULUS]} for k in range(300)]}), "300 keys"),
    "a set of no list": (state({"x": {"a": 0}}), "a dict is found"),
    "pairs that are none": (state({"m": [[1, 2, 3]]}), "unpack"),
    "a mapping that is a list": (state({"p": [1]}), "a list is found"),
    "arrays that are none": (lambda about: about.update(arrays={"0": 1}), "unpack"),
    "an array of half a byte": (table(["<f0.5", "C", [24]]), "not a numeric type"),
    "a shape of truth values": (table(["<f8", "C", [True, 12]]), "an array of shape"),
    "a shape of seventeen axes": (table(["<f8", "C", [1] * 16 + [12]]), "an array of shape"),
    "a shape that is a text": (table(["<f8", "C", "12"]), "an array of shape"),
    "big-endian numbers": (table([">f8", "C", [12]]), "not a numeric type"),
    "dates": (table(["<M8[s]", "C", [12]]), "not a numeric type"),
    "a number of too few bits": (state({"b": "00"}), "1 bytes"),
    "a number that has no name": (state({"f": "__import__"}), "__import__"),
    "a name that leads out": (state({"r": "../../etc:passwd", "v": {}}), "not a registered record"),
    "no JSON": (lambda about: "{", "Expecting"),
    "no text": (lambda about: '{"\xe9": 1}', "ascii"),
}


@pytest.mark.parametrize("name", FORGERIES)
def test_forged_states_are_refused(name: str, file: Path) -> None:
    """The digest is right in each: anybody can reckon it. Nothing large is ever allocated."""
    change, words = FORGERIES[name]
    forged(file, change)
    tracemalloc.start()
    try:
        with pytest.raises(StateError, match=words):
            read_state(file, "test")
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()


def test_other_versions_are_refused(file: Path) -> None:
    """The version is looked at before anything behind it."""
    for version in (0, 1, 3, 2**32 - 1):
        forged(file, lambda about: None, version=version)
        with pytest.raises(StateError, match=rf"format version {version}; this SEALS reads 2"):
            read_state(file, "test")


def test_lengths_that_the_file_does_not_have_are_refused(file: Path) -> None:
    """Declared bytes of the parts and those of the file are compared before any is read."""
    forged(file, lambda about: None, declared=1 << 60)
    with pytest.raises(StateError, match="it declares"):
        read_state(file, "test")
    _about, arrays = opened(file.read_bytes())
    file.write_bytes(closed('{"a": "' + "w" * (1 << 23) + '"}', arrays))
    with pytest.raises(StateError, match="it declares"):
        read_state(file, "test")


def test_a_sparse_file_is_not_read_whole(file: Path) -> None:
    """A file may be declared large and have nothing in it: the run says what it can have."""
    os.truncate(file, 1 << 33)
    with pytest.raises(StateError, match="8,589,934,592 bytes; this one has at most 1,048,576"):
        read_state(file, "test", most=1 << 20)


@pytest.mark.parametrize("cut", [0, 5, 59, 60, 200, -1])
def test_a_file_cut_short_is_refused(cut: int, file: Path) -> None:
    """Wherever the end is."""
    file.write_bytes(file.read_bytes()[:cut])
    with pytest.raises(StateError, match=r"not a state written|it declares"):
        read_state(file, "test")


@pytest.mark.parametrize("place", [3, 14, 30, 50, 70, -1])
def test_a_damaged_byte_is_refused(place: int, file: Path) -> None:
    """Whether in the head, the digest, the text or the numbers."""
    raw = bytearray(file.read_bytes())
    raw[place] ^= 0x40
    file.write_bytes(raw)
    with pytest.raises(StateError):
        read_state(file, "test")
    raw[place] ^= 0x40
    file.write_bytes(raw)
    assert same(read_state(file, "test"), whole())


def test_a_changed_number_is_noticed(file: Path) -> None:
    """A number among others looks sound; the digest tells."""
    raw = bytearray(file.read_bytes())
    raw[-64] ^= 1
    file.write_bytes(raw)
    with pytest.raises(StateError, match="its digest differs"):
        read_state(file, "test")


def test_only_ordinary_files_are_opened(file: Path, tmp_path: Path) -> None:
    """Links, pipes, folders and devices are refused at once."""
    link, pipe = tmp_path / "link", tmp_path / "pipe"
    link.symlink_to(file)
    os.mkfifo(pipe)
    for place in (link, tmp_path / "absent"):
        with pytest.raises(StateError, match="cannot be opened"):
            read_state(place, "test")
    for place in (pipe, tmp_path, Path("/dev/zero")):
        with pytest.raises(StateError, match="not a regular file"):
            read_state(place, "test")


class Evil:
    """Would make a folder when unpickled."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> Any:
        return os.mkdir, (str(self.mark),)


def test_a_pickle_is_never_opened(tmp_path: Path) -> None:
    """It is known by its first byte, and refused for what it is."""
    for protocol in (2, 4, 5):
        (tmp_path / "state.bin").write_bytes(pickle.dumps(Evil(tmp_path / "mark"), protocol))
        with pytest.raises(StateError, match="it is a pickle"):
            read_state(tmp_path / "state.bin", "test")
    assert not (tmp_path / "mark").exists()


@pytest.mark.parametrize(
    "change",
    [
        {"bit_generator": "MT19937"},
        {"has_uint32": 2},
        {"uinteger": 1 << 32},
        {"uinteger": -1},
        {"state": {"state": 1 << 128, "inc": 1}},
        {"state": {"state": 1, "inc": 2}},
        {"state": {"state": 1.0, "inc": 1}},
        {"state": {"state": True, "inc": 1}},
        {"state": {"state": 1}},
        {"state": None},
        {"more": 1},
    ],
)
def test_a_forged_generator_is_refused(change: dict[str, Any]) -> None:
    """Numbers out of range, an even increment, another generator."""
    sound = np.random.default_rng(3).bit_generator.state
    assert checked_generator(sound) == sound
    with pytest.raises(ValueError, match="random generator"):
        checked_generator({**sound, **change})


@pytest.mark.parametrize(
    ("found", "words"),
    [
        ({"a": np.zeros(4), "b": Level(1.0)}, r"state.a is an array float64 \(4,\)"),
        ({"a": np.zeros(3, np.float32), "b": Level(1.0)}, "array float32"),
        ({"a": None, "b": Level(1.0)}, "state.a is an entry"),
        ({"a": np.zeros(3), "b": (1.0, ())}, "state.b is an entry"),
        ({"a": np.zeros(3)}, "no entry 'b'"),
        ({"a": np.zeros(3), "b": Level("x")}, "state.b.height"),  # type: ignore[arg-type]
    ],
)
def test_a_state_of_another_form_is_refused(found: Any, words: str) -> None:
    """Shapes, kinds and entries are those of the simulation at hand."""
    with pytest.raises(ValueError, match=words):
        conform(found, {"a": np.ones(3), "b": Level(2.0)})


def test_tables_may_have_grown() -> None:
    """Below the entries named so, first lengths of arrays are free and the others are not."""
    like = {"rows": {"a": np.ones((2, 3))}, "b": np.ones(2)}
    conform({"rows": {"a": np.ones((5, 3))}, "b": np.ones(2)}, like, tables=("rows",))
    for a, b in (((5, 4), 2), ((5, 3), 3)):
        with pytest.raises(ValueError, match="this simulation has array"):
            conform({"rows": {"a": np.ones(a)}, "b": np.ones(b)}, like, tables=("rows",))
