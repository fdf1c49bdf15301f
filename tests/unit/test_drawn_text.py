"""Text of strangers is drawn as it is: no formula, no markup, no program of a page."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.cli.main import main
from seals.drawn_text import in_markdown, in_table
from seals.logs.atomic import write_table
from seals.report.figures import Chart, Mark, Series
from seals.report.page import Paragraph, Section, page
from seals.report.pictures import figure_class, log_scale, write_picture
from seals.sweep.book import Job, claimed, read_jobs

pytestmark = pytest.mark.usefixtures("elsewhere")

NAME = "base$\\frac$"
"""A name that is half a formula."""
HOSTILE = ["=cmd|'/C calc'!A0", "+1+cmd|' /C calc'!A0", "-2+3", "@SUM(1)", "\tx", "\r=1"]


def test_names_in_charts_are_no_formulas() -> None:
    """Dollars in titles, axes, keys and marks are dollars."""
    line = Series(name=NAME, x=np.arange(3.0), y=np.arange(3.0))
    chart = Chart(
        title=NAME, y_label=NAME, x_label=NAME, series=(line,), marks=(Mark(at=1.0, label=NAME),)
    )
    assert write_picture("a.png", chart).is_file()
    axes: Any = figure_class()().add_subplot()
    assert not axes.set_title(NAME).get_parse_math()


def test_logarithmic_axes_have_plain_labels() -> None:
    """With formulas left out, powers are written as numbers."""
    figure = figure_class()()
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    axes: Any = figure.add_subplot()
    axes.plot([1.0, 1e3], [1.0, 1e3])
    log_scale(axes, "y")
    FigureCanvasAgg(figure).draw()
    found = [label.get_text() for label in axes.get_yticklabels() if label.get_text()]
    assert found
    assert not any("$" in text for text in found)


def test_a_robot_named_by_formulas_runs() -> None:
    """Names of robot and links reach report and charts, and are drawn as they are."""
    Path("r").mkdir()
    Path("r/r.urdf").write_text(
        f'<robot name="{NAME}"><link name="{NAME}"><inertial><mass value="1"/><inertia ixx="1" '
        'iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>'
    )
    Path("r/robot.yaml").write_text("urdf: r.urdf\n")
    assert main(["run", "robot=r", "time.duration=0.05", "out=made"]) == 0
    assert (Path("made") / "report.html").is_file()


@pytest.mark.parametrize("text", HOSTILE)
def test_cells_of_tables_are_no_formulas(text: str) -> None:
    """A spreadsheet would run what begins with such a sign; numbers stay numbers."""
    assert in_table(text) == f"'{text}"
    write_table("t.csv", {text: np.array([1.0, -2.0]), "words": np.array([text, "-3"])})
    content = Path("t.csv").read_bytes().decode()
    assert f'"\'{text}"' in content
    assert '"-3"' in content
    write_table("t.parquet", {"words": np.array([text])})


def test_messages_of_jobs_are_no_formulas() -> None:
    """jobs.csv quotes what a job said, and keeps its words."""
    with claimed(Path(), 3) as lock:
        lock.note(Job(3, "failed", 2, 0.1, ("+effect@effects.a=gravity",), "=1+cmd|'x'!A0"))
    job = read_jobs(Path())[3]
    assert job.message == "'=1+cmd|'x'!A0"
    assert job.words == ("+effect@effects.a=gravity",)


def test_text_on_a_page_of_markdown_is_text() -> None:
    """The viewer's Markdown runs what stands in braces: all signs of markup go as references."""
    text = "run 1 failed. ConfigError: {alert(1)} <img src=x onerror=y> [a](b) `c` *d* _e_ & f"
    shown = in_markdown(text)
    assert not set("{}<>[]`*_") & set(shown)
    assert "&#123;alert(1)&#125;" in shown


def test_the_viewers_note_is_text() -> None:
    """A refusal may hold whatever a stranger's file says."""
    from seals.plugins.viewers.browser.panel import Panel

    panel: Any = object.__new__(Panel)
    panel._session = SimpleNamespace(length=1.0, note="{alert(1)}")
    panel._note = SimpleNamespace(content="")
    panel._told, panel.time = 0.0, SimpleNamespace(max=1.0, value=0.0)
    panel.tell(0.5)
    assert "{" not in panel._note.content


def test_signs_that_turn_lines_round_reach_no_page() -> None:
    """Names with marks of writing direction, or such that end lines, would show another text."""
    name = "a\u202eb\u2028c\x1bd \u2212 \u00e9"
    line = Series(name=name, x=np.arange(3.0), y=np.arange(3.0))
    chart = Chart(title=name, y_label=name, series=(line,))
    made = page(name, [Section(title=name, blocks=[Paragraph(text=name), chart])])
    assert not [sign for sign in made if not sign.isprintable() and sign not in "\n\t"]
    assert "\\u202e" not in made
    assert "a b c d \u2212 \u00e9" in made
    assert in_markdown(name).startswith("a b c d ")
