"""What is recorded for an accelerator does what the processor does."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest

from seals.arrays import fixed, some, undecided
from seals.config.compose import compose
from seals.control.allocation import Allocation, Saturation

torch = pytest.importorskip("torch", reason="learning needs torch: pip install 'aam-seals[learn]'")


class _Pair(NamedTuple):
    a: Any
    b: Any


def _as_if_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take the ways that are taken on an accelerator, on the processor."""
    for module in ("arrays", "learn.environments.batch"):
        monkeypatch.setattr(f"seals.{module}.on_accelerator", lambda array: True)


def _twins(count: int) -> Any:
    from seals.learn.environments import batched_of

    return batched_of(compose(["task.duration=1.0"], root="learn"), count=count)


def test_copies_keep_the_form_and_share_nothing() -> None:
    """Named tuples, mappings and None stay; a change of the copy is not one of the original."""
    from seals.pytree import copied, leaves, put

    nest = _Pair(torch.ones(2), {"x": (torch.zeros(1).expand(3), None)})
    copy = copied(nest)
    put(_Pair(torch.full((2,), 5.0), {"x": (torch.ones(3), None)}), copy)
    assert isinstance(copy, _Pair)
    assert copy.b["x"][1] is None
    assert [x.tolist() for x in leaves(copy)] == [[5.0, 5.0], [1.0, 1.0, 1.0]]
    assert [x.tolist() for x in leaves(nest)] == [[1.0, 1.0], [0.0, 0.0, 0.0]]


def test_nests_of_another_form_are_not_put() -> None:
    """Fewer tensors than there are places for is a mistake, not a partial copy."""
    from seals.pytree import put

    with pytest.raises(ValueError, match="zip"):
        put((torch.ones(1),), (torch.ones(1), torch.ones(1)))


def test_nobody_waits_for_an_accelerator() -> None:
    """The answer is yes there, whatever the flags: they are not looked at."""
    flags = torch.zeros(3, dtype=torch.bool)
    assert not some(flags)
    assert some(flags | True)
    assert some(torch.zeros(3, dtype=torch.bool, device="meta"))


def test_a_constant_is_converted_once() -> None:
    """The same tensor comes back for the same constant, and another for another type."""
    constant, like = np.arange(3.0), torch.zeros(1)
    assert fixed(constant, like) is fixed(constant, like)
    assert fixed(constant, like).tolist() == [0.0, 1.0, 2.0]
    assert fixed(constant, like.double()).dtype == torch.float64
    # equal numbers in another place are another constant
    assert fixed(np.arange(3.0), like) is not fixed(constant, like)


