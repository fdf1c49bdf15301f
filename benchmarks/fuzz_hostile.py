"""Hostile but well-formed files for fuzzing: nested, recursive, huge, with foreign references.

Unlike damaged ones, each is drawn by a grammar of its format: sound enough to get past its parser.
"""

from __future__ import annotations

import io
import json
import os
import struct
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from benchmarks.fuzz_targets import TARGETS as SOUND
from benchmarks.fuzz_targets import URDF, Target, bag_of, checked, parquet_of

_META = "format: hidden-effect-log\nformat_version: 1\n"
_NUMBERS = (
    "0",
    "-1",
    "1e400",
    "9" * 30,
    "9" * 5000,
    ".nan",
    "0x" + "f" * 500,
    "1:59" * 300,
    "1e-5",
)
_NAMES = ("/dev/zero", "../../../../etc/passwd", "absent.x", "pipe", "link", "a b", "~/a", "C:\\a")
_LONGEST = 1 << 22
"""Characters of a list of one thing again and again: lists of lists of them filled the memory."""
_SIZES = (0, 1, -1, 2**31 - 1, 2**31, 2**32 - 1, 2**62, 2**63 - 1)


def _pick(data: Random, choices: Sequence[Any]) -> Any:
    return data.choice(choices)


def _count(data: Random, most: int) -> int:
    return data.randint(0, most)


