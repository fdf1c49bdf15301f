"""Batched ray caster in PyTorch: colour, depth, parts and normals of many cameras."""

from seals.plugins.viewers.raycast.renderer import RendererRaycast as RendererRaycast
