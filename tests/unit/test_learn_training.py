"""The loop of a training: rows, checkpoints, a kill and what follows, an early end."""

from __future__ import annotations

import copy
import csv
import os
import pickle
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.errors import ConfigError
from seals.learn.learner import Spaces
from seals.learn.networks import description
from seals.learn.policy import load_policy
from seals.learn.starts import validation_seeds
from seals.learn.training.checkpoint import FILE, read_checkpoint, write_checkpoint
from seals.learn.training.loop import Rows, Training
from seals.learn.training.schedule import TrainingSchedule
from seals.learn.training.scoring import score
from seals.plugins.learners.bc import BC
from seals.plugins.learners.dagger import Dagger
from seals.plugins.learners.ppo import PPO
from seals.plugins.learners.sac import SAC
from seals.schema import check_tree
from seals.testing.reaching import PointReach, demonstrations

torch = pytest.importorskip("torch")
pytest.importorskip("torchrl")
torch.set_num_threads(1)

SMALL: dict[str, Any] = {"hidden": [16, 16], "batch": 32, "capacity": 300, "random_steps": 40}
SHOWN: dict[str, Any] = {"demonstrations": "buffer", "steps": 3, "alpha": 0.6, "one_step": 1.0}
LEARNERS = {
    "sac": SAC(**SMALL),
    "sacfd": SAC(**SMALL, **SHOWN, pretrain=10),
    "ppo": PPO(hidden=[16], horizon=8),
    "dagger": Dagger(hidden=[16], batch=32, ratio=1, capacity=300, led=20),
}


def training_of(
    learner: Any,
    folder: Path,
    *,
    course: TrainingSchedule | None = None,
    count: int = 4,
    seed: int = 1,
) -> Training:
    """Return a training among points that are to reach others."""
    spaces = Spaces(observation_size=6, action_size=3, count=count)
    agent = learner.start(spaces, device="cpu", seed=seed)
    if agent.wants == "must":
        agent.add_demonstrations(demonstrations(4))
    return Training(
        PointReach(count),
        agent,
        course=course
        or TrainingSchedule(steps=400, look_every=200, log_every=50, episodes=4, checkpoint=0.0),
        folder=folder,
        eval_env=PointReach(4),
        metadata={"learner": "toy", "config_hash": "0"},
        seed=seed,
    )


def table(path: Path) -> list[dict[str, str]]:
    """Read a CSV file."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def losses(training: Training, count: int) -> list[float]:
    """Go on with a training until some updates are made; return every figure they told."""
    told: list[float] = []
    update = training.agent.update

    def heard() -> Any:
        figures = update()
        told.extend(float(value) for value in figures.values())
        return figures

    training.agent.update = heard  # type: ignore[method-assign]
    enough = training.updates + count
    training.course.steps = training.step
    while training.updates < enough:
        training.course.steps += training.environment.count
        training.run()
    return told


@pytest.mark.thorough
@pytest.mark.parametrize("name", LEARNERS)
def test_a_training_goes_on_bit_by_bit(tmp_path: Path, name: str) -> None:
    """At least 20 updates after a checkpoint tell the figures of a training never cut off."""
    first = training_of(LEARNERS[name], tmp_path / "first")
    first.run()
    first.write()
    kept = read_checkpoint(tmp_path / "first", device="cpu")
    second = training_of(LEARNERS[name], tmp_path / "second")
    assert second.resume(kept) == []
    assert (second.step, second.updates) == (first.step, first.updates)
    one, two = losses(first, 20), losses(second, 20)
    assert len(one) >= 20
    assert one == two
    other = losses(training_of(LEARNERS[name], tmp_path / "third", seed=2), 20)
    assert one[: len(other)] != other[: len(one)]


SCRIPT = """
import sys
from pathlib import Path
import torch
torch.set_num_threads(1)
from seals.learn.learner import Spaces
from seals.learn.training.checkpoint import read_checkpoint
from seals.learn.training.schedule import TrainingSchedule
from seals.learn.training.loop import STOP, Training
from seals.learn.training.loop import take_up
from seals.plugins.learners.sac import SAC
from seals.testing.reaching import PointReach

def train(folder, resume):
    learner = SAC(hidden=[16, 16], batch=32, capacity=3000, random_steps=40)
    agent = learner.start(Spaces(observation_size=6, action_size=3, count=4), device="cpu", seed=1)
    course = TrainingSchedule(steps=800, look_every=200, log_every=20, episodes=4, checkpoint=0.2)
    envs = PointReach(4), PointReach(4)
    training = Training(envs[0], agent, course=course, folder=folder, eval_env=envs[1], seed=1)
    if resume:
        training.resume(read_checkpoint(folder, device="cpu"))
    training.run()

