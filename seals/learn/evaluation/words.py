"""Tables and sentences of evaluation results."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from seals.learn.evaluation.result import EvaluationResult

Rows = list[tuple[str, ...]]
FURTHER = {
    "reached_after": "time to target, median [s]",
    "cost_of_transport": "cost of transport, median",
}
"""Further columns of a table, where any episode tells them: those that reached the target."""


def label(found: EvaluationResult) -> str:
    """Return the policy's name, for a folder its last part."""
    path = Path(found.policy)
    # training keeps its policy in a folder of that name: the run's own says more
    path = path.parent if path.name == "policy" and path.parent.name else path
    return path.as_posix() if len(path.parts) < 3 else Path(*path.parts[-2:]).as_posix()


def rows_of(judgements: Sequence[EvaluationResult]) -> tuple[tuple[str, ...], Rows]:
    """Return header and rows of a table, a row for each policy and world."""
    shares = list(judgements[0].shares())
    worlds = any(found.world for found in judgements)
    further = [name for name in FURTHER if any(_reported(found, name) for found in judgements)]
    head = (
        "policy",
        *(("world",) if worlds else ()),
        "episodes",
        *(f"{share_words(name)} (95%)" for name in shares),
        "final distance, median (90%) [m]",
        *(FURTHER[name] for name in further),
        "return, median",
    )
    rows = []
    for found in judgements:
        distance = "not told"
        if "distance" in found.columns:
            low, _, middle, _, high = found.quantiles("distance")
            distance = f"{middle:.3f} ({low:.3f} to {high:.3f})"
        rows.append(
            (
                label(found),
                *((found.world or "its own",) if worlds else ()),
                str(found.episodes),
                *(found.share(name).text() if name in found.columns else "" for name in shares),
                distance,
                *(f"{found.quantiles(n)[2]:.2f}" if _reported(found, n) else "" for n in further),
                f"{found.quantiles('return')[2]:.4g}",
            )
        )
    return head, rows


def _reported(found: EvaluationResult, name: str) -> bool:
    """Test if any episode reports this fact."""
    return name in found.columns and bool(np.isfinite(found.columns[name]).any())


def share_words(name: str) -> str:
    """Return the words for the name of a share, as ``within 1 cm`` for ``success_1cm``."""
    return name.replace("success_", "within ").replace("cm", " cm") if "_" in name else name


def sentences(judgements: Sequence[EvaluationResult]) -> list[str]:
    """Return the claims that the intervals support about the first policy against the others."""
    first, *others = judgements
    own = first.share()
    out = []
    for other in others:
        share = other.share()
        who = label(other) if not other.world else f"the same in the world '{other.world}'"
        if own.low > share.high:
            out.append(f"{label(first)} succeeds more often than {who}: the intervals are apart.")
        elif own.high < share.low:
            out.append(f"{label(first)} succeeds less often than {who}: the intervals are apart.")
        else:
            out.append(f"{label(first)} and {who}: no difference is shown, the intervals meet.")
    return out
