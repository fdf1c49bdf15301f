"""The ledger: every effect by name, their sum what the body feels."""

from __future__ import annotations

import contextlib
from typing import Any

import numpy as np
import pytest

from seals.api import make
from seals.backend import Dynamics
from seals.motion import Wrench
from seals.world import Ledger


def test_the_sum_is_what_the_backend_is_given(monkeypatch: pytest.MonkeyPatch) -> None:
    """At every step the wrench handed to the backend is the sum over the effects in the ledger."""
    options = ["robot=free_arm", "water=fossen", "initial.position=[0,0,0.1]"]
    with contextlib.closing(make([*options, "initial.velocity=[0.3,0.1,-0.5]"])) as world:
        actor, given = world.actors["robot"], []
        apply = actor.body.apply

        def watched(dynamics: Dynamics, step: float) -> None:
            given.append(np.array(dynamics.wrench[0]))
            apply(dynamics, step)

        monkeypatch.setattr(actor.body, "apply", watched)
        for _ in range(60):
            world.step()
    np.testing.assert_allclose(actor.ledger.wrenches.sum(axis=1), given, atol=1e-13)
    assert {"gravity", "buoyancy", "water_drag", "added_mass"} <= set(actor.ledger.effects)


def test_the_sum_is_what_the_body_feels() -> None:
    """The force in the ledger over a step, times the step, is the gain of momentum."""
    still = [f"effects.added_mass.mass_{a}=0" for a in "xyz"]
    options = ["robot=ball", "water=fossen", "initial.position=[0,0,0.03]", "time.step=0.001"]
    moving = ["initial.velocity=[0.5,0,-1]", "effects.slamming.coefficient=0"]
    with contextlib.closing(make([*options, *moving, *still])) as world:
        actor, speeds = world.actors["robot"], []
        for _ in range(101):
            speeds.append(actor.body.read().velocity)
            world.step()
        force = actor.ledger.wrenches.sum(axis=1)[:, 0, :3]
    # the ball does not turn: link axes are world axes; trapezoidal rule over 0.1 s
    impulse = 0.001 * (force[:-1] + force[1:]).sum(axis=0) / 2.0
    np.testing.assert_allclose(0.3 * (speeds[-1] - speeds[0]), impulse, rtol=1e-4, atol=1e-6)


def test_weight_and_lift_are_told_apart() -> None:
    """At rest under water the ledger holds -m g and rho g V by their names."""
    with contextlib.closing(
        make(["robot=ball", "water=fossen", "initial.position=[0,0,-5]"])
    ) as world:
        world.step()
        ledger = world.actors["robot"].ledger
        weight, lift = ledger.of("gravity")[0, 0], ledger.of("buoyancy")[0, 0]
    volume = 4.0 / 3.0 * np.pi * 0.05**3
    # density of fresh water at 20 degC: 998.206 kg/m^3 (Millero and Poisson 1981)
    np.testing.assert_allclose(weight, [0, 0, -0.3 * 9.81, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(
        lift, [0, 0, 998.206 * 9.81 * volume, 0, 0, 0], rtol=1e-6, atol=1e-12
    )


@pytest.mark.parametrize("rows", [None, slice(1, 2), np.array([1])])
def test_rows_grow_and_rewind(rows: Any) -> None:
    """A full ledger grows without losing rows; rewinding leaves no trace of what came later."""
    ledger = Ledger(["a", "b"], ["x", "y"], steps=2)
    for k in range(5):
        row = ledger.open_row(0.1 * k)
        count = 2 if rows is None else 1
        ledger.write(row, "b", rows, Wrench(np.full((count, 3), k + 1.0), None))
    assert ledger.wrenches.shape == (5, 2, 2, 6)
    np.testing.assert_array_equal(ledger.of("b")[:, 1, 0], [1, 2, 3, 4, 5])
    assert not ledger.of("a").any()
    ledger.rewind(2)
    assert ledger.rows == 2
    row = ledger.open_row(0.2)
    assert not row.any()
    np.testing.assert_allclose(ledger.time, [0.0, 0.1, 0.2])


def test_columns_name_effect_link_and_component() -> None:
    """Columns that are zero throughout are left out."""
    ledger = Ledger(["a", "b"], ["x", "y"], steps=1)
    row = ledger.open_row(0.5)
    ledger.write(row, "b", slice(1, 2), Wrench(np.array([[0.0, 2.0, 0.0]]), None))
    assert {key: values.tolist() for key, values in ledger.columns().items()} == {
        "t": [0.5],
        "b.y.force_y": [2.0],
    }
