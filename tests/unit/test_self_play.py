"""Self-play: the game is zero-sum, training goes on where it stopped, Elo follows the games."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

pytest.importorskip("torch", reason="learning needs torch: pip install 'aam-seals[learn]'")

from seals.errors import ConfigError
from seals.experiments.self_play import main
from seals.experiments.self_play.elo import DRAWN, SCALE, elo, rated, tournament
from seals.experiments.self_play.league import COUNT, LEARNER, play
from seals.experiments.self_play.pursuit import (
    HUNTER,
    PREY,
    ROLES,
    SAYS,
    SEEN,
    Pursuit,
    Scripted,
    Squad,
    TaskPursuit,
)


@pytest.mark.parametrize("word", ["--turns=0", "--steps=100", "--steps=300", "--seed=x"])
def test_senseless_numbers_are_refused(word: str, tmp_path: Path) -> None:
    """Before any folder is made."""
    with pytest.raises((ConfigError, SystemExit)):
        main(["play", "--out", str(tmp_path / "out"), word])
    assert not (tmp_path / "out").exists()


@pytest.mark.thorough
def test_two_roles_see_one_game_with_opposite_rewards() -> None:
    """Scripts on both sides: the same flights, rewards of either sign, ends at the same steps."""
    seeds, games = [5, 6, 7], {role: Pursuit(role, count=3) for role in ROLES}
    seen = {role: game.reset(seeds) for role, game in games.items()}
    ended = False
    for _ in range(80):
        turn = {}
        for role, game in games.items():
            assert seen[role].shape == (3, SEEN[role])
            action = Scripted(role, game.game).act(seen[role])
            assert action.shape == (3, SAYS[role])
            turn[role] = game.step(action)
            seen[role] = turn[role].observation
        hunter, prey = turn[HUNTER], turn[PREY]
        assert (hunter.reward == -prey.reward).all()
        assert (hunter.reward <= 0.0).all()
        assert (hunter.terminated == prey.terminated).all()
        ended = ended or bool(hunter.terminated.any())
        if bool((hunter.terminated | hunter.truncated).any()):
            break
        for name in ("position", "target", "target_velocity"):
            assert np.array_equal(getattr(games[HUNTER].now, name), getattr(games[PREY].now, name))
    assert ended


def test_a_prey_follows_its_command_with_its_lag() -> None:
    """After one time constant 1 - 1/e of the pace; it moves by its velocity; it cannot be shown."""
    task = TaskPursuit(rate=10.0, lag=0.2, pace=0.1)
    goal = np.array([[1.0, -2.0, 0.0, 0.0]])
    for _ in range(2):
        before, goal = goal, task.run(goal, np.array([[1.0, 0.0]]))
    assert goal[0, 2] == pytest.approx(0.1 * (1.0 - np.exp(-1.0)), rel=1e-12)
    assert goal[0, 0] - before[0, 0] == pytest.approx(0.1 * goal[0, 2], rel=1e-12)
    place, velocity = task.target(goal, goal[:, :1])
    assert place[0, 2] == task.stance + task.over
    assert velocity[0].tolist() == [goal[0, 2], goal[0, 3], 0.0]


def test_each_policy_of_a_squad_acts_in_its_rows() -> None:
    """Actions stand where the observations stood."""
    task = TaskPursuit()
    squad = Squad([Scripted(PREY, task), Still()], [0, 1, 0, 1])
    import torch

    seen = torch.arange(4.0 * SEEN[PREY]).reshape(4, SEEN[PREY]) + 1.0
    said = squad.act(seen)
    assert torch.equal(said[::2], Scripted(PREY, task).act(seen[::2]))
    assert not said[1::2].any()


def test_elo_of_one_pair_solves_its_equation() -> None:
    """30 of 40 games: the likelihood's slope, games against rating 0 included, is zero there."""
    games = _games(np.zeros(40), np.zeros(40), np.arange(40) < 30)
    hunters, prey = elo(games)
    odds = brentq(lambda x: 30.0 - 40.0 * _share(2.0 * x) + DRAWN - 2.0 * DRAWN * _share(x), 0, 5)
    assert hunters[0] == pytest.approx(SCALE * odds, rel=1e-9)
    assert prey[0] == pytest.approx(-hunters[0], rel=1e-9)


