"""Structural validation of a URDF: XML, unique names, attributes, numbers; expansion of xacro.

The parsers behind it repair what they can; a robot that was repaired silently is not the one meant.
"""

from __future__ import annotations

import functools
import itertools
import math
import re
from collections.abc import Iterator, Mapping
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import TypeAlias
from xml.etree import ElementTree

from seals.child_process import environment
from seals.errors import MissingExtra, RobotError, printable, refuse_unlisted
from seals.isolated_reading import out_of_time, run_bounded
from seals.untrusted_io import plain_json

PATIENCE = 30.0
"""Time after which the process that expands macros is ended [s]."""
_KEPT = ("PYTHONPATH", "PYTHONSAFEPATH", "PYTHONHOME", "LD_LIBRARY_PATH", "SYSTEMROOT")
"""Variables without which no Python starts; the process forgets them as well."""


_COMMENT = re.compile(r"<!--(.*?)-->", re.DOTALL)


def holds_macros(text: str) -> bool:
    """Return whether the text of a URDF needs xacro.

    Example:
        >>> holds_macros('<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"/>')
        True
    """
    return re.search(r"<xacro:|xmlns:xacro", _COMMENT.sub("", text)) is not None


def with_plain_comments(text: str) -> str:
    """Return XML whose comments hold no two dashes, which XML forbids and people write.

    Lines keep their numbers. What is left of ``<!--`` without an end stays as it is.

    Example:
        >>> with_plain_comments("<a/><!-- b --msgtype ---- c -->")
        '<a/><!-- b - -msgtype - - - - c -->'
    """
    return _COMMENT.sub(lambda found: f"<!--{_parted(found[1])}-->", text)


def with_plain_names(text: str) -> str:
    """Return XML without a default name space, and with undeclared prefixes made part of names.

    Programs that read robots look at neither; an XML parser takes the one for other elements and
    refuses the other.

    Example:
        >>> with_plain_names('<robot xmlns="http://a.b"><drake:x/></robot>')
        '<robot><drake_x/></robot>'
    """
    text = re.sub(r"""(<[\w.-]+[^<>]*?)\sxmlns=("[^"]*"|'[^']*')""", r"\1", text)
    declared = {"xml", "xmlns", *re.findall(r"xmlns:([\w.-]+)=", text)}

    def named(found: re.Match[str]) -> str:
        joined = ":" if found[2] in declared else "_"
        return f"{found[1]}{found[2]}{joined}"

    return re.sub(r"(</?)([A-Za-z_][\w.-]*):(?=[A-Za-z_])", named, text)


def _parted(comment: str) -> str:
    parted = re.sub(r"-(?=-)", "- ", comment)
    return f"{parted} " if parted.endswith("-") else parted


def expanded(
    path: Path,
    packages: Mapping[str, Path] | None = None,
    arguments: Mapping[str, str] | None = None,
) -> str:
    """Return the URDF expanded from a xacro file.

    The package xacro runs in a process of its own, with little time and memory, without the
    environment of this one; it opens ordinary files near the given one only, and writes none.

    Args:
        path: of the file; files that it includes lie in its folder, in a package beside its own, or
            in one of the given ones.
        packages: folders of ``$(find NAME)``, by name, where they are not around the file.
        arguments: values of ``$(arg NAME)``, by name.

    Raises:
        MissingExtra: the package xacro is not installed.
        RobotError: the macros cannot be expanded.
    """
    if not _installed():
        raise MissingExtra(
            f"URDF {path} holds xacro macros, which need the package xacro; it is not installed.\n"
            "Install it: pip install xacro. Or expand the file elsewhere: "
            "xacro model.urdf.xacro > model.urdf"
        )
    done = run_bounded(
        Path(str(files("seals.robot"))) / "macros_child.py",
        [
            str(path.resolve()),
            *(f"{name}={folder.resolve()}" for name, folder in (packages or {}).items()),
            *(f"{name}:={value}" for name, value in (arguments or {}).items()),
        ],
        env={key: value for key, value in environment().items() if key in _KEPT},
        patience=PATIENCE,
        refused=functools.partial(_refused, path),
    )
    try:
        answer = plain_json(done.stdout)
        text = answer.get("urdf")
    except (ValueError, AttributeError) as cause:
        code = f"the process that expands them ended with code {done.returncode}"
        why = "its macros take too long" if out_of_time(done.returncode, 0) else code
        raise _refused(path, why) from cause
    if not isinstance(text, str):
        raise _refused(path, str(answer.get("refused")))
    return text


