"""Table of the optical coefficients of each water, and the range of each colour."""

from __future__ import annotations

import math

from seals.experiments.command import markdown
from seals.rendering.optics import WATERS, Optics

HEAD = (
    "water type",
    *(f"{what} {colour} [1/m]" for what in ("β_D", "β_B", "K_d") for colour in ("R", "G", "B")),
    "a tenth is left after R, G, B [m]",
)


def table() -> str:
    """Return the coefficients of all waters and the lengths over which nine tenths are lost."""
    rows = []
    for name in WATERS:
        medium = Optics(water_type=name).medium
        assert medium is not None  # every water in the table has one
        values = (*medium.direct, *medium.veiling, *medium.diffuse)
        reach = ", ".join(f"{math.log(10.0) / beta:.1f}" for beta in medium.direct)
        rows.append([name, *(f"{value:.3g}" for value in values), reach])
    return markdown(HEAD, rows)
