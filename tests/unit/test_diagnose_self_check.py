"""Self-check of a fit: a finer simulation of the vehicle, whose answer is known."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from seals.experiments.hidden_effect import FLIGHT_A
from seals.logs.native import read_native
from seals.sysid.predictors.plant import Plant
from seals.sysid.predictors.problem import Problem, prepare
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis, scored
from seals.sysid.scores.self_check import self_check, simulated_readings
