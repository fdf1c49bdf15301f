"""Underwater image formation: one scene in three waters at four depths, and the surface."""

from __future__ import annotations

from collections.abc import Sequence

from seals.experiments.command import folder_of, parser_of, show_table
from seals.experiments.underwater_light.sheet import draw
from seals.experiments.underwater_light.table import table


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
