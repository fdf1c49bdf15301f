"""Classes of the installed plug-ins that can be used."""

from __future__ import annotations

import warnings
from typing import Any

from seals import registry
from seals.errors import BrokenPlugin, MissingExtra


def loaded(kind: str) -> dict[str, Any]:
    """Return the classes of all installed plug-ins of a kind by name.

    A broken one is left out with a warning; one that lacks an optional dependency cannot act in any
    model and is left out.
    """
    found = {}
    for name, plugin in registry.plugins(kind).items():
        try:
            found[name] = plugin.load()
        except MissingExtra:
            continue
        except BrokenPlugin as broken:
            warnings.warn(f"'{name}' is not a candidate: {broken}", stacklevel=3)
    return found
