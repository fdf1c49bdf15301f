"""Policies judged and kept: held-out starts, worlds of a grid, demonstrations that repeat."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.cli.evaluate import with_card
from seals.cli.main import main
from seals.config.compose import compose
from seals.control.key_events import Event
from seals.errors import ConfigError
from seals.learn.batched import StepResult
from seals.learn.demonstrations.folder import read
from seals.learn.demonstrations.recording import record
from seals.learn.evaluation.application import variants_of
from seals.learn.evaluation.page import rows_of, sentences, summarise, write_results
from seals.learn.evaluation.policies import (
    PolicyKeys,
    PolicyRandom,
    PolicyScripted,
    policy_of,
)
from seals.learn.metadata import _placeless, world_hash
from seals.learn.statistics.interval import wilson

torch = pytest.importorskip("torch", reason="the extra learn is not installed")
pytest.importorskip("torchrl", reason="the extra learn is not installed")


LENGTHS = (4, 7, 10)
"""Steps until a toy episode ends; it depends on the seed."""


class Toy:
    """A point on a line that shall come to zero; seeds set start and length."""

    pixels = None
    device = "cpu"
    observation_size, action_size = 2, 1

    def __init__(self, count: int) -> None:
        self.count = count
        self.task = SimpleNamespace(action_names=("velocity_x",), rate=10.0)

    def reset(self, seeds: Sequence[int] | None = None) -> Any:
        """Begin everywhere."""
        self._begin(list(seeds or [0] * self.count), range(self.count))
        return self._seen()

    def _begin(self, seeds: Sequence[int], places: Sequence[int]) -> None:
        if len(places) == self.count:
            self.x, self.left = torch.zeros(self.count), torch.zeros(self.count)
        for k in places:
            self.x[k] = 0.1 * (seeds[k] % 10) + 0.1
            self.left[k] = LENGTHS[seeds[k] % 3]

    def _seen(self) -> Any:
        return torch.stack([self.x, self.left], 1)

    def step(self, action: Any) -> StepResult:
        """Move by a tenth of the action; what ended begins anew with seed 9."""
        self.x += 0.1 * action[:, 0]
        self.left -= 1
        final, ended = self._seen(), self.left == 0
        distance, reward = self.x.abs().clone(), -self.x.abs()
        self._begin([9] * self.count, torch.nonzero(ended)[:, 0].tolist())
        return StepResult(
            observation=self._seen(),
            reward=reward,
            terminated=ended & (distance < 0.05),
            truncated=ended & ~(distance < 0.05),
            final=final,
            success=ended & (distance < 0.05),
            facts={"distance": distance, "success_1cm": (distance < 0.01).float()},
        )

    def scripted_policy(self) -> Any:
        """Go to zero at full speed, and stay."""
        return (-10.0 * self.x[:, None]).clamp(-1, 1)

    def close(self) -> None:
        """Nothing is open."""


def expected_success(seed: int) -> bool:
    """Whether full speed, a tenth a step, comes to zero in time."""
    return round(10 * (0.1 * (seed % 10) + 0.1)) <= LENGTHS[seed % 3]


def test_recorded_episodes_are_whole() -> None:
    """Every episode has its own length, its own last observation, and nothing of the next."""
    seeds = list(range(1, 9))
    env = Toy(3)
    episodes = record(env, PolicyScripted(env), seeds)
    assert [e.seed for e in episodes] == seeds
    assert [e.steps for e in episodes] == [LENGTHS[s % 3] for s in seeds]
    assert [e.success for e in episodes] == [expected_success(s) for s in seeds]
    for e in episodes:
        assert e.observation[0, 0] == pytest.approx(0.1 * (e.seed % 10) + 0.1)
        assert e.observation[-1, 1] == 0.0
        # the sum of what was done is the way that was gone
        moved = e.observation[-1, 0] - e.observation[0, 0]
        assert 0.1 * e.action.sum() == pytest.approx(moved, abs=1e-6)
        assert e.terminated[-1] == e.success
        np.testing.assert_allclose(e.reward, -np.abs(e.observation[1:, 0]), atol=1e-6)


def test_shaken_actions_are_those_that_were_done() -> None:
    """Noise belongs to the start, not to the batch, and what is kept is what moved the point."""
    seeds = [1, 2, 4, 5, 7]
    alone = [record(env := Toy(1), PolicyScripted(env), [s], noise=0.3)[0] for s in seeds]
    together = record(env := Toy(4), PolicyScripted(env), seeds, noise=0.3)
    clean = record(env := Toy(4), PolicyScripted(env), seeds)
    for a, b, c in zip(alone, together, clean, strict=True):
        np.testing.assert_array_equal(a.action, b.action)
        assert not np.array_equal(b.action, c.action)
        assert np.abs(b.action).max() <= 1.0
        np.testing.assert_allclose(np.diff(b.observation[:, 0]), 0.1 * b.action[:, 0], atol=1e-6)


def test_random_is_the_same_in_any_batch() -> None:
    """A start has its random actions, however many step at once; another start has others."""
    one, many = PolicyRandom(3, "cpu"), PolicyRandom(3, "cpu")
    one.begin([5])
    many.begin([4, 5])
    for _ in range(3):
        single, both = one.act(None), many.act(None)
        assert torch.equal(single[0], both[1])
        assert not torch.equal(both[0], both[1])
    still = PolicyRandom(3, "cpu", most=0.0)
    still.begin([1, 2])
    assert torch.equal(still.act(None), torch.zeros(2, 3))


def test_keys_act_as_the_stick_says() -> None:
    """A key acts from its time until it is let go; the script begins anew with every episode."""
    events = [Event(0.1, "w", 1.0), Event(0.3, "w", 0.0), Event(0.3, "f", 1.0)]
    names = ["velocity_z", "velocity_x"]
    policy = PolicyKeys(events, names, rate=10.0, device="cpu")
    for _ in range(2):
        policy.begin([1, 2])
        done = torch.stack([policy.act(None) for _ in range(5)])
        assert done[:, 0, 1].tolist() == [0, 1, 1, 0, 0]
        assert done[:, 1, 0].tolist() == [0, 0, 0, -1, -1]
    with pytest.raises(ConfigError, match="Did you mean 'yaw_rate'"):
        PolicyKeys(events, ["yaw_rat"], rate=10.0, device="cpu")


def scored(policy: Any, seeds: Sequence[int], count: int) -> Any:
    """The judgement of a policy in the toy."""
    from seals.learn.training.scoring import score

    env = Toy(count)
    made = policy(env)
    return summarise(score(env, made, seeds), policy="some", world="", seconds=1.0)


def test_a_judgement_counts_every_start_once(tmp_path: Path) -> None:
    """Shares are those of the starts, whatever the batch; files hold every episode."""
    seeds = list(range(2_000_000_000, 2_000_000_011))
    found = scored(PolicyScripted, seeds, 4)
    wins = sum(expected_success(seed) for seed in seeds)
    assert found.share() == wilson(wins, 11)
    assert found.columns["length"].tolist() == [LENGTHS[s % 3] for s in seeds]
    single = scored(PolicyScripted, seeds, 1)
    assert single.columns["success"].tolist() == found.columns["success"].tolist()
    still = scored(lambda env: PolicyRandom(1, "cpu", most=0.0), seeds, 4)
    assert still.share().value == 0.0
    write_results([found, still], tmp_path, facts={"env": "toy"})
    lines = (tmp_path / "episodes.csv").read_text().splitlines()
    assert len(lines) == 1 + 22
    assert "2000000010" in lines[11]
    kept = json.loads((tmp_path / "evaluation.json").read_text())
    assert kept["judgements"][0]["shares"]["success"] == pytest.approx(list(wilson(wins, 11)))
    assert kept["judgements"][1]["quantiles"]["distance"][2] == pytest.approx(
        np.median([0.1 * (s % 10) + 0.1 for s in seeds])
    )
    head, rows = rows_of([found, still])
    assert "within 1 cm (95%)" in head
    assert len(rows) == 2


@pytest.mark.parametrize(
    ("own", "other", "words"),
    [(95, 40, "more often"), (40, 95, "less often"), (50, 55, "no difference is shown")],
)
def test_sentences_follow_the_intervals(own: int, other: int, words: str) -> None:
    """Only intervals that are apart make a claim."""
    pair = []
    for wins, name in ((own, "mine"), (other, "scripted")):
        scores = SimpleNamespace(
            seed=np.arange(100),
            success=np.arange(100) < wins,
            returns=np.zeros(100),
            length=np.ones(100),
            facts={},
        )
        pair.append(summarise(scores, policy=name, world="", seconds=0.0))  # type: ignore[arg-type]
    (text,) = sentences(pair)
    assert words in text


def test_a_policy_is_found_by_name() -> None:
    """Unknown names are refused with the nearest."""
    env: Any = Toy(2)
    assert isinstance(policy_of("random", env, device="cpu"), PolicyRandom)
    with pytest.raises(ConfigError, match="Did you mean 'scripted'"):
        policy_of("scriptd", env, device="cpu")


def metadata(folder: Path, overrides: Any) -> Path:
    """A policy's metadata with overrides."""
    folder.mkdir()
    text = {"format": "seals-policy", "version": 1, "network": {}, "overrides": overrides}
    (folder / "card.json").write_text(json.dumps(text))
    return folder


