"""Models of an answer, and overlay files of them with comments for editing by hand."""

from __future__ import annotations

import dataclasses
import datetime
import hashlib
import math
from collections.abc import Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import Any

import seals
from seals.config.overlay import WAVE, free_name
from seals.config.overrides import typed
from seals.config.plugin_lookup import plugin_name
from seals.effects.effect import Effect, MediumKind
from seals.errors import ConfigError, refuse_unlisted
from seals.logs.atomic import write_text
from seals.schema import parameters_of, plain
from seals.sysid.candidates.activity import active_words
from seals.sysid.candidates.catalogue import formula_effect, installed, wave_laws
from seals.sysid.candidates.parameters import Candidate
from seals.sysid.decision.intervals import parameters
from seals.sysid.diagnosis import Diagnosis
from seals.sysid.predictors.problem import typical_speeds
from seals.sysid.residual_force import Formula
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis
from seals.sysid.validation.answer import FORMULA, AnswerModel, Finding, FoundEffect, logs_of
from seals.sysid.validation.model import by_instance
from seals.untrusted_io import refuse_references

_HEAD = """\
# Model '{name}': {summary}.
# Use it:     seals run{robot} +{model}
# Verify it:  seals verify log=ANOTHER_LOG {model}{given}
# Numbers may be edited by hand; names and bounds are checked when the file is read.
"""


def models_of(
    found: Diagnosis, law: Formula | None = None, *, vehicle: str = ""
) -> dict[str, dict[str, Any]]:
    """Return the models that an answer offers, each with the content of an overlay file.

    An instance that the stated model holds is changed, and so is an effect whose change is
    negative where the whole cannot be.

    Args:
        found: the diagnosis.
        law: formula of the force that no effect explains.
        vehicle: name that the log gives its vehicle.

    Returns:
        By the names of their effects joined by a comma: all claims together, every claim and every
        rival alone; by `FORMULA` the formula.
    """
    reported = [(candidate, model) for candidate, model, _ in found.reported]
    choices = [reported[: len(found.answer.claims)], *([one] for one in reported)]
    out: dict[str, dict[str, Any]] = {}
    for chosen in filter(None, choices):
        name = ",".join(candidate.name for candidate, _ in chosen)
        if name not in out:
            out[name] = _entries(found, chosen) | _beside(found, chosen[0][1], vehicle)
    if law is not None:
        values = {key: _short(value) for key, value in law.parameters().items()}
        entry = {"effect": formula_effect(), "medium": law.medium, **values}
        out[FORMULA] = {"effects": {FORMULA: entry}} | _beside(found, found.hypothesis, vehicle)
    return out


def _entries(
    found: Diagnosis, chosen: Sequence[tuple[Candidate, EvidenceHypothesis]]
) -> dict[str, Any]:
    """Return the sections of a model for its effects, with the 90 % interval of each parameter."""
    made: dict[str, dict[str, Any]] = {k: {} for k in ("effects", "changes", "wave", "intervals")}
    for candidate, model in chosen:
        throughout, known = candidate.throughout, model.fitter.candidate_set
        shown = parameters(candidate, model.fit, model)
        pairs = zip(throughout.nuisance, candidate.nuisance, strict=True)
        values = {key: model.fit.values[own] for key, own in pairs}
        limits: dict[str, dict[str, list[float]]] = {}
        for key, name in zip(throughout.keys, candidate.reported, strict=True):
            values[key] = shown[name]["value"]
            ends = [_short(shown[name][end]) for end in ("low90", "high90")]
            if all(map(math.isfinite, ends)):
                instance, _, parameter = key.partition(".")
                limits.setdefault(instance, {})[parameter] = ends
        for instance, moved in by_instance(values).items():
            short = {k: _short(v) for k, v in moved.items()}
            if instance in known.waves:
                plugin = plugin_name("wave", known.waves[instance].law)
                made["wave"] = {"wave": plugin, **short}
                made["intervals"][WAVE] = limits.get(instance, {})
                continue
            law = known.effects[instance]
            section, entry = (
                "changes",
                {"effect": plugin_name("effect", type(law)), **_medium(law), **short},
            )
            if instance not in found.problem.vehicle.effects and not _below_bounds(law, moved):
                total = {k: _short(float(getattr(law, k)) + v) for k, v in moved.items()}
                section, entry = "effects", {"effect": entry["effect"], **_options(law), **total}
            free = free_name(candidate.name, made["effects"] | made["changes"])
            made[section][free] = entry
            made["intervals"][free] = limits.get(instance, {})
    return {key: value for key, value in made.items() if value}


