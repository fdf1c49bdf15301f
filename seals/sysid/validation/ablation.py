"""Ablation on one log: stated model, calibrated model, then one more effect each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from seals.arrays import Floats
from seals.config.overlay import Overlay
from seals.errors import ConfigError, PhysicsError
from seals.sysid.calibration.free_numbers import number_behind
from seals.sysid.calibration.stated import SENSORS, hull_of, stated_numbers
from seals.sysid.candidates.parameters import CandidateSet
from seals.sysid.data.robot_description import RobotDescription
from seals.sysid.predictors.problem import LOOSE, Problem, rewindowed, stated_starts
from seals.sysid.predictors.windows import Windows
from seals.sysid.validation.misfit import (
    Fall,
    Misfit,
    Yardstick,
    fall,
    measure,
    plain_errors,
    yardstick,
)
from seals.sysid.validation.model import Model, nominal, with_speeds
from seals.sysid.validation.replay import Track

CALIBRATED, ALONE = "calibrated model", "calibration alone"
"""Names of the variants below the effects."""
_MOST_NUMBERS = 3
"""Stated numbers that are said to be in question beside an effect."""
_MOVED = 0.1
"""Change in tolerances from which on a number counts as moved."""


@dataclass(frozen=True, kw_only=True)
class Ablation:
    """Errors of one log from the stated model to the model with all its effects.

    Args:
        name: of the log.
        variants: from the stated model upwards.
        gains: fall of the misfit that each effect brings to the model with all others; where only
            ends were compared, the fall from each variant below.
        total: fall from the first variant to the last.
        alone: what calibration without the effects reaches; None when it was not asked for, or
            diverged.
        edge: by how much the last variant beats calibration alone, each charged for the distance of
            its fitted values from the stated ones; None when it was not asked for.
        floor: plain errors that a perfect model would leave, by channel and horizon.
    """

    name: str
    variants: tuple[Misfit, ...]
    gains: Mapping[str, Fall]
    total: Fall
    alone: Misfit | None = None
    edge: Fall | None = None
    floor: Mapping[str, Mapping[float, float]]

    @property
    def regression(self) -> bool:
        """Return true if the full model is worse than a variant with fewer effects."""
        return self.total.worse or any(gain.worse for gain in self.gains.values())

    @property
    def best_below(self) -> Misfit:
        """The best variant with fewer effects than the full model."""
        return min(self.variants[:-1], key=lambda m: m.level)

    @property
    def first(self) -> Misfit:
        """The stated model."""
        return self.variants[0]

    @property
    def last(self) -> Misfit:
        """The model with all effects."""
        return self.variants[-1]


def model_variants(problem: Problem, overlay: Overlay) -> list[Model]:
    """Return the model variants of an ablation: stated, calibrated, then one more effect each.

    Raises:
        ConfigError: the overlay does not fit the vehicle of the log.
    """
    first, candidate_set = nominal(problem.vehicle), _library_for(problem, overlay)
    values = {key: fitted.value for key, fitted in overlay.nominal.items()}
    models = [first]
    if values:
        models.append(first.changed(CALIBRATED, values, candidate_set))
    base, parts = models[-1], overlay.parts
    for k, part in enumerate(parts):
        models.append(base.with_overlay(f"+ {part}", overlay.only(parts[: k + 1])))
    return models


def _library_for(problem: Problem, overlay: Overlay) -> CandidateSet:
    """Return the candidate set of a log, with drag exponents at the speeds of the fitted log."""
    candidate_set = problem.plant.candidate_set
    if not overlay.speeds:
        return candidate_set
    if len(overlay.speeds) != 3:
        raise ConfigError(
            f"{overlay.file}: speeds={list(overlay.speeds)} is not allowed.\n"
            "Allowed: three numbers, along x, y and z of the body [m/s]."
        )
    return with_speeds(candidate_set, overlay.speeds)


def replay_variants(
    name: str, problem: Problem, overlay: Overlay, *, tell: Callable[[int], None] | None = None
) -> Ablation:
    """Replay a log on every variant, and without each effect in turn.

    Args:
        name: of the log.
        problem: the log made ready.
        overlay: the model.
        tell: takes the number of windows done, over all replays.

    Raises:
        ConfigError: the overlay does not fit the vehicle of the log.
    """
    models = model_variants(problem, overlay)
    parts, alone = overlay.parts, None
    base = models[-1 - len(parts)]
    # the ablation itself leaves out the last
    others = {
        part: base.with_overlay(f"without {part}", overlay.only([p for p in parts if p != part]))
        for part in parts[:-1]
    }
    if overlay.nominal:
        values = {key: fitted.calibrated for key, fitted in overlay.nominal.items()}
        alone = nominal(problem.vehicle).changed(ALONE, values, _library_for(problem, overlay))
    every = [*models, *others.values(), *([] if alone is None else [alone])]
    ruler = yardstick(problem, every)
    replays = _Replays(ruler, tell)
    variants = [replays.of(m) for m in models]
    last = variants[-1]
    gains = {part: fall(replays.of(m), last) for part, m in others.items()}
    if parts:
        gains[parts[-1]] = fall(variants[-2], last)
    rival = None if alone is None else _replayed(replays, alone)
    return Ablation(
        name=name,
        variants=tuple(variants),
        gains={part: gains[part] for part in parts},
        total=fall(variants[0], last),
        alone=rival,
        edge=None if rival is None else _edge(rival, last, problem, overlay),
        floor=noise_floor(last, ruler),
    )


def compare_ends(
    name: str, problem: Problem, overlay: Overlay, *, tell: Callable[[int], None] | None = None
) -> Ablation:
    """Replay a log without the added effects, and with all of them."""
    models = model_variants(problem, overlay)
    below = models[: len(models) - len(overlay.parts)]
    ends = [*below, models[-1]]
    ruler = yardstick(problem, ends)
    replays = _Replays(ruler, tell)
    variants = tuple(replays.of(m) for m in ends)
    gains = {m.model.name: fall(m, variants[-1]) for m in variants[:-1]}
    return Ablation(
        name=name, variants=variants, gains=gains, total=fall(variants[0], variants[-1]), floor={}
    )


def replay_count(overlay: Overlay) -> int:
    """Return the number of replays of an ablation."""
    parts, calibrated = len(overlay.parts), bool(overlay.nominal)
    return 1 + parts + max(parts - 1, 0) + 2 * calibrated


class _Replays:
    """Replays of several models, with a progress count."""

    def __init__(self, ruler: Yardstick, tell: Callable[[int], None] | None) -> None:
        self._ruler, self._tell, self._before = ruler, tell, 0

    def of(self, model: Model) -> Misfit:
        """Replay one model and return its misfit."""
        made = measure(model, self._ruler, tell=self._count)
        self._before += len(self._ruler.rows)
        return made

    def _count(self, done: int) -> None:
        if self._tell is not None:
            self._tell(self._before + done)


def numbers_in_question(
    problem: Problem, overlay: Overlay, effects: Sequence[str], robot: RobotDescription | None
) -> list[str]:
    """Return the stated numbers that effects change, and those that move in their place, by name.

    Args:
        problem: the log made ready.
        overlay: the model.
        effects: names of its effects in the catalogue.
        robot: of the log.
    """
    sets, vehicle = problem.plant.candidate_set, problem.vehicle
    known = [
        number
        for number in stated_numbers(vehicle, sets, hull=hull_of(robot)).values()
        if number.value and not number.name.startswith(f"{SENSORS}.")
    ]
    moved = {key: abs(fit.calibrated - fit.value) for key, fit in overlay.nominal.items()}
    far = {
        key: by / sets.parameters[key].tolerance
        for key, by in moved.items()
        if key in sets.tolerances
    }
    keys = [key for c in sets.candidates if c.name in effects for key in c.keys]
    keys += sorted((key for key in far if far[key] > _MOVED), key=lambda key: -far[key])
    found = (number_behind(sets, known, key, vehicle.robot.links[0]) for key in keys)
    return list(dict.fromkeys(n.name for n in found if n is not None))[:_MOST_NUMBERS]


def _replayed(replays: _Replays, model: Model) -> Misfit | None:
    """Replay a calibration without the effects; None if it diverges."""
    try:
        return replays.of(model)
    except PhysicsError:
        return None


def _edge(rival: Misfit, last: Misfit, problem: Problem, overlay: Overlay) -> Fall:
    """Decrease of the misfit from calibration to the whole model, prior penalties included."""
    parameters, penalty = problem.plant.candidate_set.parameters, 0.0
    for key, fitted in overlay.nominal.items():
        tolerance = parameters[key].tolerance
        if tolerance > 0.0:
            penalty += (fitted.calibrated**2 - fitted.value**2) / tolerance**2
    plain = fall(rival, last)
    return Fall(value=plain.value + penalty / last.windows.observed, noise=plain.noise)


DRAWS = 6
"""Replicates of the noise."""
_SEED = 20


def noise_floor(last: Misfit, ruler: Yardstick) -> dict[str, dict[float, float]]:
    """Return the errors of a perfect model by channel and horizon.

    A perfect model starts every window at a trajectory found from noisy sensors, meets gusts that
    it does not know, and is compared with noisy readings. All three are drawn, seeded, and
    carried through the windows to first order.

    Args:
        last: the best model, about which the windows are linear.
        ruler: windows of the log.
    """
    rng = np.random.default_rng(_SEED)
    fitter = ruler.problem.fitter
    loose = rewindowed(fitter, gusts=LOOSE).windows
    squares: dict[str, dict[float, list[float]]] = {}
    for _ in range(DRAWS):
        track = _drawn(last.windows, loose, ruler, rng)
        for name, table in plain_errors(track, ruler, blank=True).items():
            for horizon, value in table.items():
                noise = ruler.problem.vehicle.sigma[name]
                squares.setdefault(name, {}).setdefault(horizon, []).append(value**2 + noise**2)
    return {
        name: {h: float(np.sqrt(np.mean(v))) for h, v in table.items()}
        for name, table in squares.items()
    }


def _drawn(windows: Windows, loose: Windows, ruler: Yardstick, rng: np.random.Generator) -> Track:
    """Errors of a perfect model in one replicate."""
    problem, rows = ruler.problem, ruler.rows
    start = _starts(loose, ruler, rng)
    gust = _gusts(ruler, rng)
    error = np.zeros((*rows.shape, windows.size))
    reading = np.zeros((*rows.shape, 6))
    dynamics, state = windows.dynamics, start
    for k in range(rows.shape[1]):
        at = rows[:, k]
        error[:, k] = state
        reading[:, k, :3] = state[:, 9:12]
        felt = np.einsum("wij,wj->wi", dynamics.output_matrix[at], state)
        reading[:, k, 3:] = felt + np.einsum("wij,wj->wi", dynamics.feedthrough[at], gust[:, k])
        pushed = np.einsum("wij,wj->wi", dynamics.input_matrix[at], gust[:, k])
        state = np.einsum("wij,wj->wi", dynamics.transition[at], state) + pushed
    turn = problem.vehicle.imu_turn.T
    reading = np.concatenate([reading[..., :3] @ turn, reading[..., 3:] @ turn], axis=2)
    return Track(rows=rows, error=error, reading=reading)


def _starts(loose: Windows, ruler: Yardstick, rng: np.random.Generator) -> Floats:
    """Errors of the trajectory at the starts of the windows, shape (W, n).

    With a pose they are what sensor noise alone makes of the trajectory under a free force.
    """
    problem, count = ruler.problem, len(ruler.rows)
    size = problem.fitter.trajectory.size
    if not problem.samples.posed:
        spread = stated_starts(problem.plant, problem.fitter.trajectory)[1]
        return spread * rng.standard_normal((count, size))
    noise = rng.standard_normal(loose.weight.shape) * (loose.weight > 0.0)
    found, _ = loose.explained(noise.reshape(loose.count, -1))
    nearest = np.argmin(np.abs(loose.rows[:, :1] - ruler.rows[None, :, 0]), axis=0)
    starts: Floats = found[nearest]
    return starts


def _gusts(ruler: Yardstick, rng: np.random.Generator) -> Floats:
    """Unmodelled force and torque at the stated level, shape (W, K, 6)."""
    vehicle, step = ruler.problem.vehicle, ruler.problem.samples.step
    count, length = ruler.rows.shape
    level = np.repeat(vehicle.gust, 3)
    keep = float(np.exp(-step / vehicle.gust_time))
    out = np.empty((count, length, 6))
    out[:, 0] = rng.standard_normal((count, 6))
    for k in range(1, length):
        fresh = rng.standard_normal((count, 6))
        out[:, k] = keep * out[:, k - 1] + np.sqrt(1.0 - keep**2) * fresh
    return out * level
