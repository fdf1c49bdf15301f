"""``seals runs``: run folders as rows, chosen, measured, written and drawn."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from pyarrow import parquet

from seals.cli.main import main
from seals.logs.atomic import write_json, write_table, write_yaml
from seals.sweep.application import read_conditions
from seals.sweep.book import DONE, REFUSED, Job, claimed
from seals.sweep.rows import Row, find_rows


@pytest.fixture
def runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a sweep of four jobs, one of them refused, in an otherwise empty folder."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "drops"
    for number in range(4):
        height, seed = (0.5, 1.0)[number // 2], number % 2
        words = ["robot=ball", f"initial.position=[0,0,{height}]", f"seed={seed}"]
        with claimed(folder, number) as claim:
            state = REFUSED if number == 3 else DONE
            claim.note(Job(number, state, 0, 10.0 - number, tuple(words), ""))
        if number == 3:
            continue
        place = folder / str(number)
        write_yaml(place / ".hydra" / "overrides.yaml", words)
        write_json(place / "run.json", {"state": "done", "steps": 100 * number, "seconds": 1.0})
        fall = np.linspace(height, -height, 5)
        write_table(place / "log.parquet", {"t": np.arange(5.0), "position_z": fall})
        write_table(place / "fits.csv", {"error": np.array([3.0, np.nan, 1.0 + seed])})
        write_json(place / "more.json", {"score": {"rms": 0.25 * number}})
    write_json(folder / "sweep.json", {"verb": "run", "words": []})
    return folder


def rows_of(path: Path) -> list[dict[str, str]]:
    """Return the rows of a table."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_the_table_shows_what_differs(runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """State, duration and differing overrides; what all share stands above."""
    assert main(["runs", "drops"]) == 0
    out = capsys.readouterr().out.splitlines()
    assert out[0] == "4 of 4 runs; common to all: robot=ball"
    assert out[1].split() == ["run", "state", "seconds", "initial.position", "seed"]
    assert out[2].split() == ["0", "done", "10", "[0,0,0.5]", "0"]
    assert out[5].split() == ["3", "refused", "7", "[0,0,1.0]", "1"]
    # looking leaves nothing behind
    assert [path.name for path in runs.parent.iterdir()] == ["drops"]


def test_measures_come_from_facts_logs_and_tables(runs: Path) -> None:
    """A key of run.json, of another JSON file, statistics of the log and of another table."""
    names = "steps, more.score.rms, position_z.min, position_z.range, fits.error.mean, log.t.last"
    assert main(["runs", "drops", f"metric={names}", "table=out.csv", "where=state=done"]) == 0
    rows = rows_of(Path("out.csv"))
    assert [float(row["steps"]) for row in rows] == [0.0, 100.0, 200.0]
    assert [float(row["more.score.rms"]) for row in rows] == [0.0, 0.25, 0.5]
    assert [float(row["position_z.min"]) for row in rows] == [-0.5, -0.5, -1.0]
    assert [float(row["position_z.range"]) for row in rows] == [1.0, 1.0, 2.0]
    # the value that is missing does not count
    assert [float(row["fits.error.mean"]) for row in rows] == [2.0, 2.5, 2.0]
    assert [float(row["log.t.last"]) for row in rows] == [4.0, 4.0, 4.0]


@pytest.mark.parametrize(
    ("where", "left"),
    [
        ("state=done", "012"),
        ("state!=done", "3"),
        ("seed<1", "02"),
        ("seed>=1, state=re*", "3"),
        ("initial.position=[0,0,0.5]", "01"),
        ("initial.position.2>0.7", "23"),
        ("initial.position=[0, 0, 0.5]", "01"),
        ("initial.position!=[0, 0, 0.5], seed=0", "2"),
        ("seconds<=8", "23"),
        ("robot=b?ll, run!=1", "023"),
    ],
)
def test_conditions_choose_runs(runs: Path, where: str, left: str) -> None:
    """Equality with wildcards, order, places of a list, several at once."""
    assert main(["runs", "drops", f"where={where}", "table=out.csv"]) == 0
    assert "".join(row["run"] for row in rows_of(Path("out.csv"))) == left


def test_rows_are_sorted_and_kept_as_parquet(runs: Path) -> None:
    """The largest first; a run without the measure comes last, as NaN in the file."""
    words = ["metric=position_z.max", "sort=-position_z.max", "table=out.parquet"]
    assert main(["runs", "drops", *words]) == 0
    table = parquet.read_table("out.parquet").to_pydict()
    assert table["run"] == ["2", "0", "1", "3"]
    assert table["position_z.max"][:3] == [1.0, 0.5, 0.5]
    assert np.isnan(table["position_z.max"][3])


def test_a_picture_of_a_measure_against_an_override(runs: Path) -> None:
    """One place of a list on the abscissa, a line for each seed."""
    words = ["metric=position_z.min", "against=initial.position.2", "by=seed"]
    assert main(["runs", "drops", *words, "plot=a.png"]) == 0
    assert Path("a.png").read_bytes().startswith(b"\x89PNG")
    from seals.report.figures import Chart
    from seals.sweep import application

    drawn: list[Chart] = []
    columns = {"seed": [0.0, 0.0, 1.0], "m": [1.0, 3.0, 5.0], "h": ["[1]", "[1]", "[2]"]}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(application, "write_picture", lambda path, chart: drawn.append(chart))
        application.draw(Path("x.png"), columns, "m", "seed")
    mean, points = drawn[0].series
    assert mean.x.tolist() == [0.0, 1.0]
    assert mean.y.tolist() == [2.0, 5.0]
    assert points.points
    assert points.y.tolist() == [1.0, 3.0, 5.0]


def test_values_that_differ_far_behind_the_point_stay_apart(
    runs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Overrides keep their digits in the table and in a picture; measures are shown with four."""
    seeds = (12345, 12346, 0.1234567)
    for number, seed in enumerate(seeds):
        place = runs.parent / "big" / str(number)
        write_yaml(place / ".hydra" / "overrides.yaml", [f"seed={seed}", "name=1.23456"])
        write_json(place / "run.json", {"state": "done", "height": 0.123456})
    assert main(["runs", "big", "metric=height"]) == 0
    out = capsys.readouterr().out.splitlines()
    assert out[0].endswith("name=1.23456")
    assert [line.split()[-2:] for line in out[2:]] == [[str(seed), "0.1235"] for seed in seeds]
    from seals.report.figures import Chart
    from seals.sweep import application

    drawn: list[Chart] = []
    columns = {"seed": [12345.0, 12346.0], "m": [1.0, 3.0], "h": [1.0, 1.0]}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(application, "write_picture", lambda path, chart: drawn.append(chart))
        application.draw(Path("x.png"), columns, "m", "h", "seed")
    assert [one.name for one in drawn[0].series][::2] == ["seed=12345", "seed=12346"]


