"""Charts: thinning keeps what matters, shapes are checked, pictures are written."""

from __future__ import annotations

import base64
import struct
import sys
from pathlib import Path

import numpy as np
import pytest

from seals.errors import MissingExtra, SealsError
from seals.report.bars import Columns, drawn
from seals.report.figures import MOST_POINTS, Chart, Mark, Series, lines
from seals.report.pictures import write_picture
from seals.report.style import AXES, colours_of


def test_thinning_keeps_every_peak() -> None:
    """Spikes of one sample, both ends and the order survive; few points stay."""
    rng = np.random.default_rng(3)
    y = rng.standard_normal(300_000)
    y[[7, 123_456, 299_000]] = (50.0, -60.0, 70.0)
    small = Series(name="a", x=np.arange(300_000.0), y=y).downsampled()
    assert small.x.size <= MOST_POINTS
    assert {50.0, -60.0, 70.0} <= set(small.y.tolist())
    assert (small.x[0], small.x[-1]) == (0.0, 299_999.0)
    assert np.all(np.diff(small.x) > 0)
    assert np.array_equal(small.y, y[small.x.astype(int)])


def test_short_series_are_left_alone() -> None:
    """Nothing is taken from a series that fits."""
    line = Series(name="a", x=np.arange(9.0), y=np.arange(9.0))
    assert line.downsampled() is line
    assert line.even() is line


def test_thinning_lives_with_gaps() -> None:
    """NaN leaves gaps and never hides a peak."""
    y = np.full(100_000, np.nan)
    y[50_000:60_000] = 1.0
    y[55_555] = 9.0
    small = Series(name="a", x=np.arange(100_000.0), y=y).downsampled()
    assert np.nanmax(small.y) == 9.0
    assert np.isnan(small.y).any()


def test_different_shapes_are_refused() -> None:
    """A series whose coordinates differ in shape is refused with both shapes."""
    with pytest.raises(SealsError, match=r"'b' has x of shape \(3,\) and y of shape \(4,\)"):
        Chart(title="A", y_label="y", series=(Series(name="b", x=np.zeros(3), y=np.zeros(4)),))


def test_axes_keep_their_colours() -> None:
    """x, y and z look the same in every chart; other names are told apart."""
    chart = lines("A", "m", [0.0, 1.0], {"z": [0, 1], "x": [1, 0]}).coloured()
    assert [line.colour for line in chart.series] == [AXES["z"], AXES["x"]]
    assert len(set(colours_of([f"effect_{k}" for k in range(8)]).values())) == 8


def test_picture_is_a_png_of_the_right_size(tmp_path: Path) -> None:
    """Two charts below each other give one PNG of 1120 x 1008 points, and no other file."""
    pytest.importorskip("matplotlib", reason="pictures need matplotlib")
    marks = (Mark(at=0.5, label="now"), Mark(at=0.0, label="water", level=True))
    line = Series(name="z", x=np.arange(3.0), y=np.arange(3.0), band=np.ones(3))
    first = Chart(title="A", y_label="m", series=(line,), marks=marks)
    second = Chart(title="B", y_label="N", series=(line, line), stacked=True)
    path = write_picture(tmp_path / "plots" / "a.png", [first, second])
    head = path.read_bytes()[:24]
    assert head[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">II", head[16:24]) == (1120, 1008)
    assert [file.name for file in path.parent.iterdir()] == ["a.png"]
    # the lossless form holds the same picture in fewer bytes
    smaller = write_picture(tmp_path / "a.webp", [first, second]).read_bytes()
    assert (smaller[:4], smaller[8:16]) == (b"RIFF", b"WEBPVP8L")
    assert len(smaller) < path.stat().st_size


def test_an_asymmetric_band_reaches_where_it_says() -> None:
    """A band of two rows lies below by the first and above by the second, thinned or not."""
    x = np.arange(5000.0)
    band = np.stack([np.full(5000, 0.25), np.full(5000, 2.0)])
    chart = Chart(title="A", y_label="1", series=(Series(name="a", x=x, y=x * 0.0, band=band),))
    columns = Columns()
    line = drawn(chart, columns)["lines"][0]
    low, high = (
        np.frombuffer(base64.b64decode(columns.texts[line[end]][1:]), dtype="<f4")
        for end in ("low", "high")
    )
    assert len(low) == len(high) < 5000
    assert set(high) == {2.0}
    assert set(low) == {-0.25}


def test_missing_matplotlib_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without matplotlib the refusal says what to install."""
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(MissingExtra, match="pip install matplotlib"):
        write_picture(tmp_path / "a.png", lines("A", "m", [0.0], {"z": [0.0]}))


def test_twelve_effects_have_twelve_colours() -> None:
    """A flying arm has more than eight effects; none shares its colour with another."""
    assert len(set(colours_of([f"effect {k}" for k in range(12)]).values())) == 12
