"""Prioritised drawing: frequencies, weights, and a bonus that means the same at every scale."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import stats

from seals.learn.replay import Memory, Prioritised
from seals.learn.starts import generator_of

torch = pytest.importorskip("torch")
pytest.importorskip("torchrl")
torch.set_num_threads(1)

ROWS = 200
SHOWN = 20
DRAWS = 8
BATCH = 12_800


def memory_of(**law: Any) -> Memory:
    """Return a memory of 20 demonstrations and 180 further transitions."""
    values = {"alpha": 0.6, "beta": 0.4, "anneal": 1000, "epsilon": 0.01, "bonus": 1.0, **law}
    sampler = Prioritised(**values)
    memory = Memory(
        capacity=ROWS - SHOWN, sampler=sampler, device="cpu", generator=generator_of(7, "cpu")
    )
    memory.protect({"number": torch.arange(SHOWN)})
    memory.add({"number": torch.arange(SHOWN, ROWS)})
    return memory


def learned(memory: Memory, errors: np.ndarray[Any, Any]) -> None:
    """Tell a memory the error of every transition."""
    batch = {"index": torch.arange(ROWS)}
    memory.update_priorities(batch, torch.from_numpy(errors))


def counts(memory: Memory) -> np.ndarray[Any, Any]:
    """Return how often each transition is drawn."""
    drawn = torch.cat([memory.sample(BATCH)["number"] for _ in range(DRAWS)])
    return np.bincount(drawn.numpy(), minlength=ROWS)


def expected(errors: np.ndarray[Any, Any], *, alpha: float, bonus: float) -> Any:
    """Return the probability of each transition, from the law as it is published."""
    shown = np.arange(ROWS) < SHOWN
    priority = (errors / errors.mean() + 0.01 + bonus * shown) ** alpha
    return priority / priority.sum()


@pytest.mark.parametrize(("alpha", "bonus"), [(0.6, 1.0), (1.0, 0.0), (0.0, 1.0), (0.6, 20.0)])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
def test_frequencies_are_those_of_the_law(alpha: float, bonus: float, scale: float) -> None:
    """102,400 draws against the law by chi-square: p above 0.001, whatever the scale of errors."""
    errors = scale * np.random.default_rng(3).exponential(1.0, ROWS)
    memory = memory_of(alpha=alpha, bonus=bonus)
    learned(memory, errors)
    share = expected(errors, alpha=alpha, bonus=bonus)
    assert stats.chisquare(counts(memory), share * DRAWS * BATCH).pvalue > 1e-3


def test_a_wrong_law_is_found() -> None:
    """The chi-square test above has the power to tell the bonus from half of it."""
    errors = np.random.default_rng(3).exponential(1.0, ROWS)
    memory = memory_of(bonus=1.0)
    learned(memory, errors)
    share = expected(errors, alpha=0.6, bonus=0.5)
    assert stats.chisquare(counts(memory), share * DRAWS * BATCH).pvalue < 1e-3


@pytest.mark.parametrize("scale", [1.0, 1e5])
def test_the_bonus_is_no_empty_gesture(scale: float) -> None:
    """With equal errors a tenth of demonstrations is drawn 2^0.6 times as often, at any scale.

    Equation: share = 0.1 * 2.01^0.6 / (0.1 * 2.01^0.6 + 0.9 * 1.01^0.6) = 0.1439.
    """
    memory = memory_of()
    learned(memory, np.full(ROWS, scale))
    share = float(np.mean([float(memory.share(memory.sample(BATCH))) for _ in range(DRAWS)]))
    # three standard deviations of a share of 102,400 draws are 0.0033
    assert share == pytest.approx(0.1439, abs=0.0033)


def test_weights_undo_the_bias() -> None:
    """With beta = 1 the weighted mean of any figure is that of even drawing."""
    errors = np.random.default_rng(5).exponential(1.0, ROWS)
    memory = memory_of(beta=1.0, alpha=1.0)
    learned(memory, errors)
    batch = memory.sample(200_000)
    weight, number = batch["weight"].double(), batch["number"].double()
    mean = float((weight * number).sum() / weight.sum())
    assert float(weight.max()) == 1.0
    # the deviation of the mean, from the draws themselves
    spread = float((weight * (number - mean)).std() / weight.mean() / np.sqrt(len(number)))
    assert mean == pytest.approx((ROWS - 1) / 2.0, abs=4.0 * spread)


def test_new_transitions_are_tried_first() -> None:
    """What was never drawn has the largest error seen of late, so that it is looked at."""
    memory = memory_of(alpha=1.0, bonus=0.0)
    errors = np.ones(ROWS)
    errors[50] = 9.0
    learned(memory, errors)
    memory.add({"number": torch.arange(ROWS, ROWS + 1)})
    drawn = torch.cat([memory.sample(BATCH)["number"] for _ in range(DRAWS)]).numpy()
    newest, largest = np.sum(drawn == ROWS), np.sum(drawn == 50)
    # both are Poisson, the difference has the deviation of the root of their sum
    assert abs(int(newest) - int(largest)) < 4.0 * np.sqrt(newest + largest)


def test_priorities_go_on_from_their_state() -> None:
    """The next draws and weights are bit-equal after a round through the state."""
    memory, other = memory_of(), memory_of()
    learned(memory, np.random.default_rng(1).exponential(1.0, ROWS))
    fresh = Memory(
        capacity=ROWS - SHOWN,
        sampler=Prioritised(alpha=0.6, beta=0.4, anneal=1000, epsilon=0.01, bonus=1.0),
        device="cpu",
        generator=generator_of(0, "cpu"),
    )
    fresh.load(memory.state())
    fresh.sampler.generator.set_state(memory.sampler.generator.get_state())
    one, two = memory.sample(BATCH), fresh.sample(BATCH)
    assert torch.equal(one["number"], two["number"])
    assert torch.equal(one["weight"], two["weight"])
    assert not torch.equal(one["number"], other.sample(BATCH)["number"])
