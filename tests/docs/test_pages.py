"""Every page is run as it is printed, in an empty folder; what is not run says why."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from seals.cli.main import VERBS

ROOT = Path(__file__).parents[2]
from tests.docs.follow import follow, main, walk  # noqa: E402
from tests.docs.pages import (  # noqa: E402
    OBSTACLES,
    WHENS,
    blocks,
    name_of,
    pages,
    steps,
    told,
    untied,
)

PAGES = pages(ROOT)
# their own tests look at what they make, too
TUTORIALS = (
    "tutorial_missing_effect.md",
    "tutorial_own_robot.md",
    "tutorial_own_animal.md",
    "tutorial_own_flight.md",
)
LANGUAGES = {"console", "python", "yaml", "toml", "text", "json", "xml", "bibtex", "printed"}
FIRST = ("README", "start", "formats", "tethers")
"""Pages that make test follows; make thorough follows the others."""
MOST_NEVER = 15
"""Blocks that need a network, a person, an accelerator or a program that is not here."""
LASTS = re.compile(r"\d+ (s|min)\b")
COMMAND = re.compile(r"^\s*(?:\$ )?(?:seals|python|pip|pytest|make|git|apt-get) \S", re.M)


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(
            page, marks=[] if name_of(page) in FIRST else [pytest.mark.thorough, pytest.mark.pages]
        )
        for page in PAGES
        if page.name not in TUTORIALS
    ],
    ids=name_of,
)
def test_a_page_runs_as_printed(page: Path, tmp_path: Path) -> None:
    """Its commands and programs end and print as it says; ``make pages`` runs the slow ones."""
    folder = tmp_path / "bare"
    folder.mkdir()
    follow(page, folder)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_a_page_hides_no_command(page: Path) -> None:
    """Commands stand in blocks that are run, or that say in words why they are not."""
    text = page.read_text(encoding="utf-8")
    for block in blocks(text):
        where = f"{name_of(page)}:{block.line}"
        assert block.language in LANGUAGES, f"{where}: language {block.language!r}"
        assert block.when in WHENS, f"{where}: {block.when!r} is none of {WHENS}"
        assert block.when != "slow" or LASTS.match(block.reason), f"{where}: how long?"
        wanting = block.reason.partition(":")[0]
        assert block.when != "never" or wanting in OBSTACLES, f"{where}: none of {OBSTACLES}"
        assert block.language != "printed" or not untied(block), f"{where}: not in the paragraph"
        if block.language in ("text", "yaml", "json") and not block.file:
            assert not COMMAND.search(block.text), f"{where}: a command that nobody runs"
    outside = re.sub(r"^```.*?^```", "", text, flags=re.S | re.M)
    hidden = [line for line in outside.splitlines() if re.match(r" {4}", line)]
    assert not [line for line in hidden if COMMAND.match(line)], name_of(page)


def test_few_blocks_are_never_run() -> None:
    """Only what no test can have."""
    never = [
        f"{name_of(page)}:{block.line}"
        for page in PAGES
        for block in blocks(page.read_text(encoding="utf-8"))
        if block.when == "never"
    ]
    assert len(never) <= MOST_NEVER, never


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_a_command_that_is_not_run_has_a_verb_that_exists(page: Path) -> None:
    """Of blocks that are never run, the verb at least is true."""
    for step in steps(page.read_text(encoding="utf-8")):
        words = step.command.split()
        if words[0] == "seals" and len(words) > 1:
            assert words[1] in VERBS or step.code == 2, step.command


def test_the_readme_and_the_start_are_run_whole() -> None:
    """Of these two, nothing is left out but what this very check is part of, or a download."""
    for name in ("README.md", "docs/start.md"):
        left = [b for b in blocks((ROOT / name).read_text("utf-8")) if b.when == "never"]
        words = " ".join(step.command for block in left for step in block.steps)
        assert "seals " not in words, name


def test_a_line_that_is_not_printed_is_found(tmp_path: Path) -> None:
    """The runner refuses a wrong line, a wrong exit code, and a program that raises."""
    good = "```console\n$ echo 12 seals\n12 seals\n$ exit 3\n[exit code 3]\n```\n"
    wrong = {
        "line": "```console\n$ echo 12 seals\n13 seals\n```\n",
        "code": "```console\n$ exit 3\n```\n",
        "program": "```python\nraise ValueError\n```\n",
    }
    for name, text in {"good": good, **wrong}.items():
        page = tmp_path / f"{name}.md"
        page.write_text(text, encoding="utf-8")
        folder = tmp_path / name
        folder.mkdir()
        if name == "good":
            assert follow(page, folder)[:3] == (1, 2, 1)
        else:
            with pytest.raises(AssertionError):
                follow(page, folder)


def test_a_page_says_what_it_saves_and_what_it_leaves_out(tmp_path: Path) -> None:
    """Files are saved under their name; blocks that are slow or never run are passed by."""
    text = (
        "Save as `a/b.yaml`:\n\n```yaml\nx: 1\n```\n\n"
        "<!-- run: slow, an hour of computing -->\n```console\n$ false\n```\n"
        "<!-- run: never, it waits for a browser -->\n\n```console\n$ false\n```\n"
        "```console\n$ cat a/b.yaml \\\n  a/b.yaml\nx: 1\n```\n"
    )
    assert [b.when for b in blocks(text)] == ["always", "slow", "never", "always"]
    page = tmp_path / "page.md"
    page.write_text(text, encoding="utf-8")
    folder = tmp_path / "bare"
    folder.mkdir()
    assert follow(page, folder).blocks == 2
    assert (folder / "a" / "b.yaml").read_text() == "x: 1\n"


@pytest.mark.parametrize(
    ("line", "output", "same"),
    [
        ("misfit 2 -> 0.99", "misfit 2 -> 0.987 (floor 1)", True),
        ("misfit 2 -> 0.99", "misfit 2 -> 0.981 (floor 1)", False),
        # both are rounded: a last digit may go up or down by one
        ("x = 2.708 m/s", "x = 2.707 m/s", True),
        ("x = 2.708 m/s", "x = 2.706 m/s", False),
        ("x = 2.7 m/s", "x = -2.7 m/s", False),
        ("2.7 m/s", "12.7 m/s", False),
        ("2.7 m/s", "-2.7 m/s", False),
        # counts are exact
        ("12 seals", "13 seals", False),
        ("12 seals", "12.4 seals", True),
        ("momentum 5.4e-08 a step", "momentum 5.41e-08 a step", True),
        ("momentum 5.4e-08 a step", "momentum 5.5e-08 a step", True),
        ("momentum 5.4e-08 a step", "momentum 5.6e-08 a step", False),
        ("momentum 5.4e-08 a step", "momentum 5.4e-07 a step", False),
        ("wind ... 90 %", "wind, after 3 s, 90 %", True),
        ("wind ... 90 %", "wind\n90 %", False),
        ("a 1 b 2", "a 1 b 3\na 1 b 2", True),
        ("2 3", "1 2 3", True),
    ],
)
def test_figures_are_compared_to_the_digits_shown(line: str, output: str, same: bool) -> None:
    """Rounded figures to a unit of their last digit, counts exactly, dots for what is left out."""
    assert told(line, output) is same


def followed(tmp_path: Path, text: str, *, slow: bool = False) -> list[str]:
    """The faults of a page."""
    page = tmp_path / "page.md"
    page.write_text(text, encoding="utf-8")
    (tmp_path / "bare").mkdir()
    return walk(page, tmp_path / "bare", slow=slow).faults


PRINTS = "```console\n$ echo 'error 8.912, 2.15'\n```\n\n"


@pytest.mark.parametrize(
    ("prose", "wrong"),
    [
        ("It fell from 8.9.\n<!-- printed: error 8.9, ... -->\n", ""),
        ("It fell from 8.7.\n<!-- printed: error 8.7, ... -->\n", "error 8.912, 2.15"),
        ("It fell from 8.7.\n<!-- printed: error 8.9, ... -->\n", "figures 8.9"),
        ("8.9\n\nIt fell.\n<!-- printed: error 8.9, ... -->\n", "figures 8.9"),
    ],
)
def test_figures_of_prose_are_tied_to_what_was_printed(
    tmp_path: Path, prose: str, wrong: str
) -> None:
    """A figure that the paragraph shows otherwise, or that no command printed, is found."""
    faults = followed(tmp_path, PRINTS + prose)
    assert len(faults) == bool(wrong)
    assert wrong in "".join(faults)


@pytest.mark.parametrize(("figure", "count"), [("2.15", 0), ("2.25", 1)])
def test_all_rows_of_a_table_are_tied(tmp_path: Path, figure: str, count: int) -> None:
    """Each row below the head was printed."""
    printed = "```console\n$ echo '| a | 8.912 |'; echo '| b | 2.15 |'\n```\n\n"
    table = f"| of | error |\n|---|---|\n| a | 8.9 |\n| b | {figure} |\n<!-- printed: rows -->\n"
    assert len(followed(tmp_path, printed + table)) == count


def test_a_tie_waits_for_a_slow_block(tmp_path: Path) -> None:
    """Where the block that prints was left out, its figures are not compared; else they are."""
    slow = "<!-- run: slow, 1 s -->\n" + PRINTS + "It was 1.5.\n<!-- printed: error 1.5 -->\n"
    assert followed(tmp_path, slow) == []
    (tmp_path / "bare").rename(tmp_path / "before")
    assert len(followed(tmp_path, slow, slow=True)) == 1


def test_what_would_go_on_for_ever_is_interrupted(tmp_path: Path) -> None:
    """Ctrl-C once the lines were seen; a command that ends with a fault before is found."""
    good = "```console\n$ echo ready; sleep 600\nready\n^C\n```\n"
    assert followed(tmp_path, good) == []
    (tmp_path / "bare").rename(tmp_path / "before")
    assert len(followed(tmp_path, good.replace("sleep 600", "exit 3"))) == 1


def test_a_block_may_be_run_in_a_clone(tmp_path: Path) -> None:
    """There the sources lie; what it writes stays out of them."""
    block = "```console\n$ ls README.md; touch made\nREADME.md\n```\n"
    text = f"<!-- run: slow, 1 s in a clone -->\n{block}"
    assert followed(tmp_path, text, slow=True) == []
    assert not (ROOT / "made").exists()


def test_a_failure_says_where_and_what(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Page, line, expected, got; then commands, figures and time; exit code 1."""
    page = tmp_path / "page.md"
    page.write_text("# A\n\n```console\n$ echo 12.5 seals\n13.5 seals\n```\n", encoding="utf-8")
    assert main([str(page)]) == 1
    out, err = capsys.readouterr()
    assert "page.md:4: echo 12.5 seals\n  expected: 13.5 seals\n  got:      12.5 seals" in err
    assert "1 commands run, 1 figures compared, 1 wrong, in 0 s" in out


