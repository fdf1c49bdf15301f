"""Parts of learners beside those of TorchRL: ``python benchmarks/learning_parts.py``.

One core, single precision, the sizes of ``env=reach``: 25 numbers observed, three actions, two
hidden layers of 128, batches of 256. Rates are calls a second, the median of blocks that
alternate. ``tests/unit/test_learn_parts.py`` holds the results against each other. ``--lines``
counts the lines of all code for learning instead, folder by folder.
"""

from __future__ import annotations

import argparse
import ast
import copy
import io
import logging
import math
import statistics
import time
import tokenize
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import torch  # noqa: TID253  it measures nothing else
from tensordict import TensorDict
from tensordict.nn import TensorDictModule
from torchrl.data import LazyTensorStorage, TensorDictReplayBuffer
from torchrl.data.replay_buffers.samplers import PrioritizedSampler, RandomSampler
from torchrl.envs.transforms import MultiStepTransform
from torchrl.envs.transforms.vecnorm import VecNormV2
from torchrl.modules import Actor, ProbabilisticActor, ValueOperator
from torchrl.modules import TanhNormal as TorchrlTanhNormal
from torchrl.objectives import BCLoss, SACLoss, SoftUpdate

import seals.learn
import seals.plugins.learners
from seals.learn.actor_critic import HIGHEST, LOWEST, TanhNormal
from seals.learn.learner import Spaces
from seals.learn.network_agent import RunningNormaliser
from seals.learn.replay import Memory, Prioritised, Returns, Sampler
from seals.learn.starts import generator_of
from seals.plugins.learners.bc import BC, BcAgent
from seals.plugins.learners.sac import SAC, SacAgent

SEEN, ACTIONS, BATCH, GAMMA = 25, 3, 256, 0.98
ENVIRONMENTS = 64
"""Rows that are written at once."""
ROWS = 100_000
"""Transitions of a full memory."""
STEPS = 3
"""Most steps of a transition."""
BLOCKS = 7
FOLDERS = (Path(seals.plugins.learners.__path__[0]), Path(seals.learn.__path__[0]))
"""What is code for learning."""


class Part(NamedTuple):
    """Part of a learner.

    Args:
        name: what it does.
        own: one call of ours.
        theirs: one call of TorchRL's, None where it cannot be made here.
    """

    name: str
    own: Callable[[], Any]
    theirs: Callable[[], Any] | None