def _installed() -> bool:
    try:
        return find_spec("xacro") is not None
    except ValueError:
        return False


def _refused(path: Path, why: str) -> RobotError:
    return RobotError(
        f"URDF {path}: xacro cannot expand it: {why}.\n"
        "An argument without a default: arg=NAME=VALUE. A package of $(find NAME): package="
        "NAME=FOLDER. Environment variables are not available here: expand the file where they are."
    )


Element: TypeAlias = "ElementTree.Element[str]"

LARGEST = 1e17
"""Size beyond which no number of a robot lies [any unit]."""
MOST_SHAPES = 2000
"""Collision and visual shapes of a robot."""
_MOST_NAME, _FINEST = 200, 1e-9
JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed")
_INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_SHAPES = {
    "box": {"size": 3},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "capsule": {"radius": 1, "length": 1},
}


def check_structure(path: Path, text: str, *, endless: bool = False) -> None:
    """Refuse a URDF that violates its format.

    Args:
        path: of the file, for messages.
        text: its content, free of document types and entities.
        endless: whether limits of joints may be infinite, or as large as numbers get.

    Raises:
        RobotError: says where, what is wrong, and what is allowed.
    """
    where = f"URDF {path}"
    root = _parsed(where, text)
    links, joints = root.findall("link"), root.findall("joint")
    shapes = sum(1 for tag in ("collision", "visual") for _ in root.iter(tag))
    if shapes > MOST_SHAPES:
        raise RobotError(f"{where} has {shapes:,} shapes.\nAllowed: up to {MOST_SHAPES:,}.")
    for element in (root, *links, *joints):
        # refuse a name that could begin a line, or be looked up, where it is written to
        name = element.get("name", "")
        if not name.isprintable() or "${" in name or len(name) > _MOST_NAME:
            raise RobotError(
                f"{where}: a {element.tag} is named '{printable(name[:60])}'.\n"
                f"Allowed: up to {_MOST_NAME} printable characters on one line, without '${{'."
            )
    for kind, elements in (("link", links), ("joint", joints)):
        names = [element.get("name", "") for element in elements]
        if "" in names:
            raise RobotError(f"{where}: a {kind} has no name.\nGive it one: <{kind} name=...>.")
        twice = (
            sorted({name for name in names if names.count(name) > 1}) if len(names) < 5000 else []
        )
        if twice:
            raise RobotError(
                f"{where}: the {kind} '{twice[0]}' occurs twice.\n"
                f"Give every {kind} a different name."
            )
    for link in links:
        _link(f"{where}: link '{link.get('name')}'", link)
    for joint in joints:
        _joint(f"{where}: joint '{joint.get('name')}'", joint, endless=endless)


def _parsed(where: str, text: str) -> Element:
    """Root element of sound XML that describes a robot."""
    if holds_macros(text):
        advice = (
            "Expand it first: xacro model.urdf.xacro > model.urdf; "
            "or import it: seals new robot NAME urdf=FILE"
        )
        raise RobotError(f"{where} holds xacro macros.\n{advice}")
    try:
        root: Element = ElementTree.fromstring(text.encode("utf-8"))
    except (ElementTree.ParseError, ValueError, LookupError) as cause:
        raise RobotError(
            f"{where} cannot be read as XML: {cause}.\n"
            "Was it copied completely? Every element must be closed."
        ) from cause
    if root.tag != "robot":
        raise RobotError(
            f"{where} contains a <{root.tag}>, not a <robot>.\n"
            "A robot folder contains a URDF; seals new robot also takes xacro, SDF and MJCF."
        )
    return root


