"""Twins as machine code, row by row, are those of NumPy, whatever their number and the threads."""

from __future__ import annotations

import gc
import weakref
from typing import Any

import numpy as np
import pytest

from seals.config.compose import compose
from seals.learn.environments.build import batched_of, build_learning
from seals.learn.environments.machine_twin import MachineLaw
from seals.learn.environments.twin import TwinSimulator
from seals.scalar_compiler import rows
from seals.scalar_compiler.functions import take
from seals.scalar_compiler.graph import Table
from seals.scalar_compiler.rows import RowKernel

pytest.importorskip("llvmlite")
torch = pytest.importorskip("torch")

STEPS = 6
WORDS = ("env=hover", "robot=hexacopter")


def environments(count: int, *, coded: bool, words: tuple[str, ...] = WORDS) -> Any:
    """N environments of one task."""
    found: Any = batched_of(compose([*words], root="learn"), count=count, coded=coded)
    return found


def flown(batch: Any, seeds: list[int], actions: Any) -> list[Any]:
    """Observations, rewards and true positions of some steps."""
    found = [batch.reset(seeds).numpy()]
    for action in actions:
        turn = batch.step(torch.as_tensor(action))
        found += [turn.observation.numpy(), turn.reward.numpy(), batch.now.position.copy()]
    return found


def actions_of(batch: Any) -> Any:
    """Random actions of some steps."""
    rng = np.random.default_rng(1)
    shape = (STEPS, batch.count, batch.action_size)
    return rng.uniform(-1.0, 1.0, shape).astype(np.float32)


