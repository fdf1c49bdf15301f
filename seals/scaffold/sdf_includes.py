"""Replacement of ``<include>`` in an SDF model by models from folders beside its own."""

from __future__ import annotations

import re
from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from xml.etree import ElementTree

from seals.errors import LogError, RobotError
from seals.untrusted_io import read_xml

_DEEPEST = 8
_MOST = 100
"""Models that one file may bring in."""


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
    _expand(path, copy, packages, changes, ())
    return copy


def _expand(
    path: Path,
    model: ElementTree.Element,
    packages: Mapping[str, Path],
    changes: list[str],
    above: tuple[Path, ...],
) -> None:
    for inner in (*model.findall("model"), *model.findall("world")):
        _expand(path, inner, packages, changes, above)
    for include in model.findall("include"):
        file = _file_of(path, include, packages)
        if file in above or len(above) >= _DEEPEST or len(changes) > _MOST:
            raise RobotError(
                f"SDF {path}: the model {file.parent.name} includes itself, or too many others.\n"
                f"Allowed: {_DEEPEST} models inside of each other, {_MOST} together."
            )
        try:
            found = read_xml(file).findall("model")
        except LogError as cause:
            raise RobotError(f"SDF {path} includes a model: {cause}") from cause
        if len(found) != 1:
            raise RobotError(f"SDF {file} holds {len(found)} models.\nOne is needed here.")
        own = found[0]
        own.set("name", include.findtext("name") or own.get("name") or file.parent.name)
        _place(own, include)
        for mesh in own.iter("uri"):
            _rebase(mesh, file)
        changes.append(f"model {file.parent.name} included")
        _expand(file, own, packages, changes, (*above, file))
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
