"""First screen of a diagnosis report: what, where, when and by how much."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from seals.report import Code, Section, Table
from seals.report.page import page
from seals.sysid.decision.answer import Claim
from seals.sysid.decision.verdict import Verdict
from seals.sysid.report.words import alike_words, first_answers, headline
from seals.sysid.residual_force.signature import Signature

HELD = {"stated": 6.648, "before": 2.002, "after": 0.987, "noise_floor": 1.0}


def claim_of(
    name: str, confidence: float, rivals: tuple[str, ...] = (), alike: tuple[str, ...] = ()
) -> Claim[Any]:
    """A claim of an effect beside names that fit as well, and those that nearly do."""
    model: Any = SimpleNamespace(candidates=[SimpleNamespace(name=name)])
    return Claim(
        hypothesis=model,
        index=0,
        confidence=confidence,
        rivals=rivals,
        alike=(*rivals, *alike),
        shared=float(len(rivals)),
    )


def answers(
    verdict: Verdict, effects: list[dict[str, Any]], mark: Signature, *, missing: bool
) -> dict[str, str]:
    """The answers of a diagnosis of one log."""
    claims = [claim_of(e["name"], e["confidence"]) for e in effects]
    found: Any = SimpleNamespace(
        answer=SimpleNamespace(verdict=verdict, claims=claims), logs=("flight",)
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
    assert told["where"] == "force mostly along world z, constant in the world"
    assert told["when"] == "from 8.00 s, in air"
    assert list(told.values())[-1] == "6.65 → 2 → 0.987"


def test_an_effect_on_a_drive_says_which() -> None:
    """The rotor or the link, also where no force stands out along an axis."""
    rotor = {"value": 4, "low90": 4, "high90": 4, "unit": "1"}
    effect = {"name": "weak_rotor", "confidence": 0.99, "parameters": {"rotor": rotor}}
    told = answers(Verdict.named, [effect], Signature(sentences=()), missing=False)
    assert told["where"] == "rotor 4"
    effect = {"name": "quadratic_drag", "confidence": 0.99, "link": "gripper"}
    told = answers(Verdict.named, [effect], Signature(sentences=()), missing=False)
    assert told["where"] == "link gripper"


def test_a_wide_table_becomes_blocks_on_a_narrow_screen() -> None:
    """Each cell carries its head; a table of few columns stays one."""
    wide = Table(head=["a", "b", "c", "d", "e"], rows=[["1", "2", "3", "4", "5"]])
    narrow = Table(head=["f"], rows=[["6"]])
    text = page("title", [Section(title="s", blocks=[wide, narrow])])
    assert '<td data-label="e">5</td>' in text
    assert "<td>6</td>" in text
    assert "content: attr(data-label)" in text[: text.index("</style>")]


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


def test_names_of_equal_weight_are_told_as_equal() -> None:
    """A further effect that two names explain as well is one of both, not nearly one of them."""
    claims = [
        claim_of("wind", 0.999, alike=("tether",)),
        claim_of("payload", 0.49, rivals=("inertia",)),
    ]
    answer = SimpleNamespace(verdict=Verdict.named, claims=claims)
    found: Any = SimpleNamespace(answer=answer, logs=("flight",))
    effects = [{"name": c.name, "confidence": c.confidence} for c in claims]
    assert headline(found, {"effects": effects}) == (
        "The model lacks wind (more than 99 % confident) and payload or inertia (98 % confident "
        "that it is one of them)."
    )
    assert alike_words(found) == [
        "Explains the log nearly as well as wind, not quite excluded: tether.",
        "This log cannot distinguish: payload, inertia. Each explains it equally well.",
    ]
