"""The table of speeds: what fell is said by ratios, whatever the pace of the machine."""

from __future__ import annotations

import pytest

from benchmarks.speed import CASES, TOLERANCE, Row, fallen, table

BEFORE = Row(1000.0, 2000.0, 0.5, 1.5, 4.0, 100.0, 2.0, 4.0)


def test_a_slower_machine_is_no_fall() -> None:
    """Half the pace of both, twice the seconds of a start."""
    slower = BEFORE._replace(pace=500.0, engine=1000.0, real=2.0, start=4.0)
    assert fallen({"a": slower}, {"a": BEFORE}) == []


@pytest.mark.parametrize(
    ("field", "key", "up"),
    [
        ("share", "share", False),
        ("slow", "slow", True),
        ("memory", "memory", True),
        ("begin", "start", True),
    ],
)
def test_what_is_beyond_its_tolerance_is_said(field: str, key: str, up: bool) -> None:
    """Each number by itself; just within its factor it is not."""
    then = getattr(BEFORE, field)
    for beyond, count in ((1.01, 1), (0.99, 0)):
        now = then * TOLERANCE[key] * (beyond if up else 1.0 / beyond)
        said = fallen({"a": BEFORE._replace(**{field: now})}, {"a": list(BEFORE)})
        assert len(said) == count


def test_a_case_without_a_last_number_is_new() -> None:
    """Ten cases, each a row of the table."""
    rows = dict.fromkeys(CASES, BEFORE)
    assert len(CASES) == 10
    assert fallen(rows, {}) == []
    assert len(table(rows).splitlines()) == 12
