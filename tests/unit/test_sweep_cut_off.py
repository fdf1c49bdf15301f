"""Jobs of a sweep that were cut off: only their own checkpoint is taken up, and only then."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from seals.cli.main import main
from seals.cli.sweep import begun
from seals.config.compose import compose
from seals.errors import ConfigError, DiskFull, PhysicsError
from seals.learn.training import application as trainings
from seals.logs.atomic import write_yaml
from seals.run import application as runs
from seals.run.application import run_into
from seals.run.build import build_run
from seals.run.folder import write_config
from seals.run.recorder import Moment, Recorder
from seals.sweep.book import read_jobs

SHORT = ["experiment=drop_test", "time.duration=0.05"]
SEALS = "import sys; from seals.cli.main import main; sys.exit(main(sys.argv[1:]))"


class Job:
    """Stands for the run of a job: leaves a checkpoint and ends by an error, or without one.

    Args:
        file: that makes a checkpoint.
        error: by which the first call ends; later ones end well.
    """

    def __init__(self, file: str, error: BaseException) -> None:
        """Remember nothing yet."""
        self.file, self.error = file, error
        self.resumed: list[bool] = []
        self.kept: list[bool] = []

    def __call__(self, config: Any) -> int:
        """Note what it is told and what it finds."""
        from hydra.core.hydra_config import HydraConfig

        kept = Path(HydraConfig.get().runtime.output_dir) / self.file
        self.resumed.append(config.resume is not None)
        self.kept.append(kept.is_file())
        if len(self.resumed) > 1:
            return 0
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_bytes(b"state")
        raise self.error


def launcher() -> Any:
    """Return the class of the default launcher, as Hydra holds it: it loads the module itself."""
    from hydra.core.plugins import Plugins

    Plugins.instance()
    from hydra._internal.core_plugins.basic_launcher import BasicLauncher

    return BasicLauncher


VERBS = [("run", runs, "checkpoint/state.bin", SHORT)]
VERBS += [("run", runs, ".checkpoint.before/state.bin", SHORT)]
VERBS += [("train", trainings, "checkpoint.bin", ["env=reach", "learner=sac"])]


@pytest.mark.thorough
@pytest.mark.parametrize(("verb", "module", "file", "words"), VERBS)
def test_a_job_that_was_cut_off_goes_on(
    verb: str, module: Any, file: str, words: list[str], tmp_path: Path, monkeypatch: Any
) -> None:
    """Without a line in the book, a job with a checkpoint of its own is told to take it up."""
    job = Job(file, KeyboardInterrupt())
    monkeypatch.setattr(module, "execute", job)
    line = [verb, "-m", *words, "seed=3", f"hydra.sweep.dir={tmp_path / 's'}"]
    assert main(line) == 130
    assert main([*line, "--resume"]) == 0
    assert (job.resumed, job.kept) == ([False, True], [False, True])


@pytest.mark.thorough
@pytest.mark.parametrize(("verb", "module", "file", "words"), VERBS)
def test_a_job_that_failed_begins_anew(
    verb: str, module: Any, file: str, words: list[str], tmp_path: Path, monkeypatch: Any
) -> None:
    """A checkpoint knows nothing of what was mended since, so it goes."""
    job = Job(file, PhysicsError("it diverged"))
    monkeypatch.setattr(module, "execute", job)
    line = [verb, "-m", *words, "seed=3", f"hydra.sweep.dir={tmp_path / 's'}"]
    assert main(line) == 1
    assert main([*line, "--resume"]) == 0
    assert (job.resumed, job.kept) == ([False, False], [False, False])


@pytest.mark.parametrize(
    "fault",
    [
        DiskFull("there is no room.\nMake some."),
        ConfigError("it began by other words.\nGive the same."),
    ],
)
def test_a_job_without_room_or_refused_goes_on(
    fault: Exception, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A full disk and words that were refused are no faults of what was computed: it goes on."""
    job = Job("checkpoint/state.bin", fault)
    monkeypatch.setattr(runs, "execute", job)
    line = ["run", "-m", *SHORT, "seed=3", f"hydra.sweep.dir={tmp_path / 's'}"]
    assert main(line) != 0
    assert main([*line, "--resume"]) == 0
    assert job.resumed == [False, True]


