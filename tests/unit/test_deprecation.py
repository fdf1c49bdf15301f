"""Former names of public classes and attributes still work and warn."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any, ClassVar

import numpy as np
import pytest

from seals.arrays import Array
from seals.control.protocols import ControllerOptions
from seals.effects.binding import has_hook
from seals.effects.effect import Effect, Parameters
from seals.motion import Body, Medium
from seals.plugin_options import options_of
from seals.sensors.protocol import SensorInput

RENAMED = [
    ("seals.control", "Aim", "Reference"),
    ("seals.control", "Order", "ActuatorCommand"),
    ("seals.control", "Situation", "RobotState"),
    ("seals.control.protocols", "Aim", "Reference"),
    ("seals.control.protocols", "Situation", "RobotState"),
    ("seals.sensors.protocol", "Felt", "SensorInput"),
    ("seals.sensors.instrument", "Seen", "TrueValues"),
]


@pytest.mark.parametrize(("module", "old", "new"), RENAMED)
def test_a_former_class_name_is_the_present_class(module: str, old: str, new: str) -> None:
    """A plug-in that imports a former name gets the class, and the warning says the new name."""
    home = import_module(module)
    with pytest.warns(DeprecationWarning, match=rf"{old} is now {module}\.{new}"):
        assert getattr(home, old) is getattr(home, new)


def test_an_unknown_name_of_such_a_module_is_refused() -> None:
    """Names that never were are an AttributeError as usual."""
    with pytest.raises(AttributeError, match=r"seals\.control"):
        import_module("seals.control").Amis  # noqa: B018  the access is the test


def test_a_former_hook_of_an_effect_is_taken_over() -> None:
    """An effect that defines `nominal` and `dries` has the present hook and attribute."""
    with pytest.warns(DeprecationWarning, match="Heavier") as caught:

        class Heavier(Effect):
            dries: ClassVar[bool] = True
            twins: ClassVar[tuple[str, ...]] = ("buoyancy",)

            @staticmethod
            def nominal(body: Body, params: Parameters) -> Array:
                return body.mass

    assert {str(w.message) for w in caught} == {
        "Heavier.dries is now zero_when_dry; use the new name.",
        "Heavier.twins is now identification.confounders; use the new name.",
        "Heavier.nominal is now inertia_change; use the new name.",
    }
    effect: Any = Heavier()
    assert effect.zero_when_dry
    assert effect.identification.confounders == ("buoyancy",)
    assert effect.inertia_change is effect.nominal
    assert has_hook(effect, "inertia_change")


def test_a_parameter_of_a_former_name_is_left_alone() -> None:
    """A number called `supply` is a parameter, not the hook of a battery."""

    @dataclass(kw_only=True)
    class Supplied(Effect):
        supply: float = 1.0

    assert not has_hook(Supplied(), "battery_update")


@pytest.mark.parametrize("base", [ControllerOptions, object])
def test_a_former_option_of_a_controller_is_taken_over(base: type) -> None:
    """A controller that says `weighs`, with and without the base class, is understood."""
    gait = type("Gait", (base,), {"weighs": False})()
    with pytest.warns(DeprecationWarning, match=r"Gait\.weighs is now needs_mass_properties"):
        options = options_of(gait, ControllerOptions)
    assert options.needs_mass_properties is False


def test_former_fields_of_what_sensors_get_can_be_read() -> None:
    """A sensor that reads `askew` and `supply` gets the present fields."""
    still, turn = np.zeros(3), np.eye(3)
    given = SensorInput(0.0, 0.1, still, turn, still, still, still, still, axis_misalignment=turn)
    with pytest.warns(DeprecationWarning, match="axis_misalignment"):
        assert given.askew is turn
    with pytest.warns(DeprecationWarning, match="battery_state"):
        assert given.board.supply() == (0.0, 0.0, 0.0)


def test_a_law_that_reads_the_former_share_gets_the_fraction_of_its_medium() -> None:
    """`medium.share` is `medium.medium_fraction`."""
    one = np.ones((1, 1))
    medium = Medium(0.3 * one, *([one] * 10))
    with pytest.warns(DeprecationWarning, match="medium_fraction"):
        assert medium.share == 0.3