def test_the_card_sets_the_world(tmp_path: Path) -> None:
    """Overrides of the training come first; words of the same key take their place."""
    place = metadata(tmp_path / "p", ["task.duration=2", "+effect@effects.stream=current"])
    assert with_card([f"policy={place}", "episodes=3"]) == [
        "task.duration=2",
        "+effect@effects.stream=current",
        f"policy={place}",
        "episodes=3",
    ]
    assert with_card([f"policy={place}", "task.duration=5"])[0].startswith("+effect")
    assert with_card(["policy=scripted"]) == ["policy=scripted"]
    # settings of another plug-in than the one that is chosen go with their choice
    sloping = ["backend=mujoco_warp", "backend.slope=0.2", "task.duration=4"]
    card = f"policy={metadata(tmp_path / 'sloping', sloping)}"
    assert with_card([card]) == [*sloping, card]
    assert with_card([card, "backend=mujoco_warp"])[:2] == ["backend.slope=0.2", "task.duration=4"]
    assert with_card([card, "backend=mujoco"]) == ["task.duration=4", card, "backend=mujoco"]


@pytest.mark.parametrize(
    "word",
    [
        "effects.gravity._target_=os.system",
        "name=${oc.env:HOME}",
        "hydra.run.dir=/elsewhere",
        "hydra/launcher=x",
        "--multirun",
        "-m=1",
        7,
    ],
)
def test_a_hostile_card_sets_nothing(tmp_path: Path, word: Any) -> None:
    """Classes, references, flags and Hydra's own settings are refused."""
    with pytest.raises(ConfigError, match=r"no training writes|Allowed: (text|a list)"):
        with_card([f"policy={metadata(tmp_path / 'p', [word])}"])


