"""Lines in the spectrum of the residual force."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.sysid.residual_force.conditions import Conditions
from seals.sysid.residual_force.evidence import Evidence
from seals.sysid.residual_force.lagged import AXES
from seals.sysid.residual_force.regress import Table, gain
from seals.sysid.residual_force.residual import thinned_rows
from seals.sysid.residual_force.terms import basis_of

_SLOWEST = 2.5
"""Periods in the log that the lowest frequency has."""
_NYQUIST = 0.8
"""Share of the highest frequency that the knots can carry."""
_AROUND = 61
"""Frequencies whose median is the background of a line."""
_SURE = 0.01
"""Chance below which a line is taken to be there."""
_MUCH = 0.4
"""Share that a line must explain which the motion holds as well: the motion may follow it."""


@dataclass(frozen=True, kw_only=True)
class Spectrum:
    """Decrease of the misfit by a sinusoid on one axis, over frequency.

    Args:
        frequency: [Hz], shape (f,).
        gain: of the best axis, shape (f,).
        peak: frequency of the line that stands out most from its surroundings [Hz].
        peak_sd: its standard error [Hz].
        axis: on which it stands out.
        amplitude: of the line [N or N m].
        chance: probability that noise of the same colour shows such a line somewhere.
        share: of the misfit's excess that it explains on held-out windows.
        moving: whether the motion or the commands hold the same line.
    """

    frequency: Floats
    gain: Floats
    peak: float
    peak_sd: float
    axis: str
    amplitude: float
    chance: float
    share: float
    moving: bool

    @property
    def sure(self) -> bool:
        """Return true for a significant line; stricter where the motion has that frequency too."""
        return self.chance < _SURE and (not self.moving or self.share > _MUCH)

    def to_dict(self) -> dict[str, Any]:
        """Return figures and the thinned curve."""
        out = asdict(self)
        keep = thinned_rows(len(self.frequency))
        out["frequency"] = np.round(self.frequency[keep], 5).tolist()
        out["gain"] = np.round(self.gain[keep], 3).tolist()
        return out | {"sure": self.sure}


def spectrum(found: Evidence, around: Conditions) -> Spectrum:
    """Fit sinusoids of all frequencies to the misfit, axis by axis."""
    span = float(np.ptp(around.time))
    step = float(np.median(np.diff(around.time[: found.knots])))
    low, high = _SLOWEST / span, _NYQUIST * 0.5 / step
    frequency = np.arange(low, max(high, 2.0 * low), 0.4 / span)
    power, _ = _gains(found, around, frequency)
    background = np.stack([_background(row) for row in power])
    # the gain of noise is chi-square with two degrees of freedom: its median is 2 ln 2
    level = np.maximum(background / (2.0 * np.log(2.0)), 1.0)
    contrast = power / (2.0 * level)
    axis, at = np.unravel_index(int(np.argmax(contrast)), contrast.shape)
    fine = frequency[at] + np.linspace(-0.4, 0.4, 17) / span
    near, amplitude = _gains(found, around, np.maximum(fine, 0.5 * low))
    best = int(np.argmax(near[axis]))
    tried = 6 * len(frequency) * 0.5
    noise = max(float(near[axis, best]) / float(level[axis, at]), 1e-9)
    kind = "swing" if int(axis) < 3 else "shake"
    basis = basis_of(kind, {"rate": 2.0 * np.pi * float(fine[best])}, around)
    held = Table(found, basis).held_out(range(6))
    return Spectrum(
        frequency=frequency,
        gain=power.max(axis=0),
        peak=float(fine[best]),
        peak_sd=float(np.sqrt(12.0 / noise) / (2.0 * np.pi * span)),
        axis=AXES[int(axis)],
        amplitude=float(amplitude[axis, best]),
        chance=float(min(1.0, tried * np.exp(-contrast[axis, at]))),
        share=gain(found.before, held, found).share,
        moving=_in_motion(around, float(fine[best]), span),
    )


def _gains(found: Evidence, around: Conditions, frequency: Floats) -> tuple[Floats, Floats]:
    """Fall of the misfit and amplitude of a sinusoid by axis and frequency, (6, f) each."""
    knots, calm = found.knots, found.calm
    time = around.time.reshape(found.count, knots)
    phase = 2.0 * np.pi * time[:, :, None] * frequency
    waves = np.concatenate([np.cos(phase), np.sin(phase)], axis=2)
    size = len(frequency)
    gain, height = np.zeros((6, size)), np.zeros((6, size))
    for axis in range(6):
        own = slice(axis * knots, (axis + 1) * knots)
        bent = np.matmul(calm[:, own, own], waves)
        cc = np.einsum("wkf,wkf->f", waves[:, :, :size], bent[:, :, :size])
        ss = np.einsum("wkf,wkf->f", waves[:, :, size:], bent[:, :, size:])
        cs = np.einsum("wkf,wkf->f", waves[:, :, :size], bent[:, :, size:])
        right = np.einsum("wkf,wk->f", waves, calm[:, own, -1])
        c, s = right[:size], right[size:]
        det = np.maximum(cc * ss - cs**2, 1e-12 * cc * ss + 1e-300)
        a, b = (ss * c - cs * s) / det, (cc * s - cs * c) / det
        gain[axis], height[axis] = a * c + b * s, np.hypot(a, b)
    return gain, height


def _background(power: Floats) -> Floats:
    """Median around each frequency, the larger of two widths, so that a steep slope is no line."""
    from scipy.ndimage import median_filter

    wide = min(_AROUND, 2 * (len(power) // 4) + 1)
    out: Floats = median_filter(power, size=wide, mode="nearest")
    narrow: Floats = median_filter(power, size=max(5, wide // 3 + 1), mode="nearest")
    return np.maximum(out, narrow)


def _in_motion(around: Conditions, peak: float, span: float) -> bool:
    """Return true if velocity, rotation or throttle have a line at a frequency."""
    series = [*around.velocity.T, *around.spin.T]
    if around.throttle is not None:
        series.append(around.throttle)
    frequency = peak + np.arange(-12, 13) / span
    frequency = frequency[frequency > 0.5 / span]
    phase = np.exp(-2j * np.pi * around.time[:, None] * frequency)
    centre = int(np.argmin(np.abs(frequency - peak)))
    for values in series:
        power = np.abs((values - values.mean()) @ phase) ** 2
        near = float(power[max(0, centre - 1) : centre + 2].max())
        if near > 8.0 * float(np.median(power)) / np.log(2.0) and near > 0.3 * float(power.max()):
            return True
    return False
