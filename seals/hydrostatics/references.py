"""Check of the files that a mesh refers to: materials, images, buffers."""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from seals.errors import LogError, RobotError
from seals.untrusted_io import plain_json, regular_file

MOST_BYTES = 50_000_000
"""Largest file that a mesh may name [byte]."""
MOST_COPIES = 10_000
"""Most copies of its parts that a mesh may place, and groups that it may have."""
_MOST_ELEMENTS = 20_000_000
_MOST_TRIANGLES = 2_000_000
"""Most triangles of an OBJ, whose faces may have any number of corners."""
_TEXTS = (".obj", ".off", ".ply", ".stl")
MOST_LINES = 2_000_000
MOST_WORDS = 8_000_000
MOST_SOLIDS = 1_000
"""Most lines, words and solids of a mesh that is text: each takes time, whatever its size."""
_MATERIALS = re.compile(
    rb"^[ \t\v\f]*(mtllib|maplib|usemap|call|csh)[ \t]+(.+?)[ \t]*$", re.I | re.M
)
_POINTING = re.compile(rb"[ \t\v\f]*(mtllib|usemtl|maplib|usemap|call|csh)\b", re.I)
_PARTS = re.compile(rb"^[ \t\v\f]*(?:o|g|usemtl)[ \t]", re.I | re.M)
_FACES = re.compile(rb"^[ \t\v\f]*f[ \t][^\n]*", re.I | re.M)
_PICTURES = re.compile(
    rb"^[ \t\v\f]*(?:map_\w+|bump|disp|decal|refl|norm)[ \t]+(.+?)[ \t]*$", re.I | re.M
)
_TEXTURE = re.compile(rb"^comment[ \t]+TextureFile[ \t]+(.+?)[ \t]*$", re.I | re.M)
_SCHEME = re.compile(r"^\w[\w+.-]*:")
_AGAIN, _POSED = "instance_node", "instance_controller"
_PLACING = ("node", _AGAIN, "instance_geometry", _POSED)
_HEADER = 1 << 20
_SOLIDS = re.compile(rb"endsolid", re.I)
_JOINT = b"\\\n"


def refuse_references(path: Path, where: str) -> None:
    """Refuse a mesh that refers to a device, a pipe, or a file outside its folder.

    The libraries and engines that read meshes open what these name, and wait for it, without a
    bound. What does not exist may be named: materials are often lost on the way.

    Args:
        path: an existing file of bearable size.
        where: what names it, for the message.

    Raises:
        RobotError: it names something else than an ordinary file in its folder, or in one beside
            it, or places more copies of its parts, lines or words than allowed.
    """
    kind = path.suffix.lower()
    try:
        if kind in _TEXTS:
            _refuse_bulk(_lines(path), kind)
        for name in _NAMES[kind](path) if kind in _NAMES else ():
            refuse_elsewhere(name, path, where)
    except ValueError as cause:
        raise RobotError(
            f"{where}: '{path.name}' is damaged: {cause}.\nExport it again."
        ) from cause


def refuse_elsewhere(name: str, path: Path, where: str) -> None:
    """Refuse a referenced file name that leads out of the folder.

    Args:
        name: as it stands there.
        path: of the file that it stands in.
        where: what names that file, for the message.

    Raises:
        RobotError: it is absolute, an address, leads elsewhere, or is not a regular file.
    """
    advice = (
        "\nAllowed: a regular file in its folder, or in a folder beside it. Remove the line; seals "
        "new robot NAME urdf=FILE leaves such lines out."
    )
    shown = f"{where}: '{path.name}' names '{name[:80]}'"
    plain = name.replace("\\", "/").removeprefix("file://").removeprefix("package://")
    if "\0" in name or _SCHEME.match(plain) or plain.startswith(("/", "~")):
        raise RobotError(f"{shown}, which does not name a nearby file.{advice}")
    try:
        target = (path.parent / plain).resolve()
        near = target.is_relative_to(path.parent.resolve().parent)
    except (OSError, RuntimeError, ValueError) as cause:
        raise RobotError(f"{shown}, which cannot be resolved: {cause}.{advice}") from cause
    if not near:
        raise RobotError(f"{shown}, which is in another folder.{advice}")
    if os.path.lexists(target) and not target.is_dir():
        try:
            regular_file(target, most=MOST_BYTES)
        except LogError as cause:
            if "is empty" not in str(cause):
                why = str(cause).partition("\n")[0].removeprefix(f"'{target}' ").rstrip(".")
                raise RobotError(f"{shown}, which {why}.{advice}") from cause


