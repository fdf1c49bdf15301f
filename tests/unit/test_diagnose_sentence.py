"""Sentence of a diagnosis of several logs."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.decision.verdict import Verdict
from seals.sysid.report.sentence import sentence


def test_a_log_that_lacks_something_else_is_told() -> None:
    """The misfit stands log by log; where one log keeps its own, its name does."""
    misfits = {"a": (90.0, 1.02), "b": (80.0, 0.98), "c": (300.0, 14.0)}
    table = {
        "fitted": [],
        "stated_wrong": [],
        "within_tolerance": [],
        "held_out_by_log": [
            {"log": name, "before": before, "after": after}
            for name, (before, after) in misfits.items()
        ],
    }
    found: Any = SimpleNamespace(
        given_log="log=a",
        given_robot="",
        answer=SimpleNamespace(verdict=Verdict.none_of_these, reasons=("why",)),
        held_out={"before": 150.0, "after": 5.0},
        problem=SimpleNamespace(policy=DecisionPolicy()),
        to_dict=lambda: table,
    )
    assert sentence(found).splitlines() == [
        "No effect of the library explains the log: why.",
        "  by log: a 90 -> 1.02; b 80 -> 0.98; c 300 -> 14",
        "  A further effect is missing in c: diagnose this log separately.",
    ]
    table["held_out_by_log"] = []
    assert sentence(found) == "No effect of the library explains the log: why."
