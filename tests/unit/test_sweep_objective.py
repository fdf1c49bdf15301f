"""What a run returns to Hydra's sweepers, and a search by one of them from the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from seals.cli.main import main
from seals.untrusted_io import read_plain_yaml

DROP = ["experiment=drop_test", "time.duration=0.02"]
searching = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::FutureWarning")


def search(folder: Path, *words: str) -> list[str]:
    """Words of a search for the height of fall."""
    pytest.importorskip(
        "hydra_plugins.hydra_optuna_sweeper", reason="a search needs aam-seals[sweep]"
    )
    import optuna

    # its handler keeps the error channel of the test before
    optuna.logging.disable_default_handler()
    sweeper = ["hydra/sweeper=optuna", "hydra.sweeper.sampler.seed=1", "hydra.sweeper.n_jobs=1"]
    place = "initial.position.2=interval(0.5,1.5)"
    return ["run", "-m", *DROP, *sweeper, place, f"hydra.sweep.dir={folder}", *words]


@searching
def test_a_sweeper_of_hydra_finds_the_best_value(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The lowest drop is the best of all; taken up again, no job runs and it is the same."""
    words = search(tmp_path / "s", "hydra.sweeper.n_trials=2", "objective=position_z.max")
    assert main(words) == 0
    text = capsys.readouterr().out
    found: Any = read_plain_yaml(tmp_path / "s" / "optimization_results.yaml")
    heights = [
        read_plain_yaml(tmp_path / "s" / str(k) / ".hydra" / "overrides.yaml")[0] for k in range(2)
    ]
    lowest = min(float(word.partition("=")[2]) for word in heights)
    assert found["best_params"] == {"initial.position.2": lowest}
    assert found["best_value"] == pytest.approx(lowest, abs=1e-9)
    assert f"best {lowest:.6g}: initial.position.2={lowest}" in text
    before = (tmp_path / "s" / "jobs.csv").read_text()
    assert main([*words, "--resume"]) == 0
    assert (tmp_path / "s" / "jobs.csv").read_text() == before
    assert f"best {lowest:.6g}" in capsys.readouterr().out


@searching
def test_a_mistyped_objective_ends_a_search_after_one_job(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Two lines: what was given, and the nearest name; nothing else on the error channel."""
    words = search(tmp_path / "s", "hydra.sweeper.n_trials=5", "objective=position_z.mxa")
    assert main(words) == 2
    assert capfd.readouterr().err.splitlines() == [
        "ConfigError: objective=position_z.mxa: no run has this metric.",
        "Did you mean 'max'?  Statistics: first, last, max, mean, min, range, rms, std",
    ]
    assert len((tmp_path / "s" / "jobs.csv").read_text().splitlines()) == 2


def test_a_single_run_prints_its_objective(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The same name as in a search tries an objective; a list gives several."""
    words = ["run", *DROP, f"hydra.run.dir={tmp_path / 'r'}"]
    assert main([*words, "objective=[position_z.first,simulated_seconds]"]) == 0
    assert "objective: (1.0, 0.02" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["hydra/sweeper=optuna", "seed=1,2"], "Give objective=METRIC"),
        (["hydra/sweeper=optna", "objective=seconds"], "Did you mean 'optuna'?"),
    ],
)
def test_a_search_for_nothing_is_refused(
    words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """A sweeper that searches wants an objective, and its own name."""
    assert main(["run", "-m", *DROP, *words]) == 2
    assert said in capsys.readouterr().err
