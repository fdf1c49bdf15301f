"""``seals diagnose experiment=...``: names the effects missing in the model of several runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from seals.compare.application import read_logs, settings_of
from seals.compare.report import case_charts, sections_of
from seals.compare.result import Comparison, Group
from seals.config.compose import output_folder
from seals.file_names import DIAGNOSIS, REPORT, file_name
from seals.logs.atomic import finite, write_json
from seals.report import Block, Paragraph, Section, Table, write_page, write_picture
from seals.sysid.decision.verdict import Verdict
from seals.sysid.report.naming import parameter_text
from seals.sysid.runs import RunsDiagnosis, diagnose_runs


def execute(config: Any) -> int:
    """Run one composed experiment (root ``compare``) and return the exit code of its verdict."""
    settings = settings_of(config)
    found = diagnose_runs(settings, read_logs(settings))
    out = output_folder(settings.out)
    write_json(
        out / DIAGNOSIS,
        finite(
            found[0].to_dict()
            if len(found) == 1
            else {"groups": {one.name: one.to_dict() for one in found}}
        ),
    )
    _write_runs_report(found, out)
    for one in found:
        print(_sentence(one))
    print(f"\n{out / DIAGNOSIS}")
    # of several verdicts the most informative one
    order = list(Verdict)
    return max((one.answer.verdict for one in found), key=lambda v: -order.index(v)).exit_code


def _sentence(one: RunsDiagnosis) -> str:
    """Return the result of a diagnosis of runs as a few lines of text."""
    table = one.to_dict()
    heads = {
        Verdict.named: "missing:",
        Verdict.ambiguous: "one of these is missing:",
        Verdict.nothing_missing: "nothing is missing",
        Verdict.none_of_these: "none of the effects in the library",
        Verdict.cannot_tell: "cannot tell",
    }
    lines = [f"{one.name}: {heads[one.answer.verdict]}"]
    for effect in table["effects"]:
        law = f" ({effect['law']})" if effect["law"] else ""
        lines.append(f"  {effect['name']}{law}, confidence {100 * effect['confidence']:.0f} %")
        lines += [f"    {parameter_text(name, p)}" for name, p in effect["parameters"].items()]
    lines += [f"  {words}" for words in table["reasons"]]
    for channel, size in table["rms"].items():
        if size["before"] is not None and size["after"] is not None:
            lines.append(f"  {channel}: error {size['before']:.4g} -> {size['after']:.4g}")
    return "\n".join(lines)


def _write_runs_report(found: Sequence[RunsDiagnosis], folder: Path) -> Path:
    """Write report.html and, for every diagnosis, a picture of measurement and models."""
    folder.mkdir(parents=True, exist_ok=True)
    sections = [_rank(one) for one in found]
    for one in found:
        cases = one.search.validator.experiment.cases
        group = Group(
            name=one.name, cases=cases, variants=one.variants, offsets={c.name: {} for c in cases}
        )
        picture = folder / f"{file_name(one.name)}.png"
        shown = next((k for k, c in enumerate(group.cases) if c.held_out), 0)
        write_picture(picture, case_charts(group, shown))
        nominal = ", ".join(one.search.validator.experiment.candidate_set.nominal)
        sections += sections_of(
            Comparison(
                name=one.name,
                model=f"stated: {nominal}",
                groups=[group],
                findings={},
                sources={},
                seconds=one.seconds,
            )
        )
    return write_page(folder / REPORT, f"Diagnosis: {found[0].name}", sections)


def _rank(one: RunsDiagnosis) -> Section:
    rows = [
        [
            " + ".join(t["effects"]) or "stated model",
            f"{t['gain']:+.3f}",
            f"{t['standard_error']:.3f}",
            f"{t['price']:.2f}",
            f"{t['seen']:.3f}",
            f"{t['held_out']:.3f}",
        ]
        for t in one.to_dict()["tried"]
    ]
    head = ["added", "gain", "standard error", "price", "log error, fitted", "log error, held out"]
    words = "; ".join(one.answer.reasons)
    lead = (
        f"{one.answer.verdict.value}: {', '.join(c.candidate.label for c in one.answer.claims)}. "
        "Gain is the reduction of the logarithm of the error on held-out runs, minus a penalty for "
        "each further parameter; it is significant above twice its standard error."
    )
    blocks: list[Block] = [Paragraph(text=words)] if words else []
    blocks.append(Table(head=head, rows=rows, right=(1, 2, 3, 4, 5)))
    return Section(title=f"{one.name}: what was tried", lead=lead, blocks=blocks)
