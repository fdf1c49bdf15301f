"""Networks, squashed actions, scales of observations and rewards, shifted pictures."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seals.errors import ConfigError
from seals.learn.actor_critic import HIGHEST, LOWEST, TanhNormal
from seals.learn.network_agent import RunningNormaliser, transform_reward
from seals.learn.networks import actor_of, description, mlp, policy_of
from seals.learn.starts import first_weights, generator_of
from seals.plugins.learners.visual_sac import random_shift

torch = pytest.importorskip("torch")
pytest.importorskip("torchrl")
torch.set_num_threads(1)


def test_squashed_actions_have_the_density_of_their_transform() -> None:
    """The log density agrees with PyTorch's own normal distribution under a tanh transform."""
    output = torch.randn(500, 6, generator=generator_of(1, "cpu"))
    action, log_prob = TanhNormal(output).sample(generator_of(2, "cpu"))
    mean, raw = output.double().chunk(2, -1)
    deviation = (LOWEST + 0.5 * (HIGHEST - LOWEST) * (torch.tanh(raw) + 1.0)).exp()
    tanh = torch.distributions.TanhTransform()
    law = torch.distributions.TransformedDistribution(
        torch.distributions.Normal(mean, deviation), [tanh]
    )
    # where tanh is one to machine precision its inverse is not known
    inside = (action.abs() < 0.999).all(-1)
    assert int(inside.sum()) > 100
    wanted = law.log_prob(action.double()).sum(-1)
    assert float((log_prob - wanted)[inside].abs().max()) < 2e-3


def test_squashed_actions_keep_a_finite_density_at_the_edge() -> None:
    """A mean far outside gives the action 1 and a density that does not overflow."""
    action, log_prob = TanhNormal(torch.tensor([[30.0, -5.0]])).sample(generator_of(1, "cpu"))
    assert action.item() == 1.0
    assert bool(torch.isfinite(log_prob).all())


def test_running_scale_is_that_of_all_observations() -> None:
    """Batches of any size join to mean and variance of the whole, the prior included."""
    rows = np.random.default_rng(1).normal([3.0, -50.0], [0.1, 20.0], (1000, 2))
    running = RunningNormaliser(2, "cpu")
    for part in np.split(rows, [1, 2, 10, 600]):
        running.update(torch.from_numpy(part).float())
    state = running.layer
    # the prior: a hundredth of a row of mean 0 and variance 1
    mean = rows.sum(0) / 1000.01
    second = ((rows**2).sum(0) + 0.01) / 1000.01
    np.testing.assert_allclose(state.running_mean.numpy(), mean, rtol=1e-4)
    np.testing.assert_allclose(state.running_var.numpy(), second - mean**2, rtol=1e-3)
    shown = running.layer(torch.from_numpy(rows).float())
    np.testing.assert_allclose(shown.std(0).numpy(), 1.0, rtol=0.02)


@pytest.mark.parametrize(
    ("form", "values"),
    [
        ("plain", [-2.0, 0.0, 2e5]),
        ("symlog", [-np.log(3.0), 0.0, np.log1p(2e5)]),
        ("clip", [-1, 0, 1]),
    ],
)
def test_forms_of_a_reward(form: str, values: list[float]) -> None:
    """Rewards of -1, 0 and 1e5, doubled, in each form."""
    reward = torch.tensor([-1.0, 0.0, 1e5], dtype=torch.float64)
    np.testing.assert_allclose(
        transform_reward(reward, scale=2.0, form=form).numpy(), values, rtol=1e-12
    )


def test_a_shift_moves_whole_pictures() -> None:
    """Each picture is the original seen through a window moved by its own draw, edges repeated."""
    pixels = torch.randint(0, 255, (40, 2, 9, 7), dtype=torch.uint8)
    found = random_shift(pixels, most=3, generator=generator_of(4, "cpu"))
    assert found.dtype == torch.uint8
    padded = np.pad(pixels.numpy(), ((0, 0), (0, 0), (3, 3), (3, 3)), mode="edge")
    moves = set()
    for before, after in zip(padded, found.numpy(), strict=True):
        hits = [
            (i, j)
            for i in range(7)
            for j in range(7)
            if np.array_equal(before[:, i : i + 9, j : j + 7], after)
        ]
        assert len(hits) == 1
        moves.add(hits[0])
    # all 49 places are as likely as any: 40 draws that hit fewer than 15 would be no chance
    assert len(moves) >= 15
    assert random_shift(pixels, most=0, generator=generator_of(4, "cpu")) is pixels


@pytest.mark.parametrize("normalise", [True, False])
@pytest.mark.parametrize("squash", ["tanh", "clip"])
def test_a_policy_is_the_mean_of_its_actor(normalise: bool, squash: str) -> None:
    """The network handed out gives the squashed first outputs on normalised observations."""
    with first_weights(5):
        body = mlp(4, 6, [8, 8])
    running = RunningNormaliser(4, "cpu")
    running.update(torch.randn(50, 4) * 3.0 + 1.0)
    network = description(
        observation=4, action=3, hidden=[8, 8], normalise=normalise, squash=squash
    )
    told, tensors = policy_of(network, body=body, norm=running.layer if normalise else None)
    actor = actor_of(told)
    actor.load_state_dict(tensors)
    observation = torch.randn(20, 4) * 3.0
    state = running.layer
    seen = observation
    if normalise:
        seen = ((observation - state.running_mean) / (state.running_var + 1e-5).sqrt()).clamp(
            -10, 10
        )
    mean = body(seen)[:, :3]
    wanted = mean.tanh() if squash == "tanh" else mean.clamp(-1.0, 1.0)
    assert float((actor(observation) - wanted).detach().abs().max()) < 1e-5


def test_first_weights_come_from_the_seed_alone() -> None:
    """One seed means one network, and the global generator is left as it was."""
    torch.manual_seed(0)
    before = torch.get_rng_state()
    nets: list[Any] = []
    for seed in (3, 3, 4):
        with first_weights(seed):
            nets.append(mlp(4, 2, [8], layer_norm=True).state_dict())
    assert torch.equal(torch.get_rng_state(), before)
    assert all(torch.equal(nets[0][key], nets[1][key]) for key in nets[0])
    assert not all(torch.equal(nets[0][key], nets[2][key]) for key in nets[0])


@pytest.mark.parametrize(
    ("network", "words"),
    [
        ({"kind": "mpl"}, "Did you mean 'mlp'"),
        ({"kind": "mlp", "observation": 3}, "card.json"),
        ({"kind": "pixels", "observation": 3, "pixels": 3}, "card.json"),
    ],
)
def test_a_description_that_cannot_be_used_is_refused(network: Any, words: str) -> None:
    """An unknown kind and a missing key are refused in words."""
    with pytest.raises(ConfigError, match=words):
        actor_of(network)
