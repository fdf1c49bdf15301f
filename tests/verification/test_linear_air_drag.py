"""The paper's linear drag in air: F = c v, in place of the quadratic one."""

from __future__ import annotations

import numpy as np

from seals.api import make


def test_the_manipulator_coasts_under_linear_drag() -> None:
    """At level attitude and 4, 3 m/s the force is -0.5 x 4 and -0.3 x 3 N; no other drag acts."""
    world = make(["experiment=linear_air_drag"])
    world.step()
    ledger = world.actors["robot"].ledger
    force = ledger.of("linear_air_drag")[0].sum(axis=0)[:3]
    np.testing.assert_allclose(force, [-2.0, -0.9, 0.0], atol=1e-9)
    assert not np.any(ledger.of("air_drag")[0])
    world.close()
