"""Accuracy of a detector on labelled pictures, by water type and distance."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from seals.errors import ConfigError
from seals.experiments.visual_catch.pictures import ABSENT, PRESENT, Pictures, metres
from seals.learn.comparison.page import text_table
from seals.logs.atomic import write_table
from seals.plugins.tasks.sighting.detector import (
    DetectorNetwork,
    inputs_of,
    load_detector,
    peaks_of,
)
from seals.rendering.optics.waters import WATERS

FAR = (0.6, 1.2)
"""Limits of near, middle and far [m]."""


def accuracy(pictures: Pictures, detector: str) -> list[dict[str, Any]]:
    """Return the figures of all pictures, of each water type and each range of distances.

    Raises:
        ConfigError: the detector reads no pictures.
    """
    found = load_detector(detector, animal="crab", stance=0.0)
    if not isinstance(found, DetectorNetwork):
        raise ConfigError(f"--detector={detector} reads no pictures.\nGive a trained one's folder.")
    peaks = _peaks(pictures, found)
    depth = pictures.place[:, 2]
    cases = {"all": np.ones(len(depth), dtype=bool)}
    cases |= {name: pictures.water == k for k, name in enumerate(WATERS)}
    cases |= {
        f"nearer than {FAR[0]} m": depth < FAR[0],
        f"{FAR[0]} to {FAR[1]} m": (depth >= FAR[0]) & (depth < FAR[1]),
        f"beyond {FAR[1]} m": depth >= FAR[1],
    }
    rows = [_row(name, pictures, peaks, case, found.threshold) for name, case in cases.items()]
    return [row for row in rows if row["present"] or row["absent"]]


def _peaks(pictures: Pictures, found: DetectorNetwork) -> Any:
    import torch

    rows = []
    with torch.no_grad():
        for first in range(0, len(pictures.label), 256):
            cut = slice(first, first + 256)
            depth = metres(torch.as_tensor(pictures.depth[cut].astype(np.int32)))
            seen = inputs_of(torch.as_tensor(pictures.colour[cut]), depth)
            rows.append(peaks_of(found.network(seen), seen).numpy())
    return np.concatenate(rows)


def _row(name: str, pictures: Pictures, peaks: Any, case: Any, threshold: float) -> dict[str, Any]:
    there, none = (case & (pictures.label == kind) for kind in (PRESENT, ABSENT))
    sure = peaks[:, 0] > threshold
    hit = there & sure
    off = peaks[hit, 1:] - pictures.place[hit]
    across = np.linalg.norm(off[:, :2], axis=1) * pictures.place[hit, 2] / pictures.focus[hit]
    away = 1e3 * np.hypot(across, off[:, 2])
    half, most = np.quantile(away, [0.5, 0.95]) if len(away) else (np.nan, np.nan)
    return {
        "case": name,
        "present": int(there.sum()),
        "found": int(hit.sum()),
        "absent": int(none.sum()),
        "false": int((none & sure).sum()),
        "median_mm": float(half),
        "most_mm": float(most),
    }


def report(rows: list[dict[str, Any]], out: Path) -> None:
    """Print the figures and write them as a table.

    Args:
        rows: of `accuracy`.
        out: folder for ``accuracy.parquet``.
    """
    out.mkdir(parents=True, exist_ok=True)
    columns: Mapping[str, Any] = {name: [row[name] for row in rows] for name in rows[0]}
    write_table(out / "accuracy.parquet", columns)
    cells = [
        [
            row["case"],
            f"{row['found']} of {row['present']}",
            f"{row['false']} of {row['absent']}",
            f"{row['median_mm']:.1f}",
            f"{row['most_mm']:.1f}",
        ]
        for row in rows
    ]
    print(text_table(["", "found", "false", "median [mm]", "95 % below [mm]"], cells))
