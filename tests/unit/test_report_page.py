"""The page: one file, offline, safe against hostile names, drawn by a real browser."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from seals.report import (
    Chart,
    Code,
    Facts,
    Fold,
    Mark,
    Paragraph,
    Section,
    Series,
    Table,
    page,
    write_page,
)

TIME = np.linspace(0.0, 2.0, 50)


def chart(title: str = "Height") -> Chart:
    """Return a small chart."""
    return Chart(title=title, y_label="z [m]", series=(Series(name="z", x=TIME, y=1.0 - TIME**2),))


def loads() -> Chart:
    """Return a small stacked chart whose second part changes its sign."""
    parts = (
        Series(name="weight", x=TIME, y=-np.ones(50)),
        Series(name="drag", x=TIME, y=np.sin(9 * TIME)),
    )
    return Chart(title="Loads", y_label="N", series=parts, stacked=True)


def figures(html: str) -> list[dict[str, object]]:
    """Return the charts' JSON out of a page."""
    found = re.search(r'id="figures">(.*?)</script>', html, re.DOTALL)
    assert found is not None
    return list(json.loads(found.group(1)))


def test_page_needs_no_network() -> None:
    """Nothing is loaded from elsewhere, and plotly is inside exactly once."""
    html = page("Run", [Section(title="A", blocks=[chart(), Fold(title="more", blocks=[chart()])])])
    assert re.findall(r"<(?:script|link|img|iframe)[^>]+(?:src|href)=", html) == []
    assert html.count("plotly.js v") == 1
    assert len(html) < 6_000_000


def test_page_without_charts_is_small() -> None:
    """Words and tables alone do not carry a drawing library."""
    assert len(page("Words", [Section(title="A", blocks=[Paragraph(text="none")])])) < 20_000


def test_names_cannot_break_out() -> None:
    """Markup in any text is shown, not run."""
    evil = "</script><img src=x onerror=alert(1)>"
    line = Series(name=evil, x=TIME, y=TIME)
    drawn = Chart(title=evil, y_label=evil, series=(line,), marks=(Mark(at=1.0, label=evil),))
    blocks = [
        drawn,
        Paragraph(text=evil),
        Facts(values={evil: evil}),
        Table(head=[evil], rows=[[evil]]),
        Code(text=evil),
        Fold(title=evil, blocks=[Paragraph(text=evil)]),
    ]
    html = page(evil, [Section(title=evil, lead=evil, blocks=blocks)], subtitle=evil)
    assert "<img" not in html
    assert figures(html)[0]["data"][0]["name"] == evil  # type: ignore[index]


def test_numbers_arrive_bit_for_bit() -> None:
    """The binary form holds the very doubles, gaps included."""
    values = np.array([0.1, np.nan, -1e300, 3.0])
    line = Series(name="a", x=np.arange(4.0), y=values)
    html = page("A", [Section(title="A", blocks=[Chart(title="A", y_label="y", series=(line,))])])
    coded = figures(html)[0]["data"][0]["y"]  # type: ignore[index]
    assert coded["dtype"] == "f8"
    assert base64.b64decode(coded["bdata"]) == values.tobytes()


def test_stack_keeps_signs_apart_and_adds_the_sum() -> None:
    """A part that changes sign is drawn in both stacks, in one colour, with one legend entry."""
    html = page("A", [Section(title="A", blocks=[loads()])])
    traces: list[dict[str, object]] = figures(html)[0]["data"]  # type: ignore[assignment]
    kept = [(trace["name"], trace.get("stackgroup"), trace.get("showlegend")) for trace in traces]
    assert kept == [
        ("weight", "down", True),
        ("drag", "up", True),
        ("drag", "down", False),
        ("sum", None, None),
    ]


def test_one_chart_may_stand_twice() -> None:
    """The same chart in two places gets two drawings."""
    twice = chart()
    html = page("A", [Section(title="A", blocks=[twice]), Section(title="B", blocks=[twice])])
    assert re.findall(r'id="(chart-\d+)"', html) == ["chart-0", "chart-1"]
    assert len(figures(html)) == 2


def test_file_appears_whole(tmp_path: Path) -> None:
    """The written page is the page, and nothing else is left beside it."""
    sections = [Section(title="A", blocks=[Paragraph(text="x")])]
    write_page(tmp_path / "report.html", "Run", sections, badge="done")
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == page(
        "Run", sections, badge="done"
    )


def test_browser_draws_every_open_chart(tmp_path: Path) -> None:
    """A headless browser draws the charts, and those in a closed fold only on demand."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    if browser is None:
        pytest.skip("no chromium on this machine")
    sections = [Section(title="A", blocks=[chart(), loads(), Fold(title="more", blocks=[chart()])])]
    path = write_page(tmp_path / "report.html", "Run", sections)
    flags = ["--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=8000"]
    profile = f"--user-data-dir={tmp_path / 'profile'}"
    done = subprocess.run(
        [browser, *flags, profile, "--dump-dom", f"file://{path}"],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    drawn = re.findall(
        r'class="plot js-plotly-plot" id="(chart-\d)"|id="(chart-\d)" class="plot js-plotly-plot"',
        done.stdout,
    )
    plots = re.findall(r'<div class="([^"]*)" id="chart-\d"', done.stdout)
    assert ["js-plotly-plot" in classes for classes in plots] == [True, True, False], drawn
