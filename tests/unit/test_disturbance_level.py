"""Level of gusts between the levels that are compared."""

from __future__ import annotations

import numpy as np
import pytest

from seals.sysid.scores.disturbance_level import LEVELS, lowest_between


def test_the_level_of_gusts_lies_between_those_compared() -> None:
    """The lowest point of a parabola in the logarithm; at the ends the end itself."""
    scores = {s: 5.0 * np.log(s / 1.3) ** 2 for s in LEVELS}
    assert lowest_between(scores) == pytest.approx(1.3, rel=1e-9)
    assert lowest_between({s: -s for s in LEVELS}) == LEVELS[-1]
    assert lowest_between({s: s for s in LEVELS}) == LEVELS[0]
