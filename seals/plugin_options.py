"""Defaults of optional attributes and methods of plug-ins."""

from __future__ import annotations

from typing import Any, TypeVar, cast

Options = TypeVar("Options")


def options_of(plugin: object, options: type[Options]) -> Options:
    """Return a plug-in completed with the default options of its kind.

    A plug-in that derives from the class of options comes back as it is. Any other is given the
    defaults of what it lacks, once; what it has stays.

    Args:
        plugin: object of a plug-in class.
        options: class whose public attributes, properties and methods are the defaults.

    Raises:
        AttributeError: the plug-in lacks an option and its class has ``__slots__``.

    Example:
        >>> class Options:
        ...     idles: bool = False
        >>> class Stranger: ...
        >>> options_of(Stranger(), Options).idles
        False
    """
    if not isinstance(plugin, options):
        for name, default in vars(options).items():
            if not name.startswith("_") and not hasattr(plugin, name):
                own: Any = default
                if hasattr(default, "__get__"):
                    own = default.__get__(plugin, type(plugin))
                object.__setattr__(plugin, name, own)
    return cast("Options", plugin)
