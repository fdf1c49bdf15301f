"""Score of the public logs: counts by hand, and a stranger's answers beside ours."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from seals.cli.main import main
from seals.errors import ConfigError
from seals.experiments.naming_benchmark import command
from seals.experiments.naming_benchmark.command import BEGIN, END, into_page
from seals.experiments.naming_benchmark.regions import AXES, Shown, true_regions
from seals.experiments.naming_benchmark.score import Counts, compared, score, table
from seals.experiments.naming_benchmark.told import right

NOWHERE = {"by_time": [], "by_phase": []}


def answer(verdict: str, *names: str, said: list[str] | None = None) -> dict[str, object]:
    """Return an answer that declares some regions of which `a` and `b` are true."""
    declared = {"by_time": said or [], "by_phase": []}
    there = {"by_time": ["a", "b"], "by_phase": []}
    effects = [{"name": name} for name in names]
    regions = {"true": there, "declared": declared}
    return {"verdict": verdict, "effects": effects, "regions": regions, "seconds": 1.0}


def truth(*names: str, inside: bool = True) -> dict[str, object]:
    """Return the truth of a log."""
    return {"effects": [{"name": name} for name in names], "in_library": inside}


def test_f1_and_false_discovery_by_hand() -> None:
    """Two of three declared are there, one of three there is missed."""
    counts = compared({"a", "b", "c"}, {"b", "c", "d"})
    assert counts == Counts(true=2, false=1, missed=1)
    assert counts.f1 == pytest.approx(2.0 * (2 / 3) * (2 / 3) / (4 / 3))
    assert counts.false_discovery == pytest.approx(1 / 3)


@pytest.mark.parametrize(
    ("known", "told", "expected"),
    [
        (truth("wind"), answer("named", "wind"), True),
        (truth("wind"), answer("named", "wind", "payload"), False),
        (truth("linear_drag"), answer("named", "linear_drag", "angular_drag"), True),
        (truth("wind"), answer("ambiguous", "wind", "payload"), False),
        (truth(), answer("nothing_missing"), True),
        (truth(), answer("cannot_tell"), False),
        (truth("magnet", inside=False), answer("none_of_these"), True),
        (truth("magnet", inside=False), answer("named", "tether"), False),
    ],
)
def test_what_is_right_as_a_whole(
    known: dict[str, object], told: dict[str, object], *, expected: bool
) -> None:
    """All names and no other; nothing where nothing is; refused outside the library."""
    assert right(known, told) is expected


def test_a_score_adds_up_over_logs() -> None:
    """One right, one false alarm and one stranger that got a name."""
    pairs = [
        (truth("wind"), answer("named", "wind", said=["a"])),
        (truth(), answer("named", "payload", said=["c"])),
        (truth("magnet", inside=False), answer("named", "tether")),
    ]
    found = score("ours", pairs)
    assert (found.logs, found.right, found.alarms, found.calm) == (3, 1, 1, 1)
    assert found.names == Counts(true=1, false=2, missed=0)
    assert found.regions["by_time"] == Counts(true=1, false=1, missed=5)
    assert "| ours | 3 | 1 | 1 of 1 |" in table([found])


def test_regions_are_where_the_readings_move_as_much_as_their_noise() -> None:
    """Two windows a second; a phase joins seconds."""
    size = np.zeros((4, 6))
    size[0, 0], size[1, 0], size[2, 5] = 1.6, 0.2, 3.0
    shown = Shown(np.array([0.25, 0.75, 1.25, 1.75]), size)
    found = shown.regions(0.0, ["air calm", "air lively"])
    assert found.by_time == {"0 s specific_force_x", "1 s angular_velocity_z"}
    assert found.by_phase == {"air calm specific_force_x", "air lively angular_velocity_z"}


def test_the_public_logs_hold_what_they_say() -> None:
    """Where nothing is hidden no reading moves; elsewhere some do, in half seconds of 18 s."""
    folders = sorted(path.parent for path in command.LOGS.glob("*/truth.yaml"))
    assert len(folders) == 10
    for folder in folders:
        hidden = yaml.safe_load((folder / "truth.yaml").read_text(encoding="utf-8"))["effects"]
        shown = true_regions(folder)
        assert shown.size.shape == (36, len(AXES))
        assert (shown.size.max() > 1.0) == bool(hidden), folder.name


def test_a_method_of_ones_own_is_scored(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An answer that lies in the folder gets its regions and a row; nothing else is answered."""
    own = tmp_path / "mine"
    own.mkdir()
    told = {"verdict": "named", "effects": [{"name": "linear_drag"}]}
    (own / "quad_drag.json").write_text(json.dumps(told), encoding="utf-8")
    assert main(["benchmark", f"out={tmp_path}", "logs=[quad_drag]", "methods=[]"]) == 0
    assert "| mine | 1 | 1 | 0 of 0 | 1.00 | 0.00 |" in capsys.readouterr().out
    regions = json.loads((own / "quad_drag.json").read_text(encoding="utf-8"))["regions"]
    assert set(regions["true"]["by_time"]) & set(regions["declared"]["by_time"])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["log=[quad_drag]"], "Did you mean 'logs'"),
        (["logs=[quad_drg]"], "quad_drag"),
        (["methods=[mujoco_sysid]"], "needs mujoco=PYTHON"),
    ],
)
def test_slips_are_refused_in_words(
    words: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 2, and what is meant or needed."""
    assert main(["benchmark", f"out={tmp_path}", *words]) == 2
    assert said in capsys.readouterr().err


def test_an_answer_that_is_none_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A file without a verdict is named with what it should hold."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "quad_drag.json").write_text("[]", encoding="utf-8")
    assert main(["benchmark", f"out={tmp_path}", "logs=[quad_drag]", "methods=[]"]) == 2
    assert "is no answer" in capsys.readouterr().err


def test_a_page_gets_the_table_between_its_marks(tmp_path: Path) -> None:
    """What stands around it stays; a page without marks is refused."""
    page = tmp_path / "page.md"
    page.write_text(f"a\n{BEGIN}\nold\n{END}\nb\n", encoding="utf-8")
    into_page(page, "| new |")
    assert page.read_text(encoding="utf-8") == f"a\n{BEGIN}\n\n| new |\n\n{END}\nb\n"
    page.write_text("a\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="has no"):
        into_page(page, "| new |")
