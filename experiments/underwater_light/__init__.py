"""Underwater image formation: one scene in three waters at four depths, and the surface."""

from __future__ import annotations

import math
from collections.abc import Sequence

from seals.experiments.command import folder_of, markdown, parser_of, show_table
from seals.experiments.underwater_light.sheet import draw
from seals.rendering.optics import WATERS, Optics


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the contact sheet and the table of waters."""
    parser = parser_of("underwater_light", "")
    parser.add_argument("--format", choices=("png", "webp"), default="png")
    given = parser.parse_args(arguments)
    out = folder_of(given, "underwater_light")
    out.mkdir(parents=True, exist_ok=True)
    draw(out / f"figure.{given.format}")
    show_table(out, table())
    return 0


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