@pytest.mark.thorough
def test_the_grid_changes_what_it_says() -> None:
    """Factors meet the numbers of their patterns and no others; overrides add effects."""
    base = ["grid=robustness"]
    config = compose(base, root="evaluate")
    variants = variants_of(config.grid)
    worlds = {name: v.world(base=base, root="evaluate", where=name) for name, v in variants.items()}
    for name, factor in (("drag x 0.5", 0.5), ("drag x 2", 2.0)):
        for effect, keys in (("water_drag", "coefficient_z"), ("spin_drag", "quadratic_x")):
            own = config.effects[effect][keys]
            assert worlds[name].effects[effect][keys] == pytest.approx(factor * own)
        assert worlds[name].effects.added_mass == config.effects.added_mass
    assert worlds["current 0.2 m/s"].effects.stream.velocity_x == 0.2
    assert worlds["payload 0.1 kg"].effects.load.mass == 0.1
    assert worlds["rigid bodies, delay 40 ms"].effects.late.delay == 0.04
    hashes = {world_hash(world) for world in worlds.values()} | {world_hash(config)}
    assert len(hashes) == len(worlds) + 1


@pytest.mark.parametrize("name", ["worlds", "particles"])
def test_every_grid_composes(name: str) -> None:
    """Each world of each grid is one that the configuration knows."""
    base = [f"grid={name}"]
    for label, variant in variants_of(compose(base, root="evaluate").grid).items():
        world = variant.world(base=base, root="evaluate", where=label)
        assert (world.fluid is not None) == ("particle" in label)


