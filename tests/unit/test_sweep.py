"""Sweeps: many jobs by one command, their book, and what follows a kill or a failure."""

from __future__ import annotations

import csv
import io
import json
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from seals.cli.main import main
from seals.cli.sweep import begun
from seals.errors import ConfigError
from seals.run.application import run_into
from seals.run.build import run_settings
from seals.run.recorder import Moment, Recorder
from seals.sweep.book import DONE, Job, JobLock, claimed, read_jobs

SHORT = ["experiment=drop_test", "time.duration=0.05"]
FOUR = ["run", "--multirun", *SHORT, "seed=range(4)"]
SEALS = "import sys; from seals.cli.main import main; sys.exit(main(sys.argv[1:]))"
METRICS = "metric=specific_force_z.max,position_z.last,ledger.gravity.base.force_z.mean"


def lines(folder: Path) -> list[dict[str, str]]:
    """Return every line of a sweep's book."""
    with (folder / "jobs.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def table(folder: Path, out: Path) -> str:
    """Return the table of a sweep without durations."""
    assert main(["runs", str(folder), METRICS, f"table={out}", "replace=true"]) == 0
    rows = csv.DictReader(io.StringIO(out.read_text(encoding="utf-8")))
    return json.dumps([{k: v for k, v in row.items() if k != "seconds"} for row in rows])


def swept(folder: Path, *words: str) -> int:
    """Run the four jobs in this process, into a folder."""
    return main([*FOUR, f"hydra.sweep.dir={folder}", *words])


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a sweep that nothing disturbed."""
    folder = tmp_path_factory.mktemp("whole") / "sweep"
    assert swept(folder) == 0
    return folder


@pytest.mark.thorough
def test_every_job_has_its_folder_and_one_line(whole: Path) -> None:
    """Four jobs: four logs, what each printed, and four lines in the book."""
    rows = lines(whole)
    assert [(row["number"], row["state"], row["code"]) for row in rows] == [
        (str(k), "done", "0") for k in range(4)
    ]
    for number in range(4):
        assert (whole / str(number) / "log.parquet").is_file()
        assert "report:" in (whole / str(number) / "stdout.txt").read_text()
    note = json.loads((whole / "sweep.json").read_text())
    assert (note["verb"], note["jobs"], note["words"]) == ("run", 4, [*SHORT, "seed=range(4)"])


def test_progress_names_the_job_and_the_time_left(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line a job with its own words; the last line says how to look at the table."""
    words = [f"hydra.sweep.dir={tmp_path / 's'}", "seed=7,8", *SHORT]
    assert main(["run", "--multirun", *words]) == 0
    out = capsys.readouterr().out.splitlines()
    assert out[0] == f"sweep of 2 jobs: {tmp_path / 's'}"
    assert sum(line.startswith(("1 of 2  job", "2 of 2  job")) for line in out) == 2
    assert any("seed=8: done in" in line for line in out)
    assert out[-1] == f"table: seals runs {tmp_path / 's'}"


@pytest.mark.thorough
def test_a_killed_sweep_goes_on_and_no_job_runs_twice(whole: Path, tmp_path: Path) -> None:
    """SIGKILL in the middle, then the same command with --resume: the same table."""
    folder = tmp_path / "sweep"
    words = [sys.executable, "-c", SEALS, *FOUR, f"hydra.sweep.dir={folder}"]
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL, cwd=tmp_path)
    end = time.monotonic() + 120.0
    while len(read_jobs(folder)) < 2 and process.poll() is None and time.monotonic() < end:
        time.sleep(0.01)
    process.kill()
    process.wait()
    before = {number: (folder / str(number) / "run.json").read_bytes() for number in (0, 1)}
    assert 2 <= len(read_jobs(folder)) < 4
    assert swept(folder, "--resume") == 0
    assert sorted(row["number"] for row in lines(folder)) == ["0", "1", "2", "3"]
    for number, content in before.items():
        assert (folder / str(number) / "run.json").read_bytes() == content
    assert table(folder, tmp_path / "a.csv") == table(whole, tmp_path / "b.csv")


def test_a_sweep_is_taken_up_by_its_folder(whole: Path, tmp_path: Path) -> None:
    """``resume=FOLDER`` needs no other word; a sweep that is done stays as it is."""
    before = (whole / "jobs.csv").read_bytes()
    assert main(["run", f"resume={whole}"]) == 0
    assert (whole / "jobs.csv").read_bytes() == before


