"""Training in turns: hunter and prey each learn against all earlier policies of the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from seals.experiments.self_play.pursuit import (
    HUNTER,
    PREY,
    ROLES,
    SAYS,
    SEEN,
    Pursuit,
    Scripted,
    Squad,
)
from seals.learn.demonstrations.episode import Demonstrations, Origin, Who
from seals.learn.demonstrations.recording import record
from seals.learn.learner import Spaces
from seals.learn.metadata import config_hash
from seals.learn.policy import Policy, load_policy
from seals.learn.training.checkpoint import has_checkpoint
from seals.learn.training.loop import POLICY, Training, stopping, take_up
from seals.learn.training.schedule import TrainingSchedule
from seals.logs.run_folder import held
from seals.plugins.learners.sac import SAC

TURN = 65_536
"""Control steps of a turn of one role."""
COUNT = 256
"""Pursuits at once."""
SHOWN = 128
"""Episodes that scripts show each role at first."""
NOISE = 0.3
"""Deviation of what is added to their actions [1]."""
LEARNER: Mapping[str, Any] = {
    "gamma": 0.97,
    "learning_rate": 1e-3,
    "steps": 3,
    "layer_norm": True,
    "temperature": 0.05,
    "capacity": 400_000,
    "random_steps": 2560,
    "ratio": 0.12,
    "demonstrations": "buffer",
    "share": 0.25,
}
"""Of both: as in the recipe ``rlpd``, with fewer updates a step and fewer demonstrations."""


class Player:
    """One role with its training, which goes on from turn to turn.

    Args:
        role: of it.
        folder: of its training.
        seed: of weights, noise and starts.
        turn: control steps of a turn.

    Raises:
        ConfigError: in the folder is a training of another seed or length of turns.
    """

    def __init__(self, role: str, folder: Path, *, seed: int, turn: int) -> None:
        """Begin, or take up where an earlier process was stopped."""
        self.folder, self.turn = folder, turn
        self.pursuit = Pursuit(role, count=COUNT, seed=seed)
        self.script = Scripted(role, self.pursuit.game)
        spaces = Spaces(observation_size=SEEN[role], action_size=SAYS[role], count=COUNT)
        agent: Any = SAC(**LEARNER).start(spaces, device="cpu", seed=seed)
        facts = {"env": "pursuit", "role": role, "learner": "sac", "seed": seed}
        self.training = Training(
            self.pursuit,
            agent,
            course=TrainingSchedule(steps=0, look_every=turn, log_every=turn // 5, keep=True),
            folder=folder,
            metadata={**facts, "config_hash": config_hash({**facts, **LEARNER, "turn": turn})},
            seed=seed,
        )
        if has_checkpoint(folder):
            take_up(self.training, device="cpu")
        else:
            # what the script does, with noise, against the other one
            episodes = record(self.pursuit, self.script, range(SHOWN), noise=NOISE)
            origin = Origin(env="pursuit", config_hash="", who=Who.scripted, by="scripted")
            shown = Demonstrations(origin=origin, episodes=episodes)
            agent.add_demonstrations(dict(shown.transitions()))

    def policies(self, turns: int) -> list[Policy]:
        """Return the script and what was learned after each of so many turns.

        Args:
            turns: that count; 0 for the script alone.
        """
        learned = [load_policy(self.folder / f"{POLICY}_{k * self.turn}") for k in _turns_of(turns)]
        return [self.script, *learned]

    def play(self, number: int, opponents: Sequence[Policy]) -> None:
        """Learn for one turn, unless it is done: half against the newest, half against all.

        Args:
            number: of the turn, from 1 on.
            opponents: policies of the other role, the newest last.
        """
        if self.training.step >= number * self.turn:
            return
        newest = len(opponents) - 1
        rows = [newest if k % 2 else (k // 2) % len(opponents) for k in range(COUNT)]
        self.pursuit.opponent = Squad(opponents, rows)
        self.training.course = replace(self.training.course, steps=number * self.turn)
        with stopping(self.training):
            # the end of a turn is not that of the training
            self.training.run(over=False)
        self.training.write()


def _turns_of(turns: int) -> range:
    """Return the turns after which a policy was kept, the untrained one of turn 0 apart."""
    return range(1, turns + 1)


def play(folder: Path, *, turns: int, steps: int, seed: int) -> dict[str, Player]:
    """Train both in turns, the hunter first; the same call goes on where it was stopped.

    Args:
        folder: of both trainings.
        turns: of each.
        steps: control steps of a turn, a multiple of `COUNT`.
        seed: of both.

    Raises:
        ConfigError: the folder holds other trainings, or is in use.
    """
    with held(folder):
        return _played(folder, turns=turns, steps=steps, seed=seed)


def _played(folder: Path, *, turns: int, steps: int, seed: int) -> dict[str, Player]:
    players = {role: Player(role, folder / role, seed=seed, turn=steps) for role in ROLES}
    hunter, prey = players[HUNTER], players[PREY]
    for number in _turns_of(turns):
        hunter.play(number, prey.policies(number - 1))
        prey.play(number, hunter.policies(number))
        print(f"turn {number} of {turns} is over", flush=True)
    return players
