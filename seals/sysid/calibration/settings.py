"""Typed settings of ``seals calibrate``."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from seals.field_roles import roles
from seals.schema import param
from seals.sysid.report.settings import GivenLogsSettings


@roles(data="name parameters plan report", read="held_out", write="out", permission="apply")
@dataclass(kw_only=True)
class CalibrateSettings(GivenLogsSettings):
    """Settings of a calibration: logs of one vehicle, numbers to estimate, output folder.

    Args:
        name: of the calibration, part of the run folder's name.
        parameters: names of the numbers as in ``robot.yaml``, groups of them, or patterns:
            ``mass``, ``inertia``, ``effects.water_drag``, ``actuators.*``.
        held_out: another log of the vehicle, used only for the error and not fitted.
        out: folder of the results, or None for the run's folder.
        prior: standard deviation of the parameters, relative to their stated values [1].
        apply: whether to write a copy of the robot folder with the new numbers.
        plan: whether to search for a manoeuvre that determines the other parameters.
        report: whether to write the report and the plot, beside ``calibration.json``.
    """

    name: str = "calibrate"
    parameters: list[str] = field(default_factory=list)
    held_out: Any = None
    out: str | None = None
    prior: float = param(
        0.5, "1", bounds=(0.01, 10.0), tolerance=0.0, source="chosen: wrong by half", fit=False
    )
    apply: bool = False
    plan: bool = True
    report: bool = True
