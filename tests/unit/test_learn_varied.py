"""Environments that differ within the tolerances of their model."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from seals.cli.main import main
from seals.config.compose import compose
from seals.learn.environments.build import build_learning
from seals.learn.environments.posterior import drawn_parameters
from seals.schema import param

torch = pytest.importorskip("torch", reason="learning needs torch: pip install 'aam-seals[learn]'")


@dataclass(kw_only=True)
class _Effect:
    share: float = param(2.0, "1", bounds=(1.9, 9.0), tolerance=0.1, relative=True, source="s")
    size: float = param(-3.0, "m", bounds=(-9.0, 9.0), tolerance=0.5, source="s")
    known: float = param(1.0, "1", bounds=(0.0, 9.0), tolerance=0.0, source="s")
    held: float = param(1.0, "1", bounds=(0.0, 9.0), tolerance=0.5, source="s", fit=False)


def test_draws_are_as_wide_as_the_tolerances_and_within_bounds() -> None:
    """Mean and deviation are those declared; what is known or held does not vary."""
    rng = np.random.default_rng(0)
    found = drawn_parameters({"e": _Effect()}, 4000, share=1.0, rng=rng)
    assert set(found) == {"e.share", "e.size"}
    assert found["e.size"].mean() == pytest.approx(-3.0, abs=0.03)
    assert found["e.size"].std() == pytest.approx(0.5, rel=0.05)
    # 0.2 is the deviation; a third of the draws lies below the bound
    assert found["e.share"].min() == 1.9
    assert found["e.share"].max() == pytest.approx(2.0 + 3.5 * 0.2, abs=0.25)
    assert drawn_parameters({"e": _Effect()}, 4, share=0.0, rng=rng) == {}
    half = drawn_parameters({"e": _Effect()}, 4000, share=0.5, rng=np.random.default_rng(0))
    np.testing.assert_allclose(half["e.size"] + 3.0, 0.5 * (found["e.size"] + 3.0), atol=1e-12)


def test_twins_from_one_start_part_when_they_differ() -> None:
    """Equal commands lead varied twins to different places, equal twins to one."""
    from seals.learn.environments import batched_of

    config = compose(["env=reach"], root="learn")
    settings, _ = build_learning(config)
    values = drawn_parameters(settings.effects, 4, share=1.0, rng=np.random.default_rng(1))
    spread = []
    for chosen in (None, values):
        twins = batched_of(config, count=4, values=chosen)
        twins.reset([7] * 4)
        for _ in range(25):
            twins.step(torch.tensor([[0.5, 0.0, -1.0]] * 4))
        spread.append(float(np.ptp(twins.now.position, axis=0).max()))
    assert spread[0] == 0.0
    assert spread[1] > 1e-3


@pytest.mark.thorough
def test_a_training_in_varied_environments_is_judged_in_the_configured_one(tmp_path: Path) -> None:
    """The world of the policy's metadata is the same with and without; an engine refuses."""
    hashes = []
    for share in (0.0, 1.0):
        folder = tmp_path / str(share)
        words = ["env=reach", "count=4", "course.steps=8", "course.episodes=2", "task.duration=0.2"]
        assert main(["train", *words, f"varied={share}", f"hydra.run.dir={folder}"]) == 0
        hashes.append(json.loads((folder / "policy" / "card.json").read_text())["world_hash"])
    assert hashes[0] == hashes[1]


@pytest.mark.parametrize(
    ("words", "said"),
    [(["varied=1", "backend=free"], "backend=twin"), (["varied=-1"], "varied")],
)
def test_what_cannot_vary_is_refused(
    words: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The words say what to change."""
    assert main(["train", "env=reach", *words, f"hydra.run.dir={tmp_path}"]) == 2
    assert said in capsys.readouterr().err
