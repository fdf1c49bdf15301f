"""Compiled twins move as twins do: same laws, same states, in both precisions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seals.config.compose import compose
from seals.errors import ConfigError
from seals.run import build_twin
from seals.run.build import run_settings

torch = pytest.importorskip("torch", reason="fusing needs torch: pip install 'aam-seals[learn]'")

BATCH = 16


def _flown(words: list[str], like: Any, *, fused: bool) -> dict[str, Any]:
    """Return states after half a second from starts around the surface, memories of effects too."""
    settings = run_settings(words)
    twin, start = build_twin(settings, batch=BATCH, like=like, fused=fused)
    rng = np.random.default_rng(4)
    spread = {
        "position": [1.0, 1.0, 0.3],
        "velocity": [1.0, 1.0, 1.0],
        "angular_velocity": [0.5, 0.5, 0.5],
    }
    values = {name: rng.normal(size=(BATCH, 3)) * width for name, width in spread.items()}
    joints = np.asarray(start.joints)[:1]
    state = twin.start(rpy=rng.normal(size=(BATCH, 3)) * 0.4, joints=joints, **values)
    for k in range(25):
        state, rates = twin.step(state, 0.02 * k, 0.02)
    parts = {**state._asdict(), "felt": rates.specific_force}
    return {name: np.asarray(x, dtype=float) for name, x in parts.items()}


@pytest.mark.thorough
@pytest.mark.parametrize("water", ["airy", pytest.param("still", marks=pytest.mark.slow)])
def test_a_compiled_twin_moves_as_the_twin_does(water: str) -> None:
    """In double precision states agree to 1e-10 after 25 steps, in single to 1e-3."""
    words = ["robot=crazyflie", "water=fossen", f"wave={water}"]
    plain = _flown(words, np.zeros(1), fused=False)
    double = _flown(words, torch.zeros(1, dtype=torch.float64), fused=True)
    single = _flown(words, torch.zeros(1), fused=True)
    assert np.any(np.abs(plain["velocity"]) > 1.0)
    for name, expected in plain.items():
        np.testing.assert_allclose(double[name], expected, rtol=1e-10, atol=1e-10, err_msg=name)
        np.testing.assert_allclose(single[name], expected, rtol=1e-3, atol=1e-3, err_msg=name)


def test_a_twin_of_numpy_cannot_be_compiled() -> None:
    """What was given is told, and what to give."""
    settings = run_settings(["robot=crazyflie"])
    with pytest.raises(ConfigError, match=r"numpy arrays cannot be fused\.\n.*torch\.zeros"):
        build_twin(settings, batch=2, fused=True)


@pytest.mark.slow
def test_compiled_environments_do_what_environments_do() -> None:
    """Over a second of wild flight: places to 1e-9 m, rewards and ends alike, then fresh starts."""
    from seals.learn.environments import batched_of

    words = ["env=reach", "backend=twin", "backend.double=true", "task.duration=1.0"]
    plain: Any = batched_of(compose(words, root="learn"), count=12)
    fused: Any = batched_of(compose([*words, "backend.fused=true"], root="learn"), count=12)
    seeds = list(range(12))
    assert torch.equal(fused.reset(seeds), plain.reset(seeds))
    for k in range(24):
        action = torch.rand(12, 3, generator=torch.Generator().manual_seed(k)) * 2.0 - 1.0
        found, expected = fused.step(action), plain.step(action)
        place = fused.now.position.numpy()
        np.testing.assert_allclose(place, plain.now.position, rtol=0.0, atol=1e-9)
        torch.testing.assert_close(found.reward, expected.reward, rtol=0.0, atol=1e-6)
        torch.testing.assert_close(found.observation, expected.observation, rtol=0.0, atol=1e-6)
        assert not found.truncated.any()
    ended = fused.step(torch.zeros(12, 3))
    assert bool(ended.truncated.all())
    assert ended.facts["time"].tolist() == pytest.approx([1.0] * 12)
    starts = fused._starts.state["position"]
    assert all(bool((starts == place).all(1).any()) for place in fused.now.position)
    # it goes on from a snapshot as it did
    kept = fused.snapshot()
    before = [fused.step(torch.ones(12, 3)).observation for _ in range(3)]
    fused.restore(kept)
    after = [fused.step(torch.ones(12, 3)).observation for _ in range(3)]
    assert all(torch.equal(a, b) for a, b in zip(before, after, strict=True))
