"""Traced thresholds note exactly the comparisons that another threshold would turn."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np
import pytest

from benchmarks.thresholds import ALL, FIRST, done, file_of, key_of, names_of, table, traced
from benchmarks.traced import Trace, Traced


def make(value: float = 10.0, by: float = 0.3) -> tuple[Trace, Traced]:
    """A threshold of 10 that could be 7 or 13."""
    trace = Trace()
    trace.stage = "now"
    others = {("t", -1): value * (1 - by), ("t", 1): value * (1 + by)}
    return trace, Traced(value, others, trace)


@pytest.mark.parametrize(
    ("score", "noted"),
    [(6.0, set()), (8.0, {("t", -1)}), (12.0, {("t", 1)}), (14.0, set())],
)
def test_a_comparison_notes_the_change_that_would_turn_it(
    score: float, noted: set[tuple[str, int]]
) -> None:
    """Both sides of the threshold, and both orders of the operands."""
    for compare in (lambda t: score > t, lambda t: t < score, lambda t: np.float64(score) > t):
        trace, threshold = make()
        assert bool(compare(threshold)) is (score > 10.0)
        assert trace.noted.get("now", set()) == noted


def test_arithmetic_and_functions_carry_the_alternatives() -> None:
    """exp((2 t - 1) / 4) has the alternatives of its own formula."""
    trace, threshold = make()
    out = np.exp((2.0 * threshold - 1.0) / np.float64(4.0))
    assert isinstance(out, Traced)
    assert out == pytest.approx(math.exp(19.0 / 4.0))
    assert out.others[("t", -1)] == pytest.approx(math.exp(13.0 / 4.0))
    assert out.others[("t", 1)] == pytest.approx(math.exp(25.0 / 4.0))
    assert trace.used == {"t"}


def test_arrays_note_every_change_that_alters_them() -> None:
    """A mask is noted where it differs; an array of numbers always is."""
    trace, threshold = make()
    assert (np.array([1.0, 20.0]) > threshold).tolist() == [False, True]
    assert not trace.noted
    assert (np.array([1.0, 12.0]) > threshold).tolist() == [False, True]
    assert trace.noted == {"now": {("t", 1)}}
    np.array([1.0, 2.0]) * threshold
    assert trace.noted == {"now": {("t", -1), ("t", 1)}}


def test_the_table_counts_changed_answers_and_those_not_asked(tmp_path: Path) -> None:
    """One change alters the verdict, one the search, one was not diagnosed again."""
    log = Path("some") / "log"
    first = file_of(tmp_path, log, FIRST)
    first.parent.mkdir(parents=True)
    first.write_text(
        '{"answer": ["named", ["wind"]], "used": ["evidence", "screen"],'
        f' "search": ["{key_of(("evidence", 1))}", "screen-"],'
        ' "answers": {"evidence-": ["nothing_missing", []]}}',
        encoding="utf-8",
    )
    file_of(tmp_path, log, "evidence+").write_text(
        '{"answer": ["named", ["wind"]]}', encoding="utf-8"
    )
    rows = {
        r.split("|")[1].strip(" `"): r.split("|")[-3:-1] for r in _rows(table(tmp_path, [log], 0.3))
    }
    assert [c.strip() for c in rows["evidence"]] == ["1", "0"]
    assert [c.strip() for c in rows["screen"]] == ["0 (1 not run)", "0"]
    assert [c.strip() for c in rows["temperature"]] == ["-", "-"]


def test_only_the_named_thresholds_are_traced_and_told(tmp_path: Path) -> None:
    """The others are plain numbers; a result that traced fewer is made again; typos are told."""
    names, trace = names_of("absent,joint_quiet"), Trace()
    policy = traced(0.3, trace, names)
    assert {t.name for t in policy.thresholds() if isinstance(t.value, Traced)} == names
    log = Path("some") / "log"
    path = file_of(tmp_path, log, FIRST)
    assert not done((tmp_path, log, FIRST, 0.3, names))
    path.parent.mkdir(parents=True)
    path.write_text(
        '{"answer": ["named", []], "traced": ["absent", "joint_quiet"], "used": ["absent"],'
        ' "search": [], "answers": {}}',
        encoding="utf-8",
    )
    assert done((tmp_path, log, FIRST, 0.3, names))
    assert not done((tmp_path, log, FIRST, 0.3, ALL))
    rows = _rows(table(tmp_path, [log], 0.3, names))
    assert [r.split("`")[1] for r in rows] == ["absent", "joint_quiet"]
    with pytest.raises(argparse.ArgumentTypeError, match="joint_quiet"):
        names_of("joint_quit")


def _rows(text: str) -> list[str]:
    """Rows of a table of Markdown."""
    return [line for line in text.splitlines() if line.startswith("| `")]
