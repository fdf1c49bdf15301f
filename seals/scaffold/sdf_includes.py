"""Replacement of ``<include>`` in an SDF model by models from folders beside its own."""

from __future__ import annotations

import re
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from seals.errors import LogError, RobotError
from seals.untrusted_io import read_xml

_DEEPEST = 8
_MOST = 100
"""Models that one file may bring in."""
_MOST_PARTS = 200_000
"""Elements of a file with all that it brings in."""
_DEEPEST_MODEL = 20
"""Models inside of each other when all are in their places."""


def with_includes(
    path: Path,
    model: ElementTree.Element,
    packages: Mapping[str, Path],
    changes: list[str],
) -> ElementTree.Element:
    """Return a copy of an element in which every ``<include>`` is the model that it names.

    Args:
        path: of the file.
        model: its ``<model>`` element, or all of it.
        packages: folders of models, by name, where they are not beside that of the file.
        changes: what was included is added, in words.

    Raises:
        RobotError: a model is not there, lies elsewhere, or includes itself.
    """
    copy = deepcopy(model)
    _refuse_deep(path, copy)
    _expand(path, copy, _Found(packages, changes), ())
    _refuse_deep(path, copy)
    return copy


@dataclass
class _Found:
    """Where models are looked for, what was included, in words, and its elements."""

    packages: Mapping[str, Path]
    changes: list[str]
    elements: int = 0


def _refuse_deep(path: Path, model: ElementTree.Element) -> None:
    row, depth = [model], 0
    while row := [e for one in row for e in one if e.tag in ("model", "world")]:
        depth += 1
        if depth > _DEEPEST_MODEL:
            raise RobotError(
                f"SDF {path} nests its models too deep.\n"
                f"Allowed: {_DEEPEST_MODEL} inside of each other."
            )


def _expand(
    path: Path,
    model: ElementTree.Element,
    found: _Found,
    above: tuple[Path, ...],
) -> None:
    for inner in (*model.findall("model"), *model.findall("world")):
        _expand(path, inner, found, above)
    for include in model.findall("include"):
        file = _file_of(path, include, found.packages)
        if file in above or len(above) >= _DEEPEST or len(found.changes) > _MOST:
            raise RobotError(
                f"SDF {path}: the model {file.parent.name} includes itself, or too many others.\n"
                f"Allowed: {_DEEPEST} models inside of each other, {_MOST} together."
            )
        try:
            models = read_xml(file).findall("model")
        except LogError as cause:
            raise RobotError(f"SDF {path} includes a model: {cause}") from cause
        if len(models) != 1:
            raise RobotError(f"SDF {file} holds {len(models)} models.\nOne is needed here.")
        own = models[0]
        _refuse_deep(file, own)
        found.elements += sum(1 for _ in own.iter())
        if found.elements > _MOST_PARTS:
            raise RobotError(
                f"SDF {path} includes too much: above {_MOST_PARTS:,} elements.\n"
                "Leave out what is no part of the robot."
            )
        own.set("name", include.findtext("name") or own.get("name") or file.parent.name)
        _place(own, include)
        for mesh in own.iter("uri"):
            _rebase(mesh, file)
        found.changes.append(f"model {file.parent.name} included")
        _expand(file, own, found, (*above, file))
        model.remove(include)
        model.append(own)


def _place(own: ElementTree.Element, include: ElementTree.Element) -> None:
    """Override a model's pose by that of its ``<include>``, and add the plug-ins of the latter."""
    pose = include.find("pose")
    if pose is not None:
        for old in own.findall("pose"):
            own.remove(old)
        own.append(pose)
    own.extend(include.findall("plugin"))


def _rebase(uri: ElementTree.Element, file: Path) -> None:
    """Make the path of a mesh absolute that is relative to the included file."""
    text = (uri.text or "").strip()
    if text and "://" not in text and not text.startswith("/"):
        uri.text = f"file://{file.parent.resolve() / text}"


def _file_of(path: Path, include: ElementTree.Element, packages: Mapping[str, Path]) -> Path:
    uri = (include.findtext("uri") or "").strip()
    name = re.sub(r"^(model|package)://", "", uri).strip("/")
    first = name.split("/")[0]
    if (
        "://" in name
        or not re.fullmatch(r"[\w .+-]+(/[\w .+-]+)*", name)
        or ".." in name.split("/")
    ):
        raise RobotError(
            f"SDF {path} includes '{uri[:80]}', which is not the name of a model beside it.\n"
            "Allowed: model://NAME; fetch the model, and say where it is: --package NAME=FOLDER"
        )
    home = path.resolve().parent
    roots = [packages[first].resolve()] if first in packages else []
    beside = [home, home.parent] if len(home.parents) > 1 else [home]
    tried = [
        *(root / name.removeprefix(first).strip("/") for root in roots),
        *(b / name for b in beside),
    ]
    for folder in tried:
        file = folder if folder.suffix == ".sdf" else folder / "model.sdf"
        inside = any(file.resolve().is_relative_to(root) for root in (*roots, *beside))
        if file.is_file() and inside:
            return file
    raise RobotError(
        f"SDF {path} includes the model '{first}', which is not there.\n"
        f"Tried: {', '.join(map(str, tried))}. Say where it is: --package {first}=FOLDER"
    )
