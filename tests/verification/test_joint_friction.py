"""Joints that rub: they slow down, stop and stay, at any step, in all engines and the batch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.motion import Inputs
from seals.plugins.actuators.servos import Servos
from seals.plugins.backends.free import BackendFree
from seals.plugins.backends.mujoco import BackendMujoco
from seals.plugins.backends.pybullet import BackendPybullet
from seals.plugins.effects.joint_friction import JointFriction
from seals.run import build_twin, build_world

if TYPE_CHECKING:
    from seals.effects.effect import Effect
    from seals.run.settings import RunSettings
    from tests.verification.conftest import Bench

Floats = NDArray[np.float64]
INERTIA, START = 2e-3, 3.0
RNG = np.random.default_rng(0)
ENGINES: dict[str, Any] = {
    "mujoco": BackendMujoco,
    "pybullet": BackendPybullet,
    "free": BackendFree,
    "twin": None,
}
JOINT = (
    '<joint name="pivot" type="continuous"><parent link="base"/><child link="arm"/>'
    '<axis xyz="0 1 0"/></joint>'
)


def lever(bench: Bench, effects: dict[str, Effect], engine: str, step: float) -> RunSettings:
    """Return a lever of 0.1 kg that turns about its centre of mass on a fixed pivot."""
    arm = bench.link("arm", 0.1, (INERTIA,) * 3)
    robot = bench.robot(bench.link("base", 1.0, (1.0,) * 3), arm, JOINT, fixed_base=True)
    settings = bench.settings(robot, effects, weight=False, step=step, duration=0.4)
    if ENGINES[engine] is not None:
        settings.backend = ENGINES[engine]()
    return settings


def turned(settings: RunSettings, engine: str, rate: float, command: float | None = None) -> Floats:
    """Return the rates of the lever over a run that starts with one [rad/s]."""
    step, count = settings.time.step, round(settings.time.duration / settings.time.step)
    asked = None if command is None else np.array([[command]])
    if engine == "twin":
        twin, state = build_twin(settings)
        state = state._replace(joint_velocity=np.array([[rate]]))
        rates = [rate]
        for k in range(count):
            inputs = Inputs(step, twin.no_torque(), joint_command=asked)
            state = twin.advance(state, k * step, step, (inputs,) * 3)[0]
            rates.append(float(state.joint_velocity[0, 0]))
        return np.array(rates)
    world = build_world(settings)
    try:
        actor = world.actors["robot"]
        actor.reset(actor.body.read()._replace(joint_velocity=np.array([rate])), RNG)
        actor.joint_command = asked
        rates = [rate]
        for _ in range(count):
            world.step()
            rates.append(float(actor.body.read().joint_velocity[0]))
        return np.array(rates)
    finally:
        world.close()


@pytest.mark.parametrize("engine", list(ENGINES))
@pytest.mark.parametrize("step", [4e-3, 1e-3])
def test_a_joint_that_rubs_stops_and_stays(bench: Bench, engine: str, step: float) -> None:
    """Dry friction of 2 N m on 2e-3 kg m^2 stops 3 rad/s within 3 ms; nothing turns after that."""
    settings = lever(bench, {"rub": JointFriction(coulomb=2.0)}, engine, step)
    rates = turned(settings, engine, START)
    assert np.abs(rates).max() <= START
    late = rates[round(0.1 / step) :]
    assert np.abs(late).max() < 1e-3 * START


@pytest.mark.parametrize("engine", list(ENGINES))
def test_the_rate_falls_as_the_law_says(bench: Bench, engine: str) -> None:
    """I q'' = -C tanh(q'/r) has sinh(q'/r) = sinh(q'_0/r) exp(-C t/(I r)), to second order."""
    dry, turn = 0.02, 1.0
    errors = []
    for step in (4e-3, 1e-3):
        rub = JointFriction(coulomb=dry, threshold=turn)
        rates = turned(lever(bench, {"rub": rub}, engine, step), engine, START)
        t = step * np.arange(len(rates))
        exact = turn * np.arcsinh(np.sinh(START / turn) * np.exp(-dry * t / (INERTIA * turn)))
        errors.append(float(np.abs(rates - exact).max() / START))
    print(f"{engine}: {errors[0]:.1e} of the rate at 4 ms, {errors[1]:.1e} at 1 ms")
    # a scheme of second order errs by about (C h / (I r))^2 = 1.6e-3
    assert errors[0] < 1.6e-3
    assert errors[1] < errors[0] / 8.0


@pytest.mark.parametrize("engine", ["mujoco", "pybullet", "free"])
def test_friction_is_beside_the_limit_of_a_servo(bench: Bench, engine: str) -> None:
    """A servo at its limit of 0.2 N m against friction of 0.1 N m turns the lever by the rest."""
    effects: dict[str, Effect] = {
        "rub": JointFriction(coulomb=0.1, threshold=0.01),
        "servos": Servos(kp=50.0, kd=0.5, torque_limit=0.2),
    }
    settings = lever(bench, effects, engine, 4e-3)
    settings.time.duration = 0.12
    rates = turned(settings, engine, 1.0, command=30.0)
    # the step from the start is of first order
    np.testing.assert_allclose(np.diff(rates)[10:], (0.2 - 0.1) / INERTIA * 4e-3, rtol=1e-6)
