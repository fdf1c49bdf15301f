"""Typed schemas of the root configurations, one for each verb, imported when its verb is used."""

from __future__ import annotations

import importlib
from typing import Any

_AT = {
    "add": "add:AddSettings",
    "arms": "arms:ArmsSettings",
    "compare": "compare:CompareSettings",
    "convert": "convert:ConvertSettings",
    "diagnose": "diagnose:DiagnoseSettings",
    "evaluate": "evaluate:EvaluateSettings",
    "learn": "learning:LearnSettings",
    "plan": "plan:PlanSettings",
    "record": "evaluate:RecordSettings",
    "render": "render:RenderSettings",
    "run": "run:RunSettings",
    "runs": "runs:RunsSettings",
    "teleop": "teleop:TeleopSettings",
    "train": "train:TrainSettings",
    "verify": "verify:VerifySettings",
    "view": "view:ViewSettings",
}
"""Module in this package and class, by the name of the root configuration."""

NAMES = tuple(f"{root}_schema" for root in _AT)
"""As the defaults lists of the root configurations name them."""

VERBS = tuple(root for root in _AT if root not in {"arms", "learn"})
"""Roots that verbs compose, of the same name; the others are composed by programs."""


def root_schema(name: str) -> Any:
    """Return the class whose fields a root configuration has.

    Args:
        name: one of `NAMES`.

    Example:
        >>> root_schema("runs_schema").__name__
        'RunsSettings'
    """
    module, _, found = _AT[name.removesuffix("_schema")].partition(":")
    return getattr(importlib.import_module(f"seals.config.{module}"), found)
