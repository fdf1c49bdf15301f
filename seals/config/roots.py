"""Typed schemas of the root configurations, one per command."""

from __future__ import annotations

import importlib
from typing import Any

_AT = {
    "add": "seals.sysid.validation.settings:AddSettings",
    "arms": "seals.learn.comparison.settings:ArmsSettings",
    "autopilot": "seals.teleop.autopilot.settings:AutopilotSettings",
    "calibrate": "seals.sysid.calibration.settings:CalibrateSettings",
    "compare": "seals.compare.settings:CompareSettings",
    "convert": "seals.cli.convert_settings:ConvertSettings",
    "diagnose": "seals.sysid.report.settings:DiagnoseSettings",
    "evaluate": "seals.learn.evaluation.settings:EvaluateSettings",
    "export": "seals.learn.export:ExportSettings",
    "learn": "seals.learn.settings:LearnSettings",
    "plan": "seals.sysid.experiment_design.settings:PlanSettings",
    "record": "seals.learn.demonstrations.settings:RecordSettings",
    "render": "seals.view.films.settings:RenderSettings",
    "run": "seals.run.settings:RunSettings",
    "runs": "seals.sweep.settings:RunsSettings",
    "teleop": "seals.teleop.settings:TeleopSettings",
    "train": "seals.learn.training.settings:TrainSettings",
    "verify": "seals.sysid.validation.settings:VerifySettings",
    "view": "seals.view.settings:ViewSettings",
}
"""Module and class by the name of the root configuration: each beside the code of its verb."""

NAMES = tuple(f"{root}_schema" for root in _AT)
"""As the defaults lists of the root configurations name them."""

VERBS = tuple(root for root in _AT if root not in {"arms", "learn"})
"""Roots that verbs compose, of the same name; the others are composed by programs."""


def root_schema(name: str) -> Any:
    """Return the class whose fields a root configuration has.

    Example:
        >>> root_schema("runs_schema").__name__
        'RunsSettings'
    """
    module, _, found = _AT[name.removesuffix("_schema")].partition(":")
    return getattr(importlib.import_module(module), found)
