"""Photoreal frames by Mitsuba 3: water that bends, mirrors, absorbs and scatters light."""

from seals.plugins.viewers.mitsuba.renderer import RendererMitsuba

__all__ = ["RendererMitsuba"]
