"""What may be composed: typed schemas of the commands, and the YAML groups of installed packages.

Groups are folders of YAML such as ``experiment`` and ``water``.
"""

from __future__ import annotations

import contextlib
import importlib
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from seals import registry
from seals.errors import BrokenPlugin

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

OPEN = frozenset({"objects", "robots"})
"""Sections of a run to which the command line adds entries without a ``+``: they have no type
before they are built."""
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


def conf_folders() -> Iterator[tuple[registry.Plugin, Path]]:
    """Yield the conf packages with their folders, but for those that cannot be imported.

    ``seals doctor`` names them: a list must not fail for one package.
    """
    for plugin in registry.plugins("conf").values():
        with contextlib.suppress(BrokenPlugin):
            yield plugin, plugin.folder()


def recipe_groups() -> dict[str, list[Path]]:
    """Return the YAML files of every configuration group by group, without composing them."""
    found: dict[str, list[Path]] = {}
    for _, folder in conf_folders():
        for path in sorted(folder.glob("*/*.yaml")):
            found.setdefault(path.parent.name, []).append(path)
    return found


def roots_choosing(group: str) -> list[str]:
    """Return the verbs whose root configurations choose an option of a group.

    Example:
        >>> roots_choosing("learner")
        ['train']
    """
    found = []
    for _, folder in conf_folders():
        for path in sorted(folder.glob("*.yaml")):
            chosen = re.findall(r"^  - (\w+):", path.read_text(encoding="utf-8"), re.MULTILINE)
            if group in chosen and path.stem in VERBS:
                found.append(path.stem)
    return found


def experiments() -> dict[str, str]:
    """Return the installed experiments and the verb each is for.

    An experiment that chooses a reader compares with a measurement; any other one runs.
    """
    return {
        path.stem: "compare" if "/reader" in path.read_text(encoding="utf-8") else "run"
        for path in recipe_groups().get("experiment", [])
    }
