"""A plant along a trajectory: what is kept for many parameters equals what is computed afresh."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seals.sysid.candidates.catalogue import candidate_set_of
from seals.sysid.data.samples import Samples
from seals.sysid.data.trajectory import Trajectory
from seals.sysid.data.vehicle import Vehicle, read_vehicle
from seals.sysid.predictors.extended_model import ExtendedModel
from seals.sysid.predictors.linearise import dynamics_along, predict
from seals.sysid.predictors.problem import linearise_model, rewindowed, transient_rows, windows_of
from seals.sysid.predictors.trajectory_cache import TrajectoryCache, packed
from seals.sysid.predictors.windows_fit import Fitter

ROWS, STEP = 150, 0.01
VALUES = {
    "linear_drag_air_change.coefficient_x": 0.1,
    "payload_second.mass": 0.05,
    "mass.mass": 0.02,
}
KEYS = [
    "mass.mass",
    "inertia.delta_yy",
    "centre_of_gravity.offset_z",
    "payload_second.mass",
    "payload_second.position_z",
    "linear_drag_air_change.coefficient_x",
    "quadratic_drag_water_change.coefficient_z",
    "added_mass_change.mass_z",
    "buoyancy.volume_change",
    "wind.velocity_y",
    "current.velocity_x",
    "weak_rotor_2.relative_loss",
    "thrust_coefficient.relative_change",
    "servos.kp",
    "joint_friction_1.viscous",
    "joint_backlash_2.width",
]


def described(level: float | None) -> dict[str, Any]:
    """A small vehicle with rotors, a hull and an arm, at the surface of water or without any."""
    link = {
        "mass": 0.12,
        "centre_of_gravity": [0.0, 0.01, -0.07],
        "inertia": np.diag([2e-4, 2e-4, 2e-5]).tolist(),
    }
    joint = {"type": "revolute", "axis": [0, 1, 0], "lower": -2.8, "upper": 2.8}
    first = {**joint, "name": "one", "origin": [0.02, 0.0, -0.06]}
    second = {**joint, "name": "two", "origin": [0.0, 0.0, -0.14], "axis": [1, 0, 0]}
    rotor = {
        "axis": [0, 0, 1],
        "thrust_coefficient": 1.7e-5,
        "torque_coefficient": 2.4e-7,
        "time_constant": 0.04,
        "max_speed": 1050.0,
        "radius": 0.1,
    }
    places = [(0.2, -0.2, 1), (-0.2, 0.2, 1), (0.2, 0.2, -1), (-0.2, -0.2, -1)]
    box = {"type": "box", "position": [0, 0, 0], "rpy": [0, 0, 0], "size": [0.3, 0.2, 0.1]}
    hull = {"displaced_volume": 0.006, "centre_of_buoyancy": [0, 0, 0.01], "plan_area": 0.06}
    coefficients = {f"coefficient_{a}": 0.3 for a in "xyz"}
    gains = {"kp": 9.0, "kd": 0.23, "torque_limit": 2.5, "armature": 0.002}
    base = {"mass": 2.2, "centre_of_gravity": [0.01, 0, 0.02]}
    sigma = {
        "position": 0.003,
        "orientation": 0.004,
        "angular_velocity": 0.01,
        "specific_force": 0.1,
        "joint_position": 1e-3,
    }
    tolerance = {"mass": 0.005, "inertia": 0.03, "thrust_coefficient": 0.006, "link_mass": 0.01}
    return {
        "vehicle": {
            "rotors": [{**rotor, "position": [x, y, 0.0], "direction": d} for x, y, d in places],
            "hull": None if level is None else {**hull, "primitives": [box]},
            "base": {**base, "inertia": np.diag([0.02, 0.023, 0.04]).tolist()},
            "arm": {
                "links": [
                    {**link, "name": "first", "joint": first},
                    {**link, "name": "second", "joint": second},
                ],
                "controller": gains,
            },
        },
        "environment": {"water_level": level},
        "baseline": [
            {"name": "gravity"},
            *([] if level is None else [{"name": "buoyancy"}]),
            {"name": "rotor_thrust"},
            {"name": "arm"},
            {"name": "linear_drag", "medium": "air", "parameters": coefficients},
            {"name": "quadratic_drag", "medium": "water", "parameters": coefficients},
        ],
        "sensors": {"channels": {k: {"sigma": v} for k, v in sigma.items()}},
        "tolerance": {k: {"sigma": v} for k, v in tolerance.items()},
        "disturbance": {"force_sigma": 0.05, "torque_sigma": 0.003},
    }


def waving(vehicle: Vehicle) -> tuple[ExtendedModel, Trajectory]:
    """A smooth trajectory through the surface with its log; readings with noise of a fixed seed."""
    rng = np.random.default_rng(3)
    time = np.arange(ROWS) * STEP

    def swing(size: float, width: int) -> Any:
        phase, rate = rng.uniform(0.0, 6.0, width), rng.uniform(2.0, 5.0, width)
        return size * np.sin(time[:, None] * rate + phase)

    turn = np.concatenate([swing(0.3, 3), np.ones((ROWS, 1))], axis=1)
    trajectory = Trajectory(
        position=swing(0.1, 3),
        quaternion=turn / np.linalg.norm(turn, axis=1, keepdims=True),
        velocity=swing(1.0, 3),
        angular_velocity=swing(1.0, 3),
        joints=swing(0.8, 2),
        joint_velocity=swing(1.0, 2),
    )
    exact = {
        "position": trajectory.position,
        "orientation": trajectory.quaternion,
        "angular_velocity": trajectory.angular_velocity,
        "specific_force": swing(2.0, 3),
        "joint_position": trajectory.joints,
    }
    samples = Samples(
        time=time,
        step=STEP,
        runs=((0, ROWS),),
        channels={k: v + 1e-3 * rng.normal(size=v.shape) for k, v in exact.items()},
        command=600.0 + swing(50.0, 4),
        voltage=None,
        joint_command=trajectory.joints + 0.02,
    )
    candidate_set = candidate_set_of(vehicle, speeds=np.ones(3))
    return ExtendedModel(vehicle, candidate_set, samples, parts=1), trajectory


@pytest.fixture(scope="module")
def cache() -> TrajectoryCache:
    """The plant along its trajectory."""
    return TrajectoryCache(*waving(read_vehicle(described(0.0))))


@pytest.fixture(scope="module")
def fitter() -> Fitter:
    """A linearisation in the air with windows."""
    return linearise_model(*waving(read_vehicle(described(None))), {}, window=0.5)


def afresh(cache: TrajectoryCache, values: dict[str, float]) -> Any:
    """Rates of a new twin that knows nothing of the trajectory."""
    twin = cache.plant.twin(values, ROWS)
    return packed(twin.rates(cache.state, cache.time, cache.inputs(values)))


def test_a_kept_posture_changes_nothing(cache: TrajectoryCache) -> None:
    """The rates with poses and surroundings at hand are those without."""
    kept = packed(cache.response(VALUES).rates)
    assert kept == pytest.approx(afresh(cache, VALUES), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("key", KEYS)
def test_a_response_is_the_slope_of_the_rates(cache: TrajectoryCache, key: str) -> None:
    """What one effect does at known accelerations gives the derivative of all rates."""
    found = cache.changes(VALUES, [key])[key]
    step = 0.1 * cache.plant.candidate_set.parameters[key].nudge
    sides = [{**VALUES, key: VALUES.get(key, 0.0) + s * step} for s in (1.0, -1.0)]
    above, below = (afresh(cache, v) for v in sides)
    slope = (above - below) / (2.0 * step)
    assert np.abs(slope).max() > 0.0
    # one-sided quotients of laws that bend: of first order in a step of 2 %
    assert np.abs(found - slope).max() < 0.02 * np.abs(slope).max()


def test_a_unit_wrench_on_the_base_turns_and_lifts(cache: TrajectoryCache) -> None:
    """Pushing the base upward by what the drive adds gives the acceleration that the drive adds."""
    key = "thrust_coefficient.relative_change"
    response, plant = cache.response({}), cache.plant
    drive = plant.drive({})
    assert drive is not None
    speeds = drive.at[:, 0]
    rotors: Any = plant.vehicle.effects["rotors"]
    thrust = rotors.thrust_coefficient[0] * speeds**2
    torque = rotors.torque_coefficient[0] * speeds**2
    place, turns = np.array(rotors.position), np.array(rotors.direction)
    arms = np.cross(place, [0.0, 0.0, 1.0])
    lift = thrust.sum(axis=1)[:, None]
    wrench = np.concatenate([np.zeros((ROWS, 2)), lift, thrust @ arms], axis=1)
    pushed = np.stack(response.pushed(), axis=2)
    expected = np.einsum("tik,tk->ti", pushed, wrench)
    found = cache.changes({}, [key])[key]
    spun = np.einsum("ti,t->ti", pushed[:, :, 5], torque @ turns)
    best = min(np.abs(found - expected + s * spun).max() for s in (-1.0, 0.0, 1.0))
    assert best < 1e-8 * np.abs(found).max()


def test_steps_about_an_anchor_are_right_to_first_order(fitter: Fitter) -> None:
    """At the anchor the step is exact; beside it, most of its change is there."""
    cache = fitter.cache
    assert cache is not None
    plant, trajectory = cache.plant, cache.trajectory
    expansion_point = cache.expansion_point({})

    values = {"linear_drag_air_change.coefficient_x": 0.1, "wind.velocity_y": 1.0}

    def moved(size: float, **given: Any) -> Any:
        used = {k: size * v for k, v in values.items()}
        return predict(plant, trajectory, used, cache=cache, **given).defect[:-1, :12]

    still = expansion_point.defect[:-1, :12]
    near = {"expansion_point": expansion_point, "dynamics": fitter.dynamics}
    assert moved(0.0, **near) == pytest.approx(still, abs=1e-14)
    change = np.abs(moved(1.0) - still).max()
    assert change > 1e-4
    assert np.abs(moved(1.0, **near) - moved(1.0)).max() < 0.05 * change


def test_other_gusts_need_no_new_outputs(fitter: Fitter) -> None:
    """Windows under another level of the gusts equal windows set up for it."""
    level = 2.5 * fitter.windows.gusts
    fresh = windows_of(fitter.plant, fitter.trajectory, fitter.dynamics, window=0.5, gusts=level)
    shared = fitter.windows.with_disturbance(level)
    assert shared.shares_outputs(fitter.windows)
    assert not fresh.shares_outputs(fitter.windows)
    outputs = fitter.misfit({}).outputs
    left, right = (w.whiten(outputs) for w in (fresh, shared))
    assert left.product(left) == pytest.approx(right.product(right), rel=1e-9)
    assert fresh.volume == pytest.approx(shared.volume, rel=1e-12)


def test_what_was_seen_serves_other_gusts(fitter: Fitter) -> None:
    """Equations from outputs at hand equal those from the model."""
    fit = fitter.fit(("wind.velocity_x",), iterations=2)
    other = rewindowed(fitter, gusts=3.0)
    quick, slow = (
        other.reevaluated(fit, whitened=fitter.whitened_residuals(fit)),
        other.reevaluated(fit),
    )
    assert quick.cost == pytest.approx(slow.cost, rel=1e-9)
    assert quick.normal == pytest.approx(slow.normal, rel=1e-8, abs=1e-8 * slow.normal.max())


def test_a_finished_fit_stands_on_exact_steps(fitter: Fitter) -> None:
    """The cost of a fit is that of the model at its values, and a rough one is not better."""
    keys = ("payload_second.mass", "payload_second.position_z")
    coarse, fit = fitter.fit(keys, coarse=True), fitter.fit(keys)
    seen = fitter.misfit(fit.values)
    exact = float(seen.product(seen).sum()) + fit.penalty
    assert fit.cost == pytest.approx(exact, abs=1.0, rel=1e-4)
    seen = fitter.misfit(coarse.values)
    assert exact < float(seen.product(seen).sum()) + coarse.penalty + 1.0


def test_a_fit_starts_inside_its_bounds(fitter: Fitter) -> None:
    """A start from a linear guess may ask for a negative mass."""
    key = "payload_second.mass"
    low, high = fitter.candidate_set.parameters[key].bounds
    fit = fitter.fit((key,), start={key: low - 1.0}, iterations=0, coarse=True)
    assert low <= fit.values[key] <= high


def test_a_delay_that_the_windows_follow_is_free_only_where_it_is_fitted() -> None:
    """A model without a late sensor pays for a delay beyond its tolerance."""
    meta = described(None)
    meta["tolerance"]["sensor_delay"] = {"sigma": 5e-4}
    late = linearise_model(*waving(read_vehicle(meta)), {}, window=0.5)
    late, key = rewindowed(late, delay=0.02), late.candidate_set.sensor_delay
    without, fitted = (late.fit(free, iterations=0, coarse=True) for free in ((), (key,)))
    assert without.cost - fitted.cost == pytest.approx((0.02 / 5e-4) ** 2, rel=1e-6)


def test_slopes_in_the_state_keep_what_the_place_cannot_change(cache: TrajectoryCache) -> None:
    """In still water the accelerations know the height, and no other place."""
    change = dynamics_along(cache.plant, cache.trajectory, {}, cache=cache).transition
    assert np.abs(change[:, 6:12, 2]).max() > 1.0 * cache.plant.samples.step
    assert not change[:, 6:12, :2].any()


@pytest.mark.parametrize(
    "key", ["command_delay.delay", "rotor_lag.time_constant_change", "sensor_delay.delay"]
)
def test_what_acts_in_time_has_the_slope_of_the_misfit(fitter: Fitter, key: str) -> None:
    """Commands that jump inside a row and readings between two rows: the columns see both."""
    at, step = {key: 0.0007}, 2e-5
    sides = [fitter.misfit({key: at[key] + s * step}) for s in (1.0, -1.0)]
    above, below = (w.product(w).sum() for w in sides)
    column, middle = fitter.whitened([key], at), fitter.misfit(at)
    # the columns point along what the misfit loses
    slope = -2.0 * float(column.product(middle).sum())
    assert (above - below) / (2.0 * step) == pytest.approx(slope, rel=0.02)


def test_rows_are_left_out_until_a_longer_lag_has_decayed() -> None:
    """Where a change of the lag may be missing, the drives' start may take longer to decay."""
    plant, _ = waving(read_vehicle(described(None)))
    set_, step = plant.candidate_set, plant.samples.step
    (key,) = (k for k in set_.parameters if k.endswith("time_constant_change"))
    scale = set_.parameters[key].scale
    assert scale > 0.0
    lag = float(plant.vehicle.lag.max())
    assert transient_rows(plant) == math.ceil(5.0 * (lag + scale) / step)
