"""Typed settings of ``seals teleop``."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import ClassVar

from seals.field_roles import roles
from seals.run.settings import RunSettings
from seals.schema import setting


class DeviceKind(Enum):
    """Kind of input device."""

    keyboard = "keyboard"
    joystick = "joystick"


class Export(Enum):
    """Formats of a demonstration beside the log."""

    safetensors = "safetensors"


@roles(read="script")
@dataclass(kw_only=True)
class TeleopSettings(RunSettings):
    """Settings of a run controlled by a person or a script of keys.

    Args:
        device: input device.
        script: file of key events instead of keyboard input; the run is then as fast as it can be.
        speed: simulated seconds per second of real time, for a person.
        export: formats of the demonstration beside the log.
    """

    device: DeviceKind = DeviceKind.keyboard
    script: str | None = None
    speed: float = setting(1.0, "1", bounds=(0.01, 100.0), source="chosen")
    export: list[Export] = field(default_factory=list)

    several: ClassVar[bool] = False