def _tree(data: Random, depth: int) -> str:
    """Draw JSON that is nested, wide, and full of odd numbers."""
    kind = _count(data, 5) if depth else _count(data, 2)
    if kind == 0:
        return str(_pick(data, ("0", "-1", "1e400", "9" * 30, "9" * 5000, "null", "true")))
    if kind == 1:
        return json.dumps(_pick(data, ("a", "[" * 90, '"\\', "\ud800", "${oc.env:HOME}", "\0")))
    if kind == 2:
        return str(_pick(data, ("[" * 60 + "]" * 60, '{"a":' * 60 + "1" + "}" * 60, "[]")))
    if kind == 3:
        one, count = _tree(data, depth - 1), _pick(data, (0, 1, 3, 1000))
        return "[" + ",".join([one] * min(count, 1 + _LONGEST // len(one))) + "]"
    names = [_pick(data, ("a", "format", "\\udc00", "vehicle")) for _ in range(_count(data, 4))]
    return "{" + ",".join(f'"{name}":{_tree(data, depth - 1)}' for name in names) + "}"


def _json() -> Target:
    from seals.untrusted_io import read_json

    return Target(
        whole=b'{"a": [1, 2]}', name="run.json", load=read_json,
        draw=lambda data: _tree(data, 4).encode("utf-8", "surrogatepass"),
    )  # fmt: skip


def _lines(data: Random) -> bytes:
    """Draw YAML of anchors, merges, tags and odd numbers."""
    lines = [_META, "x0: &x0 {k0: 1, k1: [1, 2]}"]
    for k in range(1, _pick(data, (2, 12, 60))):
        kind = _count(data, 5)
        earlier = f"*x{_count(data, k - 1)}"
        many = ", ".join([earlier] * _pick(data, (1, 2, 9, 500)))
        lines.append(
            f"x{k}: &x{k} "
            + (
                f"{{<<: [{many}], k{k}: 1}}",
                f"[{many}]",
                f"{{? {earlier} : 1}}",
                str(_pick(data, _NUMBERS)),
                str(_pick(data, ("!!int '1:1'", "!!float 1:2.5", "!!binary aa", "!!set {a, b}"))),
                "[" * _pick(data, (1, 30, 90)) + "1" + "]" * _pick(data, (1, 30, 90)),
            )[kind]
        )
    return "\n".join(lines).encode()


def _yaml() -> Target:
    from seals.logs.native import read_meta
    from seals.untrusted_io import first_bad_number

    def load(path: Path) -> None:
        first_bad_number(read_meta(path))

    return Target(whole=_META.encode(), name="meta.yaml", load=load, draw=_lines)


def _column(data: Random, rows: int) -> Any:
    """Draw a column of any type, nested ones among them."""
    import pyarrow as pa

    kinds = (
        lambda: pa.array(np.arange(rows) * _pick(data, (0.01, 1e7, 1e300, np.nan))),
        lambda: pa.array(np.full(rows, _pick(data, (0, 2**62, -1)))),
        lambda: pa.array([[1.0] * _count(data, 50)] * rows),
        lambda: pa.array([{"x": 1.0, "y": [1]}] * rows),
        lambda: pa.DictionaryArray.from_arrays(pa.array(np.zeros(rows, np.int8)), ["x" * 100_000]),
        lambda: pa.array(np.arange(rows), pa.timestamp(_pick(data, ("s", "ms", "us", "ns")))),
        lambda: pa.nulls(rows),
        lambda: pa.array([b"\xff"] * rows),
        lambda: pa.array(
            [[[("a", [1.0])]]] * rows, pa.list_(pa.map_(pa.string(), pa.list_(pa.float64())))
        ),
    )
    return kinds[_count(data, len(kinds) - 1)]()


def _table(data: Random) -> bytes:
    import pyarrow as pa
    from pyarrow import parquet

    rows = _pick(data, (0, 1, 30, 2_000))
    names = ["t", *(_pick(data, ("t", "depth", "a.b", "a", "segment", "")) for _ in range(3))]
    raw = io.BytesIO()
    parquet.write_table(
        pa.Table.from_arrays([_column(data, rows) for _ in names], names=names), raw,
        compression=_pick(data, ("zstd", "snappy", "none", "gzip")),
        row_group_size=_pick(data, (1_000, 100_000)),
        data_page_version=_pick(data, ("1.0", "2.0")),
    )  # fmt: skip
    content = bytearray(raw.getvalue())
    for _ in range(_count(data, 2)):
        # sizes of pages and counts stand as small numbers among the bytes
        place = _count(data, len(content) - 9)
        content[place : place + 5] = _pick(data, (b"\xfe\xff\xff\xff\x0f", b"\0" * 5, b"\x80" * 5))
    return bytes(content)


def _parquet() -> Target:
    from seals.plugins.readers.native import ReaderNative

    stamps = np.arange(60) * 0.01
    return Target(
        whole=parquet_of({"t": stamps, "depth": stamps}), name="log.parquet",
        load=checked(ReaderNative()), draw=_table, folder=True,
        beside={"meta.yaml": _META.encode()},
    )  # fmt: skip


def _stamps(data: Random) -> bytes:
    start = _pick(data, ("0", "1704067200", "1704067200000000000", "-1e14", "1e300", "nan"))
    step = _pick(data, (0.0, 1e-9, 0.01, 1.0, 10.0, 1e4, 1e6, 1e9, 1e14, -1.0))
    form = _pick(
        data, ("{:.9g}", "{:.0f}", "2024-01-01T00:00:{:09.6f}", "9999-99-99T{:.0f}", "{}Z")
    )
    rows = [form.format(float(start) + k * step) for k in range(40)]
    rows[_count(data, 39)] = _pick(data, ("", "1e18", "nan", "2024-01-01", rows[0]))
    return ("t,depth\n" + "\n".join(f"{row},{k}" for k, row in enumerate(rows)) + "\n").encode()


def _clock() -> Target:
    from seals.plugins.readers.csv import ReaderCsv

    whole = "t,depth\n" + "\n".join(f"{k * 10},{k}" for k in range(40)) + "\n"
    return Target(whole=whole.encode(), name="a.csv", load=checked(ReaderCsv()), draw=_stamps)


def _shapes(data: Random) -> bytes:
    """Draw an array whose header declares anything."""
    shape = ", ".join(str(_pick(data, _SIZES)) for _ in range(_count(data, 4)))
    kind = _pick(data, ("<f8", "|O", "<U999999999", "|V9", "<c16", "|b1", "<i1", "[('a', '<f8')]"))
    more = _pick(data, ("", "(" * 300, "\0" * 9, " " * 60_000))
    kind = kind if kind.startswith("[") else f"'{kind}'"
    text = f"{{'descr': {kind}, 'fortran_order': False, 'shape': ({shape},), {more}}}\n"
    return b"\x93NUMPY\x01\0" + struct.pack("<H", len(text)) + text.encode() + bytes(64)


def _npy() -> Target:
    from seals.logs.arrays import read_npy

    raw = io.BytesIO()
    np.save(raw, np.arange(9.0))
    return Target(whole=raw.getvalue(), name="a.npy", load=read_npy, draw=_shapes)


def _strange(path: Path) -> None:
    """Read what lies behind a name: a device, a pipe, a link, a folder; by every reader."""
    from seals.errors import SealsError
    from seals.logs import read_native
    from seals.robot.urdf import read_urdf
    from seals.untrusted_io import read_json, read_text, read_yaml

    word = path.read_bytes().decode("utf-8", "replace").strip()
    path.unlink()
    if word == "pipe":
        os.mkfifo(path)
    elif word == "folder":
        path.mkdir()
    else:
        path.symlink_to(word.replace("\0", "") or "/dev/zero")
    refusals = 0
    for read in (read_json, read_text, read_yaml, read_native, read_urdf):
        try:
            read(path)
        except SealsError:
            refusals += 1
    path.rmdir() if path.is_dir() and not path.is_symlink() else path.unlink()
    assert refusals == 5


def _devices() -> Target:
    places = ("/dev/zero", "/dev/urandom", "/dev/full", "/dev/tty", "/proc/self/mem", "pipe")
    more = ("/proc/kmsg", "a", "folder", "/", "/proc/self/fd/0", "/dev/null", "/sys")
    return Target(
        whole=b"/dev/zero", name="a", load=_strange,
        draw=lambda data: str(_pick(data, (*places, *more))).encode(),
    )  # fmt: skip


def _macros(data: Random) -> bytes:
    """Draw macros that call each other, compute, include and look around."""
    parts = []
    for k in range(_count(data, 4)):
        calls = f"<xacro:m{_count(data, 4)}/>" * _pick(data, (0, 1, 2, 30))
        parts.append(f'<xacro:macro name="m{k}" params="x:=1">{calls}</xacro:macro>')
    texts = (
        *("${10**10**8}", "${'a'*10**9}", "$(env HOME)", "$(eval x)", "${x}", "${[0]*10**9}"),
        *("${xacro.load_yaml('/dev/zero')}", "$(find a)", "${().__class__}", "${1/0}", "$(cwd)"),
    )
    for _ in range(_count(data, 3)):
        parts.append(f'<link name="{_pick(data, texts)}"/><xacro:m{_count(data, 4)}/>')
        parts.append(f'<xacro:include filename="{_pick(data, (*_NAMES, "a.xacro"))}"/>')
    inside = "".join(part for part in parts if _count(data, 1))
    return f'<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">{inside}</robot>'.encode()


def _xacro() -> Target:
    from seals.robot.structure import expanded

    whole = (
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="${1}"/></robot>'
    )
    return Target(whole=whole.encode(), name="a.xacro", load=expanded, draw=_macros)


def _bodies(data: Random) -> bytes:
    """Draw a URDF of long chains, cycles, and names that lead elsewhere."""
    links = "".join(f'<link name="l{k}"/>' for k in range(_pick(data, (1, 5, 499, 700))))
    joints = "".join(
        f'<joint name="j{k}" type="fixed"><parent link="l{_count(data, 6)}"/>'
        f'<child link="l{k}"/></joint>'
        for k in range(_count(data, 6))
    )
    mesh = f'<visual><geometry><mesh filename="{_pick(data, _NAMES)}"/></geometry></visual>'
    deep = _pick(data, (1, 50, 5_000))
    shown = f'<material name="m"><texture filename="{_pick(data, _NAMES)}"/></material>'
    parts = (links, joints, mesh, "<link>" * deep + "</link>" * deep, shown)
    inside = "".join(part for part in parts if _count(data, 1))
    return URDF.replace("</link></robot>", f"{inside}</link>{inside}</robot>").encode()


def _urdf() -> Target:
    from seals.robot.urdf import read_urdf

    return Target(whole=URDF.encode(), name="r.urdf", load=read_urdf, draw=_bodies)


def _mesh(ending: str, whole: bytes, draw: Callable[[Random], bytes]) -> Callable[[], Target]:
    def build() -> Target:
        from seals.hydrostatics import hull_from_mesh

        return Target(whole=whole, name=f"a{ending}", load=hull_from_mesh, draw=draw)

    return build


_OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def _obj(data: Random) -> bytes:
    lines = _OBJ.splitlines()
    for _ in range(_count(data, 5)):
        word = _pick(data, ("mtllib", "usemtl", "call", "f", "v", "o", "g", "#", "mtl\\\nlib"))
        rest = _pick(data, (*_NAMES, "1 2 999999999", "-1 -2 -3", "1e308 1e308 1e308", "1//1 2//2"))
        lines.insert(_count(data, len(lines)), f"{word} {rest}")
    return str(_pick(data, ("\n", "\r\n", "\r"))).join(lines).encode()


def _glb_of(content: Any, rest: bytes = b"") -> bytes:
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text
    body += struct.pack("<II", len(rest), 0x004E4942) + rest
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


_CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32).tobytes()
_FACES = np.array([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3], np.uint32).tobytes()


def _gltf(corners: Any = 4, faces: Any = 12, nodes: Any = None, uri: Any = None) -> bytes:
    buffer = {"byteLength": 96, **({"uri": uri} if uri else {})}
    views = [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 48}]
    numbers = [
        {"bufferView": 0, "componentType": 5126, "count": corners, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5125, "count": faces, "type": "SCALAR"},
    ]
    part = {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}
    content = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}]}
    content |= {"nodes": nodes or [{"mesh": 0}], "meshes": [part], "accessors": numbers}
    return _glb_of({**content, "bufferViews": views, "buffers": [buffer]}, _CORNERS + _FACES)