for word in sys.argv[1:]:
    how, _, folder = word.partition("=")
    train(Path(folder), how == "resume")
"""


@pytest.mark.thorough
def test_a_killed_training_ends_like_one_that_was_left_alone(tmp_path: Path) -> None:
    """After SIGKILL at any time both curves are those of a training in one go, but for the time."""
    script = tmp_path / "train.py"
    script.write_text(textwrap.dedent(SCRIPT), encoding="utf-8")

    def start(*words: str) -> subprocess.Popen[bytes]:
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
        return subprocess.Popen([sys.executable, str(script), *words], env=environment)

    whole, cut = tmp_path / "whole", tmp_path / "cut"
    whole.mkdir()
    cut.mkdir()
    process = start(f"new={cut}")
    deadline = time.monotonic() + 120.0
    rows, kept = cut / "training.csv", cut / FILE

    def ready() -> bool:
        return kept.is_file() and rows.is_file() and len(table(rows)) >= 12

    while time.monotonic() < deadline and not ready():
        assert process.poll() is None
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert kept.is_file()
    # one process: what takes longest is its start
    assert start(f"resume={cut}", f"new={whole}").wait() == 0
    for name in ("training.csv", "evaluation.csv"):
        one, two = (table(folder / name) for folder in (whole, cut))
        for row in (*one, *two):
            del row["seconds"]
        assert one == two
        assert len(one) > 3
    assert not kept.exists()


def test_rows_of_an_earlier_life_are_told_once(tmp_path: Path) -> None:
    """After a resume the rows behind the checkpoint go, a half-written one and its own step too."""
    path = tmp_path / "a.csv"
    rows = Rows(path, ["step", "loss"])
    for step in (10, 20, 30):
        rows.append({"step": step, "loss": 1.0 / step, "unheard": 3})
    assert rows.count == 3
    with path.open("a", encoding="utf-8") as file:
        file.write("40")
    again = Rows(path, ["step", "loss"], keep=2)
    again.append({"step": 21})
    assert (path.read_text(), again.count) == ("step,loss\n10,0.1\n20,0.05\n21,\n", 3)
    # 2 is how 25 began, and 0.1 how its figure did
    path.write_text("step,loss\n10,0.1\n2,0.1")
    Rows(path, ["step", "loss"], keep=1)
    assert path.read_text() == "step,loss\n10,0.1\n"
    with pytest.raises(ConfigError, match="1 of 2 rows"):
        Rows(path, ["step", "loss"], keep=2)
    assert path.read_text() == "step,loss\n10,0.1\n"


@pytest.mark.parametrize("where", ["before", "behind"])
def test_the_row_of_the_step_that_is_kept_stands_once(where: str, tmp_path: Path) -> None:
    """A checkpoint between two updates stands before its step's row, one after them behind it."""
    course = TrainingSchedule(steps=100, look_every=100, log_every=20, episodes=4, checkpoint=0.0)
    first = training_of(LEARNERS["sac"], tmp_path, course=course)
    after, kept = first._log_evaluate_save, {}

    def heard() -> None:
        if first.step >= 60 and where == "before":
            kept.setdefault("state", copy.deepcopy(first.state()))
        after()
        if first.step >= 60 and where == "behind":
            kept.setdefault("state", copy.deepcopy(first.state()))

    first._log_evaluate_save = heard  # type: ignore[method-assign]
    first.run()
    whole = [row["step"] for row in table(tmp_path / "training.csv")]
    second = training_of(LEARNERS["sac"], tmp_path, course=course)
    second.resume(kept["state"])
    second.run()
    assert [row["step"] for row in table(tmp_path / "training.csv")] == whole


def test_curves_begin_before_learning_and_end_at_the_budget(tmp_path: Path) -> None:
    """The first evaluation is at step 0 with no update, the last one at the last step."""
    outcome = training_of(SAC(**SMALL), tmp_path).run()
    rows = table(tmp_path / "evaluation.csv")
    assert [int(row["step"]) for row in rows] == [0, 200, 400]
    assert (rows[0]["updates"], rows[-1]["updates"]) == ("0", str(outcome.updates))
    # half an update a step, after 40 random ones
    assert outcome.updates == 180
    assert {"step", "seconds", "updates", "episodes", "success", "return"} <= set(rows[0])
    assert table(tmp_path / "training.csv")[0]["step"] == "52"


