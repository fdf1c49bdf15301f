"""Every installed fluid keeps the contract of its kind."""

from __future__ import annotations

from typing import Any

import pytest

from seals import registry
from seals.testing import check_fluid

SMALL: dict[str, dict[str, Any]] = {
    "particles": {"spacing": 0.04, "size": [0.56, 0.56, 0.4], "freeboard": 0.3},
    "window": {"spacing": 0.04, "size": [0.8, 0.8, 0.4], "ring": 4},
}
"""Fields that keep the check short: the cube is five particles wide."""


@pytest.mark.filterwarnings("ignore:.*getdefaultlocale:DeprecationWarning")
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.thorough] if name == "window" else [])
        for name in registry.names("fluid")
    ],
)
def test_fluids_keep_their_contract(name: str) -> None:
    """Lift, books, snapshots, filling anew, surface."""
    report = check_fluid(name, values=SMALL.get(name))
    print(report.table())