def _glb(data: Random) -> bytes:
    count = _pick(data, (1, 3, 40, 20_000))
    below = [{"mesh": 0, "children": [min(k + 1, count - 1)] * 2} for k in range(count)]
    return _gltf(
        corners=_pick(data, (4, *_SIZES)), faces=_pick(data, (12, 12, *_SIZES)),
        nodes=_pick(data, (None, below)), uri=_pick(data, (None, None, *_NAMES)),
    )  # fmt: skip


def _rows(data: Random) -> bytes:
    """Draw a database whose indices and schema say what is not so."""
    path = Path(tempfile.mkdtemp()) / "a.db3"
    kind = _pick(data, ("sensor_msgs/msg/Imu", "std_msgs/msg/String", "a/msg/B", ""))
    size = _pick(data, (0, 4, 300, 1 << 20))
    rows = [(1, _pick(data, (k, None, "a", 2**62)), bytes(size)) for k in range(12)]
    base = bag_of(path, kind, rows)
    base.execute("CREATE INDEX times ON messages(topic_id, timestamp)")
    base.execute("PRAGMA writable_schema = ON")
    lies = (
        "UPDATE sqlite_master SET rootpage = 2 WHERE name = 'times'",
        "UPDATE sqlite_master SET rootpage = 99999 WHERE name = 'messages'",
        "UPDATE sqlite_master SET rootpage = 1 WHERE name = 'topics'",
        "UPDATE sqlite_master SET sql = 'CREATE INDEX times ON messages(data)' WHERE name='times'",
        "UPDATE sqlite_master SET sql = 'CREATE TABLE messages(id, topic_id AS (id), timestamp, "
        "data)' WHERE name = 'messages'",
        "DELETE FROM messages",
    )
    base.execute(_pick(data, lies))
    base.commit()
    base.close()
    content = bytearray(path.read_bytes())
    path.unlink()
    path.parent.rmdir()
    for _ in range(_count(data, 3)):
        place = _count(data, len(content) - 5)
        content[place : place + 4] = struct.pack(">I", _pick(data, _SIZES[:6]) & 0xFFFFFFFF)
    return bytes(content)