def without_references(raw: bytes) -> bytes:
    r"""Return an OBJ without the lines that name materials or other files.

    Example:
        >>> without_references(b"mtllib /dev/zero\nv 0 0 0\nusemtl a\n")
        b'v 0 0 0\n'
    """
    raw = _one_kind_of_ends(raw)
    # some readers join lines at a backslash, others do not
    return _stripped(_stripped(_one_kind_of_ends(raw)).replace(_JOINT, b""))


def _stripped(raw: bytes) -> bytes:
    lines = raw.splitlines(keepends=True)
    return b"".join(line for line in lines if not _POINTING.match(line))


def _of_obj(path: Path) -> Iterator[str]:
    raw = _lines(path)
    if len(_PARTS.findall(raw)) > MOST_COPIES:
        raise ValueError(f"it has more than {MOST_COPIES:,} groups")
    faces = _FACES.findall(raw)
    if sum(map(len, map(bytes.split, faces))) - 3 * len(faces) > _MOST_TRIANGLES:
        raise ValueError(f"it has more than {_MOST_TRIANGLES:,} triangles")
    for command, words in [*_MATERIALS.findall(raw), *_MATERIALS.findall(raw.replace(_JOINT, b""))]:
        if command.lower() != b"mtllib":
            raise ValueError(f"it holds the command {command.decode()}, which runs or opens a file")
        for name in _candidates(words):
            yield name
            material = path.parent / name
            if not material.is_file():
                continue
            # what leads elsewhere was refused as its name was handed out
            for pictures in _PICTURES.findall(_lines(material)):
                yield from _candidates(pictures)


def _lines(path: Path) -> bytes:
    with path.open("rb") as stream:
        raw = stream.read(MOST_BYTES + 1)
    return _one_kind_of_ends(raw)


def _refuse_bulk(raw: bytes, kind: str) -> None:
    """Refuse more lines, words or solids than a mesh of the allowed triangles has.

    Binary meshes stay below these numbers.
    """
    signs = np.frombuffer(raw, np.uint8)
    blank = (signs == 32) | ((signs >= 9) & (signs <= 13))
    words = np.count_nonzero(blank[1:] & ~blank[:-1])
    lines = raw.count(b"\n")
    if lines > MOST_LINES or words > MOST_WORDS:
        raise ValueError(
            f"it has {lines:,} lines and {words:,} words, "
            f"the limits are {MOST_LINES:,} and {MOST_WORDS:,}"
        )
    if kind == ".stl" and len(_SOLIDS.findall(raw)) > MOST_SOLIDS:
        raise ValueError(f"it has more than {MOST_SOLIDS:,} solids")


def _one_kind_of_ends(raw: bytes) -> bytes:
    return raw.replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def _candidates(words: bytes) -> list[str]:
    """Return the possible file names of a text: one with blanks in it, or several."""
    text = words.decode("utf-8", "replace").strip().strip('"')
    return list(dict.fromkeys([text, *text.split()]))


def _of_ply(path: Path) -> Iterator[str]:
    with path.open("rb") as stream:
        head = stream.read(_HEADER).replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    for name in _TEXTURE.findall(head.split(b"end_header", 1)[0]):
        yield from _candidates(name)


def _of_dae(path: Path) -> Iterator[str]:
    try:
        root = ElementTree.fromstring(path.read_bytes())
    except (ElementTree.ParseError, ValueError, LookupError) as cause:
        raise ValueError(f"not valid XML ({cause})") from cause
    for element in root.iter():
        tag = _tag(element)
        if tag in ("init_from", "ref") and (element.text or "").strip():
            yield str(element.text).strip()
        for key, value in element.attrib.items():
            if key in ("url", "source") and value and not value.startswith("#"):
                # a place inside of another file; inside of this one without a mark in old files
                name = value.partition("#")[0]
                if "/" in name or "#" in value or ":" in name:
                    yield name
    _refuse_copies(root)


