"""``out=FOLDER`` is the folder of the output, whatever the verb."""

from __future__ import annotations

from pathlib import Path

import pytest

from seals.cli.main import main
from seals.cli.slips import with_folder
from seals.experiments.command import folder_of, parser_of

BRIEF = ["robot=ball", "time.duration=0.02", "initial.position=[0,0,1]"]
pytestmark = pytest.mark.usefixtures("elsewhere")


def test_a_run_goes_to_its_folder() -> None:
    """The words of the run and its files lie there, and nowhere else."""
    assert main(["run", *BRIEF, "out=one"]) == 0
    assert (Path("one") / "log.parquet").is_file()
    assert not Path("runs").exists()


def test_a_sweep_goes_to_its_folder() -> None:
    """Each job has a folder of its own in it."""
    assert main(["run", "--multirun", *BRIEF, "seed=0,1", "out=two"]) == 0
    assert sorted(p.name for p in Path("two").iterdir() if p.is_dir()) == ["0", "1"]


@pytest.mark.thorough
def test_an_answer_goes_to_its_folder(elsewhere: Path) -> None:
    """Verbs with an answer leave no folder of their own beside it, whether or not it is good."""
    assert main(["run", *BRIEF, "time.duration=0.5", "out=flown"]) == 0
    assert main(["compare", "flown", "ball", "out=compared"]) == 0
    assert main(["diagnose", "flown", "ball", "out=answer", "plan=false"]) == 0
    assert main(["render", "flown", "out=drawn", "film=false", "width=32", "height=24"]) == 0
    folders = {path.name for path in elsewhere.iterdir()}
    assert folders == {"flown", "compared", "answer", "drawn"}


def test_a_folder_without_a_name_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    """It would be the present one."""
    assert main(["run", *BRIEF, "out="]) == 2
    assert "does not name a folder" in capsys.readouterr().err


def test_a_run_that_would_overwrite_what_it_repeats_is_refused(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """By either word for the folder."""
    assert main(["run", "repeat=old", "out=./old"]) == 2
    assert "out=./old is the folder of the run itself" in capsys.readouterr().err


def test_verbs_with_an_answer_of_their_own_keep_the_word() -> None:
    """Their output may lie beside the record of the call."""
    assert with_folder("diagnose", ["out=answer"], several=False) == ["out=answer"]


@pytest.mark.parametrize("words", [["out=here"], ["--out", "here"], ["seed=1", "--out=here"]])
def test_an_experiment_takes_the_word_too(words: list[str]) -> None:
    """Beside its option, and not among the overrides of its runs."""
    given = parser_of("soak").parse_args(words)
    assert folder_of(given, "soak") == Path("here")
    assert given.overrides == [word for word in words if word == "seed=1"]
