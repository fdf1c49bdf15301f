"""Our parts of learners against TorchRL's: equal weights and draws give equal results."""

from __future__ import annotations

from pathlib import Path

import pytest

torch = pytest.importorskip("torch", reason="learning needs torch: pip install 'aam-seals[learn]'")
pytest.importorskip("torchrl", reason="learning needs torchrl: pip install 'aam-seals[learn]'")

from tensordict import TensorDict  # noqa: E402  what follows needs it

from benchmarks import learning_parts as parts  # noqa: E402
from seals.learn.actor_critic import TanhNormal  # noqa: E402
from seals.learn.replay import Returns  # noqa: E402
from seals.learn.starts import generator_of  # noqa: E402

pytestmark = [
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    # TorchRL's loss of cloning has no targets, and says so of itself
    pytest.mark.filterwarnings("ignore:The name target_actor_network_params:UserWarning"),
]


def test_actions_are_those_of_torchrl() -> None:
    """The same noise gives the same actions, log-probabilities and slopes, to rounding."""
    output = torch.randn(500, 6, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    ours, theirs = (output.clone().requires_grad_() for _ in range(2))
    action, log_prob = TanhNormal(ours).sample(generator_of(4, "cpu"))
    torch.manual_seed(generator_of(4, "cpu").initial_seed())
    mean, deviation = parts.Spread(torch.nn.Identity())(theirs)
    law = parts.TorchrlTanhNormal(mean, deviation, low=-1.0, high=1.0, tanh_loc=False)
    other = law.rsample()
    # where tanh is 1 to the last digit, TorchRL cuts off what it takes the logarithm of
    inside = action.detach().abs().amax(-1) < 1.0 - 1e-6
    assert int(inside.sum()) > 400
    assert torch.allclose(action, other, atol=1e-12)
    assert torch.allclose(log_prob[inside], law.log_prob(other)[inside], atol=1e-6)
    for found in (log_prob, law.log_prob(other)):
        found[inside].sum().backward()
    assert torch.allclose(ours.grad, theirs.grad, rtol=1e-4, atol=1e-6)


def test_losses_of_sac_are_those_of_torchrl() -> None:
    """Critics', actor's and temperature's losses, and the slopes of all weights, agree."""
    ours, rows = parts.agent(), parts.transitions(200)
    (loss, _soft), batch = parts.loss_of(ours), TensorDict(rows, batch_size=[200])
    ours.generator.manual_seed(11)
    seen = batch["observation"]
    aim = ours._td_target(batch["reward"], batch["discount"], batch["next_observation"])
    critic = (ours.nets.values(seen, batch["action"]) - aim).square().mean(-1).sum()
    action, log_prob = TanhNormal(ours.nets.actor(seen)).sample(ours.generator)
    actor = (ours.nets.alpha * log_prob - ours.nets.values(seen, action).min(0).values).mean()
    torch.manual_seed(11)
    found = loss(parts.theirs_of(rows))
    assert float(found["loss_qvalue"].detach()) == pytest.approx(float(critic.detach()), rel=1e-5)
    assert float(found["loss_actor"].detach()) == pytest.approx(float(actor.detach()), rel=1e-5)
    assert float(found["entropy"].detach()) == pytest.approx(
        -float(log_prob.detach().mean()), rel=1e-5
    )
    pairs = [(critic, "loss_qvalue", "critics"), (actor, "loss_actor", "actor")]
    for own, name, group in pairs:
        weights = ours.nets._learned[group]
        slopes = torch.autograd.grad(own, weights, retain_graph=True)
        loss.zero_grad()
        found[name].backward(retain_graph=True)
        moved = [p.grad for p in loss.parameters() if p.grad is not None and p.numel() > 1]
        whole = torch.sort(torch.cat([s.flatten() for s in slopes])).values
        other = torch.sort(torch.cat([s.flatten() for s in moved])).values
        assert whole.shape == other.shape
        assert torch.allclose(whole, other, rtol=1e-3, atol=1e-5)


def test_returns_over_several_steps_are_those_of_torchrl() -> None:
    """Twelve steps of sixty-four environments, a tenth of which ends: rewards and states."""
    ours = Returns(length=parts.STEPS, gamma=parts.GAMMA)
    theirs = parts.MultiStepTransform(n_steps=parts.STEPS, gamma=parts.GAMMA)
    found, other = [], []
    for seed in range(12):
        step = parts.transitions(parts.ENVIRONMENTS, seed=seed)
        found.append(parts.pushed(ours, step))
        other.append(theirs.inv(parts.stepped(step).clone()))
    # theirs come out one call later
    pairs = list(zip(found[2:], other[3:], strict=False))
    assert len(pairs) == 9
    for own, given in pairs:
        assert torch.allclose(own["reward"], given["next", "reward"][:, 0, 0], atol=1e-6)
        for name, key in (
            ("observation", "observation"),
            ("action", "action"),
            ("next_observation", ("next", "observation")),
        ):
            assert torch.equal(own[name], given[key][:, 0])
        # where no episode ended on the way
        going = own["discount"] > 0.0
        assert torch.allclose(own["discount"][going], given["gamma"][:, 0][going])


def test_the_loss_of_cloning_is_that_of_torchrl() -> None:
    """Value and slopes, on the same steps."""
    ours = parts.cloner()
    theirs = parts.cloning_loss(ours)
    steps = {name: values[:300] for name, values in ours.shown.items()}
    own = ours._loss(steps)
    other = theirs(TensorDict(steps, batch_size=[300]))["loss_bc"]
    assert float(own.detach()) == pytest.approx(float(other.detach()), rel=1e-6)
    own.backward()
    other.backward()
    pairs = zip(ours.body.parameters(), theirs.parameters(), strict=True)
    assert all(torch.allclose(a.grad, b.grad, rtol=1e-4, atol=1e-7) for a, b in pairs)


def test_normalised_observations_are_those_of_torchrl() -> None:
    """After twenty steps of sixty-four environments, but for what ours starts with."""
    generator = torch.Generator().manual_seed(2)
    ours = parts.RunningNormaliser(parts.SEEN, "cpu")
    theirs = parts.VecNormV2(in_keys=["observation"], decay=1.0, reduce_batch_dims=True)
    for _ in range(20):
        seen = 3.0 + 2.0 * torch.randn(64, parts.SEEN, generator=generator)
        ours.update(seen)
        given = TensorDict({"observation": seen}, batch_size=[64])
        other = theirs._step(given, given.copy())["observation"]
    assert torch.allclose(ours.layer(seen), other, atol=2e-3)


def test_lines_are_counted_without_words(tmp_path: Path) -> None:
    """Docstrings, comments and blank lines are lines, not code."""
    file = tmp_path / "one.py"
    file.write_text('"""Words.\n\nMore."""\n\n# why\nx = (\n    1\n)\n')
    assert parts.lines_of(file) == (8, 3)
    assert parts.counted()["learners"][0] > 500


def test_parts_can_be_measured() -> None:
    """Each part runs, on both sides where TorchRL has it; rates are above zero."""
    every = (parts.drawing(), parts.updates(), parts.cloning(), parts.scaling())
    for part in (*parts.memories(), *every):
        assert parts.rate(part.own, 0.01) > 0.0
        assert part.theirs is None or parts.rate(part.theirs, 0.01) > 0.0