def _refuse_copies(root: Any) -> None:
    """Refuse nodes that refer to one another, or to large parts: copies may grow without end."""
    nodes = {str(e.get("id")): e for e in root.iter() if _tag(e) == "node" and e.get("id")}
    corners = {
        # a number has at least one digit, and a blank behind it
        str(e.get("id")): sum(len(p.text or "") for p in e.iter() if _tag(p) == "p") // 2
        for e in root.iter()
        if _tag(e) == "geometry"
    }
    largest, each = max(corners.values(), default=0), _MOST_ELEMENTS // MOST_COPIES
    known: dict[int, int] = {}

    def weight(element: Any, depth: int) -> int:
        """Return the corners that an element places, and some more for each part."""
        if id(element) not in known:
            if depth > 200:
                raise ValueError("its nodes are nested without limit")
            known[id(element)] = _MOST_ELEMENTS + 1  # of a node that stands for itself
            tag, meant = _tag(element), str(element.get("url"))[1:]
            # the shape behind a controller is named somewhere else
            own = corners.get(meant, largest) if tag in ("instance_geometry", _POSED) else 0
            count = each + own
            for child in element:
                shown = nodes.get(str(child.get("url"))[1:]) if _tag(child) == _AGAIN else child
                placed = shown is not None and _tag(child) in _PLACING
                count += weight(shown, depth + 1) if placed else 0
            known[id(element)] = min(count, _MOST_ELEMENTS + 1)
        return known[id(element)]

    for scene in root.iter():
        if _tag(scene) == "visual_scene" and weight(scene, 0) > _MOST_ELEMENTS:
            raise ValueError(
                f"it places more than {MOST_COPIES:,} parts, or {_MOST_ELEMENTS:,} corners"
            )


def _tag(element: Any) -> str:
    return str(element.tag).rpartition("}")[2]


def _of_glb(path: Path) -> Iterator[str]:
    with path.open("rb") as stream:
        head = stream.read(20)
        length = struct.unpack("<I", head[12:16])[0] if len(head) == 20 else 0
        if head[:4] != b"glTF" or length > path.stat().st_size:
            raise ValueError(
                "it does not begin as a binary glTF, or declares more data than it contains"
            )
        content = plain_json(stream.read(length))
    if not isinstance(content, dict):
        raise ValueError("its description is not a mapping")
    for kind in ("buffers", "images"):
        for item in _list(content, kind):
            uri = item.get("uri")
            if isinstance(uri, str) and not uri.startswith("data:"):
                yield uri
    _refuse_hollow(content)


def _list(content: Any, key: str) -> list[dict[str, Any]]:
    found = content.get(key)
    return [one for one in found if isinstance(one, dict)] if isinstance(found, list) else []


def _refuse_hollow(content: Any) -> None:
    """Refuse more declared numbers, or copies of a part, than the bounds allow."""
    counts = [one.get("count") for one in _list(content, "accessors")]
    known = [count for count in counts if isinstance(count, int)]
    if len(known) != len(counts) or min(known, default=0) < 0 or sum(known) > _MOST_ELEMENTS:
        raise ValueError(f"it declares more than {_MOST_ELEMENTS:,} elements")
    # each part may name the numbers of another one again, and each node a mesh of another one
    sizes = [_size(mesh, known) for mesh in _list(content, "meshes")]
    placed = [node["mesh"] for node in _list(content, "nodes") if "mesh" in node]
    if not all(isinstance(k, int) and 0 <= k < len(sizes) for k in placed):
        raise ValueError("it refers to a mesh that it does not contain")
    if len(placed) > MOST_COPIES or sum(sizes) + sum(sizes[k] for k in placed) > _MOST_ELEMENTS:
        raise ValueError(f"it places {len(placed):,} parts, which are too many for their size")


def _size(mesh: dict[str, Any], counts: list[int]) -> int:
    """Return the numbers that all parts of a mesh hold, those held twice counted twice."""
    parts = _list(mesh, "primitives")
    if len(parts) > MOST_COPIES:
        raise ValueError(f"one mesh has {len(parts):,} parts; the limit is {MOST_COPIES:,}")
    named = [part.get("attributes") for part in parts]
    keys = [key for one in named if isinstance(one, dict) for key in one.values()]
    keys += [part["indices"] for part in parts if "indices" in part]
    if not all(isinstance(key, int) and 0 <= key < len(counts) for key in keys):
        raise ValueError("a part refers to numbers that it does not contain")
    return sum(counts[key] for key in keys)


_NAMES = {".obj": _of_obj, ".ply": _of_ply, ".dae": _of_dae, ".glb": _of_glb}