def _records(data: Random) -> bytes:
    """Draw an MCAP file whose records, chunks and indices declare what is not there."""

    def record(kind: int, body: bytes) -> bytes:
        size = len(body) if _count(data, 9) else _pick(data, _SIZES[3:]) & (2**64 - 1)
        return bytes([kind]) + struct.pack("<Q", size) + body

    def text(word: bytes) -> bytes:
        return struct.pack("<I", len(word)) + word

    def number(good: int) -> int:
        return int(good if _count(data, 4) else _pick(data, _SIZES) & (2**64 - 1))

    inside = record(3, struct.pack("<H", 1) + text(b"tank") + text(b"jsonschema") + text(b"{}"))
    inside += record(4, struct.pack("<HH", 1, 1) + text(b"/tank") + text(b"json") + text(b""))
    for k in range(_count(data, 3)):
        note = _tree(data, 2).encode("utf-8", "replace")
        inside += record(5, struct.pack("<HIQQ", 1, k, number(k * 10**7), number(k)) + note)
    times = struct.pack("<QQ", number(0), number(10**9))
    chunk = (
        times
        + struct.pack("<QI", number(len(inside)), 0)
        + text(_pick(data, (b"", b"lz4", b"zstd")))
    )
    chunk += struct.pack("<Q", number(len(inside))) + inside
    index = times + struct.pack("<QQI", number(0), number(2**40), 0) + struct.pack("<Q", 0)
    body = record(1, text(b"") + text(b"")) + record(6, chunk) + record(8, index)
    body += record(15, struct.pack("<I", 0)) + record(
        2, struct.pack("<QQI", number(9), number(9), 0)
    )
    return b"\x89MCAP0\r\n" + body + b"\x89MCAP0\r\n"


HOSTILE: dict[str, Callable[[], Target]] = {
    "hostile_json": _json,
    "hostile_yaml": _yaml,
    "hostile_parquet": _parquet,
    "hostile_clock": _clock,
    "hostile_npy": _npy,
    "hostile_devices": _devices,
    "hostile_xacro": _xacro,
    "hostile_urdf": _urdf,
    "hostile_obj": _mesh(".obj", _OBJ.encode(), _obj),
    "hostile_glb": _mesh(".glb", _gltf(), _glb),
    "hostile_sqlite": lambda: replace(SOUND["rosbag2"](), draw=_rows),
    "hostile_mcap": lambda: replace(SOUND["mcap_lz4"](), draw=_records),
}
"""Targets whose files are drawn whole, by name."""
