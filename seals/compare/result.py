"""Result of a comparison, as plain data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from seals.compare.case import Case, start_names
from seals.compare.score import pooled
from seals.compare.variants import ModelVariant
from seals.logs.atomic import finite
from seals.logs.finding import Finding


@dataclass(frozen=True, kw_only=True)
class Group:
    """Cases that share one fit.

    Args:
        name: of the log, or of the whole comparison.
        cases: its stretches.
        variants: of the model, in the order of the settings.
        offsets: clock offset of the last variant by case and channel: lag [s] and correlation.
    """

    name: str
    cases: Sequence[Case]
    variants: Sequence[ModelVariant]
    offsets: dict[str, dict[str, tuple[float, float]]]


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Result of a comparison.

    Args:
        name: of the comparison.
        model: robot and effects, in words.
        groups: one, or one per log.
        findings: of the data check, by log.
        sources: origin and licence of the logs, by log.
        seconds: computing time.
    """

    name: str
    model: str
    groups: Sequence[Group]
    findings: dict[str, list[Finding]]
    sources: dict[str, str]
    seconds: float

    def as_data(self) -> dict[str, Any]:
        """Return the result as JSON-ready data, without the samples."""
        out: dict[str, Any] = finite(
            {
                "name": self.name,
                "model": self.model,
                "seconds": self.seconds,
                "sources": self.sources,
                "data_check": {k: [str(f) for f in v] for k, v in self.findings.items()},
                "groups": [_group(g) for g in self.groups],
            }
        )
        return out


def _group(group: Group) -> dict[str, Any]:
    return {
        "name": group.name,
        "cases": [
            {
                "name": c.name,
                "held_out": c.held_out,
                "rows": len(c.time),
                "start": _start(c, group.variants[-1], k),
                "noise": {k: v.tolist() for k, v in c.sigma.items()},
                "notes": c.notes,
                "clock_offset": {
                    k: {"lag": a, "correlation": b} for k, (a, b) in group.offsets[c.name].items()
                },
            }
            for k, c in enumerate(group.cases)
        ],
        "ladder": [
            {
                "name": r.name,
                "effects": r.effects,
                "fitted": [asdict(f) for f in r.fitted],
                "train": {k: asdict(s) for k, s in pooled(r.scores, held_out=False).items()},
                "held_out": {k: asdict(s) for k, s in pooled(r.scores, held_out=True).items()},
                "cases": {s.name: {"total": s.total, "regimes": s.regimes} for s in r.scores},
            }
            for r in group.variants
        ],
    }


def _start(case: Case, variant: ModelVariant, k: int) -> dict[str, Any]:
    """Origin of the start, and its shift by the data: [value, standard deviation]."""
    names = start_names(case.start.state.joints.shape[1])
    pairs = zip(names, variant.deviations[k], variant.start_sigma[k], strict=True)
    free = set(case.start.free)
    moved = {n: [float(d), float(s)] for i, (n, d, s) in enumerate(pairs) if i in free}
    return {"source": case.start.source, "moved_by": moved}
