"""Flows that vary: profiles, jet and tide against their formulas, gusts against their spectra."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from seals.effects import MediumKind, bind_effects
from seals.effects.flow_profile import FlowProfile
from seals.errors import ConfigError
from seals.motion import Body, Motion
from seals.plugins.effects.buoyancy import Buoyancy
from seals.plugins.effects.current import Current
from seals.plugins.effects.gusts import Gusts, GustSpectrum
from seals.plugins.effects.linear_drag import DragLinear
from seals.plugins.effects.wind import Wind

if TYPE_CHECKING:
    from tests.verification.conftest import Bench

RHO, EDGE = 1000.0, 0.1
MASS = RHO * EDGE**3
S, L, V = 1.5, 20.0, 8.0
"""Standard deviation [m/s], scale [m] and mean speed [m/s] of the gusts under test."""


def flow(effect: Any, place: Any, time: Any = 0.0) -> Any:
    """Velocity of the flow at points (N, 3) and times (N,) or one of either, world axes [m/s]."""
    times = np.atleast_1d(np.asarray(time, dtype=float))[:, None]
    points = np.atleast_2d(np.asarray(place, dtype=float))
    points = points + np.zeros((max(len(times), len(points)), 1))
    one, three = np.ones((1, 1)), np.zeros((1, 3))
    body = Body(one, three, one, one)
    there = Motion(times, points, np.eye(3)[None], three, three, three, body)
    bound = bind_effects({"it": effect}, ["base"]).bound[0]
    around: Any = None
    return np.asarray(bound.hooks.flow(there, around, around, None, bound.params)[0])


def above(heights: Any) -> Any:
    """Points at heights over the origin [m]."""
    return np.outer(heights, [0.0, 0.0, 1.0])


def test_wind_follows_the_power_and_the_log_law() -> None:
    """At three heights above a ground at 3 m the formulas, below ground nothing."""
    heights = np.array([0.5, 10.0, 80.0])
    power = Wind(velocity_y=6.0, profile=FlowProfile.power, datum=3.0)
    law = 6.0 * (heights / 10.0) ** (1.0 / 7.0)
    np.testing.assert_allclose(flow(power, above(heights + 3.0))[:, 1], law, rtol=1e-12)
    log = Wind(velocity_y=6.0, profile=FlowProfile.log, datum=3.0)
    law = 6.0 * np.log(heights / 0.03) / math.log(10.0 / 0.03)
    np.testing.assert_allclose(flow(log, above(heights + 3.0))[:, 1], law, rtol=1e-12)
    for effect in (power, log):
        assert not flow(effect, above([-4.0, 2.9, 3.0])).any()


def test_the_depth_mean_of_a_tidal_current_is_that_of_its_power_law() -> None:
    """Mean of (y/H)^(1/7) over the depth H is 7/8 of the surface current."""
    deep = 40.0
    tide = Current(velocity_x=1.2, profile=FlowProfile.power, datum=-deep, reference=deep)
    # midpoints of 200,000 layers, which miss below 1e-6 at the steep foot
    z = -deep + deep * (np.arange(200_000) + 0.5) / 200_000
    assert flow(tide, above(z))[:, 0].mean() == pytest.approx(1.2 * 7.0 / 8.0, abs=2e-6)


def test_a_jet_is_round_and_a_layer_is_flat() -> None:
    """One width off the middle the flow is exp(-1/2) of that in it, along the jet the same."""
    form = {"datum": -10.0, "reference": 4.0, "width": 2.0}
    jet = Current(velocity_x=0.6, velocity_y=0.8, profile=FlowProfile.jet, centre_x=1.0, **form)
    middle, side = np.array([1.0, 0.0, -6.0]), np.array([-0.8, 0.6, 0.0])
    along = np.array([0.6, 0.8, 0.0])
    up, low = np.array([0.0, 0.0, 2.0]), math.exp(-0.5)
    for place, share in (
        (middle + 50.0 * along, 1.0),
        (middle + 2.0 * side - 7.0 * along, low),
        (middle + up, low),
    ):
        np.testing.assert_allclose(flow(jet, place)[0], share * along, atol=1e-12)
    layer = Current(velocity_x=1.0, profile=FlowProfile.layer, **form)
    assert flow(layer, middle + 9.0 * side)[0, 0] == pytest.approx(1.0, abs=1e-12)
    assert flow(layer, middle - up)[0, 0] == pytest.approx(low, abs=1e-12)


def test_a_tide_turns_and_its_steady_part_stays() -> None:
    """1 - A + A cos(2 pi t / T): 1, 1 - 2 A half a period on, 1 - A on average."""
    tide = Current(velocity_x=0.5, tide=0.8, tide_period=1000.0)
    speed = flow(tide, [0.0, 0.0, 0.0], np.arange(1000.0))[:, 0]
    assert speed[0] == pytest.approx(0.5)
    assert speed[500] == pytest.approx(-0.3)
    assert speed.mean() == pytest.approx(0.1)


def spectrum(effect: Gusts, axis: int) -> Any:
    """One-sided spectral density over the wavenumber, of the stated form [m^3/s^2]."""
    along = axis == 0

    def dryden(x: Any) -> Any:
        if along:
            return 2.0 / (1.0 + x**2)
        return (1.0 + 3.0 * x**2) / (1.0 + x**2) ** 2

    def von_karman(x: Any) -> Any:
        y = 1.339 * x
        if along:
            return 2.0 / (1.0 + y**2) ** (5.0 / 6.0)
        return (1.0 + 8.0 / 3.0 * y**2) / (1.0 + y**2) ** (11.0 / 6.0)

    law = dryden if effect.spectrum is GustSpectrum.dryden else von_karman
    return lambda k: S**2 * L / math.pi * law(L * k)


@pytest.mark.parametrize("form", GustSpectrum)
def test_gusts_have_the_stated_spectrum_and_variance(form: GustSpectrum) -> None:
    """Variance of records in octaves of wavenumber against the integral of the closed form."""
    # 20 ms keep the part of von Karman's tail that folds back below half a percent of an octave
    records, count, step, waves = 40, 2**14, 0.02, 200
    sides = {f"deviation_{a}": S for a in "xyz"} | {f"length_{a}": L for a in "xyz"}
    window = np.hanning(count)[:, None]
    power, variance = np.zeros((count // 2 + 1, 3)), np.zeros(3)
    for seed in range(records):
        effect = Gusts(spectrum=form, speed=V, waves=waves, seed=seed, **sides)
        u = flow(effect, [0.0, 0.0, 0.0], step * np.arange(count))
        variance += np.mean(u**2, axis=0) / records
        power += np.abs(np.fft.rfft(u * window, axis=0)) ** 2 / (records * (window**2).sum())
    # records of 328 s hold 65 pieces of two correlation times L / V: 2.8 % of 40 of them, 1-sigma
    np.testing.assert_allclose(variance, S**2, rtol=0.1)
    k = 2.0 * math.pi * np.fft.rfftfreq(count, step) / V
    for low in (0.05, 0.1, 0.2, 0.4, 0.8):
        within = (k >= low) & (k < 2.0 * low)
        fine = np.linspace(low, 2.0 * low, 2001)
        for axis in range(3):
            rate = spectrum(effect, axis)(fine)
            expected = float(np.sum(0.5 * (rate[1:] + rate[:-1]) * np.diff(fine)))
            measured = 2.0 * float(power[within, axis].sum()) / count
            # bins of a Hann window scatter as two thirds as many; beside it the draw of the waves
            bins = 1.5 / (records * int(within.sum()))
            spread = math.sqrt(bins + (S**2 / (waves * expected)) ** 2 / records)
            assert measured == pytest.approx(expected, rel=4.0 * spread), (low, axis)


def test_gusts_near_the_ground_follow_the_specification() -> None:
    """MIL-F-8785C at 100 ft and 15 m/s: s_w = 1.5, L_w = 100 ft, g = 0.2593."""
    near = Gusts(altitude=30.48, low_wind=15.0)
    g = 0.177 + 0.0823
    assert near.deviation_z == pytest.approx(1.5)
    assert near.length_z == pytest.approx(30.48)
    assert near.deviation_x == near.deviation_y == pytest.approx(1.5 / g**0.4)
    assert near.length_x == near.length_y == pytest.approx(30.48 / g**1.2)


def test_gusts_are_carried_with_the_mean_flow_along_the_heading() -> None:
    """What is here now is V t ahead after t; across the heading and upward it is the same."""
    gusts = Gusts(deviation_x=1.0, deviation_y=1.0, deviation_z=1.0, speed=V, heading=0.5, seed=3)
    way = np.array([math.cos(0.5), math.sin(0.5), 0.0])
    here, beside = flow(gusts, [0.0, 0.0, 0.0], 2.0), [-3.0 * way[1], 3.0 * way[0], 9.0]
    np.testing.assert_allclose(flow(gusts, V * 3.0 * way, 5.0), here, atol=1e-12)
    np.testing.assert_allclose(flow(gusts, beside, 2.0), here, atol=1e-12)
    other = Gusts(deviation_x=1.0, deviation_y=1.0, deviation_z=1.0, speed=V, heading=0.5, seed=4)
    assert np.abs(flow(other, [0.0, 0.0, 0.0], 2.0) - here).max() > 0.01


@pytest.mark.parametrize(("engine", "step"), [("world", 0.004), ("twin", 0.016)])
def test_a_body_drifts_with_a_turning_tide_as_the_closed_form_says(
    bench: Bench, engine: str, step: float
) -> None:
    """M v' = -c (v - U cos w t) has the solution U r (r cos + w sin - r e^(-r t)) / (r^2 + w^2)."""
    c, u, period = 3.0, 0.6, 5.0
    drag = DragLinear(coefficient_x=c, coefficient_y=c, coefficient_z=c, medium=MediumKind.water)
    current = Current(velocity_x=u, tide=1.0, tide_period=period)
    settings = bench.settings(
        bench.body(MASS, (0.002,) * 3, hull="box", size=[EDGE] * 3),
        {"buoyancy": Buoyancy(), "current": current, "drag": drag},
        step=step,
        duration=8.0,
        environment={"water_level": 0.0, "water_density": RHO},
        position=[0, 0, -3],
    )
    run = bench.run(engine, settings)
    r, w, t = c / MASS, 2.0 * math.pi / period, run.time
    turning = r * np.cos(w * t) + w * np.sin(w * t) - r * np.exp(-r * t)
    expected = u * r * turning / (r**2 + w**2)
    # second and fourth order in the fastest rate, r + w, as in the terminal velocity
    bound = ((r + w) * step) ** (2 if engine == "world" else 4) * u + 1e-12
    assert np.abs(run.velocity[:, 0] - expected).max() < bound
    assert np.abs(run.velocity[:, 1:]).max() < 1e-9


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Gusts(altitude=1.0, low_wind=5.0), "from 3.048 to 304.8 m"),
        (lambda: Wind(profile=FlowProfile.log, reference=0.01), "above the roughness"),
    ],
)
def test_what_no_law_covers_is_refused_in_two_lines(make: Any, words: str) -> None:
    """An altitude that the specification leaves out, a reference inside the roughness."""
    with pytest.raises(ConfigError, match=words) as told:
        make()
    assert len(str(told.value).splitlines()) == 2
