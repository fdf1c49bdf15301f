"""Effects that a log may be unable to tell apart know each other."""

from __future__ import annotations

import pytest

from seals import registry
from seals.effects.identification import Identification
from seals.sysid.candidates.parameters import Candidate

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


def confounders_of(name: str) -> tuple[str, ...]:
    """Return the confounders that an effect declares."""
    return registry.get("effect", name).load().identification.confounders


@pytest.mark.parametrize(("first", "second"), PAIRS)
def test_a_pair_of_confounders_is_declared(first: str, second: str) -> None:
    """At least one of the two names the other."""
    assert second in confounders_of(first) or first in confounders_of(second)


@pytest.mark.parametrize("name", registry.names("effect"))
def test_confounders_are_installed(name: str) -> None:
    """A confounder is the name of another installed effect."""
    assert set(confounders_of(name)) <= set(registry.names("effect")) - {name}


MIDWAY = {
    "wind": (True, True),
    "payload": (True, True),
    "weak_rotor": (True, True),
    "centre_of_gravity": (True, True),
    "buoyancy": (True, True),
    "thrust_coefficient": (True, True),
    "accelerometer_bias": (True, False),
    "quadratic_drag": (True, True),
    "joint_friction": (True, True),
    "added_mass": (False, False),
}
"""Whether an effect may begin and end midway through a log."""


@pytest.mark.parametrize("name", MIDWAY)
def test_an_effect_declares_its_onset(name: str) -> None:
    """Flows, loads and faults may begin midway; the water that a hull moves may not.

    A blade that was fouled comes clear, ballast that slid slides back, weed on a hull is lost.
    """
    known = registry.get("effect", name).load().identification
    assert (known.may_begin, known.may_end) == MIDWAY[name]


def test_either_of_two_confounders_names_the_other() -> None:
    """Candidates resemble each other whichever of the two declares it."""
    first = Candidate(
        name="one", keys=(), reported=(), identification=Identification(confounders=("two",))
    )
    second, third = (Candidate(name=n, keys=(), reported=()) for n in ("two", "three"))
    assert first.resembles(second)
    assert second.resembles(first)
    assert not first.resembles(third)
