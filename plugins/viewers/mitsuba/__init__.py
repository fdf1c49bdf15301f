"""Photorealistic frames by Mitsuba 3, with refraction, reflection, absorption and scattering."""

from seals.plugins.viewers.mitsuba.renderer import RendererMitsuba as RendererMitsuba
