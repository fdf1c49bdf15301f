"""Real flights of Crazyflies with cut propellers and a weight on a string."""

from __future__ import annotations

import pytest

from benchmarks.crazypad import Answers, read
from benchmarks.crazypad_lines import lines_of
from benchmarks.real_data import BESIDE

pytestmark = pytest.mark.validation


@pytest.mark.slow
def test_cut_propellers_and_a_string_are_found() -> None:
    """Cut propellers, weights and silence about weak changes; docs state what is missed."""
    folder = BESIDE / "crazypad"
    if not folder.is_dir():
        pytest.skip(f"the flights are not there: {folder}")
    flights = read(folder)
    answers = Answers([f for f in flights if f.row.healthy])
    found = [answers.about(flight) for flight in flights]
    reached = {line.what for line in lines_of([f.row for f in flights], found) if line.reached}
    for words in (
        *("cuts of 4 mm and more", "groups of such cuts", "motor right", "two cuts of 4 mm"),
        *("nothing wrong", "heaviest string", "heaviest weight"),
    ):
        assert any(words in line for line in reached), words
