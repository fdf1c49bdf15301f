"""Check of the files that a mesh refers to: materials, images, buffers."""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from seals.errors import LogError, RobotError
from seals.untrusted_io import plain_json, regular_file

MOST_BYTES = 50_000_000
"""Largest file that a mesh may name [byte]."""
MOST_COPIES = 10_000
"""Most copies of its parts that a mesh may place."""
_MOST_ELEMENTS = 20_000_000
_MATERIALS = re.compile(
    rb"^[ \t\v\f]*(mtllib|maplib|usemap|call|csh)[ \t]+(.+?)[ \t]*$", re.I | re.M
)
_POINTING = re.compile(rb"[ \t\v\f]*(mtllib|usemtl|maplib|usemap|call|csh)\b", re.I)
_PICTURES = re.compile(
    rb"^[ \t\v\f]*(?:map_\w+|bump|disp|decal|refl|norm)[ \t]+(.+?)[ \t]*$", re.I | re.M
)
_TEXTURE = re.compile(rb"^comment[ \t]+TextureFile[ \t]+(.+?)[ \t]*$", re.I | re.M)
_SCHEME = re.compile(r"^\w[\w+.-]*:")
_HEADER = 1 << 20
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
            it, or places more copies of its parts than allowed.
    """
    names = _NAMES.get(path.suffix.lower())
    if names is None:
        return
    try:
        for name in names(path):
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
        RobotError: it is absolute, an address, leads elsewhere, or is not an ordinary file.
    """
    advice = (
        "\nAllowed: an ordinary file in its folder, or in one beside it. Take the line out; "
        "seals new robot NAME --urdf FILE leaves such lines out."
    )
    shown = f"{where}: '{path.name}' names '{name[:80]}'"
    plain = name.replace("\\", "/").removeprefix("file://").removeprefix("package://")
    if "\0" in name or _SCHEME.match(plain) or plain.startswith(("/", "~")):
        raise RobotError(f"{shown}, which does not name a file near it.{advice}")
    try:
        target = (path.parent / plain).resolve()
        near = target.is_relative_to(path.parent.resolve().parent)
    except (OSError, RuntimeError, ValueError) as cause:
        raise RobotError(f"{shown}, which cannot be looked up: {cause}.{advice}") from cause
    if not near:
        raise RobotError(f"{shown}, which lies elsewhere.{advice}")
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
        tag = str(element.tag).rpartition("}")[2]
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
    """Refuse nodes that refer to one another: their copies may grow exponentially."""
    nodes = {
        str(e.get("id")): e for e in root.iter() if str(e.tag).endswith("}node") and e.get("id")
    }
    known: dict[int, int] = {}

    def copies(element: Any, depth: int) -> int:
        if id(element) not in known:
            if depth > 200:
                raise ValueError("its nodes are nested without end")
            known[id(element)] = MOST_COPIES + 1  # of a node that stands for itself
            count = 1
            for child in element:
                tag = str(child.tag).rpartition("}")[2]
                meant = nodes.get(str(child.get("url"))[1:]) if tag == "instance_node" else child
                count += 0 if meant is None else copies(meant, depth + 1) if _places(tag) else 0
            known[id(element)] = min(count, MOST_COPIES + 1)
        return known[id(element)]

    for scene in root.iter():
        if str(scene.tag).endswith("}visual_scene") and copies(scene, 0) > MOST_COPIES:
            raise ValueError(f"it places more than {MOST_COPIES:,} parts")


def _places(tag: str) -> bool:
    return tag in ("node", "instance_node", "instance_geometry", "instance_controller")


def _of_glb(path: Path) -> Iterator[str]:
    with path.open("rb") as stream:
        head = stream.read(20)
        length = struct.unpack("<I", head[12:16])[0] if len(head) == 20 else 0
        if head[:4] != b"glTF" or length > path.stat().st_size:
            raise ValueError("it does not start as a binary glTF, or declares more than it holds")
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
    nodes = _list(content, "nodes")
    placed = sum("mesh" in node for node in nodes)
    if placed > MOST_COPIES or placed * max(known, default=0) > _MOST_ELEMENTS:
        raise ValueError(f"it places {placed:,} parts, too many for their size")


_NAMES = {".obj": _of_obj, ".ply": _of_ply, ".dae": _of_dae, ".glb": _of_glb}