def _beside(found: Diagnosis, model: EvidenceHypothesis, vehicle: str) -> dict[str, Any]:
    """Return what a model holds beside its effects: fitted nominal values, speeds, vehicle.

    Nominal values are zero where an effect changes the same value.
    """
    alone, nominal = found.search.nominal.fit.values, dict[str, Any]()
    for key in model.fitter.tolerances:
        own = key in model.fit.free
        both = {
            "value": 0.0 if own else model.fit.values[key],
            "sd": 0.0 if own else model.fit.spread(key),
            "alone": alone[key],
        }
        nominal[key] = {k: _short(v) for k, v in both.items() if math.isfinite(v)}
    speeds = typical_speeds(found.problem.fitter.trajectory)
    return {
        "nominal": nominal,
        "speeds": [_short(x) for x in speeds],
        "provenance": {"vehicle": vehicle},
    }


def overlay_of(
    finding: Finding,
    base: Mapping[str, Any],
    *,
    source: Mapping[str, Any],
) -> dict[str, Any]:
    """Return the content of an overlay.

    Args:
        finding: the answer.
        base: content of the model that it adds to; empty for none.
        source: path and SHA-256 of the log, or a list of them, as in an answer.

    Raises:
        ConfigError: the answer holds no such model, or the base holds one of the effects already.
    """
    model = _model_of(finding)
    sections: dict[str, Any] = {
        k: dict(base.get(k) or {}) for k in ("effects", "changes", "intervals")
    }
    sections["wave"] = base.get("wave")
    intervals = model.intervals
    for section, entries in (("effects", model.effects), ("changes", model.changes)):
        for name, entry in entries.items():
            _refuse_twice(name, entry, sections, base)
            free = free_name(name, {**sections["effects"], **sections["changes"]})
            sections[section][free] = entry
            sections["intervals"] |= {free: intervals[name]} if name in intervals else {}
    if model.wave:
        _refuse_twice(WAVE, model.wave, sections, base)
        sections["wave"] = model.wave
        sections["intervals"][WAVE] = intervals.get(WAVE) or {}
    words = [effect.name for effect in finding.effects]
    words += [] if finding.formula is None else ["an unnamed force"]
    logs = " and ".join(Path(path).name for path in logs_of({"log": source}))
    out: dict[str, Any] = {"summary": f"{' and '.join(words)}, found in {logs}"}
    out |= {key: value for key, value in sections.items() if value}
    out |= {k: v for k, v in (("nominal", model.nominal), ("speeds", model.speeds)) if v}
    out["provenance"] = _provenance(finding, base, source)
    out["provenance"]["vehicle"] = str(model.provenance.get("vehicle", ""))
    return out


def _model_of(finding: Finding) -> AnswerModel:
    """Return the model of an answer with the chosen effects.

    Raises:
        ConfigError: an earlier version wrote the answer, or it compares flights.
    """
    names = [effect.name for effect in finding.effects]
    known = {*installed(), *(law.candidate for law in wave_laws())}
    for name in names:
        refuse_unlisted(name, known, f"'{name}' is not a candidate for this vehicle")
    own = ",".join(names) or FORMULA
    found = (finding.answer.models or {}).get(own)
    if found is None:
        raise ConfigError(
            f"{finding.file} contains no model of {own}: an earlier version wrote it, or it "
            "compares "
            "a flight with healthy ones.\n"
            "Diagnose the log again, separately: seals diagnose log=FOLDER out=FOLDER"
        )
    refuse_references(plain(found), where=str(finding.file))
    return found


def timed_words(effect: FoundEffect) -> str:
    """Describe when a diagnosed effect acts; in an overlay it acts at all times."""
    return active_words(plain(effect.active), [span.log for span in effect.active])


