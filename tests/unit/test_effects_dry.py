"""One robot in the air: effects of water that are not asked would have given nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seals.api import make
from seals.effects.effect import MediumKind
from seals.motion import JointDrive
from seals.multibody.servo import driven
from seals.run.build import run_settings
from seals.run.simulation import simulate
from seals.sysid.data.vehicle import read_vehicle
from seals.sysid.predictors.trajectory_cache import TrajectoryCache, packed
from tests.unit.test_diagnose_along import VALUES, described, waving


def evaluated(height: float, monkeypatch: pytest.MonkeyPatch) -> tuple[Any, Any]:
    """Return the actor of a manipulator that moves at a height [m], and its last evaluation."""
    words = ["robot=aam", "water=fossen", f"initial.position=[0,0,{height}]"]
    world = make([*words, "initial.velocity=[0.3,-0.2,-0.5]"])
    actor, seen = world.actors["robot"], []
    evaluate = actor.evaluator.evaluate

    def watched(*given: Any) -> Any:
        seen.append(given)
        return evaluate(*given)

    monkeypatch.setattr(actor.evaluator, "evaluate", watched)
    for _ in range(3):
        world.step()
    world.close()
    return actor.evaluator, seen[-1]


def test_effects_that_are_not_asked_in_the_air_would_give_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """High above the water drags and buoyancy are left out; asked, each gives zero exactly."""
    evaluator, given = evaluated(5.0, monkeypatch)
    brief = {b.name for b, *_ in evaluator.evaluate(*given).loads}
    monkeypatch.setattr(evaluator, "_drying", set())
    left_out = [(b, w) for b, _, w in evaluator.evaluate(*given).loads if b.name not in brief]
    assert {"water_drag", "spin_drag", "arm_drag", "added_mass"} <= {b.name for b, _ in left_out}
    for b, wrench in left_out:
        assert b.kind is MediumKind.water
        assert all(part is None or not np.any(part) for part in wrench)


def test_everything_is_asked_at_the_surface(monkeypatch: pytest.MonkeyPatch) -> None:
    """A robot of which a part is wet gets all its effects."""
    evaluator, given = evaluated(0.05, monkeypatch)
    asked = {b.name for b, *_ in evaluator.evaluate(*given).loads}
    assert {b.name for b in evaluator.effects.loads} <= asked


def test_inertia_found_in_the_air_does_not_outlive_it() -> None:
    """A robot that falls into the water ends as one whose evaluator never leaves effects out."""
    words = ["robot=aam", "water=fossen", "initial.position=[0,0,0.5]", "time.duration=0.8"]
    found = simulate(run_settings(words)).log.channel("position")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("seals.effects.evaluation.vanishes_dry", lambda b: False)
        always = simulate(run_settings(words)).log.channel("position")
    assert found[-1, 2] < 0.0
    np.testing.assert_allclose(found, always, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("level", [-50.0, 0.0], ids=["in the air", "through the surface"])
def test_a_dry_batch_of_a_log_does_without_effects_of_water(level: float) -> None:
    """Rates along a trajectory above water, or through it, are those with all effects asked."""
    rates, asked = [], []
    for never in (False, True):
        plant, trajectory = waving(read_vehicle(described(level)))
        with pytest.MonkeyPatch.context() as patch:
            if never:
                patch.setattr("seals.effects.evaluation.vanishes_dry", lambda b: False)
            response = TrajectoryCache(plant, trajectory).response(VALUES)
        rates.append(packed(response.rates))
        asked.append(len(response._found.loads) + len(response._found.inertias))
    np.testing.assert_array_equal(*rates)
    assert (asked[0] < asked[1]) == (level < 0.0)


def test_joint_drives_keep_their_equations_and_limits() -> None:
    """Within its limit a drive gives force - gain a, at its limit the limit; M a is what acts."""
    rng = np.random.default_rng(3)
    root = rng.standard_normal((4, 4))
    matrix = (root @ root.T + np.eye(4))[None]
    gain, right = rng.uniform(0.1, 2.0, (1, 4)), rng.standard_normal((1, 4))
    force = rng.standard_normal((1, 4))
    change, pull = driven(matrix, right, JointDrive(force, gain, gain, np.full((1, 4), 1e2)), gain)
    np.testing.assert_allclose(pull, force - gain * change, rtol=1e-11)
    np.testing.assert_allclose(matrix[0] @ change[0], (right + pull)[0], rtol=1e-10, atol=1e-12)
    held = driven(matrix, right, JointDrive(force, gain, gain, np.full((1, 4), 0.3)), gain)[1]
    assert np.abs(held).max() <= 0.3
    assert np.abs(pull).max() > 0.3
