"""PyBullet's two renderers: TinyRenderer on the CPU, EGL on a graphics card."""

from seals.plugins.viewers.bullet.egl import RendererEgl
from seals.plugins.viewers.bullet.tiny import RendererTiny

__all__ = ["RendererEgl", "RendererTiny"]
