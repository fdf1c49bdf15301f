"""One run: from settings to a world, its log and its folder.

The names of this package are imported when they are first used: settings of a run are read by
commands that build no world.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from seals.run.assembly import build_twin, build_world, initial_configuration

__all__ = ["build_twin", "build_world", "initial_configuration"]


def __getattr__(name: str) -> Any:
    """Import a public name of this package.

    Raises:
        AttributeError: there is no such name.
    """
    if name not in __all__:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    from seals.run import assembly

    return getattr(assembly, name)
