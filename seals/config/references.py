"""References of a composed configuration: followed without circles, and to a bounded size."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from seals.errors import ConfigError

MOST, DEEPEST = 10_000_000, 40
"""Signs and entries of a configuration with all references filled in; references in a row."""
_REFERENCE = re.compile(r"\$\{\s*(\.*)([\w.\[\]-]*)\s*\}")

Path = tuple[str, ...]


def refuse_growth(config: Any) -> None:
    """Refuse a configuration whose references lead to themselves, or grow beyond measure.

    Args:
        config: composed by Hydra, its references unresolved.

    Raises:
        ConfigError: a value holds itself, or what is to be filled in has more than `MOST` signs.
    """
    from omegaconf import OmegaConf

    tree = OmegaConf.to_container(config, resolve=False) if OmegaConf.is_config(config) else config
    total = _Sizes(tree).of((), 0)
    if total > MOST:
        raise ConfigError(
            f"the configuration has {total:.3g} signs with its references filled in.\n"
            f"Allowed: {MOST:,}. One that holds two others, and so on, grows without end"
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
                "Give it a value of its own"
            )
        self.open.add(path)
        value = self.at(path)
        if isinstance(value, dict | list):
            keys = value if isinstance(value, dict) else range(len(value))
            total = 1 + sum(self.of((*path, str(key)), depth + 1) for key in keys)
        else:
            total = len(value) if isinstance(value, str) else 1
            total += sum(self.of(target, depth + 1) for target in self.targets(path, value))
        self.open.discard(path)
        self.known[path] = total
        return total

    def targets(self, path: Path, value: Any) -> Iterator[Path]:
        """Yield the parts that a text refers to; those that are not there are refused later."""
        for found in _REFERENCE.finditer(value if isinstance(value, str) else ""):
            target = self.place(_path(found, path))
            if target is not None:
                yield target

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
        """Return a part as it is written; None where there is none."""
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
