"""Prediction methods of a comparison, by name."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from seals.compare.case import Case
from seals.compare.cases import make_cases
from seals.compare.glide import GlidePredictor, glide_cases
from seals.compare.heave import HeavePredictor, heave_cases
from seals.compare.predict import Predictor
from seals.compare.settings import CompareSettings, PredictionMethod
from seals.compare.thrust import ThrustPredictor, thrust_cases
from seals.logs.log import Log
from seals.robot.model import RobotModel

Cutter = Callable[[Sequence[Log], CompareSettings, RobotModel], list[Case]]
_METHODS: dict[PredictionMethod, tuple[Cutter, type[Predictor]]] = {
    PredictionMethod.simulated: (make_cases, Predictor),
    PredictionMethod.glide: (glide_cases, GlidePredictor),
    PredictionMethod.thrust: (thrust_cases, ThrustPredictor),
    PredictionMethod.heave: (heave_cases, HeavePredictor),
}


def cases_of(settings: CompareSettings) -> Cutter:
    """Return the function that divides logs into cases."""
    return _METHODS[settings.compare.course][0]


def predictor_of(settings: CompareSettings) -> type[Predictor]:
    """Return the predictor of cases."""
    return _METHODS[settings.compare.course][1]


def step_of(cases: Sequence[Case]) -> float:
    """Return the time step: the sampling interval, at most 10 ms."""
    return min(0.01, *(float(np.median(np.diff(c.time))) for c in cases if len(c.time) > 1), 0.01)
