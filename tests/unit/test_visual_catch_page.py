"""The table of the page on catching by sight is that of the episodes that ship."""

from __future__ import annotations

from pathlib import Path

import pytest

from seals.errors import ConfigError
from seals.experiments.visual_catch.judged import (
    HEAD,
    PREY,
    Flight,
    digits_of,
    flown,
    judge,
    keep,
    lines,
)
from seals.learn.starts import held_out_seeds

PAGE = Path(__file__).parents[2] / "docs" / "learning_results.md"


def test_counts_and_intervals_are_of_the_episodes(tmp_path: Path) -> None:
    """Wilson's interval of 3 of 4, the median of the won, nothing for a case without success."""
    rows = [Flight("crab, seed 0", k, k < 3, 100 + 10 * k, "") for k in range(4)]
    rows += [Flight("crab, black pictures", k, False, 450, "") for k in range(2)]
    keep(rows, tmp_path / "rows.parquet")
    assert lines(tmp_path / "rows.parquet") == [
        "| crab | black pictures | 0 of 2 (0 to 66 %) |  |",
        "| crab | seed 0 | 3 of 4 (30 to 95 %) | 11.0 s |",
    ]


def test_what_a_table_holds_is_not_flown_again(tmp_path: Path) -> None:
    """Episodes stay as they were; a table of another detector is refused, and what is none."""
    path, (first, _) = tmp_path / "rows.parquet", held_out_seeds(2)
    cases = [f"{prey}, {what}" for prey in PREY for what in ("seed 0", "black pictures")]
    rows = sorted(Flight(case, first, True, 123, digits_of("aam/crab")) for case in cases)
    keep(rows, path)

    def again(detector: str, episodes: int) -> None:
        judge([detector], path, episodes=episodes, processes=1, limit=0.0)
        assert flown(path) == rows

    again("aam/crab", 1)
    again("aam/crab", 2)
    with pytest.raises(ConfigError, match="of another detector"):
        again("parts", 1)
    with pytest.raises(ConfigError, match="none"):
        again(str(tmp_path / "none"), 1)
    path.write_bytes(b"PAR1 no table")
    with pytest.raises(ConfigError, match="no table of episodes"):
        again("aam/crab", 1)


def test_the_page_shows_the_table_that_ships() -> None:
    """No figure of the page is typed."""
    assert "\n".join((HEAD, *lines())) in PAGE.read_text(encoding="utf-8")
