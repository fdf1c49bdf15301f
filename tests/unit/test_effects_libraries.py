"""Hooks of actuators, sensors, timing and rigid inertia agree under every array library."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
import pytest

from seals import registry
from seals.arrays import Array
from seals.effects import Effect, bind_effects
from seals.motion import Drives, Inputs, Reading
from seals.schema import parameters_of
from seals.testing.effect import material_effect
from seals.testing.hooks import EQUAL, other_libraries
from seals.testing.instants import Instant, converted, copied, leaves, picked, random_instant

ROWS = 60
"""More rows than the threshold below which rotations take another way."""


class Given(NamedTuple):
    """Everything the hooks are given."""

    instant: Instant
    thrust: Array
    torque: Array
    reading: Reading


Law = Callable[[Any, Given, Mapping[str, Array]], Any]


def drives(x: Given) -> Drives:
    """Return two drives, whose places are the same for all rows."""
    place = x.thrust[:1, :1] * 0.0
    places, axes, radii = converted(
        (
            np.array([[0.1, 0.2, 0.05], [-0.1, 0.2, 0.05]]),
            np.array([[0.0, 0.0, 1.0], [0.0, 0.6, 0.8]]),
            np.array([0.12, 0.0]),
        ),
        place,
    )
    return Drives(places, axes, radii, x.thrust, x.torque)


LAWS: dict[str, Law] = {
    "loads": lambda law, x, p: law(x.instant.motion, x.instant.medium, x.instant.inputs, None, p),
    "joint_loads": lambda law, x, p: law(x.instant.joints, x.instant.inputs, None, p),
    "inertia_change": lambda law, x, p: law(x.instant.motion.body, p),
    "drives": lambda law, x, p: law(x.instant.inputs, p),
    "measure": lambda law, x, p: law(x.reading, p),
    "timing": lambda law, x, p: law(p),
    "actuation": lambda law, x, p: law(
        drives(x), x.instant.motion, x.instant.medium, x.instant.inputs, p
    ),
    "drive_loads": lambda law, x, p: law(
        drives(x), x.instant.motion, x.instant.medium, x.instant.inputs, None, p
    ),
}
NEW = {"inertia_change", "drives", "measure", "timing", "actuation", "drive_loads"}
BOUNDED = {"tether", "lift", "centre_of_buoyancy", "radiation_damping", "joint_backlash", "servos"}
# parameters of kilogrammes and decimetres that matter to two drives of a few newtons
VALUES: dict[str, dict[str, Any]] = {
    "weak_rotor": {"rotor": 2},
    "ground_effect": {"coefficient": 1.0, "ground_level": -0.1},
    "thrust_in_water": {"ratio": 0.8, "ratio_change": -0.1},
    "joint_backlash": {"width": 0.3, "joint": 2},
    "rotors": {"position": [[0.1, 0.2, 0.0], [0.2, 0.1, 0.0]], "torque_change": 0.1, "first": 1},
    "thrusters": {"position": [[0.1, 0.2, 0.0], [0.2, 0.1, 0.0]]},
}


def laws() -> list[tuple[str, str, str]]:
    """Return kind, name and hook of every law that is checked here."""
    found = []
    for kind in ("effect", "actuator"):
        for name in registry.names(kind):
            cls = registry.get(kind, name).load()
            hooks = LAWS if name in BOUNDED else NEW
            found += [(kind, name, hook) for hook in sorted(hooks) if hasattr(cls, hook)]
    return found


def given(rng: np.random.Generator) -> Given:
    """Return one random batch."""
    instant = random_instant(rng, ROWS)
    command = instant.joints.position + 0.2 * rng.standard_normal(instant.joints.position.shape)
    inputs = Inputs(
        0.004,
        instant.inputs.joint_torque,
        rng.uniform(100.0, 900.0, (ROWS, 3)),
        rng.uniform(12.0, 16.0, (ROWS, 1)),
        command,
    )
    thrust, torque = rng.uniform(1.0, 5.0, (ROWS, 2)), 0.05 * rng.standard_normal((ROWS, 2))
    reading = Reading(rng.standard_normal((ROWS, 3)), 9.0 * rng.standard_normal((ROWS, 3)))
    return Given(instant._replace(inputs=inputs), thrust, torque, reading)


def spread(effect: Effect, rng: np.random.Generator) -> dict[str, Array]:
    """Return parameter values that differ from row to row."""
    values = {}
    for name, meta in parameters_of(effect).items():
        values[f"it.{name}"] = np.clip(
            getattr(effect, name) * rng.uniform(0.7, 1.3, ROWS), *meta.bounds
        )
    return values


def apart(found: Any, expected: Any) -> float:
    """Largest difference against the largest value or 1."""
    most = 0.0
    for a, b in zip(leaves(found), leaves(expected), strict=True):
        assert (a is None) == (b is None)
        if a is not None:
            scale = max(1.0, float(np.abs(b).max()))
            most = max(most, float(np.abs(a - b).max()) / scale)
    return most


@pytest.mark.parametrize(("kind", "name", "hook"), laws())
def test_a_law_agrees_everywhere(kind: str, name: str, hook: str) -> None:
    """NumPy, array-api-strict and PyTorch agree, rows do not mix, and inputs stay as they are."""
    rng = np.random.default_rng(3)
    cls = registry.get(kind, name).load()
    effect = material_effect(cls, VALUES.get(name))
    x, values = given(rng), spread(effect, rng)
    bound = bind_effects({"it": effect}, ["base"])
    law, call = getattr(effect, hook), LAWS[hook]

    def params(like: Array, row: int | None = None) -> Any:
        chosen = values if row is None else {k: v[row : row + 1] for k, v in values.items()}
        return bound.with_values(chosen, like, 1 if row is not None else ROWS).bound[0].params

    before = copied(x)
    expected = call(law, x, params(np.zeros(1)))
    assert all(leaf is None or np.isfinite(leaf).all() for leaf in leaves(expected))
    assert apart(x, before) == 0.0
    for library, like in other_libraries().items():
        found = copied(call(law, converted(x, like), params(like)))
        assert apart(found, expected) <= EQUAL, library
    for row in (0, ROWS - 1):
        alone = call(law, picked(x, row), params(np.zeros(1), row))
        if hook in ("actuation", "drives"):
            alone, whole = alone[3:], expected[3:]
        else:
            whole = expected
        assert apart(alone, picked(whole, row)) <= EQUAL


@pytest.mark.parametrize(("kind", "name", "hook"), laws())
def test_parameters_of_one_row_stand_for_all(kind: str, name: str, hook: str) -> None:
    """Constant parameters give every row what a batch of equal ones gives."""
    rng = np.random.default_rng(4)
    effect = material_effect(registry.get(kind, name).load(), VALUES.get(name))
    x, bound = given(rng), bind_effects({"it": effect}, ["base"])
    equal = {f"it.{p}": np.full(ROWS, getattr(effect, p)) for p in parameters_of(effect)}
    law, call = getattr(effect, hook), LAWS[hook]
    single = call(law, x, bound.with_values({}, np.zeros(1), ROWS).bound[0].params)
    batch = call(law, x, bound.with_values(equal, np.zeros(1), ROWS).bound[0].params)
    assert apart(single, batch) <= EQUAL
