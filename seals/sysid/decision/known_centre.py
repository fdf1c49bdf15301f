"""Forces toward a point that the log does not locate.

The parameters of a pull toward a point bend to almost any smooth force of the place; what a log
does not locate is not that pull.
"""

from __future__ import annotations

import math

import numpy as np

from seals.sysid.candidates.parameters import Candidate
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis


def unlocated(best: EvidenceHypothesis) -> list[int]:
    """Return the places among a model's candidates of those toward a point that is not known."""
    most = best.fitter.candidate_set.policy.centre_known
    return [i for i, c in enumerate(best.candidates) if centre_error(best, c) > most]


def centre_error(best: EvidenceHypothesis, candidate: Candidate) -> float:
    """Return the standard error of the point toward which a force acts by its mean distance [1].

    Zero for effects that do not act toward a point.
    """
    centre = candidate.identification.centre
    keys = [k for k in candidate.keys if k.partition(".")[2].startswith(f"{centre}_")]
    if not centre or len(keys) != 3:
        return 0.0
    point = np.array([best.fit.values[k] for k in keys])
    away = np.linalg.norm(best.fitter.trajectory.position - point, axis=1)
    error = math.sqrt(sum(best.fit.robust_spread(k) ** 2 for k in keys))
    return error / max(float(away.mean()), 1e-9)
