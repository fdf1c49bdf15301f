"""Answer of a diagnosis in sentences: verdict, confidence and next steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from seals.config.overrides import typed
from seals.sysid.candidates.activity import active_words
from seals.sysid.decision.answer import Claim
from seals.sysid.decision.verdict import Verdict
from seals.sysid.diagnosis import Diagnosis
from seals.sysid.report.naming import effect_words, figure, interval, percent
from seals.sysid.report.sentence import calibration_of, given_by, turned_words
from seals.sysid.report.tolerances import moved
from seals.sysid.residual_force import Formula, Localisation
from seals.sysid.scores.excitation import best_gains
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis

_STRAINED = 1.5
"""Tolerances beyond which a data sheet value is mentioned."""


def headline(diagnosis: Diagnosis, data: Mapping[str, Any]) -> str:
    """Return the verdict in one sentence with its confidence."""
    verdict, effects = diagnosis.answer.verdict, data["effects"]
    if verdict is Verdict.named:
        claims = diagnosis.answer.claims
        parts = [
            f"{_or(c)}{_when(diagnosis, e)} ({_sure(c)})"
            for c, e in zip(claims, effects, strict=True)
        ]
        return f"The model lacks {joined(parts)}."
    if verdict is Verdict.ambiguous:
        parts = [f"{e['name']}{_when(diagnosis, e)} ({percent(e['confidence'])})" for e in effects]
        return (
            "The model lacks one of these, but this log does not determine which: "
            f"{', '.join(parts)}."
        )
    if verdict is Verdict.none_of_these:
        count = len({c.name for c in diagnosis.problem.plant.candidate_set.candidates})
        return f"An effect is missing that none of the {count} effects of the library explains."
    if verdict is Verdict.cannot_tell:
        return _untold(diagnosis, data)
    if verdict is Verdict.nothing_missing:
        return "Nothing is missing: the model explains the log within noise and tolerances."
    return "The log cannot be used."


def _or(claim: Claim[EvidenceHypothesis]) -> str:
    """Return the name of an effect, with those that explain the log as well."""
    return " or ".join([claim.name, *claim.rivals])


def _sure(claim: Claim[EvidenceHypothesis]) -> str:
    """Return the confidence in an effect, or in the set of those that share its place."""
    if claim.rivals:
        return f"{percent(claim.confidence_of_set)} confident that it is one of them"
    return f"{percent(claim.confidence)} confident"


def alike_words(diagnosis: Diagnosis) -> list[str]:
    """Return what else explains the log: names of equal weight, and those nearly as good."""
    out = []
    for claim in diagnosis.answer.claims:
        rest = [name for name in claim.alike if name not in claim.rivals]
        if claim.rivals:
            out.append(
                f"This log cannot distinguish: {', '.join([claim.name, *claim.rivals])}. Each "
                "explains it equally well."
            )
        if rest:
            out.append(
                f"Explains the log nearly as well as {claim.name}, not quite excluded: "
                f"{', '.join(rest)}."
            )
    return out


def first_answers(
    diagnosis: Diagnosis,
    data: Mapping[str, Any],
    missing: Localisation,
    channels: Mapping[str, Mapping[str, float]],
) -> dict[str, str]:
    """Return what, where, when and by how much, each in a few words.

    Args:
        diagnosis: that is told.
        data: of the diagnosis, as `Diagnosis.to_dict` returns it.
        missing: what the stated model lacks.
        channels: residual before and after in units of what is expected, by channel.
    """
    verdict, held, effects = diagnosis.answer.verdict, data["held_out_error"], data["effects"]
    claimed = bool(diagnosis.answer.claims)
    what = " / ".join(f"{e['name']}, {percent(e['confidence'])}" for e in effects)
    if verdict is Verdict.named:
        parts = (f"{_or(c)}, {percent(c.confidence_of_set)}" for c in diagnosis.answer.claims)
        what = " / ".join(parts)
    answers = {"what": what if claimed else verdict.value.replace("_", " ")}
    mark = missing.signature
    places = [place for e in effects for place in _places(e)] if claimed else []
    if places:
        answers["where"] = joined(list(dict.fromkeys(places)))
    elif mark.along:
        held_in = f", constant in the {mark.frame}" if mark.frame != "neither" else ""
        # the axis with most of its power: a drag or a wind acts along the others too
        answers["where"] = f"force mostly along {mark.along}{held_in}"
    elif verdict is not Verdict.nothing_missing and channels:
        worst = max(channels, key=lambda name: channels[name]["before"])
        answers["where"] = f"seen in {worst}, {channels[worst]['before']:.2g} × expected"
    if claimed:
        spans = [_when(diagnosis, e).strip() or "throughout" for e in effects]
        answers["when"] = " / ".join(dict.fromkeys(spans))
    elif missing.residual.missing and missing.regimes:
        most = max(missing.regimes, key=lambda r: max(r.force_ratio, r.torque_ratio))
        answers["when"] = f"most: {most.name}"
    if mark.media and "when" in answers:
        answers["when"] += f", in {joined(list(mark.media))}"
    keys = ("stated", "before", "after") if claimed else ("stated", "before")
    steps = "stated → fitted" + (" → with it" if claimed else "")
    fall = " → ".join(figure(held[k], digits=3) for k in keys)
    answers[f"held-out error, noise is {held['noise_floor']:.3g}: {steps}"] = fall
    return answers


def _places(effect: Mapping[str, Any]) -> list[str]:
    """Return the drive, joint or link of the vehicle on which an effect acts; often none."""
    values = effect.get("parameters", {})
    found = [f"{name} {values[name]['value']:g}" for name in ("rotor", "joint") if name in values]
    return [*found, *([f"link {effect['link']}"] if effect.get("link") else [])]


def _untold(diagnosis: Diagnosis, data: Mapping[str, Any]) -> str:
    """Return in one sentence what a log that cannot tell leaves open."""
    if data["stated_wrong"]:
        words = joined([str(n["words"]) for n in data["stated_wrong"]])
        return f"The stated model is wrong, or an effect resembles this: {words}."
    moved_little = ": the motion was too weak" if diagnosis.answer.blind else ""
    return f"This log does not determine what is missing{moved_little}."


def _when(diagnosis: Diagnosis, effect: Mapping[str, Any]) -> str:
    """Return when an effect acts; empty where it acts throughout."""
    entries = effect.get("active")
    return "" if entries is None else f" {active_words(entries, diagnosis.logs)}"


def explanation(diagnosis: Diagnosis, data: Mapping[str, Any]) -> str:
    """Return what the verdict means, in a sentence or two."""
    verdict, held = diagnosis.answer.verdict, data["held_out_error"]
    if verdict in (Verdict.named, Verdict.ambiguous):
        each = [(e["name"], effect_words(e["name"]).rstrip(".")) for e in data["effects"]]
        words = " ".join(f"{name} ({meaning})." for name, meaning in each)
        first, fitted, last = (figure(held[k], digits=3) for k in ("stated", "before", "after"))
        fell = (
            f"Held-out error: {first} of the stated model, {fitted} with its numbers fitted within "
            f"their tolerances, {last} with the effect"
        )
        wrong = " ".join(_wrong(n) for n in data["stated_wrong"])
        return f"{words} {fell}; 1 is noise alone. {_strained(diagnosis)} {wrong}".strip()
    reasons = "; ".join(diagnosis.answer.reasons)
    if verdict is Verdict.none_of_these:
        share, least = data.get("explained"), diagnosis.problem.policy.explained
        # other reasons than a poor fit refuse a name as well
        part = (
            f" The best model of the library removes {percent(share)} of the removable misfit, "
            "which "
            "is too little to name an effect."
            if isinstance(share, float) and share < least and diagnosis.search.best.candidates
            else ""
        )
        return f"What is left: {reasons}.{part}"
    if verdict is Verdict.cannot_tell:
        wrong = " ".join(_wrong(n) for n in data["stated_wrong"])
        clean = "Such an effect may nevertheless be present."
        return f"In detail: {reasons}. {wrong or clean}"
    if verdict is Verdict.bad_data:
        return f"In detail: {reasons}."
    held_words = f"The held-out error is {figure(held['before'], digits=3)}; 1 is noise alone. "
    return held_words + "No effect of the library improves it beyond chance. " + _unseen(diagnosis)


def _wrong(number: Mapping[str, Any]) -> str:
    """Describe a stated number that is too far off."""
    unit = str(number["unit"])
    return (
        f"{number['words']} ({number['what']}): stated {figure(number['stated'], unit)}, found "
        f"{figure(number['found'], unit)}, {abs(number['sigma']):.1f} tolerances apart."
    )


def _strained(diagnosis: Diagnosis) -> str:
    """Return a note where the model without the effect fits too, by changing data sheet values."""
    search, held = diagnosis.search, diagnosis.held_out
    fall = (held["before"] - held["after"]) * search.nominal.fitter.windows.observed
    if fall > 0.5 * search.best.score or not diagnosis.answer.claims:
        return ""
    far = [m for m in moved(search.nominal) if abs(m.sigmas) > _STRAINED][:3]
    parts = [f"{m.words} by {abs(m.sigmas):.1f} tolerances" for m in far]
    means = f": {joined(parts)}" if parts else ""
    return (
        "Without it the model follows the log nearly as well, but only with implausible changes "
        f"of data sheet values{means}."
    )


def _unseen(diagnosis: Diagnosis) -> str:
    """Name the effects that this log could not have shown."""
    gains = diagnosis.answer.excitation
    best = best_gains(gains)
    hidden = [name for name, gain in best.items() if gain < diagnosis.problem.policy.excitation]
    if not best:
        return ""
    if not hidden:
        return "Any effect of plausible size would have been detected in this log."
    return f"An effect of plausible size would have been detected, except {joined(hidden)}."


def next_steps(
    diagnosis: Diagnosis, data: Mapping[str, Any], law: Formula | None, folder: Path
) -> tuple[list[str], str]:
    """Return what to do next, as sentences and command lines."""
    verdict = diagnosis.answer.verdict
    planned = _proposed(data.get("next_experiment"))
    words = [planned] if planned else []
    robot, answer = diagnosis.given_robot, typed("diagnosis", str(folder))
    add = f"seals add {answer} name=my_model{robot}"
    plan = f"seals plan {answer}{robot}"
    if verdict is Verdict.named:
        alike = [s for s in data["ambiguous_with"] if len(s) > 1]
        if alike:
            others = joined([n for s in alike for n in s[1:]])
            words.insert(0, f"A further flight decides whether {others} can be excluded.")
        words += dict.fromkeys(
            claim.candidate.identification.measurement
            for claim in diagnosis.answer.claims
            if claim.alike and claim.candidate.identification.data_sheet
        )
        words.append("Add the effect to the model, then verify it on a log that was never fitted.")
        lines = [add, f"seals verify log=ANOTHER_LOG model=my_model{robot}"]
        return words, "\n".join([*lines, plan] if alike else lines)
    if verdict is Verdict.ambiguous:
        name = data["effects"][0]["name"]
        words.append(
            "Fly the manoeuvre that distinguishes them; or choose one yourself, which "
            "is then recorded."
        )
        return words, f"{plan}\n{add} choose={name}"
    if verdict is Verdict.none_of_these:
        words.append("See the residual force below: when, where and along which axis it acts.")
        if law is not None:
            words.append(
                "Accept the formula that was fitted to it, or write an effect of your own."
            )
            return words, f"{add} accept=formula"
        words.append("Then write an effect of your own for it.")
        return words, ""
    if verdict in (Verdict.cannot_tell, Verdict.bad_data):
        return _after_refusal(diagnosis, data, words)
    words.append("Nothing to add. A flight with more motion would test the model more strictly.")
    return words, ""


def _after_refusal(
    diagnosis: Diagnosis, data: Mapping[str, Any], words: list[str]
) -> tuple[list[str], str]:
    """Return what to do where the log does not tell or cannot be used."""
    if diagnosis.answer.verdict is Verdict.bad_data:
        return [*words, "Correct the log, and diagnose it again."], ""
    turned = turned_words(data["stated_wrong"])
    if turned:
        return [*words, f"Correct the directions: {'; '.join(turned)}."], (
            f"seals diagnose {given_by(diagnosis)}"
        )
    if data["stated_wrong"]:
        words.append("Measure these numbers again, or estimate them from the log.")
        return words, calibration_of(data["stated_wrong"], given_by(diagnosis))
    if diagnosis.answer.blind:
        plan = f"seals plan {typed('effects', list(diagnosis.answer.blind[:1]))}"
        words.append("Fly again with more motion.")
        return words, f"{plan} {given_by(diagnosis)}"
    exact = "Fly slower, or log at a higher rate: the model is not exact enough here."
    return [*words, exact], ""


def _proposed(plan: Any) -> str:
    """Describe the proposed manoeuvre in words; empty without one."""
    if isinstance(plan, str):
        return plan
    if isinstance(plan, Mapping):
        return str(plan.get("sentence") or plan.get("words") or "")
    return ""


def parameter_rows(data: Mapping[str, Any]) -> list[list[str]]:
    """Return rows of text: parameter, value and 90 % interval of every claim."""
    rows, several = [], len(data["effects"]) > 1
    for effect in data["effects"]:
        for name, p in effect["parameters"].items():
            unit = p["unit"]
            exact = p["low90"] == p["high90"]
            limits = "–" if exact else interval(p["low90"], p["high90"], unit)
            words = name.replace("_", " ")
            words = f"{effect['name']}: {words}" if several else words
            rows.append([words, figure(p["value"], unit), limits])
    return rows


def joined(parts: Sequence[str]) -> str:
    """Join words with commas and a final 'and'.

    Example:
        >>> joined(["a"]), joined(["a", "b", "c"])
        ('a', 'a, b and c')
    """
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
