"""Effects that a log may be unable to tell apart know each other."""

from __future__ import annotations

import pytest

from seals import registry

PAIRS = [
    ("payload", "thrust_coefficient"),
    ("battery_sag", "thrust_coefficient"),
    ("linear_drag", "rotor_drag"),
    ("linear_drag", "quadratic_drag"),
    ("wind", "payload"),
    ("wind", "thrust_coefficient"),
    ("wind", "tether"),
    ("wind", "accelerometer_bias"),
    ("tether", "accelerometer_bias"),
    ("centre_of_gravity", "weak_rotor"),
    ("centre_of_gravity", "centre_of_buoyancy"),
    ("buoyancy", "payload"),
    ("command_delay", "rotor_lag"),
    ("ground_effect", "thrust_coefficient"),
    ("accelerometer_bias", "accelerometer_scale"),
    ("added_mass", "accelerometer_scale"),
    ("added_mass", "buoyancy"),
    ("accelerometer_scale", "buoyancy"),
]


def twins_of(name: str) -> tuple[str, ...]:
    """Return the twins that an effect declares."""
    found: tuple[str, ...] = registry.get("effect", name).load().twins
    return found


@pytest.mark.parametrize(("first", "second"), PAIRS)
def test_a_pair_of_twins_is_declared(first: str, second: str) -> None:
    """At least one of the two names the other."""
    assert second in twins_of(first) or first in twins_of(second)


@pytest.mark.parametrize("name", registry.names("effect"))
def test_twins_are_installed(name: str) -> None:
    """A twin is the name of another installed effect."""
    assert set(twins_of(name)) <= set(registry.names("effect")) - {name}
