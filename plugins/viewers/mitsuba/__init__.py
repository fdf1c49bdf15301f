"""Photorealistic frames by Mitsuba 3, with refraction, reflection, absorption and scattering."""

from seals.plugins.viewers.mitsuba.renderer import RendererMitsuba

__all__ = ["RendererMitsuba"]
