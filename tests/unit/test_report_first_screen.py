"""First screen of a diagnosis report: what, where, when and by how much."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from seals.report import Code, Section, Table
from seals.report.page import page
from seals.sysid.decision.verdict import Verdict
from seals.sysid.report.words import first_answers
from seals.sysid.residual_force.signature import Signature

HELD = {"stated": 6.648, "before": 2.002, "after": 0.987, "noise_floor": 1.0}


def answers(
    verdict: Verdict, effects: list[dict[str, Any]], mark: Signature, *, missing: bool
) -> dict[str, str]:
    """The answers of a diagnosis of one log."""
    found: Any = SimpleNamespace(
        answer=SimpleNamespace(verdict=verdict, claims=effects), logs=("flight",)
    )
    place: Any = SimpleNamespace(
        signature=mark, residual=SimpleNamespace(missing=missing), regimes=()
    )
    channels = {"position x": {"before": 2.5}, "position y": {"before": 1.1}}
    return first_answers(found, {"held_out_error": HELD, "effects": effects}, place, channels)


def test_a_named_effect_says_where_and_when_it_acts() -> None:
    """Axis and frame of its force, the medium, its start, and the fall of the error."""
    start = {"value": 8.0, "low90": 7.9, "high90": 8.1}
    active = [{"log": "flight", "start": start, "end": None}]
    effect = {"name": "payload", "confidence": 0.97, "active": active}
    mark = Signature(sentences=(), frame="world", along="world z", media=("air",))
    told = answers(Verdict.named, [effect], mark, missing=True)
    assert told["what"] == "payload, 97 %"
    assert told["where"] == "force along world z, constant in the world"
    assert told["when"] == "from 8.00 s, in air"
    assert list(told.values())[-1] == "6.65 → 2 → 0.987"


def test_without_a_force_the_worst_channel_says_where() -> None:
    """No name, no force: the channel that is off most, and the fall that is known."""
    told = answers(Verdict.none_of_these, [], Signature(sentences=()), missing=False)
    assert told["what"] == "none of these"
    assert told["where"] == "seen in position x, 2.5 × expected"
    assert list(told.values())[-1] == "6.65 → 2"


def test_commands_wrap_and_intervals_do_not() -> None:
    """On a narrow screen nothing that is to be copied or read is cut."""
    blocks = [Code(text="seals add diagnosis=answer"), Table(head=["a"], rows=[["1"]], right=(0,))]
    text = page("title", [Section(title="s", blocks=blocks)])
    style = text[: text.index("</style>")]
    assert "white-space: pre-wrap" in style[style.index("pre {") :].split("}")[0]
    assert "nowrap" in style[style.index(".right {") :].split("}")[0]
