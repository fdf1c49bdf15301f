"""Picture of a calibration: measurement, model and residual of the worst-fitted channel."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from seals.report import Chart, Choice, write_picture
from seals.sysid.calibration.calibration import Calibration
from seals.sysid.calibration.report import overlays

PICTURE = "calibration.png"


def draw(found: Calibration, folder: Path) -> Path:
    """Draw measurement and model before and after, the residuals below; return the path.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    choice = next(block for block in overlays(found) if isinstance(block, Choice))
    worst = next(iter(choice.options.values()))
    charts = [replace(chart, note="") for chart in worst if isinstance(chart, Chart)]
    return write_picture(folder / PICTURE, charts)
