"""PyBullet's two renderers: TinyRenderer on the CPU, EGL on a graphics card."""

from seals.plugins.viewers.bullet.renderer import RendererEgl as RendererEgl
from seals.plugins.viewers.bullet.renderer import RendererTiny as RendererTiny
