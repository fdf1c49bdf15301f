"""A batched ray caster in plain torch: colour, depth, parts and normals of many cameras at once."""

from seals.plugins.viewers.raycast.renderer import RendererRaycast

__all__ = ["RendererRaycast"]
