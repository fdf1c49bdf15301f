"""Whether a model stands after it met a log that no fit saw."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from seals.config.overlay import Overlay
from seals.sysid.validation.ladder import CALIBRATED, Ladder
from seals.sysid.validation.misfit import Fall, Misfit

WITHDRAWN = 14
"""Exit code of a model that did not stand."""
NEAR = 1.08
"""Error in units of the noise floor up to which a log counts as explained."""


@dataclass(frozen=True, kw_only=True)
class Verification:
    """The outcome of one verification.

    Args:
        overlay: the model.
        ladder: of the log.
        older: of logs that must not get worse, first and last rung only.
        fitted: whether the log is the one that the model was fitted on.
        withdrawn: why the model does not stand; empty when it does.
    """

    overlay: Overlay
    ladder: Ladder
    older: tuple[Ladder, ...]
    fitted: bool
    withdrawn: str

    @property
    def exit_code(self) -> int:
        """0 when the error fell, 14 when the model is withdrawn."""
        return WITHDRAWN if self.withdrawn else 0

    @property
    def word(self) -> str:
        """The outcome: a log that was used in the fit confirms nothing."""
        stands = "used_in_fit" if self.fitted else "confirmed"
        return "withdrawn" if self.withdrawn else stands

    def to_dict(self) -> dict[str, Any]:
        """Return the content of ``verify.json``."""
        ladder = self.ladder
        return {
            "verdict": self.word,
            "reason": self.withdrawn or None,
            "model": self.overlay.name,
            "log": ladder.name,
            "used_in_fit": self.fitted,
            "error": {
                "before": ladder.first.level,
                "after": ladder.last.level,
                "noise_floor": 1.0,
                **_as_fall(ladder.total),
            },
            "rungs": [_as_rung(m) for m in ladder.rungs],
            "noise_floor": {"misfit": 1.0, "rms": _table(ladder.floor)},
            "effects": {part: _as_fall(gain) for part, gain in ladder.gains.items()},
            "calibration_alone": None
            if ladder.alone is None or ladder.edge is None
            else {"misfit": ladder.alone.level, "edge": _as_fall(ladder.edge)},
            "older": [
                {
                    "log": old.name,
                    "before": old.first.level,
                    "after": old.last.level,
                    **_as_fall(old.total),
                    "rungs": [_as_rung(m) for m in old.rungs],
                    "regression": old.regression,
                }
                for old in self.older
            ],
        }


def judge(
    overlay: Overlay, ladder: Ladder, older: Sequence[Ladder], *, fitted: bool
) -> Verification:
    """Decide whether a model stands."""
    return Verification(
        overlay=overlay,
        ladder=ladder,
        older=tuple(older),
        fitted=fitted,
        withdrawn=_reason(overlay, ladder, older),
    )


def _reason(overlay: Overlay, ladder: Ladder, older: Sequence[Ladder]) -> str:
    """Why a model is withdrawn, in words; empty when it stands."""
    before, after = ladder.first.level, ladder.last.level
    change = f"{before:.3g} -> {after:.3g} times the noise floor"
    if not ladder.total.certain:
        verb = "rose" if ladder.total.worse else "did not fall"
        return f"on {ladder.name} the error {verb} ({change})"
    idle = [part for part, gain in ladder.gains.items() if not gain.certain]
    if idle:
        without = next((m for m in ladder.rungs if m.model.name == CALIBRATED), ladder.first)
        below = f", {without.level:.3g} -> {after:.3g}" if len(overlay.parts) == 1 else ""
        return (
            f"on {ladder.name} the error did not fall by {' and '.join(idle)}{below}; "
            "only the nominal values helped"
        )
    if ladder.edge is not None and ladder.alone is not None and ladder.edge.value <= 0.0:
        return (
            f"on {ladder.name} calibrated nominal values alone, priced by their tolerances, "
            f"do as well ({ladder.alone.level:.3g} against {after:.3g})"
        )
    for old in older:
        if old.regression:
            levels = f"{old.best_below.level:.3g} -> {old.last.level:.3g}"
            return f"on the older log {old.name} the error rose ({levels} times the noise floor)"
    return ""


def sentences(found: Verification) -> list[str]:
    """Return the outcome in a few lines."""
    ladder, name = found.ladder, found.overlay.name
    total = ladder.total
    lines = []
    if found.fitted:
        lines.append(
            f"This log was used in the fit of '{name}': it shows that the model fits, "
            "not that it holds. Verify on another log."
        )
    if found.withdrawn:
        lines.append(f"Withdrawn: {found.withdrawn}.")
    else:
        seen = "the log of the fit" if found.fitted else "never fitted"
        lines.append(
            f"The error of the simulator fell {ladder.first.level:.3g} -> {ladder.last.level:.3g} "
            f"times the noise floor on {ladder.name} ({seen}), by {total.value:.3g} "
            f"+- {total.noise:.2g}."
        )
    if not found.withdrawn and ladder.last.level > NEAR:
        lines.append(
            f"{ladder.last.level:.3g} is not yet the floor: something is missing still, or the "
            "effect is a near relation of the true one."
        )
    if ladder.alone is not None:
        lines.append(
            f"Calibrated without the effects, the nominal model reaches {ladder.alone.level:.3g} "
            "here: where that is as low, only the tolerances speak for the effects."
        )
    for old in found.older:
        verb = "worse" if old.regression else "better" if old.total.certain else "no worse"
        start = old.best_below if old.regression else old.first
        levels = f"{start.level:.3g} -> {old.last.level:.3g}"
        lines.append(f"Older log {old.name}: {verb}, {levels}.")
    return lines


def _as_fall(found: Fall) -> dict[str, float]:
    return {"fall": found.value, "noise": found.noise}


def _as_rung(m: Misfit) -> dict[str, Any]:
    return {
        "name": m.model.name,
        "misfit": m.level,
        "left_over": dict(m.channels),
        "rms": _table(m.plain),
    }


def _table(values: Mapping[str, Mapping[float, float]]) -> dict[str, dict[str, float]]:
    return {name: {f"{h:g}": x for h, x in row.items()} for name, row in values.items()}
