"""The page of ``seals view`` in a real browser: what it shows, and what its sliders do."""

from __future__ import annotations

import io
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

REQUIRED = os.environ.get("SEALS_BROWSER") == "required"
"""Whether a machine without a browser fails here, in place of leaving the test out."""
SOFTWARE = (
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
)
PATIENCE = 180.0
"""Longest time that a picture may take to come true on a busy machine without graphics [s]."""
HEIGHT = 1.0
LOWERED = 0.6
KEY = "initial.position.2"
ARROW = 1e-3
"""Share of the picture that an arrow covers at least."""
SHOWN = (slice(155, None), slice(0, 420))
"""The part of a picture that no panel and no notice covers."""

Image = NDArray[np.int64]


def absent(words: str) -> Any:
    """Skip in words, or fail where the browser is required."""
    if REQUIRED:
        pytest.fail(f"SEALS_BROWSER=required, and {words}")
    pytest.skip(words)


@pytest.fixture
def browser() -> Iterator[Any]:
    """A headless Chromium that draws without a graphics card."""
    names = ("chromium", "chromium-browser", "google-chrome")
    found = next((path for path in map(shutil.which, names) if path), None)
    if found is None:
        absent("there is no Chromium: apt-get install chromium")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        absent("playwright is not installed: pip install playwright")
    with sync_playwright() as play:
        window = play.chromium.launch(executable_path=found, args=list(SOFTWARE))
        yield window
        window.close()


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    """The page of a manipulator that drops towards waves, started as a person would."""
    pytest.importorskip("viser") if not REQUIRED else None
    words = ["robot=aam", "water=fossen", "wave=sea", "time.duration=0.3", "port=0"]
    words += [f"initial.position=[0,0,{HEIGHT}]", f"sliders=[{KEY}:0.3:2]"]
    command = [str(Path(sys.executable).parent / "seals"), "view", *words]
    said = tmp_path / "said.txt"
    with said.open("w") as out:
        server = subprocess.Popen(command, cwd=tmp_path, stdout=out, stderr=subprocess.STDOUT)
    try:
        yield str(until(lambda: _address(said.read_text(), server), said.read_text))
    finally:
        server.terminate()
        server.wait(20.0)


def _address(said: str, server: Any) -> str | None:
    found = re.search(r"http://127\.0\.0\.1:\d+/[\w-]+/", said)
    assert found or server.poll() is None, said
    return found.group(0) if found else None


def until(look: Callable[[], Any], tell: Callable[[], str]) -> Any:
    """Return what a look finds once it finds something."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        found = look()
        if found is not None and found is not False:
            return found
        time.sleep(0.2)
    raise AssertionError(f"waited {PATIENCE:g} s in vain; last seen: {tell()}")


class Page:
    """The page as a person sees and handles it."""

    def __init__(self, browser: Any, address: str) -> None:
        self.page = browser.new_page(viewport={"width": 760, "height": 480})
        self.page.goto(address)
        self.page.wait_for_selector("text=speed", timeout=1000.0 * PATIENCE)

    def picture(self) -> Image:
        """What the page shows, red, green and blue up to 255."""
        from PIL import Image as Images

        with Images.open(io.BytesIO(self.page.screenshot(timeout=60000))) as image:
            return np.asarray(image.convert("RGB"), dtype=np.int64)[SHOWN]

    def control(self, label: str) -> Any:
        """The control with a label."""
        name = self.page.get_by_text(label, exact=True).first.get_attribute("for")
        return self.page.locator(f'[id="{name}"]')

    def thumb(self, label: str) -> Any:
        """What is dragged of a slider."""
        return self.control(label).locator("[role=slider]")

    def choose(self, label: str, key: str) -> None:
        """Press a key on a slider of time until the page stands still there."""
        until(lambda: self._pressed(label, key), self.text)

    def _pressed(self, label: str, key: str) -> bool:
        self.thumb(label).press(key)
        time.sleep(1.0)
        return not self.control("play").is_checked()

    def value(self, label: str) -> float:
        """Where a slider stands."""
        return float(self.thumb(label).get_attribute("aria-valuenow"))

    def type(self, label: str, value: float) -> None:
        """Write a number into the field beside a slider."""
        field = self.control(label).locator("xpath=following-sibling::div//input")
        field.fill(str(value))
        field.press("Enter")

    def text(self) -> str:
        """All words of the page."""
        return str(self.page.inner_text("body"))

    def says(self, words: str) -> None:
        """Wait until the page says something."""
        until(lambda: words in self.text(), self.text)

    def uncheck(self, label: str) -> None:
        """Take the tick out of a box."""
        self.control(label).uncheck(force=True)


def shell(image: Image) -> tuple[int, float]:
    """How many pixels show the manipulator's orange shell, and the middle of their rows."""
    red, green, blue = (image[..., k] for k in range(3))
    seen = (red > 110) & (red > 1.25 * green) & (green > 1.25 * blue)
    return int(seen.sum()), float(np.nonzero(seen)[0].mean()) if seen.any() else np.nan


