"""Two processes of torchrun learn as one: their gradients are those of all rows together."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch", reason="learning needs torch: pip install 'aam-seals[learn]'")
pytest.importorskip("torchrl", reason="learning needs torchrl: pip install 'aam-seals[learn]'")

UPDATE = """
import os, sys, torch
import numpy as np
from seals.learn.batched import StepResult
from seals.learn.devices import alike_in_all, largest_of_all
from seals.learn.learner import Spaces
from seals.plugins.learners.ppo import PPO

rank, processes = int(os.environ.get("RANK", 0)), int(os.environ.get("WORLD_SIZE", 1))
count = 8 // processes
mine = slice(rank * count, (rank + 1) * count)
learner = PPO(hidden=[16], horizon=4, epochs=1, minibatches=1, entropy=0.01, steepest=1e3)
agent = learner.start(
    Spaces(observation_size=5, action_size=2, count=count), device="cpu", seed=7 * rank
)
getattr(agent.loss, "module", agent.loss).normalize_advantage = False
rows = torch.Generator().manual_seed(1)
seen, action, reward = (torch.randn(5, 8, k, generator=rows) for k in (5, 2, 1))
ends = torch.zeros(count, dtype=torch.bool)
for k in range(4):
    result = StepResult(
        observation=seen[k + 1, mine], reward=reward[k, mine, 0], terminated=ends, truncated=ends,
        final=seen[k + 1, mine], success=ends, facts={},
    )
    agent.observe(seen[k, mine], action[k, mine], result)
agent.update()
kept = {
    "gradients": [p.grad for p in agent.learned],
    "weights": [p.detach() for p in agent.learned],
    "norm": list(agent.norm.layer.buffers()),
    "agreed": [torch.tensor([largest_of_all(rank), alike_in_all([5, 7]), alike_in_all([5, rank])])],
}
arrays = {f"{name}_{k}": x.numpy() for name, rows in kept.items() for k, x in enumerate(rows)}
np.savez(f"{sys.argv[1]}/{processes}_{rank}.npz", **arrays)
"""


def updated(folder: Path, *launcher: str) -> None:
    """One update of PPO in a process, or in those of a launcher, which leave what they have."""
    script = folder / "update.py"
    script.write_text(UPDATE, encoding="utf-8")
    words = [sys.executable, "-P", *launcher, str(script), str(folder)]
    subprocess.run(words, check=True, cwd=folder, env={**os.environ, "OMP_NUM_THREADS": "1"})


@pytest.mark.slow
def test_two_processes_have_the_gradients_of_one(tmp_path: Path) -> None:
    """Four rows of eight in each: means of gradients, weights and normaliser are those of all."""
    updated(tmp_path)
    updated(tmp_path, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node=2")
    one, first, second = (
        np.load(tmp_path / f"{name}.npz", allow_pickle=False) for name in ("1_0", "2_0", "2_1")
    )
    assert first["agreed_0"].tolist() == second["agreed_0"].tolist() == [1, 1, 0]
    assert one["agreed_0"].tolist() == [0, 1, 1]
    for name in (name for name in one if name != "agreed_0"):
        np.testing.assert_array_equal(first[name], second[name])
        np.testing.assert_allclose(first[name], one[name], rtol=1e-5, atol=1e-7)
    assert max(abs(one[name]).max() for name in one if name.startswith("gradients")) > 1e-3