def test_single_runs_and_trainings_are_rows_as_well(runs: Path) -> None:
    """Folders without a sweep count by run.json, or by the words that Hydra noted."""
    other = runs.parent / "others"
    write_json(
        other / "a" / "run.json", {"state": "failed", "seconds": 2.0, "overrides": ["seed=4"]}
    )
    write_yaml(other / "b" / ".hydra" / "overrides.yaml", ["+name=b", "seed=5"])
    found = find_rows(other)
    assert [row.values["state"] for row in found] == ["failed", "begun"]
    assert [row.get("seed") for row in found] == [4.0, 5.0]
    assert found[1].get("name") == "b"
    assert len(find_rows(runs.parent)) == 6
    # a job alone is found with what its sweep knows of it
    assert [row.values["seconds"] for row in find_rows(runs / "2")] == [8.0]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "folder is not given"),
        (["nowhere"], "folder=nowhere does not exist"),
        (["drops/jobs.csv"], "folder=drops/jobs.csv is a file"),
        (["empty"], "there is no run in it"),
        (["drops", "where=sed<1"], "Did you mean 'seed'?"),
        (["drops", "where=seed"], "this is not a condition"),
        (["drops", "where=seed<b"], "'b' is not a number"),
        (["drops", "where=seed=7"], "none of the 4 runs satisfies it"),
        (["drops", "metric=positon_z.min"], "Did you mean 'position_z'?"),
        (["drops", "metric=position_z.avg"], "Statistics: first"),
        (["drops", "metric=fits.eror.last"], "Did you mean 'error'?"),
        (["drops", "metric=stps"], "Did you mean 'steps'?"),
        (["drops", "sort=sed"], "Did you mean 'seed'?"),
        (["drops", "table=out.xls"], ".csv or .parquet"),
        (["drops", "table=drops/0/run.csv", "plot=a.png"], "metric is not given"),
        (["drops", "by=seed"], "plot=FILE.png, or leave by out"),
        (["drops", "metric=steps", "against=seed"], "plot=FILE.png, or leave against out"),
        (["drops", "plot=a.png", "metric=steps"], "against is not given"),
        (["drops", "plot=a.png", "metric=steps", "against=robot"], "is the same in all runs"),
        (["drops", "plot=a.png", "metric=steps", "against=initial.position"], "one element of the"),
        (["drops", "plot=a.png", "metric=steps", "against=state"], "must be numbers"),
        (
            ["drops", "plot=a.png", "metric=steps", "against=seed", "by=robot"],
            "is the same in all runs",
        ),
        (["drops", "table=drops/jobs.csv"], "exists already"),
        (["drops", "were=1"], "Did you mean 'where'?"),
    ],
)
def test_refusals_of_runs(
    words: list[str], said: str, runs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What cannot be listed is refused in two lines."""
    (runs.parent / "empty").mkdir()
    assert main(["runs", *words]) == 2
    told = capsys.readouterr().err
    assert said in told
    assert len(told.splitlines()) == 2


@pytest.mark.parametrize("file", ["run.json", ".hydra/overrides.yaml"])
@pytest.mark.parametrize("left", [0, 7])
def test_a_damaged_run_does_not_hide_the_others(
    file: str, left: int, runs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A file that a kill tore or emptied is named, its run is marked, and the rest is shown."""
    write_json(runs.parent / "one" / "0" / "run.json", {"state": "done", "overrides": ["seed=4"]})
    write_yaml(runs.parent / "one" / "0" / ".hydra" / "overrides.yaml", {"seed": [1, 2]})
    write_json(runs.parent / "one" / "1" / "run.json", {"state": "done"})
    torn = runs.parent / "one" / "0" / file
    torn.write_text("{ seed: [1, 2"[:left])
    assert main(["runs", "one", "table=out.csv"]) == 0
    assert f"one/0/{file}" in capsys.readouterr().err
    assert [row["state"] for row in rows_of(Path("out.csv"))] == ["damaged", "done"]


def test_a_damaged_book_is_named(runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A book with a wrong line says which file and line it is; an empty one counts as none."""
    with (runs / "jobs.csv").open("a") as file:
        file.write("x,done,0,1.0,seed=1,\n")
    assert main(["runs", "drops"]) == 2
    assert "jobs.csv, line 6, is damaged" in capsys.readouterr().err
    (runs / "jobs.csv").write_text("")
    assert main(["runs", "drops"]) == 0


def test_a_measure_stays_inside_the_folder(runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A name with slashes opens no file elsewhere."""
    write_json(runs / "secret.json", {"key": 5.0})
    for name in ("../secret.key", f"{runs}/secret.key", f"{runs}/0/fits.error.mean"):
        assert main(["runs", "drops", f"metric={name}"]) == 2
        assert "no run has this metric" in capsys.readouterr().err


def test_places_of_lists_sort_and_group(runs: Path) -> None:
    """``KEY.2`` stands for a column wherever one is named."""
    words = ["sort=-initial.position.2", "metric=position_z.min", "table=out.csv"]
    words += ["plot=a.png", "against=seed", "by=initial.position.2"]
    assert main(["runs", "drops", *words]) == 0
    assert [row["run"] for row in rows_of(Path("out.csv"))] == ["2", "3", "0", "1"]
    assert Path("a.png").is_file()


def test_lists_of_lists_keep_their_places() -> None:
    """A place of a list of lists is a list, in conditions as well."""
    row = Row(folder=Path(), values={}, words={"p": "[[1,2],[3,4]]"})
    assert row.get("p.1") == "[3,4]"
    assert row.get("p.3") is None
    (condition,) = read_conditions("p=[[1,2],[3,4]]")
    assert condition.holds(row.get("p"))


def test_missing_values_meet_no_order() -> None:
    """A run without a value meets only !=."""
    less, same, other = read_conditions("a<1, a=1, a!=1")
    assert not less.holds(None)
    assert not same.holds(None)
    assert other.holds(None)
    assert same.holds(1.0)
    assert not less.holds("text")