def test_what_was_judged_is_written_before_a_refusal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A world that cannot be judged does not cost the one that was judged before it."""
    from seals.learn.evaluation import application

    done: list[str] = []

    def evaluate_policy(trial: Any, *, tell: Any = None) -> Any:
        if trial.world:
            raise ConfigError("no such world.\nLeave it out.")
        done.append(trial.policy)
        return scored(PolicyScripted, range(2_000_000_000, 2_000_000_004), 2)

    monkeypatch.setattr(application, "_evaluate_policy", evaluate_policy)
    monkeypatch.chdir(tmp_path)
    assert main(["evaluate", "beside=[]", "grid=worlds", "out=kept"]) == 2
    assert done == ["scripted"]
    assert json.loads((tmp_path / "kept" / "evaluation.json").read_text())["judgements"]


def test_mistyped_variants_are_refused() -> None:
    """A pattern that meets nothing, an unknown key and a wrong override are named."""
    from omegaconf import OmegaConf

    with pytest.raises(ConfigError, match="Did you mean 'scale'"):
        variants_of(OmegaConf.create({"a": {"scalle": {}}}))
    for entry, words in (
        ({"scale": {"effects.*drug*": 2.0}}, "matches no number except zero"),
        ({"overrides": ["efects.gravity=1"]}, "efects"),
    ):
        (variant,) = variants_of(OmegaConf.create({"a": entry})).values()
        with pytest.raises(ConfigError, match=words):
            variant.world(base=[], root="evaluate", where="grid.a")


def test_the_roots_of_learning_have_one_world() -> None:
    """Training, evaluation and recording compose one world from the same words."""
    words = ["task.duration=3", "water=none"]
    roots = {root: compose(words, root=root) for root in ("learn", "evaluate", "record", "train")}
    assert len({world_hash(config) for config in roots.values()}) == 1
    other = compose(["task.duration=4", "water=none"], root="train")
    assert world_hash(other) != world_hash(roots["train"])
    seeded = compose([*words, "seed=4", "learner=bc"], root="train")
    assert world_hash(seeded) == world_hash(roots["train"])


def test_record_then_replay_then_evaluate(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """On the command line: demonstrations repeat to 1e-9, and the expert is judged."""
    from seals.learn.environments import batched_of

    monkeypatch.chdir(tmp_path)
    world = ["task.duration=0.4"]
    words = ["record", *world, "episodes=3", "keep=all", "first=7", "out=demos", "noise=0.1"]
    assert main(words) == 0
    assert "3 episodes kept of 3 tried" in capsys.readouterr().out
    demos = read(tmp_path / "demos")
    config = compose(world, root="learn")
    assert demos.origin.config_hash == world_hash(config)
    assert demos.origin.action == ("velocity_x", "velocity_y", "velocity_z")
    env = batched_of(config, count=3)
    seen = [env.reset([e.seed for e in demos.episodes])]
    for step in range(max(e.steps for e in demos.episodes)):
        # an action after an episode's end is of the next one, which nobody looks at
        done = [e.action[min(step, e.steps - 1)] for e in demos.episodes]
        seen.append(env.step(torch.as_tensor(np.stack(done))).final)
    for k, kept in enumerate(demos.episodes):
        again = torch.stack([rows[k] for rows in seen[: kept.steps + 1]]).numpy()
        assert np.abs(kept.observation - again).max() <= 1e-9
    words = ["evaluate", *world, "policy=scripted", "beside=[still]", "episodes=3", "out=result"]
    assert main(words) == 0
    assert "scripted" in capsys.readouterr().out
    kept_json = json.loads((tmp_path / "result" / "evaluation.json").read_text())
    assert [j["policy"] for j in kept_json["judgements"]] == ["scripted", "still"]
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["evaluate", "policy=scriptd"], "Did you mean 'scripted'"),
        (["evaluate", "episodes=0"], "a whole number from 1"),
        (["evaluate", "grid=robust"], "robustness"),
        (["record", "keep=success"], "Did you mean 'successes'"),
        (["record", "who=humn"], "Did you mean 'human'"),
        (["record", "first=2000000000"], "reserved for the evaluation"),
        (["record", "noise=3"], "a finite number from 0 to 1"),
    ],
)
def test_mistyped_words_are_refused(
    words: list[str],
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Two lines say what and what to write instead; no folder is left behind."""
    monkeypatch.chdir(tmp_path)
    assert main([*words, "task.duration=0.2"]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert len(err.splitlines()) == 2
    assert not (tmp_path / "runs").exists()


def test_later_fields_count_only_beside_their_defaults() -> None:
    """A field that its class got later is left out at its default, and no other field is."""
    law = {"_target_": "seals.plugins.effects.quadratic_drag.DragQuadratic", "coefficient_x": 0.0}
    assert _placeless({**law, "form": "per_axis", "axis": "x", "size_y": 0.0}) == law
    changed = {**law, "form": "faces", "size_y": 0.2}
    assert _placeless({"a": changed, "folder": "/here"}) == {"a": changed}
    mass = {"_target_": "seals.plugins.effects.added_mass.AddedMass", "coupling": []}
    assert _placeless({**mass, "floating": [], "floating_fraction": 0.5}) == mass
