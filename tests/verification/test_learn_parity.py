"""The batch of twins flies as the robot in the rigid-body engine does, under the same actions."""

from __future__ import annotations

import numpy as np
import pytest

from seals.config.compose import compose

torch = pytest.importorskip("torch", reason="learning needs torch: pip install 'aam-seals[learn]'")
pytest.importorskip("pybullet", reason="compares with backend=pybullet")

STEPS = 50
"""2 s at 25 Hz: from the air into the water."""


@pytest.mark.parametrize("seed", [1, 3])
def test_the_twin_goes_where_the_engine_goes(seed: int) -> None:
    """Places differ by less than 2 % of the way over 2 s at equal steps, as twins with arms do."""
    from seals.learn.environments import batched_of

    words = ["task.duration=4"]
    engine = batched_of(compose([*words, "backend=pybullet"], root="learn"), count=1)
    twin = batched_of(compose([*words, "backend.interval=0.004"], root="learn"), count=1)
    np.testing.assert_allclose(engine.reset([seed]).numpy(), twin.reset([seed]).numpy(), atol=1e-5)
    rng = np.random.default_rng(seed)
    ways: list[list[np.ndarray]] = [[], []]
    for k in range(STEPS):
        if k % 15 == 0:
            action = torch.tensor(rng.uniform(-0.6, 0.6, (1, 3)), dtype=torch.float32)
            action[0, 2] = -0.8 if k < 45 else 0.1
        for way, world in zip(ways, (engine, twin), strict=True):
            seen = world.step(action).final[0].numpy()
            # height, velocity and the place by the target that stands still
            way.append(np.concatenate((seen[0:3], seen[6:9], seen[14:16])))
    engine.close()
    first, other = (np.array(way) for way in ways)
    length = np.linalg.norm(np.diff(first[:, :3], axis=0), axis=1).sum()
    assert length > 1.0
    assert first[:, -1].max() > 0.5
    assert np.abs(first[:, :3] - other[:, :3]).max() < 0.02 * length
