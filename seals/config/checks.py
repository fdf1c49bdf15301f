"""Checks of a composed configuration: unknown keys, missing values, ``_target_``, references.

Hydra makes an object of every mapping with ``_target_``, however deep it lies.
"""

from __future__ import annotations

import dataclasses
import re
from typing import Any

from seals.errors import ConfigError, suggestion

TARGET = "_target_"
SPECIAL = (TARGET, "_args_", "_partial_", "_recursive_", "_convert_")
"""Keys that tell Hydra to call something, or how."""
MOST, DEEPEST = 10_000_000, 40
"""Signs and entries of a configuration with all references filled in; levels, and references in a
row."""
_REFERENCE = re.compile(r"\$\{\s*(\.*)([\w.\[\]-]*)\s*\}")

Path = tuple[str, ...]


def refuse_unknown(config: Any, *, where: str, made: bool = False) -> None:
    """Refuse keys of a composed node that its schema lacks, or that have no value.

    Args:
        config: a composed node; untyped parts are walked through.
        where: its full key, empty for the root.
        made: whether Hydra will make an object of the node. References are then followed, as what
            they lead to would be made, too, and `SPECIAL` keys must be those of the schema.

    Raises:
        ConfigError: a key is unknown or without value; a mapping without a schema holds a special
            key, one with a schema names another class, or a node to be made leads back into itself.
    """
    from omegaconf import DictConfig, ListConfig, OmegaConf

    waiting: list[tuple[Any, str, int]] = [(config, where, 0)]
    while waiting:
        found, place, depth = waiting.pop()
        if not isinstance(found, DictConfig | ListConfig) or found._is_none():
            continue
        if found._is_missing() or found._is_interpolation():
            continue
        if depth > DEEPEST and made:
            raise ConfigError(
                f"{place:.80} is nested deeper than {DEEPEST} levels.\nIt may refer to itself."
            )
        below: list[tuple[Any, str, int]] = []
        node: Any = found
        schema: Any = OmegaConf.get_type(node)
        typed = isinstance(schema, type) and dataclasses.is_dataclass(schema)
        own = {f.name: f.default for f in dataclasses.fields(schema)} if typed else {}
        for key in range(len(node)) if isinstance(node, ListConfig) else map(str, node):
            listed = isinstance(key, int)
            full_key = f"{place}[{key}]" if listed else f"{place}.{key}" if place else str(key)
            if typed and key not in own:
                shown = [name for name in own if not name.startswith("_")]
                section = f"of {place}" if place else "of the configuration"
                raise ConfigError(
                    f"{full_key}: '{key}' is not a key {section}.\n{suggestion(str(key), shown)}"
                )
            if OmegaConf.is_missing(node, key) and not listed:
                raise ConfigError(f"{full_key} has no value.\nGive it: {full_key}=VALUE")
            if made and key in SPECIAL:
                if key in own and node[key] == own[key]:
                    continue
                allowed = own.get(key, "values; a plug-in is chosen by its group")
                raise ConfigError(
                    f"{full_key}={node[key]!s:.80} is not allowed.\nAllowed: {allowed}"
                )
            below.append((node[key] if made else node._get_node(key), full_key, depth + 1))
        waiting += reversed(below)


def refuse_growth(config: Any) -> None:
    """Refuse a configuration whose references lead to themselves, or grow beyond measure.

    Args:
        config: composed by Hydra, its references unresolved; or plain data.

    Raises:
        ConfigError: a value holds itself, or what is to be filled in has more than `MOST` signs.
    """
    from omegaconf import OmegaConf

    tree = OmegaConf.to_container(config, resolve=False) if OmegaConf.is_config(config) else config
    level, depth = [tree], 0
    while level and depth <= DEEPEST:
        holders = [value for value in level if isinstance(value, dict | list)]
        level = [v for held in holders for v in (held.values() if isinstance(held, dict) else held)]
        depth += 1
    if not level and len(text := repr(tree)) < MOST and "${" not in text:
        return  # as nearly always: nothing that grows
    total = _Sizes(tree).of((), 0)
    if total > MOST:
        raise ConfigError(
            f"the configuration has {total:.3g} characters after substitution of its references.\n"
            f"Allowed: {MOST:,}. References that contain several others may grow without limit"
        )


class _Sizes:
    """Sizes of the parts of a tree with references filled in, each computed once."""

    def __init__(self, tree: Any) -> None:
        self.tree = tree
        self.known: dict[Path, int] = {}
        self.open: set[Path] = set()

    def of(self, path: Path, depth: int) -> int:
        """Return the size of a part.

        Raises:
            ConfigError: it holds itself.
        """
        if path in self.known:
            return self.known[path]
        if path in self.open or depth > DEEPEST:
            what = "refers to itself" if path in self.open else f"has more than {DEEPEST} in a row"
            raise ConfigError(
                f"{'.'.join(path) or 'the configuration'} {what}: references ${{...}}.\n"
                "Replace the reference by a value"
            )
        self.open.add(path)
        value = self.at(path)
        if isinstance(value, dict | list):
            keys = value if isinstance(value, dict) else range(len(value))
            total = 1 + sum(self.of((*path, str(key)), depth + 1) for key in keys)
        else:
            text = value if isinstance(value, str) else ""
            targets = [self.place(_path(found, path)) for found in _REFERENCE.finditer(text)]
            # those that are not there are refused later
            total = len(text) or 1
            total += sum(self.of(target, depth + 1) for target in targets if target is not None)
        self.open.discard(path)
        self.known[path] = total
        return total

    def place(self, path: Path, depth: int = 0) -> Path | None:
        """Return where a part is written, when references on the way are followed; or None."""
        real: Path = ()
        for word in path:
            found = _REFERENCE.fullmatch(str(self.at(real)))
            if found and depth < DEEPEST:
                followed = self.place(_path(found, real), depth + 1)
                if followed is None:
                    return None
                real = followed
            real = (*real, word)
        return None if self.at(real) is None else real

    def at(self, path: Path) -> Any:
        """Return a part as it is written; None if there is none."""
        value = self.tree
        for word in path:
            if isinstance(value, list):
                value = value[int(word)] if word.isdigit() and int(word) < len(value) else None
            elif isinstance(value, dict):
                value = next((v for k, v in value.items() if str(k) == word), None)
            else:
                return None
        return value


def _path(found: re.Match[str], path: Path) -> Path:
    """Return the path of a reference that stands at another."""
    dots, rest = found.groups()
    words = [word for word in re.split(r"[.\[\]]+", rest) if word]
    return (*(path[: max(len(path) - len(dots), 0)] if dots else ()), *words)
