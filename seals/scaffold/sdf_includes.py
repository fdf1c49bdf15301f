"""Replacement of ``<include>`` in an SDF model by models from folders beside its own."""

from __future__ import annotations

import re
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from seals.check.finding import listed
from seals.errors import RobotError
from seals.scaffold.resources import read_tree
from seals.untrusted_io import read_bytes

_DEEPEST = 8
_LONGEST_CONFIG = 100_000
"""Size of a model.config that is looked at [bytes]."""
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
    changes += _parted_names(copy)
    return copy


def _parted_names(tree: ElementTree.Element) -> list[str]:
    """Give links, joints and frames of nested models names of their own; return what, in words.

    A name that another model of the file uses, too, gets the name of its model in front, wherever
    the model says it, and where the models around it say ``MODEL::NAME``.
    """
    models = [e for e in tree.iter("model") if e is not tree or tree.tag == "model"]
    named = ("link", "joint", "frame")
    own = {
        model: {str(e.get("name")) for tag in named for e in model.findall(tag) if e.get("name")}
        for model in models
    }
    counts: dict[str, int] = {}
    for names in own.values():
        for name in names:
            counts[name] = counts.get(name, 0) + 1
    inner = [model for above in models for model in above.findall("model")]
    changed = []
    for model in reversed(inner):
        twice = sorted(name for name in own[model] if counts[name] > 1)
        title = str(model.get("name"))
        renamed = {name: f"{title}_{name}" for name in twice}
        if not renamed:
            continue
        _rename(model, renamed)
        _rename(tree, {f"{title}::{old}": new for old, new in renamed.items()})
        words = listed(twice, 4)
        changed.append(
            f"names of model {title} are prefixed with it, because other models use "
            f"them too: {words}"
        )
    return changed


def _rename(model: ElementTree.Element, names: Mapping[str, str]) -> None:
    """Replace names of links, joints and frames where they are stated or referred to."""
    for element in model.iter():
        if element.tag in ("link", "joint", "frame") and element.get("name") in names:
            element.set("name", names[str(element.get("name"))])
        for key in ("relative_to", "attached_to", "frame", "expressed_in"):
            if element.get(key) in names:
                element.set(key, names[str(element.get(key))])
        text = (element.text or "").strip()
        if text in names and element.tag not in ("uri", "name"):
            element.text = names[text]


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
                f"SDF {path} nests its models too deeply.\nAllowed: {_DEEPEST_MODEL} nested levels."
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
                f"Allowed: {_DEEPEST} nested models, {_MOST} together."
            )
        try:
            models = read_tree(file).findall("model")
        except RobotError as cause:
            raise RobotError(f"SDF {path} includes a model: {cause}") from cause
        if len(models) != 1:
            raise RobotError(f"SDF {file} holds {len(models)} models.\nOne is needed here.")
        own = models[0]
        _refuse_deep(file, own)
        found.elements += sum(1 for _ in own.iter())
        if found.elements > _MOST_PARTS:
            raise RobotError(
                f"SDF {path} includes too much: above {_MOST_PARTS:,} elements.\n"
                "Remove elements that are not part of the robot."
            )
        own.set("name", include.findtext("name") or own.get("name") or file.parent.name)
        # override a model's pose by that of its `<include>`, and add the plug-ins of the latter
        pose = include.find("pose")
        if pose is not None:
            for old in own.findall("pose"):
                own.remove(old)
            own.append(pose)
        own.extend(include.findall("plugin"))
        for uri in own.iter("uri"):
            # the path of a mesh is relative to the included file
            text = (uri.text or "").strip()
            if text and "://" not in text and not text.startswith("/"):
                uri.text = f"file://{file.parent.resolve() / text}"
        found.changes.append(f"model {file.parent.name} included")
        _expand(file, own, found, (*above, file))
        model.remove(include)
        model.append(own)


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
            "Allowed: model://NAME; fetch the model, and say where it is: package=NAME=FOLDER"
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
        if folder.suffix != ".sdf" and not file.is_file():
            file = folder / _named_file(folder / "model.config")
        inside = any(file.resolve().is_relative_to(root) for root in (*roots, *beside))
        if file.is_file() and inside:
            return file
    raise RobotError(
        f"SDF {path} includes the model '{first}', which does not exist.\n"
        f"Tried: {', '.join(map(str, tried))}. Give its folder: package={first}=FOLDER"
    )


def _named_file(config: Path) -> str:
    """Name of the SDF file that a ``model.config`` states, the last of several; else model.sdf."""
    beside = config.resolve().parent == config.parent.resolve()
    if not (beside and config.is_file()) or config.stat().st_size > _LONGEST_CONFIG:
        return "model.sdf"
    text = read_bytes(config, most=_LONGEST_CONFIG).decode(errors="replace")
    names = re.findall(r"<sdf\b[^>]*>\s*([\w.+-]+\.sdf)\s*</sdf>", text)
    return str(names[-1]) if names else "model.sdf"
