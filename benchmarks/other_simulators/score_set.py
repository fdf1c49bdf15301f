"""Count the answers to a set: right, set, silent, refused or wrong; cases not asked are left out.

    python -m benchmarks.other_simulators.score_set SET OUT

``answers`` of ``truth.yaml`` lists what is right: effects joined by +, a verdict, ``stated_wrong``
(the answer says that a stated number is wrong), ``not_silent`` (anything but nothing_missing and
but a wrong name), ``not_sensor`` (no sensor fault and no drag is named).
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import yaml

from benchmarks.other_simulators.flight_sets import cases_in, command_line

REFUSED = ("none_of_these", "cannot_tell", "bad_data")
WORDS = (*REFUSED, "nothing_missing", "not_silent", "not_sensor", "stated_wrong")
NOT_ASKED = ("accelerometer", "gyroscope", "sensor", "angular_drag", "drag")
KINDS = ("right", "set", "silent", "refused", "wrong")


def sort_of(answers: Sequence[str], found: dict[str, Any]) -> str:
    """Return the kind of an answer.

    Args:
        answers: that are right.
        found: ``verdict``, ``effects`` (names and parameters) and ``stated_wrong`` of the answer.
    """
    verdict, names = found["verdict"], [e["name"] for e in found["effects"]]
    right = {a if a in WORDS else joined(a.split("+")) for a in answers}
    moved, said = bool(found.get("stated_wrong")), verdict in ("named", "ambiguous")
    if verdict == "named" and joined(names) in right:
        return "wrong" if len(names) == 1 and says_nothing(found["effects"][0]) else "right"
    if verdict == "ambiguous" and any(set(a.split("+")) & set(names) for a in right):
        return "set"
    fits = (
        verdict in right,
        moved and "stated_wrong" in right,
        (verdict in REFUSED or moved) and "not_silent" in right,
        said and "not_sensor" in right and not any(n.startswith(NOT_ASKED) for n in names),
    )
    if any(fits):
        return "right"
    other = {"nothing_missing": "silent"} | dict.fromkeys(REFUSED, "refused")
    return other.get(verdict, "wrong")


def joined(names: Iterable[str]) -> str:
    """Return names in one order."""
    return "+".join(sorted(names))


def says_nothing(effect: dict[str, Any]) -> bool:
    """Return whether a named effect has a parameter of zero, or a single one that may be zero."""
    numbers = effect["parameters"].values()
    return any(
        abs(n["value"]) <= 1e-9
        or (len(numbers) == 1 and n.get("low90", 1.0) < 0.0 < n.get("high90", -1.0))
        for n in numbers
    )


def answer_of(folder: Path) -> dict[str, Any]:
    """Return what SEALS answered; a refused step counts as bad data."""
    if (folder / "diagnosis.json").exists():
        return json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))
    steps = folder / "steps.json"
    codes = [s["rc"] for s in json.loads(steps.read_text()).values()] if steps.exists() else []
    return {"verdict": "bad_data" if 2 in codes else "failed", "effects": []}


def main() -> None:
    """Print a line a case and the shares."""
    asked = command_line("set", "out")
    counts: Counter[str] = Counter()
    for case in cases_in(asked.set, asked.only):
        if not (asked.out / case.name).is_dir():
            continue
        truth = yaml.safe_load((case / "truth.yaml").read_text(encoding="utf-8"))
        found = answer_of(asked.out / case.name)
        kind = sort_of(truth["answers"], found)
        counts[kind] += 1
        names = joined(e["name"] for e in found["effects"])
        want = "; ".join(truth["answers"])
        print(f"{truth['name']:22s} {want:42s} {found['verdict']:16s} {names:40s} {kind}")
    total = max(counts.total(), 1)
    shares = " ".join(f"{k}={100 * counts[k] / total:.1f}" for k in KINDS)
    print(f"SCORE cases={counts.total()} {shares}")


if __name__ == "__main__":
    main()
