"""Line-of-sight guidance against the closed form of a unicycle, and fins against their source."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.api import make
from seals.control.fins import fins_of
from seals.control.line_of_sight import LegPosition
from seals.control.plant import build_plant
from seals.errors import ConfigError
from seals.plugins.guides.los import Los
from seals.run.assembly import build_world
from seals.run.build import run_settings

SPEED, AHEAD = 1.3, 4.0


def situation(place: np.ndarray, velocity: np.ndarray, step: float) -> Any:
    """Return what the guide reads of a state."""
    return SimpleNamespace(position=place, velocity=velocity, step=step, yaw=0.0, time=0.0)


def driven(guide: Los, start: list[float], seconds: float, current: float = 0.0) -> np.ndarray:
    """Drive a unicycle, whose heading is the reference at once, by the middle of every step."""
    step, place, rows = 0.01, np.array([0.0, 0.0, 0.0]), []
    memory = guide.start(situation(place, np.zeros(3), step))
    place = np.array(start)
    drift = np.array([0.0, current, 0.0])
    for _ in range(round(seconds / step)):
        rows.append(place)
        first, memory_ = guide.aim(situation(place, np.zeros(3), step), memory)
        middle = place + 0.5 * step * (first.velocity + drift)
        second, _ = guide.aim(situation(middle, np.zeros(3), step), memory)
        place, memory = place + step * (second.velocity + drift), memory_
    return np.array(rows)


def test_the_cross_track_error_falls_at_the_closed_form_rate() -> None:
    """Along e' = -U e / sqrt(e^2 + D^2): sqrt(e^2 + D^2) - D asinh(D / e) falls by U a second."""
    guide = Los(places=[[500.0, 0.0, 0.0]], speed=SPEED, lookahead=AHEAD)
    rows = driven(guide, [0.0, 9.0, 0.0], 20.0)
    error, time = rows[:, 1], 0.01 * np.arange(len(rows))
    form = np.sqrt(error**2 + AHEAD**2) - AHEAD * np.arcsinh(AHEAD / error)
    # the midpoint rule errs by the square of the step
    np.testing.assert_allclose(form, form[0] - SPEED * time, atol=2e-4)
    # near the leg it is exp(-U t / D)
    late = error[-200:]
    rate = -np.diff(np.log(late)).mean() / 0.01
    assert rate == pytest.approx(SPEED / AHEAD, rel=1e-3)


def test_the_integral_removes_the_error_of_a_current_across_the_leg() -> None:
    """Without it a current v leaves e with sin(chi) = -v / U; with it nothing is left."""
    plain = Los(places=[[500.0, 0.0, 0.0]], speed=SPEED, lookahead=AHEAD)
    left = driven(plain, [0.0, 1.0, 0.0], 40.0, current=0.3)[-1, 1]
    assert left == pytest.approx(AHEAD * math.tan(math.asin(0.3 / SPEED)), rel=1e-3)
    summed = Los(places=[[500.0, 0.0, 0.0]], speed=SPEED, lookahead=AHEAD, integral_gain=0.5)
    assert abs(driven(summed, [0.0, 1.0, 0.0], 80.0, current=0.3)[-1, 1]) < 0.01


def test_depth_is_led_by_line_of_sight_within_the_steepest_climb() -> None:
    """Far from the depth it climbs at the limit, near it by exp(-U t / D)."""
    guide = Los(places=[[500.0, 0.0, 0.0]], speed=SPEED, climb_lookahead=AHEAD, climb_limit=0.3)
    rows = driven(guide, [0.0, 0.0, -8.0], 40.0)
    assert (rows[101, 2] - rows[1, 2]) == pytest.approx(SPEED * math.sin(0.3), rel=1e-6)
    assert abs(rows[-1, 2]) < 0.01
    assert rows[:, 2].max() < 1e-9


def test_legs_follow_each_other_at_their_distance_of_acceptance() -> None:
    """The next leg begins 2 m before a corner, the last place is passed before it is done."""
    guide = Los(places=[[10.0, 0.0, 0.0], [10.0, 10.0, 0.0]], acceptance=2.0)
    state = guide.start(situation(np.zeros(3), np.zeros(3), 0.1))
    stages = []
    for place in ([7.9, 0.0, 0.0], [8.1, 0.0, 0.0], [10.0, 9.9, 0.0], [10.0, 10.1, 0.0]):
        _, state = guide.aim(situation(np.array(place), np.zeros(3), 0.1), state)
        stages.append((guide.stage(state), guide.finished(state)))
    assert stages == [("to place 1", None), *[("to place 2", None)] * 2, ("to place 2", True)]


def test_a_place_beside_a_leg_has_signs_to_the_left_and_above() -> None:
    """On a leg north-east that climbs, in closed form."""
    found = LegPosition.of(np.zeros(3), np.array([3.0, 4.0, 5.0]), np.array([-0.8, 0.6, 1.0]))
    assert found.cross == pytest.approx(1.0)
    assert found.along == pytest.approx(0.0)
    assert found.above == pytest.approx(1.0)
    assert (found.course, found.climb) == pytest.approx((math.atan2(4, 3), math.pi / 4))
    with pytest.raises(ConfigError, match=r"los.places=\[\[1, 2\]\] is not allowed"):
        Los(places=[[1, 2]])  # type: ignore[list-item]


def test_fins_turn_the_torpedo_by_the_published_coefficients() -> None:
    """9.64 N and 6.15 N m a radian and (m/s)^2 for a pair of fins (Prestero 2001)."""
    settings = run_settings(["robot=torpedo", "water=fossen", "backend=free"])
    world = build_world(settings)
    actor = world.actors["robot"]
    plant = build_plant(actor.robot, actor.effects, settings.environment)
    fins, names = fins_of(plant), actor.robot.joints
    world.close()
    push = dict(zip((names[j] for j in fins.joints), fins.slope[:, None] * fins.axis, strict=True))
    arm = dict(zip((names[j] for j in fins.joints), fins.position, strict=True))
    rudders, planes = ("rudder_top", "rudder_bottom"), ("plane_left", "plane_right")
    assert np.abs(sum(push[k] for k in rudders)) == pytest.approx([0.0, 9.64, 0.0], abs=0.03)
    assert np.abs(sum(push[k] for k in planes)) == pytest.approx([0.0, 0.0, 9.64], abs=0.03)
    yaw = sum(np.cross(arm[k], push[k]) for k in rudders)[2]
    # turning the rudder anticlockwise at the stern turns the vehicle clockwise
    assert yaw == pytest.approx(-6.15, abs=0.03)
    assert fins.limit == pytest.approx(0.24)


def test_a_vehicle_that_cannot_steer_is_refused_by_name(tmp_path: Path) -> None:
    """A propeller without rudder commands no yaw; the refusal says what it takes."""
    words = ["robot=torpedo", "water=fossen", "guide=los", "backend=free", "~effects.fins"]
    with pytest.raises(ConfigError, match="do not command yaw") as refusal:
        make(words)
    assert "a rudder" in str(refusal.value)
