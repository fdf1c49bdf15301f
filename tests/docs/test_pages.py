"""Every page is run as it is printed, in an empty folder; what is not run says why."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from seals.cli.main import VERBS

ROOT = Path(__file__).parents[2]
if str(ROOT) not in sys.path:
    sys.path.append(str(ROOT))

from tests.docs.follow import follow  # noqa: E402
from tests.docs.pages import WHENS, blocks, pages, steps, told  # noqa: E402

PAGES = pages(ROOT)
# their own tests look at what they make, too
TUTORIALS = (
    "tutorial_missing_effect.md",
    "tutorial_own_robot.md",
    "tutorial_own_animal.md",
    "tutorial_own_flight.md",
)
LANGUAGES = {"console", "python", "yaml", "toml", "text", "json", "xml", "bibtex"}
COMMAND = re.compile(r"^\s*(?:\$ )?(?:seals|python|pip|pytest|make|git|apt-get) \S", re.M)


def name_of(page: Path) -> str:
    """The name of a test: that of its page."""
    return page.stem


@pytest.mark.parametrize("page", [p for p in PAGES if p.name not in TUTORIALS], ids=name_of)
def test_a_page_runs_as_printed(page: Path, tmp_path: Path) -> None:
    """Its commands and programs end and print as it says."""
    folder = tmp_path / "bare"
    folder.mkdir()
    follow(page, folder)


def slow_pages() -> list[Path]:
    """The pages with blocks that take long."""
    return [p for p in PAGES if any(b.when == "slow" for b in blocks(p.read_text("utf-8")))]


@pytest.mark.slow
@pytest.mark.parametrize("page", slow_pages(), ids=name_of)
def test_a_page_runs_as_printed_with_what_takes_long(page: Path, tmp_path: Path) -> None:
    """The whole page, in order."""
    folder = tmp_path / "bare"
    folder.mkdir()
    follow(page, folder, slow=True)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_a_page_hides_no_command(page: Path) -> None:
    """Commands stand in blocks that are run, or that say in words why they are not."""
    text = page.read_text(encoding="utf-8")
    for block in blocks(text):
        where = f"{page.name}:{block.line}"
        assert block.language in LANGUAGES, f"{where}: language {block.language!r}"
        assert block.when in WHENS, f"{where}: {block.when!r} is none of {WHENS}"
        assert block.when == "always" or len(block.reason.split()) > 2, f"{where}: no reason"
        if block.language in ("text", "yaml", "json") and not block.file:
            assert not COMMAND.search(block.text), f"{where}: a command that nobody runs"
    outside = re.sub(r"^```.*?^```", "", text, flags=re.S | re.M)
    hidden = [line for line in outside.splitlines() if re.match(r" {4}", line)]
    assert not [line for line in hidden if COMMAND.match(line)], page.name


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
            assert follow(page, folder) == 1
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
    assert follow(page, folder) == 2
    assert (folder / "a" / "b.yaml").read_text() == "x: 1\n"
    assert told("x: 1", "x: 1.01")
    assert not told("x: 1", "x: 2")


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