def write_overlay(
    path: Path,
    option: str,
    content: Mapping[str, Any],
    *,
    robot: str = " robot=MY_ROBOT",
    given: str = "",
) -> None:
    """Write an overlay file with usage comments.

    Args:
        path: of the file.
        option: value of ``model=`` that takes it.
        content: of the file.
        robot: word of the command line that gives the robot, behind a blank.
        given: the same and what is left out of the stated model; empty if the log describes its
            vehicle.
    """
    import yaml

    words = {"robot": robot, "given": given, "model": typed("model", option)}
    head = _HEAD.format(name=path.stem, summary=content.get("summary", ""), **words)
    body = yaml.safe_dump(plain(dict(content)), sort_keys=False, default_flow_style=None, width=100)
    write_text(path, head + body)


def withdraw(path: Path, reason: str) -> None:
    """Mark an overlay as withdrawn, keeping what the user wrote into it."""
    import yaml

    text = path.read_text(encoding="utf-8")
    kept = [line for line in text.splitlines() if not line.startswith("withdrawn:")]
    line = yaml.safe_dump({"withdrawn": reason}, width=10**6).strip()
    write_text(path, "\n".join([*kept, line]) + "\n")


def _below_bounds(law: Effect, moved: Mapping[str, float]) -> bool:
    declared = parameters_of(law)
    return any(
        not declared[k].bounds[0] <= float(getattr(law, k)) + v <= declared[k].bounds[1]
        for k, v in moved.items()
    )


def _options(law: Effect) -> dict[str, Any]:
    """Return the options of an effect that differ from its plug-in's defaults."""
    fresh, out = type(law)(), {}
    for entry in dataclasses.fields(law):
        value = getattr(law, entry.name)
        if entry.name != "correction" and value != getattr(fresh, entry.name):
            out[entry.name] = value.value if isinstance(value, Enum) else value
    return {**_medium(law), **out}


def _medium(law: Effect) -> dict[str, str]:
    medium = getattr(law, "medium", None)
    return {"medium": medium.value} if isinstance(medium, MediumKind) else {}


def _refuse_twice(
    name: str, entry: Mapping[str, Any], sections: Mapping[str, Any], base: Mapping[str, Any]
) -> None:
    """Refuse an effect that the base model already adds."""
    own = [*sections["effects"].values(), *sections["changes"].values(), sections["wave"]]
    kinds = ("effect", "wave", "medium", "links", "rotor", "joint")
    if base and any(e and all(e.get(k) == entry.get(k) for k in kinds) for e in own):
        raise ConfigError(
            f"base={base.get('name')} adds {name} already: it would act twice.\n"
            "Leave base= out: the diagnosis was made against the log's own stated model."
        )


def _provenance(
    finding: Finding, base: Mapping[str, Any], source: Mapping[str, Any]
) -> dict[str, Any]:
    logs = logs_of({"log": source})
    paths, digests = list(logs), [digest for digest in logs.values() if digest]
    out: dict[str, Any] = {
        "log": paths[0] if len(paths) == 1 else paths,
        "log_sha256": digests[0] if len(digests) == 1 else digests,
        **({"without": list(finding.answer.without)} if finding.answer.without else {}),
        "verdict": finding.answer.verdict,
        "confidence": {e.name: _short(e.confidence) for e in finding.effects},
        "diagnosis": str(finding.file.resolve()),
        "diagnosis_sha256": hashlib.sha256(finding.file.read_bytes()).hexdigest(),
        "date": datetime.datetime.now().astimezone().isoformat(timespec="seconds"),
        "seals": seals.__version__,
    }
    active = {e.name: timed_words(e) for e in finding.effects if e.active}
    if active:
        out["active"] = active
    if finding.formula is not None:
        out["accepted"] = f"a formula without a name, by the user: {finding.formula.text}"
    if finding.chosen:
        why = "chosen by the user among effects that the log cannot distinguish"
        out["chosen"] = f"{finding.names[0]}, {why}"
    if base:
        out["base"] = {"name": base.get("name"), **(base.get("provenance") or {})}
    return out


def _short(value: Any) -> float:
    """Round to six significant digits."""
    return float(f"{float(value):.6g}")
