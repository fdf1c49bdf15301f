"""Decision stage of the diagnosis: thresholds, verdicts and confidences.

`policy` holds every threshold, `verdict` the possible outcomes, `evidence` decides on models scored
by their Laplace evidence (one log), `cross_validation` on models scored by held-out error (several
runs).
"""
