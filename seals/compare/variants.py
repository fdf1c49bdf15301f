"""Model variants of a comparison, each with more effects than the one before."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from seals.arrays import Floats
from seals.compare.case import Case
from seals.compare.predict import fit_keys
from seals.compare.prediction_methods import predictor_of
from seals.compare.score import CaseScore, pooled, score_case
from seals.compare.settings import CompareSettings
from seals.compare.solve import Solver
from seals.effects.binding import bind_effects
from seals.effects.effect import Effect
from seals.errors import refuse_unlisted
from seals.robot.model import RobotModel

SINGLE = "model"


@dataclass(frozen=True, kw_only=True)
class FittedValue:
    """Fitted parameter.

    Args:
        key: as written by the user.
        value: in ``unit``.
        sigma: one standard deviation, in ``unit``.
        unit: SI unit.
        at_bound: whether it stands on a bound.
    """

    key: str
    value: float
    sigma: float
    unit: str
    at_bound: bool


@dataclass(frozen=True, kw_only=True)
class ModelVariant:
    """Model variant: the effects that act, their fitted parameters and scores.

    Args:
        name: of the variant.
        effects: that act.
        fitted: parameters found on the training stretches.
        scores: one per case.
        predicted: samples of the model, one dict per case.
        deviations: of the starts, one per case.
        start_sigma: their standard deviations, one per case; 0 where held.
    """

    name: str
    effects: list[str]
    fitted: list[FittedValue]
    scores: list[CaseScore]
    predicted: list[dict[str, Floats]]
    deviations: list[Floats]
    start_sigma: list[Floats]

    def rms(self, channel: str, *, held_out: bool) -> float:
        """Root mean square of one channel over the training or the held-out cases."""
        scores = pooled(self.scores, held_out=held_out)
        return scores[channel].rms if channel in scores else float("nan")


def fit_variants(
    settings: CompareSettings, robot: RobotModel, cases: Sequence[Case], *, step: float
) -> list[ModelVariant]:
    """Fit and score every variant.

    Raises:
        ConfigError: a variant names an effect that the model does not hold.
    """
    variants = {str(k): [str(e) for e in v] for k, v in settings.ladder.items()} or {
        SINGLE: list(settings.effects)
    }
    # a wrong name of the last variant is refused before the first is fitted
    chosen = {}
    for name, active in variants.items():
        for effect in active:
            said = f"ladder.{name}: there is no effect '{effect}'"
            refuse_unlisted(effect, settings.effects, said)
        chosen[name] = {n: e for n, e in settings.effects.items() if n in active}
    return [
        _variant(name, effects, settings, robot, cases, step=step)
        for name, effects in chosen.items()
    ]


def _variant(
    name: str,
    effects: dict[str, Effect],
    settings: CompareSettings,
    robot: RobotModel,
    cases: Sequence[Case],
    *,
    step: float,
) -> ModelVariant:
    keys = [k for k in fit_keys(settings.fit, settings.effects) if k.effect in effects]
    # a ladder adds effects to a robot that has its drives throughout
    bound = bind_effects({**settings.actuators, **effects}, robot.links)
    values = np.array([k.start for k in keys])

    train = [c for c in cases if not c.held_out]
    rest = [c for c in cases if c.held_out]
    found: dict[str, tuple[dict[str, Floats], Floats, Floats]] = {}
    fitted: list[FittedValue] = []
    for chosen, free in ((train, range(len(keys))), (rest, range(0))):
        if chosen:
            predictor = predictor_of(settings)(settings, robot, bound, keys, chosen, step=step)
            solver = Solver(predictor, iterations=settings.compare.iterations)
            task = solver.fit(values, free=free)
            sigma, starts = solver.spreads(task)
            for k, case in enumerate(chosen):
                found[case.name] = task.predicted[k], task.deviations[k], starts[k]
            if free:
                values = task.values
                fitted = [
                    FittedValue(
                        key=key.key,
                        value=float(v),
                        sigma=float(s),
                        unit=key.parameter.unit,
                        at_bound=bool(v <= key.parameter.bounds[0] or v >= key.parameter.bounds[1]),
                    )
                    for key, v, s in zip(keys, values, sigma, strict=True)
                ]
    ordered = [found[c.name] for c in cases]
    return ModelVariant(
        name=name,
        effects=list(effects),
        fitted=fitted,
        scores=[score_case(c, found[c.name][0]) for c in cases],
        predicted=[predicted for predicted, _, _ in ordered],
        deviations=[deviation for _, deviation, _ in ordered],
        start_sigma=[sigma for _, _, sigma in ordered],
    )
