"""Drag that acts spread about the origin of a link: it brakes the rotation, too.

With drag shared by places r_k of mean squares s_i = <r_k,i^2> (none of the means <r_k,i> and
<r_k,i r_k,j> other than zero), the place k moves at v + w x r_k, and to first order in w

    T_i = -w_i (d_j s_k + d_k s_j),   d_i = dF_i / dv_i,

j and k being the other two axes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Array, namespace
from seals.effects.binding import has_hook
from seals.effects.effect import Effect, Parameters
from seals.effects.identification import Freed, Subject

DRAWING: dict[str, Any] = {
    "bounds": (0.0, 1e3),
    "tolerance": 0.0,
    "source": "the body's drawing",
    "fit": False,
    "later": True,
}
"""Declaration of a size of the body that no fit moves by itself: spread, extent."""
OTHERS = 1.0 - np.eye(3)[None]
"""Sums over the other two axes of each."""
_NAMES = tuple(f"spread_{axis}" for axis in "xyz")
_PLAUSIBLE = 0.1
"""Spread of a drag of which nothing is known, of the vehicle's length squared: a rod has 1/12."""


def states_spread(drag: Effect) -> bool:
    """Return whether a drag states a spread."""
    return any(getattr(drag, name) for name in _NAMES)


def is_spread(drag: Effect) -> bool:
    """Return whether a drag acts spread, or may: as a candidate or a found correction."""
    return drag.correction or states_spread(drag)


def turning_slope(slope: Array, params: Parameters) -> Array:
    """Return torque over angular velocity [N m s/rad], shape (N, 3).

    Args:
        slope: dF_i / dv_i of the whole drag, negative [N s/m], shape (N, 3).
        params: of the drag, with ``spread`` and `OTHERS` as ``others``.
    """
    xp, spread, others = namespace(slope), params["spread"], params["others"][0]
    product = xp.matmul(slope, others) * xp.matmul(spread, others)
    return product - xp.matmul(slope * spread, others)


def fitted_spread(subject: Subject) -> dict[str, Freed]:
    """Return the parameters of a drag of unknown shape that are fitted beside its coefficients.

    A drag acts on the body, or at the drives: what a rotor loses with the speed of the air through
    it brakes the rotation, too, and that is no effect of its own.
    """
    sizes = np.full(3, _PLAUSIBLE * subject.length**2)
    drives = [e for e in subject.effects.values() if has_hook(e, "drives")]
    if drives:
        at = (np.reshape(e.position, (-1, 3)) for e in drives)  # type: ignore[attr-defined]
        places = np.concatenate(list(at))
        sizes = np.maximum(sizes, np.square(places).mean(axis=0))
    return {
        name: Freed(scale=float(size), bounds=DRAWING["bounds"])
        for name, size in zip(_NAMES, sizes, strict=True)
    }
