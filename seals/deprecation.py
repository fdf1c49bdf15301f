"""Former names of public classes and attributes: still usable, with a warning."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def renamed_members(module: str, names: Mapping[str, str]) -> Callable[[str], Any]:
    """Return a module's ``__getattr__`` that resolves former names with a warning.

    Args:
        module: full name of the module.
        names: present name by former name.

    Example:
        >>> find = renamed_members("math", {"circle_constant": "pi"})
        >>> with warnings.catch_warnings(record=True) as caught:
        ...     warnings.simplefilter("always")
        ...     value = find("circle_constant")
        >>> str(caught[0].message)
        'math.circle_constant is now math.pi; use the new name.'
    """

    def find(name: str) -> Any:
        if name not in names:
            raise AttributeError(f"module '{module}' has no attribute '{name}'")
        warn_renamed(f"{module}.{name}", f"{module}.{names[name]}", level=3)
        return getattr(import_module(module), names[name])

    return find


def add_former_names(owner: type, names: Mapping[str, str]) -> None:
    """Make the fields of a class readable under their former names, with a warning.

    Args:
        owner: the class.
        names: present name by former name.
    """
    for old, new in names.items():
        setattr(owner, old, property(_reader(owner.__name__, old, new)))


def _reader(owner: str, old: str, new: str) -> Callable[[Any], Any]:
    def read(value: Any) -> Any:
        warn_renamed(f"{owner}.{old}", f"{owner}.{new}", level=3)
        return getattr(value, new)

    return read


def warn_renamed(old: str, new: str, *, level: int = 2) -> None:
    """Warn that a name was replaced.

    Args:
        old: former name.
        new: present name.
        level: of the caller, see `warnings.warn`.
    """
    warnings.warn(f"{old} is now {new}; use the new name.", DeprecationWarning, level)