def test_a_sweep_goes_on_after_a_full_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without room for its line a job counts as cut off; with room again --resume does it."""
    job = Job("checkpoint/state.bin", KeyboardInterrupt())
    job.resumed.append(False)
    monkeypatch.setattr(runs, "execute", job)
    line = ["run", "-m", *SHORT, "seed=3", f"hydra.sweep.dir={tmp_path / 's'}"]

    def full(file: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("seals.sweep.book._forget_torn_line", full)
        assert main(line) == 2
    told = capsys.readouterr().err
    assert "no space left on the disk" in told
    assert "Free some space, then continue" in told
    assert (tmp_path / "s" / "jobs.csv").read_bytes() == b""
    assert main([*line, "--resume"]) == 0
    assert [state.state for state in read_jobs(tmp_path / "s").values()] == ["done"]


def test_a_lost_worker_is_told_in_two_lines(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A launcher that gives up: what did not end is named, and --resume does it and it alone."""
    basic = launcher()
    before = basic.launch

    def lossy(self: Any, jobs: Any, initial_job_idx: int) -> Any:
        before(self, jobs[:1], initial_job_idx)
        raise RuntimeError("a worker\nwas killed.")

    monkeypatch.setattr(runs, "execute", lambda config: 0)
    line = ["run", "-m", *SHORT, "seed=1,2,3", f"hydra.sweep.dir={tmp_path / 's'}"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(basic, "launch", lossy)
        assert main(line) == 2
    first, second = capsys.readouterr().err.splitlines()
    assert first == "SealsError: the sweep was interrupted: RuntimeError: a worker was killed."
    assert second.startswith("Without an end: jobs 1, 2. The same command with --resume continues;")
    assert main([*line, "--resume"]) == 0
    assert sorted(read_jobs(tmp_path / "s")) == [0, 1, 2]


def test_a_launcher_that_cannot_begin_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without a job there is nothing to go on with, and the folder is free again."""

    def absent(self: Any, jobs: Any, initial_job_idx: int) -> Any:
        raise FileNotFoundError(2, "no queue here")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(launcher(), "launch", absent)
    assert main(["run", "-m", *SHORT, "seed=1,2", "hydra.sweep.dir=s"]) == 2
    assert "the sweep could not start: FileNotFoundError" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_jobs_that_vanish_are_missed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A launcher that returns although a job has no line in the book: that is no success."""
    basic = launcher()
    before = basic.launch
    monkeypatch.setattr(runs, "execute", lambda config: 0)
    monkeypatch.setattr(
        basic, "launch", lambda self, jobs, initial_job_idx: before(self, jobs[:2], 0)
    )
    assert main(["run", "-m", *SHORT, "seed=1,2,3", f"hydra.sweep.dir={tmp_path / 's'}"]) == 1
    assert "Without an end: job 2." in capsys.readouterr().err


def test_what_was_mended_counts(tmp_path: Path) -> None:
    """A job that failed is run by the configuration as it is now, not as it was."""
    options = tmp_path / "options" / "experiment"
    options.mkdir(parents=True)
    mine = "# @package _global_\ndefaults:\n  - drop_test\n  - _self_\ntime: {step: 0.01}\n"
    mine += "effects: {water_drag: {coefficient_z: VALUE}}\n"
    (options / "mine.yaml").write_text(mine.replace("VALUE", "1.0e+5"), encoding="utf-8")
    words = ["experiment=mine", "time.duration=1", "checkpoint=0.01", "seed=1"]
    line = ["run", "-m", *words, f"hydra.sweep.dir={tmp_path / 's'}"]
    line += ["--config-dir", str(options.parent)]
    assert main(line) == 1
    (options / "mine.yaml").write_text(mine.replace("VALUE", "1.0"), encoding="utf-8")
    assert main([*line, "--resume"]) == 0
    assert [job.state for job in read_jobs(tmp_path / "s").values()] == ["done"]


def test_sweeps_with_less_and_with_more_are_taken_up_by_their_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Words that take something away, and a folder of configuration that is named again."""
    options = tmp_path / "options" / "experiment"
    options.mkdir(parents=True)
    text = "# @package _global_\ndefaults:\n  - drop_test\n  - _self_\n"
    (options / "mine.yaml").write_text(text, encoding="utf-8")
    monkeypatch.setattr(runs, "execute", lambda config: 0)
    flag = ["--config-dir", str(options.parent)]
    words = ["experiment=mine", "~effects.slamming", "seed=1,2"]
    folder = tmp_path / "s"
    assert main(["run", "-m", *words, f"hydra.sweep.dir={folder}", *flag]) == 0
    assert json.loads((folder / "sweep.json").read_text())["words"] == words
    (folder / "jobs.csv").unlink()
    assert main(["run", f"resume={folder}", *flag]) == 0
    assert sorted(read_jobs(folder)) == [0, 1]
    note = {"verb": "run", "words": ["robot=ball", "bare"]}
    (folder / "sweep.json").write_text(json.dumps(note))
    assert main(["run", f"resume={folder}"]) == 2
    assert "'bare', which no sweep of seals run writes" in capsys.readouterr().err


def test_words_in_another_order_number_the_jobs_as_before(tmp_path: Path) -> None:
    """The order of the words is that of the note, or job 1 would become another one."""
    note = {"verb": "run", "words": ["robot=ball", "seed=1,2", "name=a,b"]}
    (tmp_path / "sweep.json").write_text(json.dumps(note))
    line = ["-m", "name=a,b", "seed=1,2", "robot=ball", "--resume"]
    words = begun("run", [*line, f"hydra.sweep.dir={tmp_path}"])[0]
    assert [word for word in words if not word.startswith(("-", "hydra"))] == note["words"]


@pytest.mark.parametrize("seed", [1, 2])
def test_the_checkpoint_of_another_run_is_not_taken_up(seed: int, tmp_path: Path) -> None:
    """A sweep in a folder with a killed run in 0: job 0 begins anew, its words the same or not."""
    folder, words = tmp_path / "s", [*SHORT, f"seed={seed}"]

    class Stop(Recorder):
        def record(self, moment: Moment) -> None:
            if moment.world.time > 0.03:
                raise KeyboardInterrupt

    config = compose([*words, "checkpoint=1e-9"])
    run_into(folder / "0", build_run(config), overrides=words, recorders=[Stop()])
    write_config(folder / "0", config)
    write_yaml(folder / "0" / ".hydra" / "overrides.yaml", words)
    assert (folder / "0" / "checkpoint").is_dir()
    assert main(["run", "-m", *SHORT, "seed=1", f"hydra.sweep.dir={folder}"]) == 0
    run = json.loads((folder / "0" / "run.json").read_text())
    assert run["resume_of"] is None
    assert not (folder / "0" / "checkpoint").exists()


@pytest.mark.slow
def test_a_killed_training_of_a_sweep_goes_on_at_its_checkpoint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """SIGKILL once a checkpoint is there: --resume does not practise from the start again."""
    folder = tmp_path / "s"
    words = ["env=reach", "learner=sac", "seed=0", "count=4", "course.steps=3000"]
    words += ["course.episodes=4", "course.checkpoint=1"]
    line = ["train", "-m", *words, f"hydra.sweep.dir={folder}"]
    with subprocess.Popen([sys.executable, "-c", SEALS, *line], cwd=tmp_path) as first:
        seen: set[int] = set()
        # the first one holds nothing but the start
        while len(seen) < 2 and first.poll() is None:
            seen |= {file.stat().st_mtime_ns for file in folder.glob("0/checkpoint.bin")}
            time.sleep(0.02)
        os.kill(first.pid, signal.SIGKILL)
    steps, before = [], trainings.take_up

    def take_up(training: Any, **others: Any) -> list[str]:
        remarks = before(training, **others)
        steps.append(training.step)
        return remarks

    monkeypatch.setattr(trainings, "take_up", take_up)
    assert main(["train", f"resume={folder}"]) == 0
    assert len(steps) == 1
    assert steps[0] > 0
