"""Every guard against strangers' files has a test that fails without it."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

from benchmarks.guards import GUARDS, held, unguarded

ROOT = Path(__file__).parents[2]


@pytest.mark.killed
@pytest.mark.parametrize("name", GUARDS)
def test_a_guard_that_is_gone_is_noticed(name: str) -> None:
    """The tests of a guard fail when its text is taken out of its module."""
    if GUARDS[name].needs:
        pytest.importorskip(GUARDS[name].needs, reason=f"{GUARDS[name].needs} is not installed")
    code, said = unguarded(name)
    assert held(code, said), said[-2000:]


def test_every_guard_stands_where_the_list_says() -> None:
    """The text of each is once in its module, and its tests are there."""
    for name, guard in GUARDS.items():
        origin = getattr(importlib.util.find_spec(guard.module), "origin", None)
        assert origin is not None, name
        assert Path(origin).read_text(encoding="utf-8").count(guard.text) == 1, name
        assert (ROOT / guard.tests).is_file(), name
