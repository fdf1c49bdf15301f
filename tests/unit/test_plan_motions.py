"""Reference motions, manoeuvres and safety bounds of a plan."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from seals.sysid.experiment_design.manoeuvres import LIBRARY, LONGEST, manoeuvres
from seals.sysid.experiment_design.motions import smooth, sweep, visits
from seals.sysid.experiment_design.scene import AIR, ARM, CROSSING, DROP, WATER, Scene
from seals.sysid.experiment_design.separation import Contest, chance, confidence

SCENE = Scene(
    kind=AIR,
    home=np.array([0.0, 0.0, 1.5]),
    low=0.2,
    high=3.5,
    reach=4.0,
    speed=3.0,
    push=2.5,
    lift=3.0,
    tilt=0.6,
    joints=np.zeros(0),
    level=None,
)


def test_a_smooth_step_starts_and_ends_at_rest() -> None:
    """Value, speed and acceleration are those of rest at both ends."""
    time = np.linspace(0.0, 2.0, 2001)
    step = smooth(time, 0.5, 1.0)
    speed = np.gradient(step, time)
    assert step[0] == 0.0
    assert step[-1] == 1.0
    assert np.abs(speed[time < 0.501]).max() < 1e-2
    assert speed.max() == pytest.approx(1.875, rel=1e-3)


def test_visits_stay_where_they_should() -> None:
    """Every stop is held for its time."""
    time = np.linspace(0.0, 8.0, 801)
    values = visits(time, [0.0, 1.0, -1.0], stay=2.0, move=1.0)
    assert np.allclose(values[time <= 2.0], 0.0)
    assert np.allclose(values[(time > 3.01) & (time < 4.99)], 1.0)
    assert np.allclose(values[time > 6.01], -1.0)


def test_a_sweep_keeps_its_acceleration() -> None:
    """Early and late swings push as hard as asked for, at ever higher frequency."""
    time = np.arange(0.0, 15.0, 1e-3)
    wave = sweep(time, push=2.0, low=0.4, high=4.0, seconds=15.0)
    acceleration = np.gradient(np.gradient(wave, time), time)
    early, late = np.abs(acceleration[4000:7000]).max(), np.abs(acceleration[11000:14000]).max()
    assert early == pytest.approx(2.0, rel=0.15)
    assert late == pytest.approx(2.0, rel=0.15)


@pytest.mark.parametrize("kind", [AIR, ARM, WATER, CROSSING, DROP])
def test_every_kind_of_vehicle_has_manoeuvres(kind: str) -> None:
    """At least four, none of them too long, and each says in words what is done."""
    found = manoeuvres(kind)
    assert len(found) >= 4
    assert all(m.seconds <= LONGEST and m.words for m in found)


def test_names_are_unique() -> None:
    """A name stands for one manoeuvre within a kind of vehicle."""
    for kind in (AIR, ARM, WATER, CROSSING, DROP):
        names = [m.name for m in manoeuvres(kind)]
        assert len(set(names)) == len(names)


@pytest.mark.parametrize("manoeuvre", [m for m in LIBRARY if AIR in m.kinds], ids=lambda m: m.name)
def test_references_stay_in_the_room(manoeuvre: object) -> None:
    """What is asked for lies inside the box, even in a low room."""
    from seals.sysid.experiment_design.manoeuvres import Manoeuvre

    assert isinstance(manoeuvre, Manoeuvre)
    assert manoeuvre.path is not None
    low = replace(SCENE, high=1.9)
    for scene in (SCENE, low):
        place = manoeuvre.path(scene, np.arange(0.0, manoeuvre.seconds, 0.02)).place
        assert place[:, 2].min() >= scene.low
        assert place[:, 2].max() <= scene.high
        assert np.abs(place[:, :2]).max() <= scene.reach


def test_confidence_grows_with_separation() -> None:
    """No separation leaves a guess, a large one makes sure, noise keeps it below certainty."""
    values = [
        confidence([Contest(truth="a", rival="b", separation=s, gap=s)]) for s in (0.0, 4.0, 60.0)
    ]
    assert values[0] == pytest.approx(0.5)
    assert values[0] < values[1] < values[2]
    assert values[1] < 0.9 < values[2]


def test_a_silent_effect_has_no_chance() -> None:
    """A gain below the threshold of the diagnosis is not found; one far above it is."""
    quiet = Contest(truth="a", rival="nothing", separation=2.0, gap=0.0)
    loud = Contest(truth="a", rival="nothing", separation=200.0, gap=190.0)
    assert chance(quiet) < 0.01
    assert chance(loud) > 0.99
