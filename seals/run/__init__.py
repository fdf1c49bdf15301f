"""One run: from settings to a world, its log and its folder."""

from seals.run.assembly import build_twin, build_world, initial_configuration

__all__ = ["build_twin", "build_world", "initial_configuration"]
