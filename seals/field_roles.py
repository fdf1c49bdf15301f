"""Roles of settings' fields: which of them the file of a stranger may set.

Values that come from a policy's card, the note of a sweep, a run folder or a folder of
configuration may be *data* only. Paths, addresses and permissions are given on the command line.
Each class declares the roles of its fields, once: that is the only list.
"""

from __future__ import annotations

import dataclasses
import enum
import functools
import types
import typing
from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeVar

from seals.errors import ConfigError

C = TypeVar("C", bound=type)
_OWN = "_seals_roles"
_KNOWN = "_seals_all_roles"


class Role(enum.Enum):
    """What a field of settings does to the world outside of the computation."""

    data = "data"
    """Numbers, choices and names: nothing."""
    read = "path to read"
    write = "path to write"
    address = "address"
    """Where to listen, where to connect, who may come in."""
    permission = "permission"
    """To overwrite, to start a program or to talk to others."""


def roles(
    *,
    data: str = "",
    read: str = "",
    write: str = "",
    address: str = "",
    permission: str = "",
) -> Callable[[C], C]:
    """Declare the roles of a class's fields; above ``@dataclass``.

    Fields that hold only numbers and enumerations are data and need no entry.

    Args:
        data: names of fields, separated by blanks; as for all others.
        read: paths to read.
        write: paths to write.
        address: addresses.
        permission: permissions.

    Raises:
        ConfigError: a name is not that of a field.

    Example:
        >>> @roles(data="name", write="out")
        ... @dataclasses.dataclass(kw_only=True)
        ... class Settings:
        ...     name: str = ""
        ...     out: str = ""
        ...     step: float = 0.1
        >>> {name: role.value for name, role in roles_of(Settings).items()}
        {'name': 'data', 'out': 'path to write', 'step': 'data'}
    """
    listed = {
        Role.data: data,
        Role.read: read,
        Role.write: write,
        Role.address: address,
        Role.permission: permission,
    }

    def mark(cls: C) -> C:
        given = {name: role for role, names in listed.items() for name in names.split()}
        known = {field.name for field in dataclasses.fields(cls)}
        if set(given) - known:
            missing = ", ".join(sorted(set(given) - known))
            raise ConfigError(f"{cls.__name__} has no field {missing}.\nDeclare roles of fields.")
        setattr(cls, _OWN, given)
        return cls

    return mark


@functools.cache
def roles_of(cls: type) -> Mapping[str, Role | None]:
    """Return the role of every field of a dataclass; None if it states none and needs one."""
    known: Mapping[str, Role | None] | None = vars(cls).get(_KNOWN)
    if known is not None:
        return known
    stated: dict[str, Role] = {}
    for base in reversed(cls.__mro__):
        stated |= vars(base).get(_OWN, {})
    hints = typing.get_type_hints(cls)
    return {
        field.name: stated.get(
            field.name, Role.data if all(map(_harmless, parts_of(hints[field.name]))) else None
        )
        for field in dataclasses.fields(typing.cast(Any, cls))
    }


def carried(cls: type) -> dict[str, Any]:
    """Return what the namespace of a class derived from another holds to keep its roles."""
    return {_KNOWN: roles_of(cls)}


def parts_of(hint: Any) -> Iterator[Any]:
    """Yield the types in a type, at any depth: of ``list[str] | None`` text and None."""
    arguments = typing.get_args(hint)
    if not arguments:
        yield hint
    for argument in arguments:
        yield from parts_of(argument)


def _harmless(part: Any) -> bool:
    if part in (int, float, types.NoneType, Ellipsis):
        return True
    return isinstance(part, type) and (
        issubclass(part, enum.Enum) or dataclasses.is_dataclass(part)
    )