def test_rows_are_those_of_numpy() -> None:
    """Within 1e-12 while the drives are within their limits."""
    many, plain = (environments(9, coded=coded) for coded in (True, False))
    # beyond them the search solves systems of condition 1e9: 1e-9 m after a quarter of a second
    actions = 0.1 * actions_of(many)
    for batch in (many, plain):
        flown(batch, list(range(9)), actions)
    assert plain.simulator.machine is None
    assert not any(law.refused for law in many.simulator.machine)
    np.testing.assert_allclose(many.now.position, plain.now.position, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(many.now.rotation, plain.now.rotation, rtol=0.0, atol=1e-12)


@pytest.mark.thorough
def test_rows_are_those_of_one_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bit for bit the same alone, among others, and on any threads."""
    seeds, many = list(range(50)), environments(50, coded=True)
    actions = actions_of(many)
    found = flown(many, seeds, actions)
    for threads in (1, 3):
        monkeypatch.setattr(rows, "cores", lambda threads=threads: threads)
        again = flown(environments(50, coded=True), seeds, actions)
        for one, other in zip(found, again, strict=True):
            np.testing.assert_array_equal(one, other)
    alone = flown(environments(1, coded=True), [7], actions[:, 7:8])
    for one, other in zip(alone, found, strict=True):
        np.testing.assert_array_equal(one[0], other[7])


def test_a_row_at_the_surface_is_looked_up_and_no_other() -> None:
    """The second law takes what the first one doubts; without it NumPy does."""
    words = (*WORDS, "backend=twin")
    settings, task = build_learning(compose([*words], root="learn"))
    coded = TwinSimulator(settings, task, count=3, device="cpu", coded=True)
    plain = TwinSimulator(settings, task, count=3, device="cpu")
    draw = task.draw(np.random.default_rng(0), 3)
    heights = np.array([0.02, 5.0, -5.0])
    place = np.concatenate((np.zeros((3, 2)), heights[:, None]), axis=1)
    draw = draw._replace(position=place, velocity=np.array([[0.0, 0.0, -1.0]] * 3))
    still = np.zeros((3, 1))
    both = []
    for simulator in (coded, plain):
        robots, goal = simulator.begin(draw)
        action = np.zeros((3, len(task.action_names)))
        now = simulator.instant(robots, goal, action, still)
        for _ in range(3):
            robots = simulator.advance(robots, action, now)
            now = simulator.instant(robots, goal, action, still)
        both.append((now, robots))
    (one, _), (other, _) = both
    assert 0.0 < other.submersion[0, 0] < 1.0
    for name in ("position", "rotation", "velocity", "angular_velocity", "submersion", "tool"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=0.0, atol=1e-12)
    assert coded.machine is not None
    assert len(coded.machine[0]._kernels) == 2


def test_coded_environments_go_with_their_last_name() -> None:
    """No reference cycle through the laws keeps them and their tables alive."""
    gc.collect()
    gc.disable()
    try:
        twins = environments(2, coded=True)
        twins.reset([0, 1])
        twins.step(torch.zeros(2, twins.action_size))
        parts = [weakref.ref(x) for x in (twins, twins.simulator, twins.simulator.machine[0])]
        del twins
        assert [part() for part in parts] == [None] * 3
    finally:
        gc.enable()


def test_what_no_law_is_sure_of_is_left_to_numpy() -> None:
    """Rows that all laws doubt have NumPy's numbers, others those of machine code."""
    from seals.arrays import doubt

    def doubting(x: Any) -> tuple[Any]:
        doubt(x > 1.0)
        return (2.0 * x,)

    law = MachineLaw([doubting, doubting])
    (found,) = law(
        lambda x: (-x,),
        lambda a, b, mask: (np.where(mask[:, None], a[0], b[0]),),
        np.array([[1.0], [3.0]]),
    )
    np.testing.assert_array_equal(found, [[2.0], [-3.0]])


def test_a_law_that_decides_by_numbers_stays_with_numpy() -> None:
    """Refused once, at the first call."""
    law = MachineLaw([lambda x: (x if x > 0.0 else -x,)])
    (found,) = law(lambda x: (np.abs(x),), lambda a, b, mask: a, np.array([[-1.0]]))
    np.testing.assert_array_equal(found, [[1.0]])
    assert law.refused


def test_arrays_link_by_link() -> None:
    """Two links of three robots: rows of the first link, then of the second."""
    law = RowKernel(lambda x, y: [x + y, x * 0.0 + 4.0], [(2, 1), (1, 1)])
    x, y = np.arange(6.0)[:, None], np.array([[10.0], [20.0], [30.0]])
    both, fixed = law([x, y])
    assert both[:, 0].tolist() == [10.0, 21.0, 32.0, 13.0, 24.0, 35.0]
    assert fixed.shape == (6, 1)


@pytest.mark.parametrize(
    ("index", "row"), [(0.0, 0), (2.0, 2), (-1.0, 0), (9.0, 2), (np.inf, 2), (np.nan, 0)]
)
def test_a_table_is_never_left(index: float, row: int) -> None:
    """An index beyond a table, or one that is not a number, reads the nearest row of it."""
    values = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])
    law = RowKernel(lambda x: [take(Table(values), x, axis=0)], [(1,)])
    assert law([np.array([index])])[0].tolist() == [values[row].tolist()]


def test_a_batch_of_one_crosses_the_surface_as_one_of_three() -> None:
    """What enters has an added mass that changes: that of one robot was kept as it first was."""
    found = []
    for count in (1, 3):
        settings, task = build_learning(compose(["env=hover"], root="learn"))
        twin = TwinSimulator(settings, task, count=count, device="cpu")
        draw = task.draw(np.random.default_rng(0), count)
        draw = draw._replace(
            position=np.array([[0.0, 0.0, 0.05]] * count),
            velocity=np.array([[0.0, 0.0, -2.0]] * count),
            yaw=np.zeros((count, 1)),
        )
        flight, _ = twin.begin(draw)
        aim = {"velocity": np.array([[0.0, 0.0, -1.0]] * count), "yaw": np.zeros((count, 1))}
        flight = twin.twin.fly(flight, aim, 20)
        found.append(flight.state.position[0])
    np.testing.assert_allclose(found[0], found[1], rtol=0.0, atol=1e-12)
