"""Typed settings of rendering besides the water optics."""

from __future__ import annotations

from dataclasses import dataclass

from seals.rendering.scene import TILE, Detail
from seals.schema import setting


@dataclass(kw_only=True)
class SightSettings:
    """Settings of the scene for cameras.

    Args:
        detail: ``visual`` draws links as their URDF does, ``simple`` by the primitives that
            displace water or touch.
        tile: edge of the squares on level ground [m], 0 for one colour.
        ripples: wind whose short waves lie on the water for the eye alone, so that light dances
            in a calm pool as well; 0 for none [m/s].
    """

    detail: Detail = Detail.visual
    tile: float = setting(TILE, "m", bounds=(0.0, 1e3), source="chosen")
    ripples: float = setting(0.0, "m/s", bounds=(0.0, 15.0), source="chosen: none")
