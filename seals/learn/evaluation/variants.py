"""Named variants of a world: overrides of its configuration, and factors on its numbers."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from seals.config.build import typed_entries
from seals.config.compose import compose
from seals.errors import ConfigError, suggestion
from seals.field_roles import roles


@roles(data="scale", permission="overrides")
@dataclass(kw_only=True)
class Variant:
    """Variant of a world.

    Args:
        overrides: of the configuration, as on the command line.
        scale: factors on numbers, by shell patterns of their full keys such as
            ``effects.*drag*.coefficient_*``; each pattern must meet a number that is not zero.
        episodes: number of starts; 0 for that of the evaluation.
        count: environments that step at once; 0 for that of the evaluation.
    """

    overrides: list[str] = field(default_factory=list)
    scale: dict[str, float] = field(default_factory=dict)
    episodes: int = 0
    count: int = 0

    def world(self, *, base: Sequence[str], root: str, where: str) -> Any:
        """Compose the configuration of a variant.

        Args:
            base: overrides that are in force already.
            root: name of the root configuration.
            where: full key of the variant, for the words of a refusal.

        Raises:
            ConfigError: an override is wrong, or a pattern meets no number.
        """
        kept = [word for word in base if _key(word) not in map(_key, self.overrides)]
        try:
            config = compose([*kept, *self.overrides], root=root)
        except ConfigError as cause:
            raise ConfigError(f"{where}: {cause}") from cause
        for pattern, factor in self.scale.items():
            _scale(config, pattern, factor, where)
        return config


def variants_of(node: Any) -> dict[str, Variant]:
    """Return the variants of a configuration's ``grid``.

    Raises:
        ConfigError: an entry has an unknown key, or a value of another type.
    """
    return typed_entries(Variant, node, where="grid")


def _key(override: str) -> str:
    return override.lstrip("+~").partition("=")[0]


def _scale(config: Any, pattern: str, factor: float, where: str) -> None:
    from omegaconf import OmegaConf

    touched = 0
    keys = []
    for key, value in _numbers(config):
        keys.append(key)
        if fnmatch.fnmatchcase(key, pattern) and value != 0.0:
            OmegaConf.update(config, key, value * factor)
            touched += 1
    if not touched:
        near = suggestion(pattern, keys, label="Numbers there", most=8)
        raise ConfigError(f"{where}.scale: '{pattern}' meets no number but zero.\n{near}")


def _numbers(node: Any, prefix: str = "") -> Iterator[tuple[str, float]]:
    """Yield the real numbers of a configuration with their full keys, in order.

    Example:
        >>> from omegaconf import OmegaConf
        >>> config = OmegaConf.create({"a": {"b": 2.0, "c": 1}, "d": "x"})
        >>> list(_numbers(config))
        [('a.b', 2.0)]
    """
    from omegaconf import DictConfig

    # a list of numbers, and a count, are left alone: a factor means nothing to half of them
    for key in node:
        full = f"{prefix}{key}"
        value = node._get_node(key)
        if isinstance(value, DictConfig) and not value._is_none():
            yield from _numbers(value, f"{full}.")
        elif not isinstance(value, DictConfig) and isinstance(
            value._value() if hasattr(value, "_value") else value, float
        ):
            yield full, float(value._value())
