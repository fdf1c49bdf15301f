"""What strangers named does not steer the terminal."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path

import pytest

from seals.cli.check import show
from seals.cli.main import main
from seals.config.compose import compose
from seals.errors import ConfigError
from seals.run.build import build_run
from seals.terminal import PlainStream, drawing, plain_streams
from seals.text_table import table

STEERING = "\x1b[2J\x1b]0;owned\x07\x9b1A\u202e"
"""Clears the screen, sets the title, goes up a line, writes from the right."""


def steers(text: str) -> bool:
    """Return whether a text has signs that are neither printable nor ends of lines."""
    return not text.replace("\n", "").replace("\t", "").isprintable()


def test_streams_replace_what_steers() -> None:
    """For a while, once, also for lines written together; other attributes are those below."""
    below = io.StringIO()
    stream = PlainStream(below)
    stream.writelines([f"µ {STEERING}\n", "\ta\r"])
    assert not steers(below.getvalue())
    assert below.getvalue().startswith("µ ")
    assert stream.getvalue() == below.getvalue()
    assert drawing(stream) is below  # type: ignore[arg-type]
    before = sys.stdout, sys.stderr
    with plain_streams(), plain_streams():
        assert drawing(sys.stdout) is before[0]
        assert drawing(sys.stderr) is before[1]
    assert (sys.stdout, sys.stderr) == before


def test_names_of_columns_are_printed_plainly(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A log whose columns are sequences of a terminal is converted, and remarked on."""
    log = tmp_path / "a.csv"
    rows = "".join(f"{k / 100},{k % 7},{k % 5}\n" for k in range(300))
    log.write_text(f"t,depth,{STEERING}\n{rows}")
    assert main(["convert", f"log={log}", "reader=csv", f"out={tmp_path / 'out'}"]) == 0
    said = capsys.readouterr()
    assert "owned" in said.out + said.err
    assert not steers(said.out + said.err)


def test_words_of_a_refusal_are_printed_plainly(capsys: pytest.CaptureFixture[str]) -> None:
    """Whoever gives a value that a stranger wrote sees it without its steering signs."""
    assert main(["run", f"robot={STEERING}owned"]) == 2
    assert not steers(capsys.readouterr().err)


def test_a_table_of_runs_is_printed_plainly(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A state that holds a line of its own forges none."""
    (tmp_path / "a").mkdir()
    facts = {"state": f"done\nforged  done{STEERING}", "seconds": 1.0}
    (tmp_path / "a" / "run.json").write_text(json.dumps(facts))
    assert main(["runs", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert not steers(out)
    assert not any(line.startswith("forged") for line in out.splitlines())
    assert len(table([("a", "b\nc")]).splitlines()) == 1


def test_a_check_is_printed_plainly(capsys: pytest.CaptureFixture[str]) -> None:
    """Its table is drawn past the plain stream; markup in a name is none."""
    from seals.check.finding import RobotFinding, Verdict

    words = dict.fromkeys(("subject", "found", "advice"), STEERING)
    finding = RobotFinding(verdict=Verdict.WARN, **words)
    with plain_streams():
        show(f"a[/b]{STEERING}", [finding])
    out = capsys.readouterr().out
    assert not steers(out)
    assert "a[/b]" in out


@pytest.mark.parametrize("name", ["a\nb", "a\x1b[31m", "a\u202eb"])
def test_a_name_of_a_run_is_one_printable_line(name: str) -> None:
    """It becomes part of a folder's name, and of every line on the run."""
    config = compose(["robot=ball"])
    config.name = name
    with pytest.raises(ConfigError, match="cannot be part of a folder's name"):
        build_run(config)
