"""Text and tables of a comparison: claims that the intervals support."""

from __future__ import annotations

from collections.abc import Sequence

from seals.learn.comparison.outcome import ArmComparison, Study
from seals.learn.statistics.curve import LAST

METRIC_NAMES = {"area": "area under the curve", "last": f"mean of the last {LAST:.0%}"}
_SAYS = {
    ("area", "better"): "learns faster than",
    ("area", "worse"): "learns more slowly than",
    ("last", "better"): "ends higher than",
    ("last", "worse"): "ends lower than",
}
_SAYS_OF_OTHERS = {
    ("area", "better"): "lies above",
    ("area", "worse"): "lies below",
    **{key: words for key, words in _SAYS.items() if key[0] == "last"},
}
"""Where the value is none that learning raises, such as a distance."""

Rows = list[tuple[str, ...]]


def claims(study: Study) -> list[str]:
    """Return one sentence per comparison: the claim that its interval supports, or ``open``."""
    return [_claim(duel, study) for duel in study.duels]


def _claim(duel: ArmComparison, study: Study) -> str:
    found = duel.improvement
    chance = (
        f"probability of improvement {found.value:.2f}, {study.terms.level:.0%} interval "
        f"{found.low:.2f} to {found.high:.2f}"
    )
    if duel.verdict == "open":
        return (
            f"{duel.arm} against {duel.against}, {METRIC_NAMES[duel.metric]}: "
            f"no difference is shown ({chance})."
        )
    says = _SAYS if study.terms.value in ("success", "return") else _SAYS_OF_OTHERS
    return f"{duel.arm} {says[duel.metric, duel.verdict]} {duel.against} ({chance})."


def arm_rows(study: Study) -> tuple[tuple[str, ...], Rows]:
    """Return header and rows of the table of arms."""
    level = f"{study.terms.level:.0%}"
    head = (
        "arm",
        "runs",
        *(f"{METRIC_NAMES[key]}, IQM ({level})" for key in METRIC_NAMES),
        "lowest run, end",
        "highest run, end",
    )
    rows = [
        (
            arm.name,
            str(len(arm.runs)),
            *(arm.middle[key].text(3) for key in METRIC_NAMES),
            f"{arm.scores['last'].min():.3f}",
            f"{arm.scores['last'].max():.3f}",
        )
        for arm in study.arms
    ]
    return head, rows


def comparison_rows(study: Study) -> tuple[tuple[str, ...], Rows]:
    """Return header and rows of the table of comparisons."""
    head = (
        f"against {study.terms.reference}",
        "metric",
        "P(improvement)",
        "the same, bootstrap",
        "paired seeds above",
        "exact p",
        "verdict",
    )
    return head, [
        (
            duel.arm,
            METRIC_NAMES[duel.metric],
            duel.improvement.text(),
            duel.bootstrap.text(),
            "no pairs" if duel.pairs is None else duel.pairs.text(),
            f"{duel.p:.4f}" if duel.p >= 1e-4 else "<0.0001",
            duel.verdict,
        )
        for duel in study.duels
    ]


def run_rows(study: Study) -> tuple[tuple[str, ...], Rows]:
    """Return header and rows of the table of all runs."""
    head = ("arm", "seed", *METRIC_NAMES.values(), "state", "folder")
    rows = []
    for arm in study.arms:
        for k, run in enumerate(arm.runs):
            seed = "" if run.seed is None else str(run.seed)
            scores = (f"{arm.scores[key][k]:.3f}" for key in METRIC_NAMES)
            rows.append((arm.name, seed, *scores, run.state, run.folder.as_posix()))
    return head, rows


def terms_words(study: Study) -> str:
    """Return the analysis plan of the comparison in a sentence."""
    terms = study.terms
    return (
        f"{terms.value} over {terms.over} up to {terms.budget:g}; reference {terms.reference}; "
        f"{terms.level:.0%} intervals, {terms.resamples} resamples of whole runs, "
        f"seed {terms.seed}."
    )


def text_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table as lines of text, columns aligned."""
    from seals.text_table import table

    return table([tuple(head), *(tuple(row) for row in rows)], indent="")
