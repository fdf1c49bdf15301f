"""When an effect acts: weights of rows."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.testing import assert_allclose

from seals.sysid.candidates.activity import Activity, Moment, Span

TIME = 2.0 + 0.1 * np.arange(11)


def samples(logs: tuple[tuple[int, int], ...] = ()) -> Any:
    """Rows of one log or of several."""
    spans = tuple(SimpleNamespace(first=a, last=b) for a, b in logs)
    return SimpleNamespace(rows=len(TIME), time=TIME, step=0.1, logs=spans)


def test_an_effect_acts_from_its_moment_on() -> None:
    """1 in the rows from 2.5 s on, 0 before."""
    begin = Moment(value=2.5, low90=2.5, high90=2.5)
    weights = Activity(spans=(Span(log=0, start=begin),)).weights(samples())
    assert_allclose(weights, [0.0] * 5 + [1.0] * 6)


def test_an_effect_that_grows_is_nothing_at_first_and_whole_at_the_end_of_each_log() -> None:
    """In proportion to the time within the log in which it acts; none in another."""
    growing = Activity(spans=(Span(log=1),), growing=True)
    weights = growing.weights(samples(((0, 5), (5, 11))))
    assert_allclose(weights, [0.0] * 5 + [0.0, 0.2, 0.4, 0.6, 0.8, 1.0], atol=1e-12)
