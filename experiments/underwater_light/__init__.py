"""Light under water: one scene in three waters at four depths, and the surface from all sides."""

from __future__ import annotations

import argparse
import datetime
from collections.abc import Sequence
from pathlib import Path

from seals.experiments.underwater_light.sheet import draw
from seals.experiments.underwater_light.table import table


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the contact sheet and the table of waters."""
    parser = argparse.ArgumentParser(prog="python -m seals.experiments.underwater_light")
    parser.add_argument("--out", type=Path, help="folder; runs/DATE/TIME_NAME when left out")
    parser.add_argument("--format", choices=("png", "webp"), default="png")
    given = parser.parse_args(arguments)
    stamp = datetime.datetime.now().astimezone()
    out = given.out or Path("runs") / f"{stamp:%Y-%m-%d}" / f"{stamp:%H-%M-%S}_underwater_light"
    out.mkdir(parents=True, exist_ok=True)
    draw(out / f"figure.{given.format}")
    (out / "table.md").write_text(table(), encoding="utf-8")
    print((out / "table.md").read_text(encoding="utf-8"))
    return 0