def test_cloning_looks_before_and_after(tmp_path: Path) -> None:
    """Without steps of its own a learner makes all its updates and stands at the budget."""
    outcome = training_of(BC(hidden=[16], batch=32, updates=120, look=20), tmp_path).run()
    assert (outcome.step, outcome.updates) == (400, 120)
    assert [row["step"] for row in table(tmp_path / "evaluation.csv")] == ["0", "400"]
    assert [row["updates"] for row in table(tmp_path / "training.csv")] == ["50", "100"]


def test_a_training_ends_when_it_is_good_enough(tmp_path: Path) -> None:
    """A policy that reaches every target ends its training after two evaluations in a row."""

    class Expert:
        """Does what the script does."""

        interactive, wants, reports = True, "no", ()

        def __init__(self, environment: PointReach) -> None:
            self.environment = environment

        def act(self, observation: Any, *, explore: bool) -> Any:
            return self.environment.scripted_policy()

        def observe(self, *_: Any) -> None:
            """Learn nothing."""

        def due(self) -> int:
            return 0

        def policy(self) -> Any:
            # one layer that takes the way to the target, in steps of 0.1 m
            way = torch.cat([-torch.eye(3), torch.eye(3)], 1) / 0.1
            network = description(
                observation=6, action=3, hidden=[], normalise=False, squash="clip"
            )
            return network, {"0.0.weight": way, "0.0.bias": torch.zeros(3)}

    environment = PointReach(4)
    expert: Any = Expert(environment)
    course = TrainingSchedule(
        steps=4000, look_every=40, episodes=4, stop_at=1.0, in_a_row=2, checkpoint=0.0
    )
    training = Training(
        environment, expert, course=course, folder=tmp_path / "early", eval_env=PointReach(4)
    )
    outcome = training.run()
    assert outcome.early
    # the evaluation before the first step counts
    assert (outcome.step, outcome.success) == (40, 1.0)


def test_scores_do_not_depend_on_how_many_step_at_once(tmp_path: Path) -> None:
    """Seven episodes one by one, three at a time or all together are the same episodes."""
    training = training_of(SAC(**SMALL), tmp_path)
    training.run()
    policy = load_policy(tmp_path / "policy")
    found = [score(PointReach(count), policy, validation_seeds(7)) for count in (1, 3, 7)]
    for other in found[1:]:
        np.testing.assert_array_equal(found[0].success, other.success)
        np.testing.assert_array_equal(found[0].length, other.length)
        np.testing.assert_allclose(found[0].returns, other.returns, rtol=1e-4)
        np.testing.assert_allclose(
            found[0].facts["distance"], other.facts["distance"], rtol=1e-3, atol=1e-5
        )
    assert found[0].seed.tolist() == validation_seeds(7)


@pytest.mark.thorough
def test_a_policy_is_read_by_a_fresh_process(tmp_path: Path) -> None:
    """Reading a policy is the first thing a process does with the packages of learning."""
    training_of(SAC(**SMALL), tmp_path).run()
    folder = str(tmp_path / "policy")
    code = f"from seals.learn.policy import load_policy; print(load_policy({folder!r}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "NetworkPolicy" in done.stdout


def test_the_expert_scores_full_marks() -> None:
    """Sums and lengths of the script are those of its straight way."""

    class Script:
        """Does what the environment's script does."""

        def begin(self, seeds: Sequence[int]) -> None:
            """Forget nothing."""

        def act(self, observation: Any) -> Any:
            return environment.scripted_policy()

    environment = PointReach(5)
    state = environment.reset(validation_seeds(5)).double()
    found = score(environment, Script(), validation_seeds(5))
    assert found.success.all()
    # a step is 0.1 along each axis: the longest axis decides, less where 0.1 m is near enough
    longest = (state[:, :3] - state[:, 3:]).abs().max(1).values.numpy()
    assert (found.length >= np.floor(longest / 0.1) - 1).all()
    assert (found.length <= np.ceil(longest / 0.1)).all()


