"""Former names of public classes and attributes still work and warn."""

from __future__ import annotations

from importlib import import_module

import pytest

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