def test_results_survive_and_what_is_green_is_not_run_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A page is run again where it was wrong or its blocks have changed; what is kept counts."""
    kept = tmp_path / "pages.json"
    good, wrong = tmp_path / "good.md", tmp_path / "wrong.md"
    good.write_text(f"```console\n$ echo 1.5; touch {tmp_path}/run\n1.5\n```\n", encoding="utf-8")
    wrong.write_text("```console\n$ echo 1.5\n1.7\n```\n", encoding="utf-8")
    words = [str(good), str(wrong), "--results", str(kept)]
    assert main(words) == 1
    assert "2 pages: 2 commands run, 2 figures compared, 1 wrong" in capsys.readouterr().out
    (tmp_path / "run").unlink()
    wrong.write_text("```console\n$ echo 1.7\n1.7\n```\n", encoding="utf-8")
    assert main(words) == 0
    assert "2 pages: 2 commands run, 2 figures compared, 0 wrong" in capsys.readouterr().out
    assert not (tmp_path / "run").exists()
    good.write_text(good.read_text() + "\nMore.\n", encoding="utf-8")
    assert main(words) == 0
    assert not (tmp_path / "run").exists()
    good.write_text(good.read_text().replace("\n1.5", "\n1.50"), encoding="utf-8")
    assert main(words) == 0
    assert (tmp_path / "run").exists()


def test_a_page_that_changes_while_it_is_run_is_run_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What was found belongs to the page that was read."""
    page, kept = tmp_path / "page.md", tmp_path / "pages.json"
    command = f"sed -i s/1.5$/1.7/ {page}; echo 1.5;"
    page.write_text(f"```console\n$ {command}\n1.5\n```\n", encoding="utf-8")
    assert main([str(page), "--results", str(kept)]) == 0
    assert main([str(page), "--results", str(kept)]) == 1
    assert "expected: 1.7" in capsys.readouterr().err


TEN_LINES = {
    "autopilots.md": 2,  # ArduPilot and PX4
    "ros2.md": 3,  # ROS 2, a recording, Foxglove
    "sensors.md": 1,
    "learning_tools.md": 1,
}


@pytest.mark.parametrize("name", TEN_LINES)
def test_a_newcomer_gets_to_a_bridge_in_ten_lines(name: str) -> None:
    """Words, commands and programs of such a part, without fences and remarks on tests."""
    text = (ROOT / "docs" / name).read_text(encoding="utf-8")
    parts = re.findall(r"^#+ [^\n]* in ten lines\n(.*?)(?=^#|\Z)", text, re.M | re.S)
    assert len(parts) == TEN_LINES[name]
    for part in parts:
        lines = [x for x in part.splitlines() if x and not x.startswith(("```", "<!--"))]
        assert 2 <= len(lines) <= 10, "\n".join(lines)