def _link(where: str, link: Element) -> None:
    inertial = link.find("inertial")
    if inertial is not None:
        _origin(where, inertial)
        mass, inertia = inertial.find("mass"), inertial.find("inertia")
        _numbers(f"{where}: mass", mass, "value", 1)
        for name in _INERTIA:
            _numbers(f"{where}: inertia", inertia, name, 1)
    for part in (*link.findall("visual"), *link.findall("collision")):
        _origin(where, part)
        geometry = part.find("geometry")
        for shape in () if geometry is None else geometry:
            _shape(where, shape)


def _shape(where: str, shape: Element) -> None:
    """Sizes of a primitive, or the file and the scale of a mesh."""
    if shape.tag == "mesh":
        if not shape.get("filename"):
            raise RobotError(f"{where}: a mesh has no filename.\nGive it: <mesh filename=...>.")
        if shape.get("scale") is not None:
            scale = _numbers(f"{where}: mesh", shape, "scale", 3)
            if min(map(abs, scale)) < _FINEST:
                raise RobotError(
                    f"{where}: mesh has scale='{shape.get('scale')}'.\n"
                    f"Allowed: factors of {_FINEST:g} or more, or their negative values."
                )
        return
    for name, count in _SHAPES.get(shape.tag, {}).items():
        sizes = _numbers(f"{where}: {shape.tag}", shape, name, count)
        if min(sizes) <= 0.0:
            raise RobotError(
                f"{where}: {shape.tag} has {name}='{shape.get(name)}'.\n"
                "Allowed: lengths above zero, in metres."
            )


def _joint(where: str, joint: Element, *, endless: bool) -> None:
    for end in ("parent", "child"):
        element = joint.find(end)
        if element is None or not element.get("link"):
            raise RobotError(f"{where} has no {end} link.\nGive it: <{end} link=...>.")
    kind = joint.get("type", "")
    if kind in ("floating", "planar"):
        raise RobotError(
            f"{where} has the type '{kind}', between two bodies.\n"
            "Make it fixed, or import the bodies as robots of their own. Only a floating joint "
            f"from a bare 'world' to the base is left out.  Allowed: {', '.join(JOINT_TYPES)}"
        )
    refuse_unlisted(kind, JOINT_TYPES, f"{where} has the type '{kind}'", error=RobotError)
    _origin(where, joint)
    axis, limit = joint.find("axis"), joint.find("limit")
    if axis is not None:
        _numbers(f"{where}: axis", axis, "xyz", 3)
    if limit is None and kind in ("revolute", "prismatic"):
        raise RobotError(
            f"{where} is {kind} and has no <limit>.\n"
            "Add <limit lower=... upper=... effort=... velocity=.../>, or make it continuous."
        )
    for name in ("lower", "upper"):
        if limit is not None and limit.get(name) is not None:
            value = next(_floats(str(limit.get(name))), math.nan)
            if endless and abs(value) >= LARGEST:
                continue
            _numbers(f"{where}: limit", limit, name, 1)


def _origin(where: str, element: Element) -> None:
    origin = element.find("origin")
    for name in ("xyz", "rpy"):
        if origin is not None and origin.get(name) is not None:
            _numbers(f"{where}: origin", origin, name, 3)


def _numbers(where: str, element: Element | None, name: str, count: int) -> list[float]:
    """Finite numbers of an attribute that must be there."""
    given = None if element is None else element.get(name)
    if given is None:
        raise RobotError(f"{where}: {name} is missing.\nGive it: {name}=...")
    return numbers(where, name, given, count)


def numbers(where: str, name: str, text: str | None, count: int) -> list[float]:
    """Return the numbers in a text; refuse those that are not finite.

    Raises:
        RobotError: another count, or one is not finite or beyond every size of a robot.

    Example:
        >>> numbers("link", "size", "1 2 3", 3)
        [1.0, 2.0, 3.0]
    """
    values = list(itertools.islice(_floats(text or ""), count + 1))
    if len(values) != count or not all(abs(x) < LARGEST for x in values):
        allowed = "a finite number" if count == 1 else f"{count} finite numbers"
        raise RobotError(
            f"{where}: {name}='{(text or '').strip()[:60]}' is not {allowed}.\n"
            f"Allowed: {allowed}, with a decimal point."
        )
    return values


def _floats(text: str) -> Iterator[float]:
    for word in text.split():
        try:
            yield float(word)
        except ValueError:
            yield math.nan