def test_a_failed_job_is_told_and_run_again(
    pebble: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A refused job leaves the others alone; once mended, --resume runs it and it alone."""
    folder, urdf = tmp_path / "sweep", pebble / "pebble.urdf"
    whole = urdf.read_text(encoding="utf-8")
    urdf.write_text("<robot>", encoding="utf-8")
    words = ["run", "-m", f"robot=ball,{pebble}", "time.duration=0.02", f"hydra.sweep.dir={folder}"]
    assert main(words) == 1
    told = capsys.readouterr().err
    assert f"job 1  robot={pebble}: RobotError:" in told
    assert "--resume runs these again" in told
    assert [job.state for job in read_jobs(folder).values()] == ["done", "refused"]
    assert not (folder / "1").exists()
    urdf.write_text(whole, encoding="utf-8")
    assert main([*words, "--resume"]) == 0
    assert [(row["number"], row["state"]) for row in lines(folder)] == [
        ("0", "done"),
        ("1", "refused"),
        ("1", "done"),
    ]
    assert (folder / "1" / ".hydra" / "overrides.yaml").is_file()


def test_an_error_in_one_job_does_not_stop_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A bug in a job is noted with its traceback in the job's folder."""
    from seals.run import application

    def broken(config: Any) -> int:
        if config.seed == 1:
            raise ZeroDivisionError("a bug")
        return 0

    monkeypatch.setattr(application, "execute", broken)
    assert swept(tmp_path / "s") == 1
    states = {number: job.state for number, job in read_jobs(tmp_path / "s").items()}
    assert states == {0: "done", 1: "failed", 2: "done", 3: "done"}
    assert "job 1  seed=1: ZeroDivisionError: a bug" in capsys.readouterr().err
    assert "Traceback" in (tmp_path / "s" / "1" / "stdout.txt").read_text()
    monkeypatch.setattr(application, "execute", lambda config: 0)
    assert swept(tmp_path / "s", "--resume") == 0
    assert [row["number"] for row in lines(tmp_path / "s")] == ["0", "1", "2", "3", "1"]


def test_a_run_that_was_cut_off_goes_on_at_its_checkpoint(tmp_path: Path) -> None:
    """A job with a checkpoint is taken up there, in its own folder, and comes out the same."""
    folder, words = tmp_path / "s", [*SHORT, "seed=2"]
    line = ["run", "-m", *words, f"hydra.sweep.dir={folder}"]
    assert main(line) == 0
    cut = folder / "0"
    good = (cut / "log.parquet").read_bytes()

    class Stop(Recorder):
        def record(self, moment: Moment) -> None:
            if moment.world.time > 0.03:
                raise KeyboardInterrupt

    settings = run_settings([*words, "checkpoint=1e-9"])
    record = run_into(cut, settings, overrides=words, recorders=[Stop()])
    assert record.ending.value == "interrupted"
    assert (cut / "checkpoint").is_dir()
    (folder / "jobs.csv").unlink()
    assert main([*line, "--resume"]) == 0
    run = json.loads((cut / "run.json").read_text())
    assert run["resume_of"] == str(cut)
    assert (cut / "log.parquet").read_bytes() == good
    assert not (cut / "checkpoint").exists()


def test_a_claim_excludes_others_and_ends_with_its_process(tmp_path: Path) -> None:
    """A second process waits for the same number, not for another one; a kill frees it."""
    code = (
        "import sys, time\nfrom pathlib import Path\nfrom seals.sweep.book import claimed\n"
        "with claimed(Path(sys.argv[1]), 3):\n    print('held', flush=True)\n    time.sleep(600)\n"
    )
    words = [sys.executable, "-c", code, str(tmp_path)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as first:
        assert first.stdout is not None
        assert first.stdout.readline() == "held\n"
        # byte 0 is the book's own
        assert _is_held(tmp_path / ".jobs.lock", 4)
        assert not _is_held(tmp_path / ".jobs.lock", 5)
        with claimed(tmp_path, 4) as claim:
            claim.note(Job(4, DONE, 0, 0.0, (), ""))
        first.kill()
    with claimed(tmp_path, 3) as claim:
        claim.note(Job(3, DONE, 0, 0.0, (), ""))
    assert sorted(read_jobs(tmp_path)) == [3, 4]


def _is_held(lock: Path, place: int) -> bool:
    """Whether another process holds one byte of a lock file."""
    code = (
        "import fcntl, os, sys\n"
        f"d = os.open({str(lock)!r}, os.O_RDWR)\n"
        f"try: fcntl.lockf(d, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, {place})\n"
        "except OSError: sys.exit(1)\n"
    )
    return subprocess.run([sys.executable, "-c", code], check=False).returncode == 1


@pytest.mark.parametrize("key", ["hydra.sweep.dir", "++hydra.sweep.dir"])
def test_a_second_sweep_in_the_same_folder_touches_nothing(
    key: str, whole: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The second is refused however it names the folder, and the first stays whole."""
    before = {path: path.read_bytes() for path in whole.rglob("*") if path.is_file()}
    place = f"{whole.parent}/${{replace}}" if key.startswith("+") else f"{whole}"
    words = ["run", "-m", "robot=box", "seed=0,1", f"name={whole.name}"]
    assert main([*words, f"{key}={place.replace('replace', 'name')}"]) == 2
    assert "already contains a sweep" in capsys.readouterr().err
    assert {path: path.read_bytes() for path in whole.rglob("*") if path.is_file()} == before


def test_a_torn_line_counts_as_not_written(tmp_path: Path) -> None:
    """What a kill left of a line is cut off before the next one."""
    with claimed(tmp_path, 0) as claim:
        claim.note(Job(0, DONE, 0, 1.0, ("seed=0",), ""))
    with (tmp_path / "jobs.csv").open("a") as file:
        file.write("1,done,0,1.0,see")
    assert list(read_jobs(tmp_path)) == [0]
    with claimed(tmp_path, 2) as claim:
        assert isinstance(claim, JobLock)
        claim.note(Job(2, DONE, 0, 1.0, ("initial.position=[0, 0, 1]",), "a, 'b'"))
    assert list(read_jobs(tmp_path)) == [0, 2]
    assert read_jobs(tmp_path)[2].words == ("initial.position=[0, 0, 1]",)
    assert read_jobs(tmp_path)[2].message == "a, 'b'"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["robot=ball", "--resume"], "belongs to a sweep"),
        (["-m", "robot=ball", "--resume"], "none of the 0 sweeps in runs/"),
        (["-m", "robot=ball", "--resume", "hydra.sweep.dir=nowhere"], "no sweep in this folder"),
        (["-m", "robot=ball", "hydra.sweep.subdir=a"], "named by their numbers"),
        (["-m", "robot=ball", "hydra/launcher=jobli"], "Did you mean 'joblib'"),
        (["-m", "robot=ball", "hydra.sweep.dir=WHOLE"], "already contains a sweep"),
        (["-m", "robot=box", "--resume", "hydra.sweep.dir=WHOLE"], "started with other overrides"),
        (
            ["-m", "robot=box", "--resume", "++hydra.sweep.dir=WHOLE"],
            "started with other overrides",
        ),
        (["-m", "robot=box", "--resume", "hydra.sweep.dir=${name}"], "Give its name"),
        (["resume=WHOLE", "seed=3"], "would change the sweep"),
    ],
)
def test_refusals_of_sweeps(
    words: list[str],
    said: str,
    whole: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """What cannot be swept or taken up is refused in two lines, and nothing is written."""
    monkeypatch.chdir(tmp_path)
    assert main(["run", *(word.replace("WHOLE", str(whole)) for word in words)]) == 2
    told = capsys.readouterr().err
    assert said in told
    assert len(told.splitlines()) == 2
    assert list(tmp_path.iterdir()) == []


def test_the_words_of_a_strangers_sweep_set_values_alone(tmp_path: Path) -> None:
    """A note that speaks to Hydra, or names a class, is not taken up."""
    for word in ("hydra.launcher.setup=[rm]", "effects.a._target_=os.system"):
        note = {"verb": "run", "words": ["robot=ball", word]}
        (tmp_path / "sweep.json").write_text(json.dumps(note))
        with pytest.raises(ConfigError, match="contains"):
            begun("run", [f"resume={tmp_path}"])


@pytest.mark.slow
def test_processes_that_outlive_their_sweep_are_waited_for(whole: Path, tmp_path: Path) -> None:
    """Killed alone, the first process leaves others at work; what they finish is not run again."""
    pytest.importorskip("hydra_plugins.hydra_joblib_launcher")
    folder = tmp_path / "sweep"
    words = [*FOUR, f"hydra.sweep.dir={folder}", "hydra/launcher=joblib", "hydra.launcher.n_jobs=2"]
    with subprocess.Popen([sys.executable, "-c", SEALS, *words], cwd=tmp_path) as first:
        while not read_jobs(folder) and first.poll() is None:
            time.sleep(0.01)
        first.kill()
    assert swept(folder, "--resume") == 0
    assert sorted(row["number"] for row in lines(folder)) == ["0", "1", "2", "3"]
    assert table(folder, tmp_path / "a.csv") == table(whole, tmp_path / "b.csv")


@pytest.mark.slow
@pytest.mark.parametrize("launcher", ["joblib", "submitit_local"])
def test_launchers_make_the_same_numbers(launcher: str, whole: Path, tmp_path: Path) -> None:
    """Jobs in processes of their own come out as those of this process."""
    pytest.importorskip(f"hydra_plugins.hydra_{launcher.partition('_')[0]}_launcher")
    folder = tmp_path / "sweep"
    words = [*FOUR, f"hydra.sweep.dir={folder}", f"hydra/launcher={launcher}"]
    subprocess.run([sys.executable, "-c", SEALS, *words], check=True, cwd=tmp_path)
    assert sorted(read_jobs(folder)) == [0, 1, 2, 3]
    assert table(folder, tmp_path / "a.csv") == table(whole, tmp_path / "b.csv")


def test_values_that_are_wrong_together_end_a_sweep_that_can_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A job that cannot be composed is refused when it begins; what ran before it stays."""
    from seals.run import application
    from seals.sweep import job

    monkeypatch.setattr(application, "execute", lambda config: 0)
    monkeypatch.setattr(job, "newcomers", lambda batch: batch[:1])
    words = ["run", "-m", "robot=ball", "seed=1,b", f"hydra.sweep.dir={tmp_path / 's'}"]
    assert main(words) == 2
    assert "seed" in capsys.readouterr().err
    assert [job.state for job in read_jobs(tmp_path / "s").values()] == ["done"]
    assert main([*words, "--resume"]) == 2
    assert [row["number"] for row in lines(tmp_path / "s")] == ["0"]


def test_options_found_by_their_names_are_watched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Only Hydra's loader knows what ``glob(...)`` stands for: counted and noted."""
    from seals.run import application

    monkeypatch.setattr(application, "execute", lambda config: 0)
    words = ["run", "-m", "robot=glob(bal*)", "seed=1,2", f"hydra.sweep.dir={tmp_path / 's'}"]
    assert main(words) == 0
    assert capsys.readouterr().out.startswith("sweep of 2 jobs")
    assert json.loads((tmp_path / "s" / "sweep.json").read_text())["jobs"] == 2


@pytest.mark.parametrize("wrong", ["~hydra.callbacks.sweep", "begin"])
def test_a_sweep_that_nobody_watches_does_not_run(
    wrong: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Without its callback, or when that fails, the command fails instead of passing it over."""
    from seals.sweep import watch

    words = ["run", "-m", *SHORT, "seed=1,2", f"hydra.sweep.dir={tmp_path / 's'}"]
    if wrong == "begin":

        def broken(config: Any) -> int:
            raise ConfigError("it cannot be counted.\nCount it.")

        monkeypatch.setattr(watch, "count_of", broken)
    else:
        words.append(wrong)
    assert main(words) == 2
    assert ("counted" if wrong == "begin" else "would not be recorded") in capsys.readouterr().err
    assert not list(tmp_path.glob("s/*/log.parquet"))


@pytest.mark.thorough
def test_every_kind_of_value_is_composed_once_before_the_first_job(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Twelve jobs of two words and any numbers: two are composed; a wrong value stops them all."""
    from hydra.plugins.sweeper import Sweeper

    from seals.run import application

    composed: list[Sequence[str]] = []
    before = Sweeper.validate_batch_is_legal

    def counted(self: Any, batch: Sequence[Sequence[str]]) -> None:
        composed.extend(batch)
        before(self, batch)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Sweeper, "validate_batch_is_legal", counted)
    monkeypatch.setattr(application, "execute", lambda config: 0)
    assert main(["run", "-m", "robot=ball,aam", "seed=1,2,3", "time.duration=0.1,0.2"]) == 0
    assert [words[0] for words in composed] == ["robot=ball", "robot=aam"]
    assert Sweeper.validate_batch_is_legal is counted
    (sweep,) = tmp_path.glob("runs/*/*")
    assert len(read_jobs(sweep)) == 12
    assert main(["run", "-m", "robot=ball", "seed=1,2", "time.duration=0.1,long"]) == 2
    assert main(["run", "-m", "robot=ball", "seed=1,2.5"]) == 2
    assert list(tmp_path.glob("runs/*/*")) == [sweep]
