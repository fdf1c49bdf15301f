"""Wind and current: frames, media, and what they act on."""

from __future__ import annotations

import numpy as np
import pytest

from seals.frames import matrix_of
from seals.run import build_twin, build_world
from seals.run.build import run_settings

FAR = {"air": "initial.position=[0,0,50]", "water": "initial.position=[0,0,-50]"}


def acceleration(*options: str) -> np.ndarray:
    """Acceleration of the ball's origin in the world at the start [m/s^2]."""
    run = run_settings(["robot=ball", "water=fossen", *options])
    twin, state = build_twin(run)
    rates = twin.rates(state, 0.0)
    turn = matrix_of(state.quaternion)[0]
    return turn @ (rates.velocity + np.cross(state.angular_velocity, state.velocity))[0]


@pytest.mark.parametrize("yaw", [0.0, 1.0, 3.0])
@pytest.mark.parametrize(("flow", "medium"), [("wind", "air"), ("current", "water")])
def test_a_flow_is_given_in_the_world(flow: str, medium: str, yaw: float) -> None:
    """A flow toward east pushes a body at rest toward east, however the body is turned."""
    drag = [f"effects.{medium}_drag.coefficient_{a}=2.0" for a in "xyz"]
    still = [f"initial.rpy=[0.3,-0.2,{yaw}]", FAR[medium], *drag]
    blow = [f"+effect@effects.flow={flow}", "effects.flow.velocity_x=1.5"]
    push = acceleration(*still, *blow) - acceleration(*still)
    assert push[0] > 1.0
    # with unequal loads on the three body axes a square law leaves the flow's line a little
    assert np.abs(push[1:]).max() < 0.5 * push[0]


@pytest.mark.parametrize(("flow", "medium"), [("wind", "water"), ("current", "air")])
def test_a_flow_acts_in_its_own_medium_only(flow: str, medium: str) -> None:
    """Wind does not push a submerged body, nor a current one in the air."""
    blow = [f"+effect@effects.flow={flow}", "effects.flow.velocity_x=1.5", FAR[medium]]
    np.testing.assert_array_equal(acceleration(*blow), acceleration(FAR[medium]))


def test_drag_vanishes_when_drifting_with_the_current() -> None:
    """A body that moves with the current feels weight and lift only, added mass included."""
    moving = ["initial.velocity=[0.7,-0.4,0.2]", "initial.rpy=[0.3,-0.2,1]", FAR["water"]]
    drift = ["+effect@effects.flow=current", "effects.flow.velocity_x=0.7"]
    drift += ["effects.flow.velocity_y=-0.4", "effects.flow.velocity_z=0.2"]
    np.testing.assert_allclose(
        acceleration(*moving, *drift), acceleration(FAR["water"]), atol=1e-12
    )


def test_turning_in_a_current_is_no_acceleration_of_the_water() -> None:
    """A spinning body that drifts keeps drifting: the current is steady in the world."""
    turning = ["initial.angular_velocity=[1,2,-1]", FAR["water"]]
    drift = ["+effect@effects.flow=current", "effects.flow.velocity_x=0.7"]
    found = acceleration("initial.velocity=[0.7,0,0]", *turning, *drift)
    np.testing.assert_allclose(found, acceleration(*turning), atol=1e-12)


def test_two_flows_add_up() -> None:
    """A second current, said to be a correction, adds to the first."""
    both = ["+effect@effects.a=current", "+effect@effects.b=current", "effects.b.correction=true"]
    parts = ["effects.a.velocity_x=0.3", "effects.b.velocity_x=0.5"]
    one = ["+effect@effects.a=current", "effects.a.velocity_x=0.8"]
    found = acceleration(FAR["water"], *both, *parts)
    np.testing.assert_allclose(found, acceleration(FAR["water"], *one), atol=1e-12)


def test_the_simulator_sees_the_same_wind() -> None:
    """In the world's ledger the drag of a body at rest in wind from the west points east."""
    blow = ["+effect@effects.flow=wind", "effects.flow.velocity_x=3.0", "initial.rpy=[0,0,1.5708]"]
    run = run_settings(["robot=ball", *blow, "effects.air_drag.coefficient_y=0.01"])
    world = build_world(run)
    world.step()
    force = world.actors["robot"].ledger.of("air_drag")[0, 0, :3]
    world.close()
    # yawed by 90 degrees, east is the body's -y: F_y = -c v^2
    np.testing.assert_allclose(force, [0.0, -0.01 * 9.0, 0.0], atol=1e-5)
