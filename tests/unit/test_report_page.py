"""The page: one file, offline, safe against hostile names, drawn by a real browser."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

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


def figures(html: str) -> dict[str, Any]:
    """Return the charts' JSON out of a page."""
    found = re.search(r'id="figures">(.*?)</script>', html, re.DOTALL)
    assert found is not None
    return dict(json.loads(found.group(1)))


def column(html: str, index: int) -> Any:
    """Return a column of numbers out of a page."""
    text = figures(html)["arrays"][index]
    return np.frombuffer(base64.b64decode(text[1:]), dtype=f"<f{text[0]}")


def test_page_needs_no_network() -> None:
    """Nothing is loaded from elsewhere, and the script is inside exactly once."""
    html = page("Run", [Section(title="A", blocks=[chart(), Fold(title="more", blocks=[chart()])])])
    assert re.findall(r"<(?:script|link|img|iframe)[^>]+(?:src|href)=", html) == []
    assert html.count("const lineChart") == 1
    assert len(html) < 40_000


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
    assert figures(html)["charts"][0]["lines"][0]["name"] == evil


def test_numbers_arrive_as_a_screen_can_show_them() -> None:
    """Single precision where its rounding is invisible, else the very doubles; gaps stay gaps."""
    wide = np.array([0.1, np.nan, -1e300, 3.0])
    fine = 1e6 + np.array([0.1, 0.2, 0.3, 0.4])
    short = np.array([0.1, np.nan, 0.3, 3.0])
    across = np.arange(4.0)
    made = tuple(Series(name=str(k), x=across, y=y) for k, y in enumerate((wide, fine, short)))
    html = page("A", [Section(title="A", blocks=[Chart(title="A", y_label="y", series=made)])])
    drawn = [line["y"] for line in figures(html)["charts"][0]["lines"]]
    assert column(html, drawn[0]).tobytes() == wide.tobytes()
    assert column(html, drawn[1]).tobytes() == fine.tobytes()
    assert column(html, drawn[2]).dtype == np.float32
    np.testing.assert_allclose(column(html, drawn[2]), short, rtol=1e-7)
    # three lines share one abscissa
    assert len(figures(html)["arrays"]) == 4


def test_stack_keeps_signs_apart_and_adds_the_sum() -> None:
    """A part that changes sign is drawn in both stacks, in one colour, with one legend entry."""
    html = page("A", [Section(title="A", blocks=[loads()])])
    areas = figures(html)["charts"][0]["lines"]
    assert [(a["name"], a.get("quiet")) for a in areas] == [
        ("weight", False),
        ("drag", False),
        ("drag", True),
        ("sum", None),
    ]
    weight, up, down, total = areas
    sine = np.sin(9 * TIME)
    np.testing.assert_allclose(column(html, weight["high"]), -np.ones(50), atol=1e-6)
    np.testing.assert_allclose(column(html, up["high"]), np.maximum(sine, 0.0), atol=1e-5)
    np.testing.assert_allclose(column(html, down["low"]), 0.0 * sine - 1.0, atol=1e-5)
    np.testing.assert_allclose(column(html, down["high"]), np.minimum(sine, 0.0) - 1.0, atol=1e-5)
    np.testing.assert_allclose(column(html, total["y"]), sine - 1.0, atol=1e-5)


def test_one_chart_may_stand_twice() -> None:
    """The same chart in two places gets two drawings."""
    twice = chart()
    html = page("A", [Section(title="A", blocks=[twice]), Section(title="B", blocks=[twice])])
    assert re.findall(r'id="(chart-\d+)"', html) == ["chart-0", "chart-1"]
    assert len(figures(html)["charts"]) == 2


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
    plots = re.findall(r'<div class="([^"]*)" id="chart-\d"', done.stdout)
    assert ["drawn" in classes for classes in plots] == [True, True, False]
    # weight, drag twice: areas; sum and height: lines
    assert len(re.findall(r"<path d=", done.stdout)) == 5


ZOOM = """<script>
const send = (kind, x) => document.querySelector("#chart-0 svg").dispatchEvent(
  new PointerEvent(kind, {clientX: x, clientY: 150, pointerId: 1, bubbles: true}));
SVGElement.prototype.setPointerCapture = () => {};
const ticks = () => [...document.querySelectorAll("#chart-1 .tick")];
const span = () => ticks().map((t) => t.textContent).join(" ");
const words = [span()];
const box = document.querySelector("#chart-0 svg").getBoundingClientRect();
send("pointermove", box.left + 0.5 * box.width);
words.push(document.querySelector("#chart-0 .hint").textContent);
send("pointerdown", box.left + 0.4 * box.width);
send("pointermove", box.left + 0.6 * box.width);
send("pointerup", box.left + 0.6 * box.width);
words.push(span());
document.querySelector("#chart-0 svg").dispatchEvent(new MouseEvent("dblclick"));
words.push(span());
document.querySelector("#chart-1 .entry").click();
words.push(String(document.querySelectorAll("#chart-1 path").length));
document.body.dataset.words = words.join(";");
</script></body>"""
"""Reads a value, zooms and returns, and hides a line, as a reader with a pointer does."""


def test_charts_over_time_zoom_together_and_tell_their_values(tmp_path: Path) -> None:
    """Dragging in one chart narrows the other, double-click widens it; the legend hides a line."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    if browser is None:
        pytest.skip("no chromium on this machine")
    html = page("Run", [Section(title="A", wide=True, blocks=[chart(), loads()])])
    path = tmp_path / "opened.html"
    path.write_text(ZOOM.join(html.rsplit("</body>", 1)), encoding="utf-8")
    flags = ["--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=8000"]
    done = subprocess.run(
        [
            browser,
            *flags,
            f"--user-data-dir={tmp_path / 'profile'}",
            "--dump-dom",
            f"file://{path}",
        ],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    found = re.search(r'data-words="([^"]*)"', done.stdout)
    assert found is not None, done.stderr
    before, hint, zoomed, after, paths = found.group(1).split(";")
    assert before == after != zoomed
    assert "0.5" in before
    # nobody sees the ends of the time axis any more
    assert zoomed.split()[0] not in ("0", "2")
    value = float(hint.partition("z: ")[2].replace("−", "-"))
    time = float(hint.partition("z: ")[0].rstrip("z:"))
    assert value == pytest.approx(1.0 - time**2, abs=0.1)
    # three areas and the sum are left of four areas when the weight is hidden
    assert paths == "3"
