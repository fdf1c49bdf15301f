"""Plug-ins that derive from no base get the defaults of what they may have; others keep theirs."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import pytest

from seals.backend import BodyOptions
from seals.control.protocols import NO_LEGS, ControllerOptions
from seals.effects.effect import ActuatorOptions, EffectOptions, MediumKind
from seals.errors import ConfigError
from seals.plugin_options import options_of
from seals.sensors.mount import MountedSensor
from seals.sensors.options import SensorOptions


class Stranger:
    """A plug-in of no base, with one option of its own."""

    def __init__(self) -> None:
        self.idles = True
        self.voltage_power = 2.0


class Closed:
    """A plug-in that takes no attributes."""

    __slots__ = ()


def test_a_stranger_gets_the_defaults_and_keeps_its_own() -> None:
    """What it lacks is filled in; the object stays the same."""
    stranger = Stranger()
    sensor = options_of(stranger, SensorOptions)
    assert sensor is stranger  # type: ignore[comparison-overlap]
    assert (sensor.idles, sensor.sees, sensor.inertial, sensor.latency) == (True, False, True, 0.0)
    assert sensor.bind(None) is None  # type: ignore[func-returns-value]
    drive = options_of(stranger, ActuatorOptions)
    assert (drive.voltage_power, drive.fall, drive.low) == (2.0, None, None)
    effect = options_of(stranger, EffectOptions)
    assert (effect.medium, tuple(effect.sensors), effect.order) == (None, (), 0)
    body = options_of(stranger, BodyOptions)
    assert not body.implicit
    assert body.middle_speed() is None
    assert body.joint_forces() is None


def test_a_stranger_among_controllers_has_no_form_over_a_batch() -> None:
    """The refusal names its class; its legs have no phase."""
    controller = options_of(Stranger(), ControllerOptions)
    assert controller.needs_mass_properties
    assert controller.leg_phase(None) is NO_LEGS
    plant: Any = None
    with pytest.raises(ConfigError, match="controller Stranger has no batched form"):
        controller.batched(plant, np.zeros(0), np.zeros(1))


def test_a_plugin_of_the_base_comes_back_untouched() -> None:
    """Fields and class attributes of a subclass stand; nothing is written to it."""

    class Depth(MountedSensor):
        sees: ClassVar[bool] = True

    depth = Depth(latency=0.2)
    before = dict(vars(depth))
    found = options_of(depth, SensorOptions)
    assert vars(depth) == before
    assert (found.sees, found.inertial, found.latency) == (True, False, 0.2)


def test_media_are_those_of_the_class() -> None:
    """An effect with a field `medium` shows it through the options."""
    from seals.plugins.effects.linear_drag import DragLinear

    assert options_of(DragLinear(medium=MediumKind.water), EffectOptions).medium is MediumKind.water


def test_a_closed_plugin_is_not_passed_by() -> None:
    """A class with slots that lacks an option fails at once."""
    with pytest.raises(AttributeError):
        options_of(Closed(), SensorOptions)
