"""Domain randomisation: effect parameters drawn within their declared tolerances."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.learn.environments.posterior import Posterior
from seals.schema import Parameter, parameters_of


def drawn_parameters(
    effects: Mapping[str, Any],
    count: int,
    *,
    share: float,
    rng: np.random.Generator,
    known: Posterior | None = None,
) -> dict[str, Floats]:
    """Draw parameters of N environments, normally distributed about those configured.

    Whoever learns in all of them at once learns what works for any robot that the model may mean.

    Args:
        effects: of the run by name.
        count: N.
        share: of the tolerances that is one standard deviation; 0 for no difference.
        rng: decides the draws, effect by effect.
        known: what is known better than by tolerances; these are drawn jointly, about their means
            with their own deviations and correlations, whatever the share.

    Returns:
        ``"effect.parameter"`` to values, shape (N,), as twins take them.

    References:
        Tobin et al. 2017, arXiv 1703.06907 (randomised worlds); here they are as wide as the
        tolerances of the model, and no wider.
    """
    estimates = {} if known is None else known.estimates
    found, about = {}, {}
    for name, effect in effects.items():
        for field, declared in parameters_of(effect).items():
            key, value = f"{name}.{field}", getattr(effect, field)
            if key in estimates:
                mean, size = estimates[key]
            else:
                mean, size = value, share * _deviation(declared, value)
                if size == 0.0:
                    continue
            about[key] = mean, size, declared.bounds
            found[key] = rng.standard_normal(count)
    if known is not None and estimates:
        joint = known.standard(np.array([found[key] for key in estimates]))
        found |= dict(zip(estimates, joint, strict=True))
    scaled = {key: (mean + size * found[key], ends) for key, (mean, size, ends) in about.items()}
    return {key: np.clip(values, *ends) for key, (values, ends) in scaled.items()}


def _deviation(known: Parameter, value: Any) -> float:
    """Return the standard deviation of a parameter in its unit, 0 if unknown.

    Args:
        known: what is declared of it.
        value: configured; what is no number does not vary.
    """
    if not known.fit or isinstance(value, bool) or not isinstance(value, int | float):
        return 0.0
    return known.tolerance * (abs(float(value)) if known.relative else 1.0)
