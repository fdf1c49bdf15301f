"""The experiment of light under water, small."""

from __future__ import annotations

from pathlib import Path

import pytest

from seals.experiments.underwater_light import main, sheet


def test_the_sheet_and_the_table_are_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A contact sheet of sixteen small pictures, and a row for each of the ten waters."""
    from PIL import Image

    monkeypatch.setattr(sheet, "SIZE", (12, 16))
    assert main(["--out", str(tmp_path)]) == 0
    with Image.open(tmp_path / "figure.png") as picture:
        assert picture.size == (4 * 16 + 3 * 4, 4 * 12 + 3 * 4)
        assert len(picture.getcolors(10_000) or []) > 500
    assert "| coastal_9 | 1.06 |" in capsys.readouterr().out
    assert (tmp_path / "table.md").read_text(encoding="utf-8").count("\n") == 12


def test_red_fades_from_the_sheet_with_depth() -> None:
    """In the clear water's row the share of red falls from picture to picture."""
    sheet_rows = sheet.depths(sheet.sea())
    reds = [float(light[..., 0].mean() / light.mean()) for light in sheet_rows[0]]
    assert reds == sorted(reds, reverse=True)
    assert reds[-1] < 0.5 * reds[0]
