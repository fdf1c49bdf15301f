"""Folders named by the clock: two commands of one second get two of them."""

from __future__ import annotations

import datetime
import json
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from hydra._internal.hydra import Hydra

from seals.cli.main import main
from seals.cli.sweep import begun
from seals.logs.atomic import write_json
from seals.run import application
from seals.sweep.book import read_jobs
from seals.sweep.watch import fresh_folder

DAY = Path("runs/2030-01-02")


@pytest.fixture
def stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Let the clock of folders' names stand still, and runs do nothing."""

    class Clock(datetime.datetime):
        @classmethod
        def now(cls, tz: Any = None) -> Any:
            """Return one and the same time."""
            return datetime.datetime(2030, 1, 2, 3, 4, 5)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("hydra.core.utils.datetime", Clock)
    monkeypatch.setattr(application, "execute", lambda config: 0)
    return tmp_path


def test_runs_of_one_second_have_folders_of_their_own(stopped: Path) -> None:
    """The first has the usual name, the second a number behind it; both keep their words."""
    for seed in (1, 2, 3):
        assert main(["run", "robot=ball", f"seed={seed}", "name=ball"]) == 0
    for suffix, seed in (("", 1), ("_2", 2), ("_3", 3)):
        words = (DAY / f"03-04-05_ball{suffix}" / ".hydra" / "overrides.yaml").read_text()
        assert f"seed={seed}" in words
    # a folder that is named stays as it is named
    for seed in (1, 2):
        assert main(["run", "robot=ball", f"seed={seed}", "hydra.run.dir=mine"]) == 0
    assert [path.name for path in stopped.iterdir() if path.name.startswith("mine")] == ["mine"]


def test_a_run_that_is_refused_leaves_no_folder(stopped: Path) -> None:
    """The folder was made before the run was checked, and goes again."""
    assert main(["run", "robot=ball", "time.step=-1"]) == 2
    assert list(stopped.iterdir()) == []


@pytest.mark.thorough
@pytest.mark.parametrize("launcher", ["basic", "joblib"])
def test_sweeps_of_one_second_have_folders_of_their_own(launcher: str, stopped: Path) -> None:
    """No job of the first is touched by the second, and --resume finds each by its words."""
    if launcher == "joblib":
        pytest.importorskip("hydra_plugins.hydra_joblib_launcher")
    words = ["experiment=drop_test", "time.duration=0.01", f"hydra/launcher={launcher}"]
    words += ["hydra.launcher.n_jobs=1"] if launcher == "joblib" else []
    for seeds in ("seed=1,2", "seed=11,12"):
        assert main(["run", "-m", *words, seeds]) == 0
    first, second = sorted(DAY.iterdir())
    assert second.name == f"{first.name}_2"
    for folder, seeds in ((first, (1, 2)), (second, (11, 12))):
        assert json.loads((folder / "sweep.json").read_text())["words"][-1].startswith("seed=")
        for number, seed in enumerate(seeds):
            assert read_jobs(folder)[number].words[-1] == f"seed={seed}"
            noted = (folder / str(number) / ".hydra" / "overrides.yaml").read_text()
            assert f"seed={seed}\n" in noted
    assert main(["run", "-m", *words, "seed=1,2", "--resume"]) == 0


def test_the_sweep_that_began_last_is_taken_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Not the last by name; a damaged note of some other sweep is told and passed over."""
    monkeypatch.chdir(tmp_path)
    moments = {
        "2030-01-02/03-04-05_ball": "2030-01-02T03:04:05+00:00",
        "foo": "2030-01-02T05:04:05.250000+01:00",
        "2031-09-09/a_name": "2030-01-02T03:59:00+00:00",
        "other": "2033-01-02T03:04:05+00:00",
    }
    for name, started in moments.items():
        words = ["seed=1,2", "robot=box" if name == "other" else "robot=ball"]
        note = {"verb": "run", "words": words, "started": started}
        write_json(tmp_path / "runs" / name / "sweep.json", note)
    (tmp_path / "runs" / "torn").mkdir()
    (tmp_path / "runs" / "torn" / "sweep.json").write_text("{")
    words = begun("run", ["-m", "robot=ball", "seed=1,2", "--resume"])[0]
    assert words[-1] == "hydra.sweep.dir='runs/foo'"
    assert "torn/sweep.json' is damaged" in capsys.readouterr().err


def test_many_at_once_get_different_folders(tmp_path: Path) -> None:
    """Whoever makes a folder has it alone."""
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda _: fresh_folder(tmp_path / "a" / "b"), range(40)))
    assert len(set(found)) == 40
    assert tmp_path / "a" / "b" in found


def test_a_command_is_composed_once(
    tmp_path: Path, elsewhere: Path, monkeypatch: pytest.MonkeyPatch, install: Callable[..., Path]
) -> None:
    """Not a second time for its mode, unless a file of another package sets that: then it acts."""
    composed: list[Any] = []
    before = Hydra.compose_config

    def counted(self: Any, *args: Any, **kwargs: Any) -> Any:
        composed.append(args)
        return before(self, *args, **kwargs)

    monkeypatch.setattr(Hydra, "compose_config", counted)
    words = ["run", "robot=ball", "time.duration=0.01"]
    assert main([*words, f"hydra.run.dir={tmp_path / 'one'}"]) == 0
    assert len(composed) == 1
    experiment = """
        # @package _global_
        hydra:
          mode: MULTIRUN
          sweeper:
            params: {seed: "1,2"}
        """
    files = {"reef_conf/__init__.py": "", "reef_conf/experiment/two_seeds.yaml": experiment}
    install("reef", "[seals.conf]\nreef = reef_conf", files)
    words += ["experiment=two_seeds", f"hydra.sweep.dir={tmp_path / 'two'}"]
    assert main(words) == 0
    assert [job.parent.name for job in sorted((tmp_path / "two").glob("*/run.json"))] == ["0", "1"]