@pytest.mark.thorough
def test_the_way_of_an_accelerator_leads_where_the_other_does(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Places agree to 1e-9 over a second in double precision; what is told is single."""
    plain = _twins(6)
    seen = [plain.reset([1, 2, 3, 4, 5, 6])]
    actions = [
        torch.rand(6, 3, generator=torch.Generator().manual_seed(k)) - 0.8 for k in range(24)
    ]
    rewards, places = [], []
    for action in actions:
        turn = plain.step(action)
        places.append(plain.now.position.copy())
        seen.append(turn.observation)
        rewards.append(turn.reward)
    monkeypatch.setattr(
        "seals.learn.environments.twin._like_on",
        lambda device, **kind: torch.zeros(1, dtype=torch.float64),
    )
    twins = _twins(6)
    assert torch.equal(twins.reset([1, 2, 3, 4, 5, 6]), seen[0])
    _as_if_there(monkeypatch)
    scene = twins._scene
    _drawn_ahead(twins)
    with torch.no_grad():
        for k, action in enumerate(actions):
            scene, (turn, _) = twins._advance(scene, twins._as_action(action))
            np.testing.assert_allclose(scene.now.position.numpy(), places[k], rtol=0.0, atol=1e-9)
            assert torch.allclose(turn.observation, seen[k + 1], atol=1e-6)
            assert torch.allclose(turn.reward, rewards[k], atol=1e-6)


@pytest.mark.thorough
def test_single_precision_ends_where_double_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """After a second of wild flight, half of it at the rotors' limits, places agree to 1e-5 m."""
    plain = _twins(8)
    plain.reset(list(range(8)))
    monkeypatch.setattr(
        "seals.learn.environments.twin._like_on", lambda device, **kind: torch.zeros(1)
    )
    twins = _twins(8)
    twins.reset(list(range(8)))
    for k in range(24):
        action = torch.rand(8, 3, generator=torch.Generator().manual_seed(k)) * 2.0 - 1.0
        plain.step(action)
        with undecided():
            scene, _ = twins._law(twins._scene, twins._as_action(action), None)
        twins._scene = scene
    assert scene.now.position.dtype == torch.float32
    np.testing.assert_allclose(scene.now.position.numpy(), plain.now.position, rtol=0.0, atol=1e-5)


def _drawn_ahead(twins: Any) -> None:
    draws = [twins.task.draw(twins._rng, twins.count) for _ in range(20)]
    twins._starts = twins.simulator.drawn_ahead(draws)
    twins._generator = torch.Generator().manual_seed(0)


def test_what_is_kept_does_not_go_on_with_the_recording(monkeypatch: pytest.MonkeyPatch) -> None:
    """A snapshot stays as it was when the tensors of the environments are written over."""
    from seals.pytree import leaves

    monkeypatch.setattr(
        "seals.learn.environments.twin._like_on",
        lambda device, **kind: torch.zeros(1, dtype=torch.float64),
    )
    twins = _twins(2)
    first = twins.reset([1, 2])
    twins._generator = torch.Generator().manual_seed(0)
    kept = twins.snapshot()
    for tensor in leaves(twins._scene):
        tensor.zero_()
    twins.restore(kept)
    assert torch.equal(twins._observation(twins.now), first)


def test_episodes_begin_at_starts_drawn_ahead(monkeypatch: pytest.MonkeyPatch) -> None:
    """What ended goes on from a start of the store, what did not is left alone."""
    monkeypatch.setattr(
        "seals.learn.environments.twin._like_on",
        lambda device, **kind: torch.zeros(1, dtype=torch.float64),
    )
    twins = _twins(6)
    twins.reset([1, 2, 3, 4, 5, 6])
    _as_if_there(monkeypatch)
    _drawn_ahead(twins)
    ended = torch.tensor([True, False, True, False, False, True])
    before = twins._scene
    chance = twins._starts.chances(6, twins._generator)
    after = twins._reset_ended(before, ended, twins._starts.picked(chance))
    goals = {tuple(row) for row in twins._starts.goal.tolist()}
    for k, new in enumerate(ended.tolist()):
        row = tuple(after.goal[k].tolist())
        assert (row in goals) == new
        assert (row == tuple(before.goal[k].tolist())) != new
        place = after.robots.state.position[k]
        assert bool((twins._starts.state["position"] == place).all(1).any()) == new
        assert torch.equal(after.now.position[k], place)


@pytest.mark.parametrize("rows", [4, 6])
def test_commands_beyond_the_drives_are_the_best_in_most_cases(
    rows: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The changes made ahead settle 199 of 200 wild wrenches; all are within their bounds."""
    from seals.control.limbs import stowed
    from seals.control.mass_properties import MassPropertyEstimator
    from seals.control.plant import build_plant
    from seals.run.assembly import build_model
    from seals.run.build import run_settings

    robot = {4: "aam", 6: "hexacopter"}[rows]
    words = [f"robot={robot}", "water=fossen", "controller=cascade", "guide=hover"]
    settings = run_settings(words)
    model, effects = build_model(settings)
    plant = build_plant(model, effects, settings.environment)
    centre = MassPropertyEstimator(plant.robot).at(stowed(model)).centre
    like, rng = torch.zeros(1, dtype=torch.float64), np.random.default_rng(3)
    allocation = Allocation(
        plant.layout,
        centre=centre,
        like=like,
        saturation=Saturation.priority,
        weights=np.array([1.0, 10, 10, 0.1]),
    )
    limit = torch.from_numpy(np.tile(plant.layout.limit, (2000, 1)))
    bounds = {"gain": limit * 0.0 + 1.0, "limit": limit, "low": -0.5 * limit}
    wrench = torch.from_numpy(rng.normal(size=(2000, 4)) * [30.0, 3.0, 3.0, 0.3])
    exact = allocation.commands(wrench, **bounds)
    _as_if_there(monkeypatch)
    ahead = allocation.commands(wrench, **bounds)
    far = ((ahead - exact).abs() / limit).amax(1)
    assert float((far > 1e-4).double().mean()) < 0.005
    assert bool((ahead <= limit * (1.0 + 1e-9)).all())
    assert bool((ahead >= -0.5 * limit * (1.0 + 1e-9)).all())


def test_what_was_tried_can_be_undone() -> None:
    """Networks and optimisers stand as before; what the optimisers began is zero."""
    from seals.learn.actor_critic import ActorCriticNetworks

    nets = ActorCriticNetworks(
        features=2,
        actions=1,
        hidden=[4],
        layer_norm=False,
        critics=2,
        learning_rate=1e-2,
        temperature=0.1,
        encoders={},
        device="cpu",
    )
    before = [tensor.detach().clone() for tensor in nets.updated_tensors()]
    for _ in range(2):
        nets.step("critics", nets.values(torch.ones(3, 2), torch.ones(3, 1)).sum())
        nets.polyak_update(0.5)
    assert not all(torch.equal(a, b) for a, b in zip(nets.updated_tensors(), before, strict=False))
    nets.restore_tensors(before)
    now = nets.updated_tensors()
    assert all(torch.equal(a, b) for a, b in zip(now, before, strict=False))
    assert len(now) > len(before)
    assert not any(bool(tensor.any()) for tensor in now[len(before) :])


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA device")
def test_a_recording_replays_the_law() -> None:
    """State, random numbers and what is told go on from replay to replay."""
    from seals.learn.recorded import Recorded

    noise = torch.Generator(device="cuda").manual_seed(0)

    def law(state: Any, given: Any) -> tuple[Any, Any]:
        after = state[0] + given
        return (after,), {
            "twice": after * 2.0,
            "noise": torch.rand(1, generator=noise, device="cuda"),
        }

    recorded = Recorded(law, (torch.zeros(1, device="cuda"),), torch.ones(1, device="cuda"), noise)
    told = [recorded(torch.full((1,), float(k), device="cuda")) for k in (1, 2, 3)]
    assert [float(each["twice"]) for each in told] == [2.0, 6.0, 12.0]
    assert len({float(each["noise"]) for each in told}) == 3
    assert float(recorded.state[0]) == 6.0
