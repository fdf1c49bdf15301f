"""A policy that sees, taught by critics that know: who learns with whom, and what is withheld."""

from __future__ import annotations

from typing import Any

import pytest

from seals.errors import ConfigError
from seals.learn.learner import Spaces

torch = pytest.importorskip("torch", reason="learning needs torch: pip install 'aam-seals[learn]'")
pytest.importorskip("torchrl", reason="learning needs torchrl: pip install 'aam-seals[learn]'")
torch.set_num_threads(1)

NAMES = ("target_x", "target_y", "target_z", "x", "y", "z")
SMALL: dict[str, Any] = {
    "hidden": [32, 32],
    "channels": 4,
    "strides": [2, 1],
    "batch": 32,
    "random_steps": 64,
    "capacity": 2000,
}


def _agent(**values: Any) -> Any:
    from seals.plugins.learners.visual_sac import VisualSAC

    spaces = Spaces(observation_size=6, action_size=3, count=8, pixels=(6, 12, 12), names=NAMES)
    return VisualSAC(**{**SMALL, **values}).start(spaces, device="cpu", seed=0)


def _practised(agent: Any, steps: int = 12) -> Any:
    from seals.testing.reaching import PointReach

    points = PointReach(8, size=12)
    seen = points.reset(list(range(8)))
    for _ in range(steps):
        action = agent.act(seen, explore=True)
        turn = points.step(action)
        agent.observe(seen, action, turn)
        seen = turn.observation
    return seen


LOOKING = [
    ({"critics_see": "state"}, {"actor": ["actor"]}),
    ({}, {"critics": ["critics"]}),
    ({"encoders": "two"}, {"critics": ["critics"], "actor": ["actor"]}),
]


@pytest.mark.parametrize(("values", "moved"), LOOKING)
def test_an_encoder_learns_with_those_who_look_through_it(
    values: dict[str, Any], moved: dict[str, list[str]]
) -> None:
    """A step of critics or actor moves its own layers of the picture, and no other ones."""
    agent = _agent(use_state=False, **values)
    _practised(agent)
    found: dict[str, list[str]] = {name: [] for name in agent.encoders}
    plain = agent.nets.step

    def step(name: str, loss: Any) -> None:
        before = {
            k: [x.detach().clone() for x in e.parameters()] for k, e in agent.encoders.items()
        }
        plain(name, loss)
        for k, encoder in agent.encoders.items():
            pairs = zip(before[k], encoder.parameters(), strict=True)
            if not all(torch.equal(a, b) for a, b in pairs):
                found[k].append(name)

    agent.nets.step = step
    agent.update()
    assert found == moved


def test_slow_critics_look_through_a_slow_encoder() -> None:
    """It follows that of the critics by the share tau, and values of a target are from it."""
    agent = _agent(use_state=False, tau=0.25)
    seen = _practised(agent)
    quick, slow = agent.encoders["critics"], agent.nets.slow_encoder
    with torch.no_grad():
        for x in quick.parameters():
            x.add_(1.0)
    before = [x.clone() for x in slow.parameters()]
    agent.nets.polyak_update(0.25)
    for was, now, aim in zip(before, slow.parameters(), quick.parameters(), strict=True):
        assert torch.allclose(now, was + 0.25 * (aim - was))
    inputs = agent._critic_inputs(seen, agent._actor_inputs(seen), slow=True)
    assert torch.equal(inputs, slow(seen["pixels"].float() / 255.0 - 0.5))


def test_critics_that_see_the_state_take_no_picture() -> None:
    """Their first layer has one weight for each number of state and action."""
    agent = _agent(use_state=False, critics_see="state")
    assert agent.nets.critics[0][0].in_features == 6 + 3
    assert agent.nets.actor[0].in_features == agent.learner.features


def test_what_is_withheld_changes_no_action() -> None:
    """A policy that may not see the target acts alike wherever it is, handed out as in training."""
    from seals.learn.networks import actor_of

    agent = _agent(use_pixels=False, withheld=["target"], critics_see="state")
    seen = _practised(agent)
    for _ in range(3):
        agent.update()
    other = {**seen, "state": seen["state"].clone()}
    other["state"][:, :3] += 1.0
    action = agent.act(seen, explore=False)
    assert torch.equal(action, agent.act(other, explore=False))
    other["state"][:, 3:] += 1.0
    assert not torch.equal(action, agent.act(other, explore=False))
    network, tensors = agent.policy()
    policy = actor_of(network)
    policy.load_state_dict(tensors)
    assert torch.allclose(policy(seen), action, atol=1e-6)
    assert network["pixels"]["columns"] == [3, 4, 5]


def test_a_name_that_is_not_there_cannot_be_withheld() -> None:
    """The nearest name is told."""
    with pytest.raises(ConfigError, match="no number of an observation is named 'tarjet_x'"):
        _agent(withheld=["tarjet_x"])


def test_something_must_be_left_to_see() -> None:
    """Neither pictures nor any number is nothing."""
    with pytest.raises(ConfigError, match="nothing is left to observe"):
        _agent(use_pixels=False, withheld=["target", "x", "y", "z"])
    assert _agent(withheld=["target", "x", "y", "z"]).nets.actor[0].in_features == 50


def test_critics_see_one_of_two() -> None:
    """Another word is refused."""
    with pytest.raises(ConfigError, match=r"learner\.critics_see=all"):
        _agent(critics_see="all")


def test_places_are_where_a_map_responds() -> None:
    """The right edge, the lower edge, and the middle of a map without a response, by hand."""
    from seals.learn.networks import feature_places

    maps = torch.zeros(2, 3, 9, 11)
    maps[0, 0, 8, 5] = maps[0, 1, 2, 10] = 50.0
    found = feature_places()(maps).reshape(2, 3, 3)
    wanted = torch.tensor([[0.0, 1.0, 0.0], [1.0, -0.5, 0.0], [50.0, 50.0, 0.0]])
    assert torch.allclose(found[0], wanted, atol=1e-5)
    assert torch.allclose(found[1], torch.zeros(3, 3), atol=1e-5)


def test_a_policy_by_places_is_handed_out_as_it_was_trained() -> None:
    """The built policy acts as the agent does; another way to pool is refused."""
    from seals.learn.networks import actor_of

    agent = _agent(use_state=False, pool="places")
    seen = _practised(agent)
    agent.update()
    network, tensors = agent.policy()
    actor = actor_of(network)
    actor.load_state_dict(tensors)
    with torch.no_grad():
        assert torch.allclose(actor(seen), agent.act(seen, explore=False), atol=1e-6)
    with pytest.raises(ConfigError, match=r"learner\.pool=mean"):
        _agent(pool="mean")
