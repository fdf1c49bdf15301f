"""A run is repeated from its folder alone, bit for bit."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
import yaml

from seals.cli.main import main
from seals.logs.table import read_parquet
from seals.run.provenance import differences, version_changes

pytestmark = pytest.mark.usefixtures("elsewhere")

LINE = ["run", "experiment=drop_test", "time.duration=0.6", "initial.velocity=[0.3,0,0]", "seed=11"]


def run(where: Path, *words: str) -> Path:
    """Run the command and return its folder."""
    assert main([*words, f"hydra.run.dir={where}"]) == 0
    return where


def test_repeat_is_bit_for_bit(elsewhere: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Log and ledger of the repeated run are the same bits, in every column."""
    first = run(elsewhere / "first", *LINE)
    capsys.readouterr()
    assert main(["run", f"repeat={first}"]) == 0
    assert "bit for bit" in capsys.readouterr().out
    (second,) = elsewhere.glob("runs/*/*")
    for table in ("log.parquet", "ledger.parquet"):
        old, new = read_parquet(first / table), read_parquet(second / table)
        assert list(old) == list(new)
        assert {key: value.tobytes() for key, value in old.items()} == {
            key: value.tobytes() for key, value in new.items()
        }
    assert json.loads((second / "run.json").read_text())["repeat_of"] == str(first)


def test_a_repeat_can_be_repeated(elsewhere: Path) -> None:
    """The folder of a repetition stands for itself: the first one may be gone."""
    first = run(elsewhere / "first", *LINE)
    assert main(["run", f"repeat={first}"]) == 0
    (second,) = elsewhere.glob("runs/*/*")
    kept = shutil.copytree(first, elsewhere / "kept")
    shutil.rmtree(first)
    third = elsewhere / "third"
    shutil.copytree(second, elsewhere / "source")
    shutil.rmtree(elsewhere / "runs")
    assert main(["run", f"repeat={elsewhere / 'source'}"]) == 0
    (made,) = elsewhere.glob("runs/*/*")
    made.rename(third)
    assert differences(third, kept) == []


def test_another_seed_is_another_log(elsewhere: Path) -> None:
    """The comparison finds a difference where there is one."""
    first = run(elsewhere / "first", *LINE)
    other = run(elsewhere / "other", *LINE[:-1], "seed=12")
    found = differences(other, first)
    assert "log.parquet:specific_force_x" in found
    assert "log.parquet:position_z" not in found


def test_changed_robot_is_taken_from_the_run(pebble: Path, elsewhere: Path) -> None:
    """A URDF that changed since is read from the run's own copy."""
    first = run(elsewhere / "first", "run", f"robot={pebble}", "time.duration=0.1")
    urdf = pebble / "pebble.urdf"
    urdf.write_text(
        urdf.read_text().replace('mass value="0.3"', 'mass value="0.4"'), encoding="utf-8"
    )
    assert main(["run", f"repeat={first}"]) == 0
    (second,) = elsewhere.glob("runs/*/*")
    assert differences(second, first) == []


def test_robot_with_a_changed_mesh_is_refused(
    pebble: Path, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Meshes are not kept in the run: a changed one is named and refused."""
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    (pebble / "hull.obj").write_text(corners, encoding="utf-8")
    hull = "{base: {shapes: [{type: mesh, file: hull.obj}]}}"
    (pebble / "robot.yaml").write_text(f"urdf: pebble.urdf\nhulls: {hull}\n", encoding="utf-8")
    first = run(elsewhere / "first", "run", f"robot={pebble}", "time.duration=0.02")
    (pebble / "hull.obj").write_text(corners.replace("0 0 1", "0 0 2"), encoding="utf-8")
    capsys.readouterr()
    assert main(["run", f"repeat={first}"]) == 2
    assert "hull.obj" in capsys.readouterr().err
    assert not list(elsewhere.glob("runs/*/*"))


@pytest.mark.parametrize(
    ("words", "wrong"),
    [
        (["repeat=nowhere"], "there is no such folder"),
        (["repeat=first", "seed=3"], "cannot be combined with seed=3"),
        (["repeat=first", "robot=ball"], "cannot be combined with robot=ball"),
    ],
)
def test_wrong_repeat_gets_two_lines(
    words: list[str], wrong: str, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What is no run, and what would change one, is refused."""
    run(elsewhere / "first", *LINE)
    capsys.readouterr()
    assert main(["run", *words]) == 2
    out, err = capsys.readouterr()
    assert (out, len(err.splitlines())) == ("", 2)
    assert wrong in err
    assert not (elsewhere / "runs").exists()


@pytest.mark.thorough
@pytest.mark.parametrize("target", ["os.system", "seals.cli.main.main", None, 3])
def test_foreign_class_in_a_run_is_refused(
    target: object, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A folder from elsewhere cannot name what is called: installed plug-ins only."""
    first = run(elsewhere / "first", *LINE)
    path = first / ".hydra" / "config.yaml"
    config = yaml.safe_load(path.read_text())
    config["effects"]["gravity"]["_target_"] = target
    path.write_text(yaml.safe_dump(config), encoding="utf-8")
    capsys.readouterr()
    assert main(["run", f"repeat={first}"]) == 2
    assert "effects.gravity" in capsys.readouterr().err


def test_half_a_configuration_is_no_run(
    elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Cut on a full disk it may be sound YAML still, of another run than the one meant."""
    path = run(elsewhere / "first", *LINE) / ".hydra" / "config.yaml"
    text = path.read_text()
    half = text[: text.index("seed: ") + len("seed: ")] + "1"
    assert yaml.safe_load(half)["seed"] == 1
    path.write_text(half)
    capsys.readouterr()
    assert main(["run", f"repeat={path.parents[1]}"]) == 2
    assert "is truncated" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["", "[1, 2]", "a: [", "\x00", "effects: 3", "time: {step: x}"])
def test_damaged_configuration_is_refused(
    text: str, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A configuration that was cut or mixed up is refused in words."""
    folder = elsewhere / "first" / ".hydra"
    folder.mkdir(parents=True)
    (folder / "config.yaml").write_text(text, encoding="utf-8")
    assert main(["run", "repeat=first"]) == 2
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 2
    assert "Traceback" not in err


def test_other_versions_are_named(elsewhere: Path) -> None:
    """Where a package has another version than in the run, both are said."""
    first = run(elsewhere / "first", *LINE)
    assert version_changes(first) == []
    facts = json.loads((first / "run.json").read_text())
    facts["versions"]["numpy"] = "1.0"
    (first / "run.json").write_text(json.dumps(facts), encoding="utf-8")
    (said,) = version_changes(first)
    assert said.startswith("numpy 1.0 then, ")
