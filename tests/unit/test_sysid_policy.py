"""Decision thresholds live in one place, with unit and reason, and are used."""

from __future__ import annotations

import ast
import re
from dataclasses import fields
from pathlib import Path

from seals.sysid.decision.policy import DecisionPolicy, SearchBudget

SYSID = Path(__file__).parents[2] / "seals" / "sysid"
POLICY = SYSID / "decision" / "policy.py"


def test_every_threshold_has_a_unit_and_a_reason() -> None:
    """No threshold stands without its unit and why it has its size."""
    for one in DecisionPolicy().thresholds():
        assert one.unit, one.name
        assert len(one.reason.split()) >= 5, one.name


def test_every_threshold_is_used() -> None:
    """A threshold that no decision reads would be a promise that changes nothing."""
    paths = (path for path in SYSID.rglob("*.py") if path != POLICY)
    text = "\n".join(path.read_text(encoding="utf-8") for path in paths)
    # rules that the policy makes of its own thresholds, and that a decision reads
    own = POLICY.read_text(encoding="utf-8")
    rules = re.findall(r"    def (\w+)\(self\) -> TieRule:", own)
    assert rules
    assert all(re.search(rf"policy\.{rule}\b", text) for rule in rules)
    text += own.replace("self.", "policy.")
    names = [f.name for f in (*fields(DecisionPolicy), *fields(SearchBudget))]
    # these three are read through `DecisionPolicy.response`
    names = [n for n in names if not n.startswith("response_")] + ["response"]
    unused = [n for n in names if not re.search(rf"\b\w*(?:policy|budget|_POLICY)\.{n}\b", text)]
    assert unused == []


def test_decisions_have_no_thresholds_of_their_own() -> None:
    """The modules that decide compare with fields of the policy, not with numbers of their own."""
    found = []
    for path in (*(SYSID / "decision").glob("*.py"), SYSID / "selection" / "window_models.py"):
        if path == POLICY:
            continue
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            value = node.value if isinstance(node, ast.Assign) else None
            if isinstance(value, ast.Constant) and isinstance(value.value, float):
                found.append(f"{path.name}:{node.lineno}")
    assert found == [f"window_models.py:{line}" for line in _settled()]


def _settled() -> list[int]:
    """Line of the one number of the search that decides nothing: convergence of a repeated fit."""
    lines = (SYSID / "selection" / "window_models.py").read_text(encoding="utf-8").splitlines()
    return [k for k, line in enumerate(lines, start=1) if line.startswith("_SETTLED = ")]


def test_the_page_of_thresholds_shows_the_policy() -> None:
    """Each threshold stands in docs/thresholds.md with its value, unit and reason."""
    page = (Path(__file__).parents[2] / "docs" / "thresholds.md").read_text(encoding="utf-8")
    rows = {line.split("|")[1].strip(" `"): line for line in page.splitlines() if "| `" in line[:4]}
    stated = {
        t.name: f"| {t.value:g} | {t.unit} | {t.reason} |" for t in DecisionPolicy().thresholds()
    }
    assert set(rows) == set(stated)
    assert [name for name, text in stated.items() if text not in rows[name]] == []