class Spread(torch.nn.Module):
    """Mean and deviation of actions from the output of a network, bounded as ours."""

    def __init__(self, network: torch.nn.Module) -> None:
        """Keep the network."""
        super().__init__()
        self.network = network

    def forward(self, seen: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return mean and deviation, shape (batch, a) each."""
        mean, raw = self.network(seen).chunk(2, -1)
        return mean, (LOWEST + 0.5 * (HIGHEST - LOWEST) * (torch.tanh(raw) + 1.0)).exp()


class Valued(torch.nn.Module):
    """Critic that takes observation and action apart."""

    def __init__(self, network: torch.nn.Module) -> None:
        """Keep the network."""
        super().__init__()
        self.network = network

    def forward(self, seen: torch.Tensor, action: torch.Tensor) -> torch.Tensor:
        """Return values, shape (batch, 1)."""
        return self.network(torch.cat([seen, action], -1))


def agent(seed: int = 0) -> SacAgent:
    """Return a fresh agent of SAC."""
    learner = SAC(
        hidden=[128, 128], batch=BATCH, gamma=GAMMA, normalise=False, temperature=0.2, steps=1
    )
    spaces = Spaces(observation_size=SEEN, action_size=ACTIONS, count=ENVIRONMENTS)
    return learner.start(spaces, device="cpu", seed=seed)


def loss_of(ours: SacAgent) -> tuple[SACLoss, SoftUpdate]:
    """Return TorchRL's loss with copies of an agent's networks, and what moves its targets."""
    spread = TensorDictModule(
        Spread(copy.deepcopy(ours.nets.actor)), in_keys=["observation"], out_keys=["loc", "scale"]
    )
    actor = ProbabilisticActor(
        spread,
        in_keys=["loc", "scale"],
        distribution_class=TorchrlTanhNormal,
        distribution_kwargs={"low": -1.0, "high": 1.0, "tanh_loc": False},
        return_log_prob=True,
    )
    critics = [
        ValueOperator(Valued(copy.deepcopy(critic)), in_keys=["observation", "action"])
        for critic in ours.nets.critics
    ]
    loss = SACLoss(
        actor,
        critics,
        num_qvalue_nets=len(critics),
        loss_function="l2",
        alpha_init=float(ours.nets.alpha),
        target_entropy=ours.learner.entropy * ACTIONS,
        delay_qvalue=True,
    )
    loss.make_value_estimator(gamma=GAMMA)
    return loss, SoftUpdate(loss, tau=ours.learner.tau)


def transitions(count: int, *, seed: int = 1) -> dict[str, torch.Tensor]:
    """Return random transitions as our memory takes them, a tenth of them terminated."""
    generator = torch.Generator().manual_seed(seed)
    numbers = torch.randn(count, 2 * SEEN + ACTIONS + 1, generator=generator)
    ended = torch.rand(count, generator=generator) < 0.1
    return {
        "observation": numbers[:, :SEEN].contiguous(),
        "next_observation": numbers[:, SEEN : 2 * SEEN].contiguous(),
        "action": torch.tanh(numbers[:, 2 * SEEN : -1]),
        "reward": numbers[:, -1].contiguous(),
        "discount": GAMMA * (~ended).float(),
    }


def theirs_of(rows: dict[str, torch.Tensor]) -> TensorDict:
    """Return the same transitions as TorchRL's losses take them."""
    ended = (rows["discount"] == 0.0)[:, None]
    after = {
        "observation": rows["next_observation"],
        "reward": rows["reward"][:, None],
        "done": ended,
        "terminated": ended,
    }
    given = {"observation": rows["observation"], "action": rows["action"], "next": after}
    return TensorDict(given, batch_size=[len(ended)])


def memories() -> list[Part]:
    """Write a step of all environments and draw a batch, evenly and by priority."""
    rows, step = transitions(ROWS), transitions(ENVIRONMENTS)
    law = {"alpha": 0.6, "beta": 0.4, "anneal": 1000, "epsilon": 0.01, "bonus": 1.0}
    found = []
    for name, sampler in (("even", Sampler()), ("by priority", Prioritised(**law))):
        memory = Memory(
            capacity=ROWS, sampler=sampler, device="cpu", generator=generator_of(0, "cpu")
        )
        memory.add(rows)

        def own(memory: Memory = memory) -> None:
            memory.add(step)
            batch = memory.sample(BATCH)
            memory.update_priorities(batch, batch["reward"])

        found.append(Part(f"replay, {name}", own, _replay(rows, step, even=name == "even")))
    return found


def _replay(rows: Any, step: Any, *, even: bool) -> Callable[[], Any] | None:
    """Return the same by TorchRL's buffer; None without its compiled sum tree."""
    try:
        sampler = RandomSampler() if even else PrioritizedSampler(ROWS, alpha=0.6, beta=0.4)
    except RuntimeError:
        return None
    buffer = TensorDictReplayBuffer(storage=LazyTensorStorage(ROWS), sampler=sampler)
    buffer.extend(TensorDict(rows, batch_size=[ROWS]))

    def theirs() -> None:
        buffer.extend(TensorDict(step, batch_size=[ENVIRONMENTS]))
        batch = buffer.sample(BATCH)
        if not even:
            buffer.update_priority(batch["index"], batch["reward"].abs())

    return theirs


def drawing() -> Part:
    """Draw actions with their log-probability."""
    output = torch.randn(BATCH, 2 * ACTIONS)
    generator = generator_of(0, "cpu")
    spread = Spread(torch.nn.Identity())

    def theirs() -> Any:
        mean, deviation = spread(output)
        law = TorchrlTanhNormal(mean, deviation, low=-1.0, high=1.0, tanh_loc=False)
        action = law.rsample()
        return action, law.log_prob(action)

    return Part(
        "actions and log-probabilities", lambda: TanhNormal(output).sample(generator), theirs
    )


def updates() -> Part:
    """Update critics, actor, temperature and target critics on a batch."""
    ours, rows = agent(), transitions(BATCH)
    batch, (loss, soft) = TensorDict(rows, batch_size=[BATCH]), loss_of(ours)
    optimiser = torch.optim.Adam(loss.parameters(), lr=ours.learner.learning_rate, fused=True)
    given = theirs_of(rows)

    def theirs() -> None:
        found = loss(given)
        optimiser.zero_grad(set_to_none=True)
        (found["loss_actor"] + found["loss_qvalue"] + found["loss_alpha"]).backward()
        optimiser.step()
        soft.step()

    return Part("update of SAC", lambda: ours._update_networks(batch), theirs)


def cloner() -> BcAgent:
    """Return an agent of behaviour cloning that was shown twenty random episodes."""
    spaces = Spaces(observation_size=SEEN, action_size=ACTIONS, count=ENVIRONMENTS)
    learner = BC(hidden=[128, 128], batch=BATCH, updates=10**9, look=10**9, normalise=False)
    found, shown = learner.start(spaces, device="cpu", seed=0), transitions(4000)
    found.add_demonstrations({**shown, "episode": torch.arange(4000) // 200})
    return found


def cloning_loss(ours: BcAgent) -> BCLoss:
    """Return TorchRL's loss with a copy of an agent's network."""
    body = torch.nn.Sequential(copy.deepcopy(ours.body), torch.nn.Tanh())
    return BCLoss(Actor(body, in_keys=["observation"]), loss_function="l2")


def cloning() -> Part:
    """Clone behaviour: draw a batch of demonstrations, and one step of the optimiser."""
    ours = cloner()
    loss, shown = cloning_loss(ours), TensorDict(ours.shown, batch_size=[len(ours.shown["action"])])
    optimiser = torch.optim.AdamW(loss.parameters(), lr=1e-3, weight_decay=1e-4)

    def theirs() -> None:
        found = loss(shown[torch.randint(len(shown), (BATCH,))])["loss_bc"]
        optimiser.zero_grad(set_to_none=True)
        found.backward()
        optimiser.step()

    return Part("update of behaviour cloning", ours.update, theirs)


def scaling() -> Part:
    """Take a step's observations into their running mean and variance, and normalise them."""
    ours, seen = RunningNormaliser(SEEN, "cpu"), transitions(ENVIRONMENTS)["observation"]
    other = VecNormV2(in_keys=["observation"], decay=1.0, reduce_batch_dims=True)
    given = TensorDict({"observation": seen}, batch_size=[ENVIRONMENTS])

    def own() -> torch.Tensor:
        ours.update(seen)
        return ours.layer(seen)

    return Part("running mean and variance", own, lambda: other._step(given, given.copy()))


def several() -> Part:
    """Make transitions of three steps of a step of all environments."""
    step, transform = transitions(ENVIRONMENTS), MultiStepTransform(n_steps=STEPS, gamma=GAMMA)
    ours, given = Returns(length=STEPS, gamma=GAMMA), stepped(step)
    return Part(
        "returns over three steps", lambda: pushed(ours, step), lambda: transform.inv(given)
    )


def stepped(step: dict[str, torch.Tensor]) -> TensorDict:
    """Return a step of all environments as TorchRL collects it, shape (environments, 1)."""
    return theirs_of(step).unsqueeze(1)


def pushed(returns: Returns, step: dict[str, torch.Tensor]) -> dict[str, Any] | None:
    """Push a step of all environments; return the transitions that it completes."""
    ended = step["discount"] == 0.0
    return returns.push(
        step["observation"],
        step["action"],
        reward=step["reward"],
        terminated=ended,
        truncated=torch.zeros_like(ended),
        final=step["next_observation"],
    )


def rate(call: Callable[[], Any], seconds: float) -> float:
    """Return calls a second over so many seconds of the processor."""
    count, began = 0, time.process_time()
    while time.process_time() - began < seconds:
        call()
        count += 1
    return count / (time.process_time() - began)


def measured(part: Part, seconds: float) -> tuple[float, float]:
    """Return the median rates of both [1/s], NaN for what cannot be made here."""
    rates: list[tuple[float, float]] = []
    for _ in range(BLOCKS):
        other = math.nan if part.theirs is None else rate(part.theirs, seconds)
        rates.append((rate(part.own, seconds), other))
    own, other = (statistics.median(column) for column in zip(*rates, strict=True))
    return own, other


def lines_of(file: Path) -> tuple[int, int]:
    """Return the lines of a file, and those of them that are code: no docstring, no comment."""
    text = file.read_text(encoding="utf-8")
    skipped = {
        line
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)
    }
    kinds = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT)
    code = {
        line
        for token in tokenize.generate_tokens(io.StringIO(text).readline)
        if token.type not in (*kinds, tokenize.ENDMARKER)
        for line in range(token.start[0], token.end[0] + 1)
    }
    return len(text.splitlines()), len(code - skipped)


def counted() -> dict[str, tuple[int, int]]:
    """Return lines and lines of code of all code for learning, by folder."""
    found: dict[str, tuple[int, int]] = {}
    for root in FOLDERS:
        for file in sorted(root.rglob("*.py")):
            name = (Path(root.name) / file.relative_to(root)).parent.as_posix()
            lines, code = lines_of(file)
            before = found.get(name, (0, 0))
            found[name] = before[0] + lines, before[1] + code
    return found


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=0.5, help="of a block")
    parser.add_argument("--lines", action="store_true", help="count lines, measure nothing")
    given = parser.parse_args()
    if given.lines:
        print("| folder | lines | of code |\n|---|---|---|")
        every = counted()
        whole = tuple(map(sum, zip(*every.values(), strict=True)))
        for name, (lines, code) in {**every, "all": whole}.items():
            print(f"| `{name}` | {lines:,} | {code:,} |")
        return
    torch.set_num_threads(1)
    logging.getLogger("torchrl").setLevel(logging.ERROR)
    print("| part | own [1/s] | TorchRL [1/s] | own / TorchRL |\n|---|---|---|---|")
    for part in (*memories(), several(), drawing(), updates(), cloning(), scaling()):
        own, other = measured(part, given.seconds)
        there = math.isfinite(other)
        told = (f"{other:,.0f}", f"{own / other:.1f}") if there else ("not in this wheel", "")
        print(f"| {part.name} | {own:,.0f} | {told[0]} | {told[1]} |")


if __name__ == "__main__":
    main()
