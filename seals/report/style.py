"""Colours of charts for light and dark backgrounds, distinct under colour blindness."""

from __future__ import annotations

# after Okabe and Ito 2008, moved to middle lightness so that one set serves both backgrounds
AXES = {"x": "#d8602a", "y": "#12966f", "z": "#2f80d0"}
"""Colours of the three axes, the same in every chart."""
CYCLE = (
    *("#2f80d0", "#d8602a", "#12966f", "#a765c2", "#c08a00", "#2fa3c4", "#cf5f8f", "#7a8791"),
    *("#8f5b3a", "#5a63c8", "#7d9a2b", "#b3394a"),
)
"""Colours of named things, in order."""
MUTED = "#7f8a94"
"""Colour of reference lines and totals."""


def colour_of(name: str, position: int) -> str:
    """Return the colour of a series: that of its axis when it is one, else the next of the cycle.

    Example:
        >>> colour_of("z", 0) == AXES["z"], colour_of("drag", 1) == CYCLE[1]
        (True, True)
    """
    return AXES.get(name, CYCLE[position % len(CYCLE)])


def colours_of(names: list[str]) -> dict[str, str]:
    """Return one colour for each name, common to all charts of a page.

    Example:
        >>> colours_of(["gravity", "drag"])["drag"] == CYCLE[1]
        True
    """
    return {name: colour_of(name, position) for position, name in enumerate(names)}


def unit_text(unit: str) -> str:
    """Return a unit in typographic form.

    Example:
        >>> unit_text("N s^2/m^2"), unit_text("1")
        ('N s²/m²', '')
    """
    return "" if unit == "1" else unit.replace("^2", "²").replace("^3", "³")
