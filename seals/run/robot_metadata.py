"""Metadata of a robot folder as a log states them, without running anything."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from seals.control.plant import layout_of
from seals.run.assembly import build_model
from seals.run.build import build_run
from seals.run.metadata import describe_vehicle
from seals.untrusted_io import read_yaml

DATASHEET = "datasheet.yaml"
"""File of a robot folder with what its logs have in common: motors, sensors, tolerances."""


def vehicle_of(robot: str) -> dict[str, Any]:
    """Return mass properties and drives of a robot by its name or folder, as in ``meta.yaml``.

    Raises:
        SealsError: there is no such robot, or it cannot be used.
    """
    from seals.config.compose import compose

    settings = build_run(compose([f"robot={robot}"]))
    model, effects = build_model(settings)
    return describe_vehicle(settings, model, layout_of(model, effects))


def datasheet_of(robot: str) -> dict[str, Any]:
    """Return the data sheet in a robot's folder; empty where there is none.

    Raises:
        UntrustedFileError: the file is damaged.
    """
    place = Path(robot) / DATASHEET
    return read_yaml(place) if place.is_file() else {}
