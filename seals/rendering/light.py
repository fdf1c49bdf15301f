"""Lighting common to all renderers: sun and sky.

Renderers shade in displayed values (sRGB) and hand out linear ones, so that two of them differ in
what they see and not in how they light it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from seals.rendering.optics import to_linear

SKY = (0.62, 0.74, 0.86)
"""Displayed colour of what nothing covers."""
CONTRAST = 0.12
"""How much darker every second tile of a plane is [1]."""


@dataclass(frozen=True, kw_only=True)
class Light:
    """Directional sunlight and ambient light.

    Equation:
        displayed = colour (ambient + (1 - ambient) max(n . l, 0)), with the normal n and the
        direction l to the sun (Lambert); no shadows.

    Args:
        azimuth: direction to the sun, 0 is east, anticlockwise from above [rad].
        height: of the sun above the horizon [rad].
        ambient: share of the light that comes from everywhere [1].
        sky: displayed colour of what nothing covers, 0 to 1.
    """

    azimuth: float = 0.9
    height: float = 1.05
    ambient: float = 0.5
    sky: tuple[float, float, float] = SKY

    @property
    def direction(self) -> tuple[float, float, float]:
        """Unit vector to the sun, world axes."""
        level = math.cos(self.height)
        east, north = level * math.cos(self.azimuth), level * math.sin(self.azimuth)
        return east, north, math.sin(self.height)

    @property
    def diffuse(self) -> float:
        """Fraction of the light that comes from the sun [1]."""
        return 1.0 - self.ambient

    def shade(self, normal: tuple[float, float, float]) -> float:
        """Return the shading factor of a face [1].

        Example:
            >>> light = Light(height=math.pi / 2)
            >>> round(light.shade((0.0, 0.0, 1.0)), 9), light.shade((0.0, 0.0, -1.0))
            (1.0, 0.5)
        """
        facing = sum(n * s for n, s in zip(normal, self.direction, strict=True))
        return self.ambient + self.diffuse * max(facing, 0.0)


TABLE: NDArray[np.float32] = to_linear(np.arange(256, dtype=np.float32) / np.float32(255.0))
"""Linear values of the 256 levels of a displayed picture."""
TABLE.setflags(write=False)
