"""Refusal of what the file of a stranger may not set: paths, addresses and permissions.

What a field does is its role, which its class declares (`seals.field_roles`). This is the one place
that applies them, to a configuration as it was composed: how a file put a value there is no matter.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from seals import registry
from seals.config.roots import OPEN, root_schema
from seals.errors import ConfigError
from seals.field_roles import Role, roles_of
from seals.robot.robot_file import PARTS

_PARTS = ("controller", "guide")
"""Keys of a robot or object that name plug-ins, of the kinds of the same name."""
_SHIPPED = re.compile(r"[\w-]+/[\w-]+")
_MARKS = "+~"


_Found = tuple[str, "Role | None", Any]
"""Full key of a value that is not data, role of the field where its class states one, and value."""


def refuse_values(config: Any, *, root: str, words: Sequence[str], where: str) -> None:
    """Refuse a composed configuration in which more than data comes from a file.

    Args:
        config: composed, of a root; its references are followed.
        root: its name, such as ``run``.
        words: of the command line: what they set, they may.
        where: the file or folder that the rest comes from, for the message.

    Raises:
        ConfigError: a path, an address or a permission is not that of the schema, not of an
            installed thing, and not on the command line.
    """
    given = {}
    for word in words:
        key, sign, text = word.lstrip(_MARKS).partition("=")
        if sign and not word.startswith("-"):
            group, _, package = key.partition("@")
            # whether all that is below is set, too
            given[package or group] = text.startswith("{")
    for key, role, value in _values(config, root_schema(f"{root}_schema"), ""):
        if _covers(given, key):
            continue
        what = "has no role" if role is None else f"is a {role.value}"
        what = what.replace("a address", "an address")
        shown = " ".join(f"{key}={value!s}".split())
        raise ConfigError(
            f"{where} sets {shown:.120}, which {what}: files set data only.\n"
            f"If you want this, state it on the command line: {key}=VALUE"
        )


def _covers(given: Mapping[str, bool], key: str) -> bool:
    if key in given or any(word.startswith(f"{key}.") for word in given):
        return True
    if key in ("robot.folder", "robot.urdf") or key.startswith("robot.hulls."):
        return "robot" in given
    return any(whole and key.startswith(f"{word}.") for word, whole in given.items())


def _values(node: Any, cls: type, key: str) -> Iterator[_Found]:
    """Yield all values below a node of a class that are not data, and not defaults."""
    from omegaconf import OmegaConf

    missing = dataclasses.MISSING
    defaults = {
        field.name: field.default if field.default_factory is missing else field.default_factory()
        for field in dataclasses.fields(cls)
    }
    for name, role in roles_of(cls).items():
        value = _at(node, name)
        place = f"{key}.{name}" if key else name
        if value is None or (not OmegaConf.is_config(value) and value == defaults.get(name)):
            continue
        if cls.__name__.startswith("RobotSettings") and name in ("folder", "urdf"):
            if str(value) != _installed(node).get(name):
                yield place, role, value
        elif name == "model" and _is_config(value):
            file = _at(value, "file")
            if file is not None and not _own_model(str(file)):
                yield place, Role.read, file
        elif role is not Role.data:
            plain = OmegaConf.to_container(value, resolve=True) if _is_config(value) else value
            if plain not in (defaults.get(name), [], {}, "") and not _shipped(role, plain):
                yield place, role, plain
        yield from _below(value, name, place)


def _below(node: Any, name: str, key: str) -> Iterator[_Found]:
    from omegaconf import DictConfig, OmegaConf

    if not _is_config(node):
        return
    schema: Any = OmegaConf.get_type(node)
    if isinstance(schema, type) and dataclasses.is_dataclass(schema):
        yield from _values(node, schema, key)
    elif name in OPEN and isinstance(node, DictConfig):
        for part, inner in ((str(k), _at(node, k)) for k in node):
            yield from _actor(inner, f"{key}.{part}")
    elif isinstance(node, DictConfig):
        for part, inner in ((str(k), _at(node, k)) for k in node):
            yield from _below(inner, part, f"{key}.{part}")
    else:
        for k in range(len(node)):
            yield from _below(_at(node, k), name, f"{key}.{k}")


def _actor(node: Any, key: str) -> Iterator[_Found]:
    """Yield what is not data of a robot or object, which has no type before it is built."""
    from seals.config.source import robot_names

    # a text alone is the robot
    robot = _at(node, "robot") if _is_config(node) else node
    if robot is not None and str(robot) not in robot_names():
        yield f"{key}.robot", Role.read, robot
    for part in _PARTS if _is_config(node) else ():
        yield from _part(_at(node, part), part, f"{key}.{part}")
    for section, kind in PARTS.items() if _is_config(node) else ():
        entries = _at(node, section)
        for part in map(str, entries) if _is_config(entries) else ():
            yield from _part(_at(entries, part), kind, f"{key}.{section}.{part}")


def _part(node: Any, kind: str, key: str) -> Iterator[_Found]:
    """Yield what is not data of a plug-in that a mapping names by its kind, or leaves to a file."""
    if not _is_config(node):
        return
    chosen = _at(node, kind)
    for plugin in registry.names(kind) if chosen is None else [str(chosen)]:
        if plugin in registry.names(kind):
            yield from _values(node, registry.get(kind, plugin).load(), key)


def _own_model(file: str) -> bool:
    """Return whether a model lies in the folder of models, where a name finds it."""
    from seals.config.overlay import FOLDER

    return not Path(file).is_symlink() and Path(file).resolve().parent == Path(FOLDER).resolve()


def _at(node: Any, name: Any) -> Any:
    """Return a value of a node, references followed; None if there is none."""
    from omegaconf.errors import OmegaConfBaseException

    try:
        return node[name] if isinstance(name, int) else node.get(name)
    except (OmegaConfBaseException, AttributeError):
        # what has no value is refused where it is needed
        return None


def _is_config(value: Any) -> bool:
    from omegaconf import OmegaConf

    return bool(OmegaConf.is_config(value)) and not value._is_none()


def _installed(node: Any) -> dict[str, str]:
    """Return folder and URDF of the installed robot of a node's name; nothing for another."""
    from seals.config.source import find_robot, robot_names

    name = str(_at(node, "name") or "")
    if not name or name not in robot_names():
        return {}
    known = find_robot(name).settings
    return {"folder": known.folder, "urdf": known.urdf}


def _shipped(role: Role | None, value: Any) -> bool:
    """Return whether a path to read is the name of what an installed robot brings: crab/walk."""
    from seals.config.source import robot_names

    listed = value if isinstance(value, list) else [value]
    return role is Role.read and all(
        isinstance(one, str)
        and _SHIPPED.fullmatch(one) is not None
        and one.partition("/")[0] in robot_names()
        for one in listed
    )
