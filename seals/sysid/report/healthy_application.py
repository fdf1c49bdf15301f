"""``seals diagnose log=SICK healthy=[LOGS]``: what changed since a vehicle's healthy flights."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from seals.errors import ConfigError, LogError
from seals.file_names import DIAGNOSIS, REPORT, short_path
from seals.logs.atomic import finite, write_json
from seals.logs.log import Log
from seals.report import Block, Facts, Paragraph, Section, Table, write_page
from seals.run.progress import progress
from seals.schema import Within, read
from seals.sound_numbers import sound_numbers
from seals.sysid.decision.verdict import Verdict
from seals.sysid.healthy_flights.balance import has_inertial
from seals.sysid.healthy_flights.diagnosis import HealthyDiagnosis, HealthyFlights
from seals.sysid.report.given_logs import GivenLogs, bad_data, given_logs, places_of, sources
from seals.sysid.report.naming import figure, parameter_text, percent

_TICKS = 32
_STAGES = 3
_ADVICE = "Give longer logs, or look for extreme values."
_HEADS = {
    Verdict.named: "Changed since the healthy flights:",
    Verdict.ambiguous: "One of these changed since the healthy flights:",
    Verdict.nothing_missing: "Nothing changed: the flight is within the scatter of the healthy "
    "flights.",
    Verdict.none_of_these: "No effect of the library explains the log:",
    Verdict.cannot_tell: "Cannot tell:",
}


def compare(given: GivenLogs, out: Path) -> int:
    """Compare a log with healthy ones, write answer and report, and return the exit code.

    Args:
        given: the log, one.
        out: folder of the answer.

    Raises:
        ConfigError: a healthy log is not there, or given twice.
        LogError: a healthy log cannot be used.
    """
    if len(given.places) > 1:
        raise ConfigError("healthy= compares one log.\nGive one: log=FOLDER healthy=[A,B]")
    sessions = _sessions(given.config.healthy)
    words = [place for session in sessions for place in session]
    places = places_of(words, key="healthy")
    if given.places[0].resolve() in {place.resolve() for place in places}:
        raise ConfigError(
            f"healthy holds {given.places[0]}, the log itself.\nGive other flights of the vehicle."
        )
    numbers = [k for k, session in enumerate(sessions) for _ in session]
    with progress("comparing", _STAGES * _TICKS) as tell:
        try:
            (log,), robot = given.each(sheet=False)
        except LogError as refusal:
            return _refused(out, str(refusal))
        beside = _read(given, words)
        tell(_TICKS)
        healthy = HealthyFlights.of(beside, robot, sessions=numbers, inertial=has_inertial(log))
        tell(2 * _TICKS)
        try:
            with sound_numbers("a comparison with healthy flights", _ADVICE):
                found = healthy.diagnose(log, robot)
        except LogError as refusal:
            return _refused(out, str(refusal))
    source = {**sources(given.places), "healthy": [sources([place]) for place in places]}
    found = replace(found, source=source)
    write_json(out / DIAGNOSIS, finite(found.to_dict()))
    pages = [_report(found, log.name, out)] if given.config.report else []
    print(_sentence(found))
    for page in (out / DIAGNOSIS, *pages):
        print(page)
    return found.verdict.exit_code


_SOME = Within(1, 10_000)
_Sessions = Annotated[list[str | Annotated[list[str], _SOME]], _SOME]


def _sessions(healthy: Any) -> list[list[str]]:
    """Return the healthy logs by session; of a plain list each is one of its own.

    Raises:
        ConfigError: it is neither a list of logs nor of lists of them.
    """
    from omegaconf import OmegaConf

    given: Any = OmegaConf.to_container(healthy) if OmegaConf.is_config(healthy) else healthy
    try:
        parts = read(_Sessions, [given] if isinstance(given, str) else given, where="healthy")
        return [[part] if isinstance(part, str) else part for part in parts]
    except ConfigError as cause:
        raise ConfigError(
            f"healthy={given!r:.80} is not allowed.\n"
            "Give logs, healthy=[A,B,C], or one list for each session: healthy=[[A,B],[C]]"
        ) from cause


def _read(given: GivenLogs, words: Sequence[str]) -> list[Log]:
    """Return the healthy logs, those of one name with their paths.

    Raises:
        LogError: one of them cannot be used.
    """
    beside = given_logs(given.config, list(words), key="healthy")
    logs, _ = beside.each(sheet=False)
    often = Counter(log.name for log in logs)
    return [
        replace(log, name=str(short_path(place))) if often[log.name] > 1 else log
        for log, place in zip(logs, beside.places, strict=True)
    ]


def _sentence(found: HealthyDiagnosis) -> str:
    """Return verdict, effects and what they rest on as a few lines of text."""
    table, lines = found.to_dict(), [_HEADS[found.verdict]]
    for effect in table["effects"]:
        drives = effect["drives"]
        where = f" at drive {' and '.join(map(str, drives))}" if drives else ""
        lines.append(f"  {effect['name']}{where}, confidence {percent(effect['confidence'])}")
        lines += [f"    {parameter_text(name, p)}" for name, p in effect["parameters"].items()]
    lines += [f"  {words}" for words in table["reasons"]]
    healthy = table["healthy"]
    lines.append(
        f"Evidence {figure(found.changed.evidence, digits=3)}, needed "
        f"{figure(healthy['required'], digits=3)}; healthy sessions: {healthy['sessions']}"
    )
    return "\n".join([*lines, *_smallest(found)])


def _smallest(found: HealthyDiagnosis) -> list[str]:
    """Describe from which size on changes of the first drive are seen, or that they are not."""
    known = {one.name: one for one in found.reference.known}
    parts = []
    for name in ("weak_rotor@1", "payload@1", "centre_of_gravity@1"):
        size = found.reference.smallest.get(name, math.nan)
        one = known[name]
        unit = "" if one.unit == "1" else f" {one.unit}"
        words = "not at all" if math.isnan(size) else f"from {figure(size, digits=2)}{unit}"
        parts.append(f"{one.effect} {words}")
    return [f"Seen at drive 1: {', '.join(parts)}"]


def _report(found: HealthyDiagnosis, name: str, out: Path) -> Path:
    """Write the page and return its path."""
    table = found.to_dict()
    healthy = table["healthy"]
    blocks: list[Block] = [Paragraph(text=line) for line in _sentence(found).splitlines()]
    facts = {
        "verdict": found.verdict.value.replace("_", " "),
        "evidence [2 ln B]": figure(found.changed.evidence, digits=3),
        "needed": figure(healthy["required"], digits=3),
        "healthy sessions": str(healthy["sessions"]),
    }
    drives = [
        [str(k + 1), f"{thrust:.4g}", percent(share)]
        for k, (thrust, share) in enumerate(
            zip(healthy["thrusts"], healthy["lost_share"], strict=True)
        )
    ]
    modes = [
        [mode, f"{m['change']:.3g}", f"{m['scatter']:.3g}", f"{m['degrees']:.3g}"]
        for mode, m in healthy["modes"].items()
    ]
    tried = [[one["label"], figure(one["score"], digits=3)] for one in table["tried"]]
    left = [
        [n, figure(one["evidence"], digits=3), ", ".join(one["explanations"]) or "-"]
        for n, one in healthy["left_out"].items()
    ]
    sections = [
        Section(title="Summary", blocks=[Facts(values=facts), *blocks], wide=True),
        Section(
            title="Drives",
            blocks=[
                Table(head=["drive", "healthy thrust [N]", "lost"], rows=drives, right=(1, 2)),
                Table(
                    head=["mode", "change [N]", "scatter of a healthy flight [N]", "degrees"],
                    rows=modes,
                    right=(1, 2, 3),
                ),
            ],
        ),
        Section(
            title="Explanations",
            blocks=[Table(head=["effect @ drives", "evidence"], rows=tried, right=(1,))],
        ),
        Section(
            title="Healthy flights compared with each other",
            blocks=[Table(head=["log", "evidence", "explanations"], rows=left, right=(1,))],
        ),
    ]
    return write_page(out / REPORT, f"{name} beside healthy flights", sections, light=True)


def _refused(out: Path, words: str) -> int:
    """Write and print that the log cannot be used; return the exit code."""
    write_json(out / DIAGNOSIS, bad_data(words))
    print(f"bad data: {words}")
    return Verdict.bad_data.exit_code
