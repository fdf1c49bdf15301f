"""Writing of overlay files, with comments for editing by hand."""

from __future__ import annotations

import dataclasses
import datetime
import hashlib
from collections.abc import Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import Any

import seals
from seals import registry
from seals.config.overlay import WAVE, free_name
from seals.config.overrides import typed
from seals.effects.effect import Effect, MediumKind
from seals.errors import ConfigError
from seals.logs.atomic import plain, write_text
from seals.schema import parameters_of
from seals.sysid.candidates.activity import active_words
from seals.sysid.candidates.parameters import Candidate
from seals.sysid.validation.answer import FORMULA, Finding, logs_of
from seals.sysid.validation.model import by_instance
from seals.sysid.validation.refit import Refit

_HEAD = """\
# Model '{name}': {summary}.
# Use it:     seals run{robot} +{model}
# Verify it:  seals verify log=ANOTHER_LOG {model}{given}
# Numbers may be edited by hand; names and bounds are checked when the file is read.
"""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Part:
    """Entry of an overlay.

    Args:
        section: ``effects``, ``changes`` or ``wave``.
        name: of the entry.
        values: as written.
        intervals: 90 % interval of each parameter.
    """

    section: str
    name: str
    values: dict[str, Any]
    intervals: dict[str, list[float]]


def overlay_of(
    finding: Finding,
    found: Refit,
    base: Mapping[str, Any],
    *,
    source: Mapping[str, Any],
    without: Sequence[str] = (),
) -> dict[str, Any]:
    """Return the content of an overlay.

    Args:
        finding: the answer.
        found: fitted values.
        base: content of the model that it adds to; empty for none.
        source: path and SHA-256 of the log, or a list of them, as in an answer.
        without: effects that were left out of the nominal model.

    Raises:
        ConfigError: the base holds one of the effects already.
    """
    sections: dict[str, Any] = {
        k: dict(base.get(k) or {}) for k in ("effects", "changes", "intervals")
    }
    sections["wave"] = base.get("wave")
    for candidate, effect in zip(found.candidates, finding.effects, strict=True):
        for part in parts_of(candidate, found, effect):
            _refuse_twice(part, sections, base)
            taken = {**sections["effects"], **sections["changes"]}
            name = part.name if part.section == "wave" else free_name(part.name, taken)
            if part.section == "wave":
                sections["wave"] = part.values
            else:
                sections[part.section][name] = part.values
            sections["intervals"][name] = part.intervals
    if finding.formula is not None:
        law = finding.formula["effect"]
        values = {k: _short(v) for k, v in law["parameters"].items()}
        entry = {"effect": law["name"], "medium": law["medium"], **values}
        sections["effects"][free_name(FORMULA, sections["effects"])] = entry
    words = [*(str(e["name"]) for e in finding.effects)]
    words += [] if finding.formula is None else ["an unnamed force"]
    out: dict[str, Any] = {"summary": f"{' and '.join(words)}, found in {_names(source)}"}
    out |= {key: value for key, value in sections.items() if value}
    out["nominal"] = {
        key: {k: _short(x) for k, x in {**v, **(finding.nominal.get(key) or {})}.items()}
        for key, v in found.nominal.items()
    }
    out["speeds"] = [_short(x) for x in found.speeds]
    out["provenance"] = _provenance(finding, base, source, without)
    return out


def timed_words(effect: Mapping[str, Any]) -> str:
    """Describe when a diagnosed effect acts; in an overlay it acts at all times."""
    entries = effect["active"]
    return active_words(entries, [str(entry["log"]) for entry in entries])


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
        given: the same and what is left out of the nominal model; empty where the log describes its
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


