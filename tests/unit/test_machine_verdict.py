"""Verdicts of environments as machine code are those of arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest

from seals.arrays import namespace
from seals.learn.environments.machine_twin import MachineVerdict

pytest.importorskip("llvmlite")


class Seen(NamedTuple):
    """A nest as a law takes and returns it."""

    place: Any
    facts: dict[str, Any]
    ended: Any


def law(seen: Seen, failed: Any) -> tuple[Seen, Any]:
    """Numbers, conditions, and what is not known."""
    xp = namespace(seen.place)
    far = xp.any(xp.abs(seen.place) > 1.0, axis=1) | failed
    cost = xp.where(xp.isnan(seen.facts["reached"]), seen.facts["reached"], seen.place[:, 0])
    return Seen(seen.place * 2.0, {"cost": cost}, far), xp.isfinite(seen.facts["reached"])


def branching(seen: Seen, failed: Any) -> Any:
    """A law that asks for a number."""
    return (seen.place if float(seen.place[0, 0]) > 0.0 else -seen.place), failed


@pytest.mark.parametrize("failed", [False, True])
@pytest.mark.parametrize("reached", [0.25, np.nan])
@pytest.mark.parametrize("given", [law, branching])
def test_a_verdict_is_that_of_arrays(given: Any, reached: float, failed: bool) -> None:
    """Flags stay flags, unknown numbers unknown; a law without machine code goes on."""
    found = MachineVerdict(given)
    for x in (0.5, -3.0):
        seen = Seen(np.array([[x, 0.1]]), {"reached": np.array([reached])}, np.array([False]))
        flags = np.array([failed])
        np.testing.assert_equal(found(seen, flags), given(seen, flags))
    assert found.refused == (given is branching)


@pytest.mark.thorough
def test_an_environment_is_the_same_with_machine_code() -> None:
    """Observations, rewards, flags and facts of Hover over some control steps."""
    pytest.importorskip("torch")
    pytest.importorskip("mujoco")
    from seals.learn.environments.gym import SealsEnv

    both = [
        SealsEnv("hover", backend="mujoco", overrides=[f"backend.compiled={flag}"])
        for flag in ("true", "false")
    ]
    for env in both:
        env.reset(seed=4)
    rng = np.random.default_rng(2)
    for _ in range(8):
        action = rng.uniform(-1.0, 1.0, both[0].action_space.shape or ()).astype(np.float32)
        fast, slow = (env.step(action) for env in both)
        np.testing.assert_allclose(fast[0], slow[0], rtol=0.0, atol=1e-6)
        assert fast[1] == pytest.approx(slow[1], abs=1e-6)
        assert fast[2:4] == slow[2:4]
        assert fast[4] == pytest.approx(slow[4], abs=1e-6)
    for env in both:
        env.close()
