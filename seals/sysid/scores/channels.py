"""Misfit of each channel by itself, and the band in which that of a right model stays.

The pooled misfit of a log averages over all readings: channels without noise, and gusts that may
take over a force, hide in it a channel that no model follows.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.frames import AXES
from seals.logs.channels import unit_of
from seals.sysid.predictors.linearise import predict
from seals.sysid.predictors.problem import WINDOW
from seals.sysid.predictors.windows import Windows
from seals.sysid.predictors.windows_fit import Fitter
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis

JOINTS = "joint_position"
"""Channel of joints: laws of play and dry friction hold less well than those of a rigid body."""
_ANGLES = ("roll", "pitch", "yaw")
_LEAST = 0.05
"""Least variance of a residual in units of the noise: rounding must not make it negative."""


@dataclass(frozen=True, kw_only=True)
class ChannelError:
    """Error of one component of a channel under three models.

    A *level* is the root mean square of the residual in units of the standard deviation that a
    right model leaves: 1 is perfect. Residuals are those of windows of a second, each from its own
    best start state.

    Args:
        name: of the component, in words.
        channel: that it belongs to.
        unit: of the errors.
        band: highest level of a right model.
        stated: level of the stated model, no number fitted.
        calibrated: level with the stated numbers fitted within their tolerances.
        after: level with the effects that were found; that of `calibrated` without any.
        rms: of the residuals of the same three models, in ``unit``.
    """

    name: str
    channel: str
    unit: str
    band: float
    stated: float
    calibrated: float
    after: float
    rms: tuple[float, float, float]

    @property
    def outside(self) -> bool:
        """True where the last model leaves more than chance does."""
        return not self.after <= self.band

    @property
    def share(self) -> float:
        """Share of the excess misfit, over the calibrated model's, that the effects explain."""
        before, after = self.calibrated**2 - 1.0, self.after**2 - 1.0
        return (before - after) / before if before > 0.0 else 0.0

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True)
class ChannelErrors:
    """Errors of all components, worst of the last model first.

    Args:
        errors: of them.
    """

    errors: tuple[ChannelError, ...] = field(default=())

    @property
    def outside(self) -> tuple[ChannelError, ...]:
        """Components that leave their band; those of joints do not count."""
        return tuple(e for e in self.errors if e.outside and e.channel != JOINTS)

    @property
    def fall(self) -> ChannelError | None:
        """Component whose misfit falls most from the stated model to the last one."""
        return max(self.errors, key=lambda e: e.stated**2 - e.after**2, default=None)


def channel_errors(nominal: EvidenceHypothesis, found: EvidenceHypothesis) -> ChannelErrors:
    """Compute the error of each component under the stated, the calibrated and the found model.

    Args:
        nominal: model without effects, its numbers fitted within their tolerances.
        found: model with effects, or the nominal one.
    """
    standard_errors = nominal.fitter.candidate_set.policy.channel_band
    first, spread = restarted(nominal.fitter, {})
    second, _ = restarted(nominal.fitter, nominal.fit.values)
    windows = found.fitter.windows
    third, own = (second, spread) if found is nominal else restarted(found.fitter, found.fit.values)
    out = []
    for i, channel in enumerate(windows.channel_of):
        seen = int(np.isfinite(third[:, :, i]).sum())
        if not np.isfinite(first[:, :, i]).any() or not seen:
            continue
        parts = ((first, spread), (second, spread), (third, own))
        levels = [_rms(residual[:, :, i] / sd[:, :, i]) for residual, sd in parts]
        axis = i - windows.channel_of.index(channel)
        out.append(
            ChannelError(
                name=component(channel, axis, windows.channel_of.count(channel)),
                channel=channel,
                unit="rad" if channel == "orientation" else unit_of(channel) or "",
                band=band(windows, seen, standard_errors=standard_errors),
                stated=levels[0],
                calibrated=levels[1],
                after=levels[2],
                rms=(_rms(first[:, :, i]), _rms(second[:, :, i]), _rms(third[:, :, i])),
            )
        )
    return ChannelErrors(
        errors=tuple(sorted(out, key=lambda e: -(e.after if math.isfinite(e.after) else math.inf)))
    )


def band(windows: Windows, seen: int, *, standard_errors: float) -> float:
    """Return the highest level that chance leaves of a component under a right model.

    Equation:
        level^2 = 1 + q sqrt(2 / n), the mean of n squared independent normal numbers and q of its
        standard deviations; n is the time of the windows over the correlation time of the stated
        gusts, or over a window where none are stated, and at most the number of readings.

    Args:
        windows: of the log.
        seen: readings of the component.
        standard_errors: q.
    """
    time = windows.count * windows.length * windows.samples.step
    apart = windows.vehicle.gust_time if windows.vehicle.gust.any() else WINDOW
    count = max(1.0, min(float(seen), time / max(apart, windows.samples.step)))
    return math.sqrt(1.0 + standard_errors * math.sqrt(2.0 / count))


def _rms(values: Floats) -> float:
    good = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(good**2))) if len(good) else math.nan


def restarted(fitter: Fitter, values: Mapping[str, float]) -> tuple[Floats, Floats]:
    """Residual of a model with the start state of every window fitted, and its standard deviation.

    Gusts and noise are left in the residual, and are in the spread.

    Args:
        fitter: of its linearisation.
        values: of its parameters by key.

    Returns:
        Both in the channels' units, shape (W, K, channels), NaN where nothing was read.
    """
    windows = fitter.windows
    prediction = predict(fitter.plant, fitter.trajectory, values, delay=windows.delay)
    whole = windows.residual(prediction)
    start, _ = windows.explained(whole)
    carried = windows._marginal.outputs[:, :, : windows.size]
    rest = whole - np.einsum("wkn,wn->wk", carried, start)
    with np.errstate(divide="ignore"):
        scale = np.where(windows.weight > 0.0, 1.0 / windows.weight, np.nan)
    spread = np.sqrt(_variance(windows))
    return windows.cells(rest) * scale, windows.cells(spread) * scale


def _variance(windows: Windows) -> Floats:
    """Variance of the whitened residual: noise and gusts, less the part fitted by the starts.

    Equation:
        C - S V S^T with C the covariance of noise and gusts, S the response to the start states
        and V the covariance of their estimate (generalised least squares).
    """
    n, m = windows.size, windows._gust_precision.shape[1]
    carried, pushed = (
        windows._marginal.outputs[:, :, :n],
        windows._marginal.outputs[:, :, n : n + m],
    )
    gusts = np.linalg.inv(windows._gust_precision)
    factor = windows._weights.inverse[:, :, :n] * windows._weights.scale[:, None, :n]
    noise = 1.0 + np.einsum("wkm,wkm->wk", np.matmul(pushed, gusts), pushed)
    taken = np.matmul(carried, factor.transpose(0, 2, 1))
    variance: Floats = np.maximum(noise - np.einsum("wkq,wkq->wk", taken, taken), _LEAST)
    return variance


def component(channel: str, axis: int, width: int) -> str:
    """Return the name of a channel's component in words."""
    words = channel.replace("_", " ")
    if channel == "orientation":
        return _ANGLES[axis]
    if width == 1:
        return words
    return f"{words} {AXES[axis]}" if width == 3 else f"{words} {axis + 1}"