def parts_of(candidate: Candidate, found: Refit, effect: Mapping[str, Any]) -> list[Part]:
    """Return the overlay entries of one effect, one for each instance that it changes.

    An instance that the nominal model holds is changed, and so is an effect whose change is
    negative where the whole cannot be.
    """
    made = []
    values = {key: found.values[key] for key in candidate.all_keys}
    intervals = _intervals(candidate, effect)
    for instance, moved in by_instance(values).items():
        limits = intervals.get(instance, {})
        short = {k: _short(v) for k, v in moved.items()}
        if instance in found.candidate_set.waves:
            plugin = _plugin_of(found.candidate_set.waves[instance].law, "wave")
            made.append(Part(section="wave", name=WAVE, values={"wave": plugin, **short},
                             intervals=limits))  # fmt: skip
            continue
        law = found.candidate_set.effects[instance]
        if instance in found.own or _below_bounds(law, moved):
            entry = {"effect": _plugin_of(type(law)), **_medium(law), **short}
            made.append(Part(section="changes", name=candidate.name, values=entry,
                             intervals=limits))  # fmt: skip
            continue
        total = {k: _short(float(getattr(law, k)) + v) for k, v in moved.items()}
        entry = {"effect": _plugin_of(type(law)), **_options(law), **total}
        made.append(Part(section="effects", name=candidate.name, values=entry, intervals=limits))
    return made


def _intervals(candidate: Candidate, effect: Mapping[str, Any]) -> dict[str, Any]:
    """90 % intervals by instance and parameter."""
    given = effect.get("parameters", {})
    table: dict[str, Any] = {}
    for key, name in zip(candidate.keys, candidate.reported, strict=True):
        ends = [given.get(name, {}).get(end) for end in ("low90", "high90")]
        # null in an answer: the log did not determine the interval
        if None not in ends:
            instance, _, parameter = key.partition(".")
            table.setdefault(instance, {})[parameter] = [_short(end) for end in ends]
    return table


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


def _plugin_of(law: type, kind: str = "effect") -> str:
    target = f"{law.__module__}:{law.__qualname__}"
    for name, plugin in registry.plugins(kind).items():
        if plugin.value == target:
            return name
    raise ConfigError(f"{target} is not installed as a plug-in.\nSee: seals list {kind}")


def _refuse_twice(part: Part, sections: Mapping[str, Any], base: Mapping[str, Any]) -> None:
    """Refuse an effect that the base model already adds."""
    if not base:
        return
    own: Sequence[Any] = [sections["wave"]] if part.section == "wave" else [
        *sections["effects"].values(), *sections["changes"].values()
    ]  # fmt: skip
    kinds = ("effect", "wave", "medium", "links", "rotor", "joint")
    if any(e and all(e.get(k) == part.values.get(k) for k in kinds) for e in own):
        raise ConfigError(
            f"base={base.get('name')} adds {part.name} already: it would act twice.\n"
            "Leave base= out: the diagnosis was made against the log's own nominal model."
        )


def _names(source: Mapping[str, Any]) -> str:
    return " and ".join(Path(path).name for path in logs_of({"log": source}))


def _provenance(
    finding: Finding, base: Mapping[str, Any], source: Mapping[str, Any], without: Sequence[str]
) -> dict[str, Any]:
    logs = logs_of({"log": source})
    paths, digests = list(logs), [digest for digest in logs.values() if digest]
    out: dict[str, Any] = {
        "log": paths[0] if len(paths) == 1 else paths,
        "log_sha256": digests[0] if len(digests) == 1 else digests,
        **({"without": list(without)} if without else {}),
        "verdict": finding.verdict,
        "confidence": {str(e["name"]): _short(e.get("confidence", 0.0)) for e in finding.effects},
        "diagnosis": str(finding.file.resolve()),
        "diagnosis_sha256": hashlib.sha256(finding.file.read_bytes()).hexdigest(),
        "date": datetime.datetime.now().astimezone().isoformat(timespec="seconds"),
        "seals": seals.__version__,
    }
    active = {str(e["name"]): timed_words(e) for e in finding.effects if "active" in e}
    if active:
        out["active"] = active
    if finding.formula is not None:
        out["accepted"] = f"a formula without a name, by the user: {finding.formula['text']}"
    if finding.chosen:
        out["chosen"] = f"{finding.names[0]}, picked by the user among what the log cannot tell"
    if base:
        out["base"] = {"name": base.get("name"), **(base.get("provenance") or {})}
    return out


def _short(value: Any) -> float:
    """Round to six significant digits."""
    return float(f"{float(value):.6g}")