def test_a_checkpoint_is_read_without_running_anything(tmp_path: Path) -> None:
    """A pickle that would run code, a torn file and an absent one are refused in words."""
    with pytest.raises(ConfigError, match="there is no checkpoint"):
        read_checkpoint(tmp_path, device="cpu")
    write_checkpoint(tmp_path, {"a": torch.ones(3), "b": {"c": None, "d": [1, 2.5, "x"]}})
    state = read_checkpoint(tmp_path, device="cpu")
    assert state["b"] == {"c": None, "d": [1, 2.5, "x"]}
    whole = (tmp_path / FILE).read_bytes()
    (tmp_path / FILE).write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ConfigError, match="cannot be resumed"):
        read_checkpoint(tmp_path, device="cpu")

    class Trap:
        """Would make a file when unpickled."""

        def __reduce__(self) -> Any:
            return os.mkdir, (str(tmp_path / "sprung"),)

    torch.save({"form": 1, "trap": Trap()}, tmp_path / FILE)
    with pytest.raises(ConfigError, match="cannot be resumed"):
        read_checkpoint(tmp_path, device="cpu")
    (tmp_path / FILE).write_bytes(pickle.dumps(Trap()))
    with pytest.raises(ConfigError, match="cannot be resumed"):
        read_checkpoint(tmp_path, device="cpu")
    assert not (tmp_path / "sprung").exists()


def test_tensors_come_back_bit_for_bit(tmp_path: Path) -> None:
    """Kinds, order in memory, keys of an optimiser, and tensors of one number."""
    kept = {
        "turned": torch.arange(6.0, dtype=torch.float64).reshape(2, 3).T,
        "flags": torch.tensor([True, False]),
        "step": torch.tensor(3.0),
        "empty": torch.zeros(0, 4),
        "state": {0: {"betas": (0.9, 0.999), "shape": torch.Size([2, 3])}},
        "random": torch.get_rng_state(),
    }
    write_checkpoint(tmp_path, kept)
    back = read_checkpoint(tmp_path, device="cpu")
    assert back["state"] == {0: {"betas": (0.9, 0.999), "shape": (2, 3)}}
    for name in ("turned", "flags", "step", "empty", "random"):
        assert torch.equal(back[name], kept[name])
        assert back[name].dtype == kept[name].dtype
        assert back[name].stride() == kept[name].stride()
    with pytest.raises(ConfigError, match=r"course\.checkpoint=0"):
        write_checkpoint(tmp_path, {"a": object()})
    assert torch.equal(read_checkpoint(tmp_path, device="cpu")["step"], kept["step"])


@pytest.mark.parametrize(("name", "value"), [("steps", -1), ("episodes", 0), ("look_every", 0)])
def test_a_course_that_makes_no_sense_is_refused(name: str, value: int) -> None:
    """Numbers below their least value are refused by their key."""
    with pytest.raises(ConfigError, match=f"course.{name}={value}"):
        check_tree(TrainingSchedule(**{name: value}), where="course")


def test_the_learning_rate_settles(tmp_path: Path) -> None:
    """It falls in a straight line to a tenth of itself, and stays there; without, it stays."""
    rates = {}
    for name, settle in (("steady", 0), ("settled", 200)):
        learner = SAC(**SMALL, learning_rate=1e-3, settle=settle)
        course = TrainingSchedule(
            steps=400, look_every=400, log_every=400, episodes=4, checkpoint=0.0
        )
        training = training_of(learner, tmp_path / name, course=course)
        update, told = training.agent.update, []

        def heard(update: Any = update, told: Any = told, training: Any = training) -> Any:
            found = update()
            optimisers = training.agent.nets.optimisers.values()
            told.append((training.agent.steps, *(o.param_groups[0]["lr"] for o in optimisers)))
            return found

        training.agent.update = heard
        training.run()
        rates[name] = np.array(told)
    assert np.allclose(rates["steady"][:, 1:], 1e-3)
    steps = rates["settled"][:, :1]
    wanted = 1e-3 * np.maximum(0.1, 1.0 - steps / 200.0)
    assert wanted.max() > 7e-4
    assert wanted.min() == pytest.approx(1e-4)
    assert np.allclose(rates["settled"][:, 1:], np.broadcast_to(wanted, (len(steps), 3)))


@pytest.mark.parametrize(("count", "horizon"), [(3, 3), (4, 2), (1, 13)])
def test_every_minibatch_of_a_round_has_steps(tmp_path: Path, count: int, horizon: int) -> None:
    """Steps that four minibatches do not divide evenly are dealt out, each of them once."""
    learner = PPO(hidden=[8], horizon=horizon, epochs=1)
    training = training_of(learner, tmp_path, count=count)
    agent: Any = training.agent
    drawn, minibatch = [], agent._minibatch

    def counted() -> Any:
        drawn.append(minibatch())
        return drawn[-1]

    agent._minibatch = counted
    training.course = TrainingSchedule(steps=count * horizon, episodes=4)
    assert training.run().updates == 4
    assert [len(rows) >= 2 for rows in drawn] == [True] * 4
    assert sorted(torch.cat(drawn).tolist()) == list(range(count * horizon))
