"""The table of the page on catching by sight is that of the episodes that ship."""

from __future__ import annotations

from pathlib import Path

from seals.experiments.visual_catch.judged import HEAD, Flight, keep, lines

PAGE = Path(__file__).parents[2] / "docs" / "learning_results.md"


def test_counts_and_intervals_are_of_the_episodes(tmp_path: Path) -> None:
    """Wilson's interval of 3 of 4, the median of the won, nothing for a case without success."""
    rows = [Flight("crab, seed 0", k, k < 3, 100 + 10 * k) for k in range(4)]
    rows += [Flight("crab, black pictures", k, False, 450) for k in range(2)]
    keep(rows, tmp_path / "rows.parquet")
    assert lines(tmp_path / "rows.parquet") == [
        "| crab | black pictures | 0 of 2 (0 to 66 %) |  |",
        "| crab | seed 0 | 3 of 4 (30 to 95 %) | 11.0 s |",
    ]


def test_the_page_shows_the_table_that_ships() -> None:
    """No figure of the page is typed."""
    assert "\n".join((HEAD, *lines())) in PAGE.read_text(encoding="utf-8")