def changed(one: Image, other: Image) -> float:
    """Share of the pixels that differ."""
    return float((np.abs(one - other).max(axis=-1) > 12).mean())


def test_the_page_shows_the_run_and_its_sliders_work(browser: Any, address: str) -> None:
    """Robot and water are seen; time moves the robot; a turned value starts another run."""
    page = Page(browser, address)
    page.says(f"run 1: {KEY} = {HEIGHT:g}")
    # time: the slider's own ends
    page.choose("time [s]", "Home")
    page.says("t = 0.000 s")
    until(lambda: page.value("time [s]") == 0.0, page.text)
    until(lambda: still(page), lambda: str(shell(page.picture())))

    # forces: the arrow of the weight goes with its tick, and nothing else moves
    drawn = page.picture()
    page.uncheck("gravity")
    until(lambda: changed(drawn, page.picture()) > ARROW, lambda: "the arrow is still there")
    # the arrow itself has some of the shell's colour
    high = until(lambda: still(page), lambda: str(shell(page.picture())))

    page.choose("time [s]", "End")
    page.says("t = 0.300 s")
    # it has fallen by 0.44 m, downward in the picture
    low = until(lambda: below(page, high), lambda: str(shell(page.picture())))
    until(lambda: page.value("time [s]") == pytest.approx(0.3), page.text)

    # water: a good part of the picture is its blue, and goes with it
    wet = page.picture()
    page.uncheck("water")
    dry = until(lambda: gone(page, wet), lambda: "the water is still there")
    blue = wet[..., 2] - wet[..., 0] > dry[..., 2] - dry[..., 0] + 10
    assert blue.mean() > 0.2

    # a value of the run: it starts anew, and from lower down
    page.type(KEY, LOWERED)
    page.says(f"run 2: {KEY} = {LOWERED:g}")
    page.choose("time [s]", "Home")
    page.says("t = 0.000 s")
    until(lambda: below(page, high), lambda: str((high, low, shell(page.picture()))))


def seen(page: Page) -> float | None:
    """Row of the shell once it is there."""
    count, row = shell(page.picture())
    return row if count > 20 else None


def still(page: Page) -> float | None:
    """Row of the shell once it stays where it is: slow pictures come seconds after the words."""
    rows = []
    for _ in range(4):
        rows.append(seen(page))
        time.sleep(1.0)
    known = [row for row in rows if row is not None]
    return known[-1] if len(known) == len(rows) and max(known) - min(known) < 3.0 else None


def below(page: Page, row: float) -> float | None:
    """Row of the shell once it is lower than another by sixteen pixels."""
    found = seen(page)
    return found if found is not None and found > row + 16.0 else None


def gone(page: Page, wet: Image) -> Image | None:
    """The picture once a fifth of it has changed."""
    image = page.picture()
    return image if changed(wet, image) > 0.2 else None