def test_elo_finds_the_ratings_that_made_the_games() -> None:
    """Three by three players of known strength, 4,000 games a pair: within 15 points."""
    random = np.random.default_rng(1)
    true = {HUNTER: np.array([-200.0, 0.0, 150.0]), PREY: np.array([100.0, -100.0, 50.0])}
    h, p = (x.ravel() for x in np.meshgrid(np.arange(3), np.arange(3), indexing="ij"))
    hunter, prey = np.repeat(h, 4000), np.repeat(p, 4000)
    share = _share((true[HUNTER][hunter] - true[PREY][prey]) / SCALE)
    found = np.concatenate(elo(_games(hunter, prey, random.random(len(hunter)) < share)))
    wanted = np.concatenate((true[HUNTER], true[PREY]))
    assert np.abs(found - (wanted - wanted.mean())).max() < 15.0


def test_who_never_lost_has_a_finite_rating_within_its_interval() -> None:
    """All caught: the hunter is above the prey, and each resample agrees."""
    start = np.arange(20)
    games = _games(np.zeros(20), np.zeros(20), np.ones(20), start)
    found = rated(games)
    assert 200.0 < found[HUNTER].elo[0] - found[PREY].elo[0] < 2000.0
    assert found[HUNTER].low[0] <= found[HUNTER].elo[0] <= found[HUNTER].high[0]


@pytest.mark.slow
def test_turns_go_on_where_they_stopped(tmp_path: Path) -> None:
    """Two turns in two calls leave the policies of one call, to the bit; a third plays nothing."""
    from seals.learn.tensor_file import read_tensors

    steps = LEARNER["random_steps"] + COUNT
    for turns in (1, 2, 2):
        players = play(tmp_path / "halves", turns=turns, steps=steps, seed=3)
    assert players[HUNTER].training.updates == players[PREY].training.updates > 0
    play(tmp_path / "whole", turns=2, steps=steps, seed=3)
    for role in ROLES:
        one, two = (
            read_tensors(
                tmp_path / part / role / f"policy_{2 * steps}" / "policy.safetensors",
                most=10**7,
                framework="torch",
            )
            for part in ("halves", "whole")
        )
        assert all((one[name] == two[name]).all() for name in two)
    for other in ({"steps": 2 * steps, "seed": 3}, {"steps": steps, "seed": 4}):
        with pytest.raises(ConfigError, match="begun with other settings"):
            play(tmp_path / "halves", turns=2, **other)
    games = tournament(*(players[role].policies(2) for role in ROLES), starts=2)
    assert len(games["caught"]) == 3 * 3 * 2
    # whoever has hardly learned does not catch what flees; the script does
    first = (games[HUNTER] == 0) & (games[PREY] == 0)
    assert games["caught"][first].any()


def test_the_page_shows_the_games_that_ship(capsys: pytest.CaptureFixture[str]) -> None:
    """No figure of its tables is typed."""
    page = (Path(__file__).parents[2] / "docs" / "learning_self_play.md").read_text("utf-8")
    assert main(["table"]) == 0
    told = [line for line in capsys.readouterr().out.splitlines() if line.startswith("|")]
    assert len(told) > 4
    assert set(told) <= set(page.splitlines())


class Still:
    """A prey that stands."""

    def act(self, observation: object) -> object:
        """Return no velocity."""
        import torch

        return torch.zeros((len(observation), SAYS[PREY]))  # type: ignore[arg-type]


def _share(odds: object) -> object:
    return 1.0 / (1.0 + np.exp(-np.asarray(odds)))


def _games(hunter: object, prey: object, caught: object, start: object = 0) -> dict[str, object]:
    columns = np.broadcast_arrays(hunter, prey, caught, start, 1)
    names = (HUNTER, PREY, "caught", "start", "steps")
    return {n: np.asarray(x, dtype=np.int64) for n, x in zip(names, columns, strict=True)}
