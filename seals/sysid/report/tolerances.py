"""Data sheet values that moved within their tolerances."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from seals.report import Bar, Bars
from seals.report.figures import Mark
from seals.sysid.decision.moved_numbers import moved_numbers
from seals.sysid.report.naming import parameter_words, unit_of
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis

_MOST = 12
_FAR = 2.0


@dataclass(frozen=True, kw_only=True)
class Moved:
    """Datasheet value and its fitted change.

    Args:
        key: of the value.
        words: what it is.
        change: fitted change, in ``unit``.
        unit: of the change.
        sigmas: change over the datasheet's tolerance (1-sigma).
        uncertainty: standard error of ``sigmas`` after the fit; near 1 the log says nothing about
            it.
    """

    key: str
    words: str
    change: float
    unit: str
    sigmas: float
    uncertainty: float

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return asdict(self)


def moved(hypothesis: EvidenceHypothesis) -> tuple[Moved, ...]:
    """Return all values with a tolerance, largest change first."""
    candidate_set = hypothesis.fitter.candidate_set
    out = []
    for number in moved_numbers(hypothesis):
        out.append(
            Moved(
                key=number.key,
                words=parameter_words(number.key),
                change=number.change,
                unit=unit_of(candidate_set, number.key),
                sigmas=number.sigmas,
                uncertainty=number.unknown,
            )
        )
    return tuple(out)


def tolerance_chart(values: tuple[Moved, ...], *, model: str) -> Bars:
    """Return a bar chart of the largest changes in units of their tolerances."""
    bars = [
        Bar(
            label=m.words,
            value=m.sigmas,
            error=m.uncertainty,
            colour="#d8602a" if abs(m.sigmas) > _FAR else "#2f80d0",
            text=f"{m.sigmas:+.1f} σ",
        )
        for m in values[:_MOST]
    ]
    return Bars(
        title=f"Data sheet values, fitted within their tolerances: {model}",
        x_label="change / tolerance (1 σ) of the data sheet",
        bars=bars,
        marks=(Mark(at=-_FAR, label="-2 σ"), Mark(at=_FAR, label="+2 σ")),
        note=(
            "Every stated value may change within its tolerance; 1 σ is the tolerance in the "
            "log's meta.yaml. Values beyond 2 σ (orange) should be checked, and so should their "
            "tolerances. Error bars: one standard error; at 1 σ the log contains no information."
        ),
    )
