"""Look-up of the plug-in name of an object or a class path."""

from __future__ import annotations

import contextlib
import re

from seals import registry
from seals.errors import SealsError, UnknownPlugin, suggestion


def plugin_name(kind: str, cls: type) -> str:
    """Return the name under which a plug-in class is installed, or its class name when it is not.

    Example:
        >>> from seals.environment.settings import EnvironmentSettings
        >>> plugin_name("effect", EnvironmentSettings)
        'EnvironmentSettings'
    """
    found = _find(kind, f"{cls.__module__}.{cls.__qualname__}")
    return cls.__name__ if found is None else found.name


def plugin_at(kind: str, path: str, *, where: str) -> registry.Plugin:
    """Return the installed plug-in whose class has the dotted ``path``.

    Args:
        kind: of plug-in.
        path: module and class, as written in ``_target_``.
        where: full key, named in the message.

    Raises:
        UnknownPlugin: no installed plug-in of this kind is that class.
    """
    found = _find(kind, path)
    if found is None:
        names = registry.names(kind)
        raise UnknownPlugin(
            f"{where} is '{path}', which is not an installed {kind}.\n"
            f"{suggestion(path.rpartition('.')[2], names, label='Installed')}"
        )
    return found


def is_plugin(path: str) -> bool:
    """Return whether a dotted path is the class of an installed plug-in of any kind.

    Example:
        >>> is_plugin("os.system")
        False
    """
    kinds = (kind for kind in registry.GROUPS if kind not in registry.FOLDER_KINDS)
    return any(_find(kind, path) is not None for kind in kinds)


def _find(kind: str, path: str) -> registry.Plugin | None:
    """Compare the declared paths first; only then import, for classes that a package re-exports."""
    installed = list(registry.plugins(kind).values())
    for plugin in installed:
        if plugin.value.replace(":", ".") == path:
            return plugin
    top = path.partition(".")[0]
    for plugin in (p for p in installed if re.split("[.:]", p.value)[0] == top):
        # a broken neighbour is not the one that is looked for
        with contextlib.suppress(SealsError):
            cls = plugin.load()
            if f"{cls.__module__}.{cls.__qualname__}" == path:
                return plugin
    return None
