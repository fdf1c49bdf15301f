"""Verification of a model on a held-out log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from seals.config.overlay import Overlay
from seals.sysid.validation.ablation import CALIBRATED, Ablation
from seals.sysid.validation.misfit import Fall, Misfit

WITHDRAWN = 14
"""Exit code of a model that did not stand."""
NEAR = 1.08
"""Error in units of the noise floor up to which a log counts as explained."""


@dataclass(frozen=True, kw_only=True)
class Verification:
    """Result of one verification.

    Args:
        overlay: the model.
        ablation: of the log.
        older: of logs that must not get worse, first and last variant only.
        fitted: whether the log is the one that the model was fitted on.
        withdrawn: why the model does not stand; empty when it does.
    """

    overlay: Overlay
    ablation: Ablation
    older: tuple[Ablation, ...]
    fitted: bool
    withdrawn: str

    @property
    def exit_code(self) -> int:
        """0 when the error fell, 14 when the model is withdrawn."""
        return WITHDRAWN if self.withdrawn else 0

    @property
    def word(self) -> str:
        """Outcome in one word; the log of the fit cannot confirm the model."""
        stands = "used_in_fit" if self.fitted else "confirmed"
        return "withdrawn" if self.withdrawn else stands

    def to_dict(self) -> dict[str, Any]:
        """Return the content of ``verify.json``."""
        ablation = self.ablation
        return {
            "verdict": self.word,
            "reason": self.withdrawn or None,
            "model": self.overlay.name,
            "log": ablation.name,
            "used_in_fit": self.fitted,
            "error": {
                "before": ablation.first.level,
                "after": ablation.last.level,
                "noise_floor": 1.0,
                **_as_fall(ablation.total),
            },
            "rungs": [_as_variant(m) for m in ablation.variants],
            "noise_floor": {"misfit": 1.0, "rms": _table(ablation.floor)},
            "effects": {part: _as_fall(gain) for part, gain in ablation.gains.items()},
            "calibration_alone": None
            if ablation.alone is None or ablation.edge is None
            else {"misfit": ablation.alone.level, "edge": _as_fall(ablation.edge)},
            "older": [
                {
                    "log": old.name,
                    "before": old.first.level,
                    "after": old.last.level,
                    **_as_fall(old.total),
                    "rungs": [_as_variant(m) for m in old.variants],
                    "regression": old.regression,
                }
                for old in self.older
            ],
        }


def judge(
    overlay: Overlay, ablation: Ablation, older: Sequence[Ablation], *, fitted: bool
) -> Verification:
    """Decide whether a model is confirmed or withdrawn."""
    return Verification(
        overlay=overlay,
        ablation=ablation,
        older=tuple(older),
        fitted=fitted,
        withdrawn=_reason(overlay, ablation, older),
    )


def _reason(overlay: Overlay, ablation: Ablation, older: Sequence[Ablation]) -> str:
    """Return why a model is withdrawn; empty when it is not."""
    before, after = ablation.first.level, ablation.last.level
    change = f"{before:.3g} -> {after:.3g} times the noise floor"
    if not ablation.total.certain:
        verb = "rose" if ablation.total.worse else "did not fall"
        return f"on {ablation.name} the error {verb} ({change})"
    idle = [part for part, gain in ablation.gains.items() if not gain.certain]
    if idle:
        without = next((m for m in ablation.variants if m.model.name == CALIBRATED), ablation.first)
        below = f", {without.level:.3g} -> {after:.3g}" if len(overlay.parts) == 1 else ""
        return (
            f"on {ablation.name} the error did not fall by {' and '.join(idle)}{below}; "
            "only the stated numbers improved the fit"
        )
    if ablation.edge is not None and ablation.alone is not None and ablation.edge.value <= 0.0:
        return (
            f"on {ablation.name} calibrated stated numbers alone, penalised by their tolerances, "
            f"are equally good ({ablation.alone.level:.3g} against {after:.3g})"
        )
    for old in older:
        if old.regression:
            levels = f"{old.best_below.level:.3g} -> {old.last.level:.3g}"
            return f"on the older log {old.name} the error rose ({levels} times the noise floor)"
    return ""


def sentences(found: Verification) -> list[str]:
    """Return the outcome as a few lines of text."""
    ablation, name = found.ablation, found.overlay.name
    total = ablation.total
    lines = []
    if found.fitted:
        lines.append(
            f"This log was used in the fit of '{name}': it shows that the model fits, "
            "but not that it is valid. Verify on another log."
        )
    if found.withdrawn:
        lines.append(f"Withdrawn: {found.withdrawn}.")
    else:
        seen = "the log of the fit" if found.fitted else "never fitted"
        lines.append(
            f"The error of the simulator fell {ablation.first.level:.3g} -> "
            f"{ablation.last.level:.3g} times the noise floor on {ablation.name} ({seen}), by "
            f"{total.value:.3g} +- {total.noise:.2g}."
        )
    if not found.withdrawn and ablation.last.level > NEAR:
        lines.append(
            f"{ablation.last.level:.3g} is above the noise floor: an effect is still missing, or "
            "the added effect only resembles the true one."
        )
    if ablation.alone is not None:
        lines.append(
            "For comparison: the stated numbers fitted without the effects reach "
            f"{ablation.alone.level:.3g} times the noise floor. If this value were equally low, "
            "only the tolerances would favour the effects."
        )
    for old in found.older:
        verb = "worse" if old.regression else "better" if old.total.certain else "no worse"
        start = old.best_below if old.regression else old.first
        levels = f"{start.level:.3g} -> {old.last.level:.3g}"
        lines.append(f"Older log {old.name}: {verb}, {levels}.")
    return lines


def _as_fall(found: Fall) -> dict[str, float]:
    return {"fall": found.value, "noise": found.noise}


def _as_variant(m: Misfit) -> dict[str, Any]:
    return {
        "name": m.model.name,
        "misfit": m.level,
        "left_over": dict(m.channels),
        "rms": _table(m.plain),
    }


def _table(values: Mapping[str, Mapping[float, float]]) -> dict[str, dict[str, float]]:
    return {name: {f"{h:g}": x for h, x in row.items()} for name, row in values.items()}
