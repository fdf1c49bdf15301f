"""Bar charts of a report: held-out gain of each effect, and errors of the ablation."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from seals.report import Bar, Bars
from seals.report.figures import Mark
from seals.sysid.report.gains import Step
from seals.sysid.report.table import NAMED, NOTHING, POSSIBLE, REJECTED, Entry

COLOURS = {NAMED: "#12966f", POSSIBLE: "#c08a00", REJECTED: "#9aa4ad"}
_LOG_FROM = 6.0
"""Ratio of errors from which on the ablation's axis is logarithmic."""


def gain_chart(entries: Sequence[Entry], *, before: float, required: float) -> Bars | None:
    """Return the held-out gains of one round as bars; None when nothing was fitted.

    Args:
        entries: of one round.
        before: held-out error that the round starts from.
        required: gain that is required; the least one, where effects differ.
    """
    shown = [e for e in entries if e.gain is not None]
    if not shown:
        return None
    shown.sort(key=lambda e: -(e.gain or 0.0))
    bars = [
        Bar(
            label=e.words,
            value=e.gain or 0.0,
            error=e.error,
            colour=COLOURS[e.status],
            text=_gain_text(e),
        )
        for e in shown
    ]
    there = before - 1.0
    marks = [Mark(at=required, label="needed")]
    if there > 3.0 * required:
        marks.append(Mark(at=there, label="down to noise"))
    beside = shown[0].beside
    title = (
        f"Reduction by each effect in addition to {' + '.join(beside)}"
        if beside
        else ("Reduction of the held-out error by each effect alone")
    )
    return Bars(
        title=title,
        x_label="reduction of the held-out error [× noise]",
        bars=bars,
        marks=tuple(marks),
        note=(
            "Each effect was fitted alone (or together with those found before) to four fifths "
            "of the log and evaluated on the held-out fifth, in turn. Error bars: one standard "
            "error over the windows of the log. Left line: the minimum for naming an effect; an "
            "effect "
            "with several parameters needs slightly more. Right line: the whole excess over the "
            "noise floor. "
            "Green: named. Amber: cannot be excluded. Grey: rejected. Bars may be similar if an "
            "effect has several parameters; the table states the decision."
        ),
    )


def _gain_text(entry: Entry) -> str:
    """Gain with its standard error; a gain within two errors of zero is called none."""
    gain, error = entry.gain or 0.0, entry.error or 0.0
    if entry.status == REJECTED and abs(gain) <= max(2.0 * error, NOTHING):
        return "none seen"
    size = f"{gain:.3g}" if abs(gain) > NOTHING else "0"
    return size + (f" ± {error:.2g}" if error else "")


def ablation_chart(steps: Sequence[Step], *, claimed: Sequence[str]) -> Bars:
    """Return the errors of the ablation as a waterfall chart down to the noise floor.

    Args:
        steps: from the datasheet's model on.
        claimed: names that the answer claims; other steps are marked as not named.
    """
    errors = [s.error for s in steps]
    log = max(errors) / max(min(*errors, 1.0), 1e-6) > _LOG_FROM
    base = 0.8 * min(*errors, 1.0) if log else 0.0
    bars = [
        Bar(
            label=steps[0].name,
            value=errors[0],
            start=base,
            colour="#d8602a",
            text=f"{errors[0]:.3g}",
        )
    ]
    for above, step in itertools.pairwise(steps):
        sure = not step.added or all(n in claimed for n in step.added.split(" + "))
        better = ("#12966f" if step.added else "#2f80d0") if sure else "#9aa4ad"
        bars.append(
            Bar(
                label=step.name if sure else f"{step.name} (not named)",
                value=step.error,
                start=above.error,
                colour="#cf5f8f" if step.error > above.error else better,
                text=f"→ {step.error:.3g}",
            )
        )
    return Bars(
        title="Ladder of errors",
        x_label="held-out error [× noise]" + (", logarithmic" if log else ""),
        bars=bars,
        marks=(Mark(at=1.0, label="floor: noise"),),
        log=log,
        note=(
            "From top to bottom the model is changed step by step. Each bar "
            "extends from the error before to the error after the change. The error is the mean "
            "squared difference between measurement and prediction, in units of noise and "
            "stated gusts, on held-out rows (the first bar needs no fit). 1 is the noise floor; "
            "small deviations from it are random."
        ),
    )
