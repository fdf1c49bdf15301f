"""Scene of the particle water without its engine: waves, paddles, basins, surface, beach, wind."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seals.environment.ground import Solid
from seals.environment.linear_waves import flap_gain, jonswap, piston_gain, wavenumber
from seals.environment.settings import ObstacleSettings
from seals.errors import ConfigError, PhysicsError
from seals.frames import matrix_of, quaternion_of_rpy
from seals.plugins.fluids.coupling import HeightField, clear_of, refuse_large
from seals.plugins.fluids.sampling import Samples
from seals.plugins.fluids.tank.basin import (
    Basin,
    build_basin,
    walls_of,
)
from seals.plugins.fluids.tank.fluid import (
    Paddle,
    PaddlePlate,
    apply_beach,
    apply_wind,
    sample_solid,
)
from seals.plugins.fluids.tank.settings import (
    BeachSettings,
    Maker,
    MakerSettings,
    SeaState,
    WindSettings,
)

G = 9.81


def basin(**changes: object) -> Basin:
    """Return a basin of 1 x 0.5 x 0.4 m."""
    values: dict[str, object] = {
        "spacing": 0.05,
        "size": (1.0, 0.5, 0.4),
        "centre": (0.2, -0.1),
        "level": 0.3,
        "bottom": None,
        "freeboard": 0.2,
        "behind": 0.0,
        "open_sides": (),
    }
    return build_basin(**{**values, **changes})  # type: ignore[arg-type]


@pytest.mark.parametrize("depth", [0.05, 0.5, 5.0, 500.0, math.inf])
def test_wavenumbers_satisfy_dispersion(depth: float) -> None:
    """The wave number solves omega^2 = g k tanh(k h) from shallow to deep water."""
    for omega in (0.3, 2.0, 9.0):
        k = wavenumber(omega, depth, G)
        assert G * k * math.tanh(min(k * depth, 700.0)) == pytest.approx(omega**2, rel=1e-10)


def test_makers_meet_their_limits() -> None:
    """In shallow water a piston lifts kh of its stroke, a flap half; in deep water both two."""
    assert piston_gain(1e-3) == pytest.approx(1e-3, rel=1e-3)
    assert flap_gain(1e-2) == pytest.approx(0.5e-2, rel=1e-2)
    assert piston_gain(400.0) == pytest.approx(2.0)
    assert flap_gain(299.9) == pytest.approx(flap_gain(300.1), rel=1e-3)


def test_an_irregular_sea_has_its_height_and_peak() -> None:
    """The spectrum's variance is that of the significant height; most of it is near the peak."""
    omega, amplitude = jonswap(0.2, 2.0, components=400)
    assert 4.0 * math.sqrt(0.5 * (amplitude**2).sum()) == pytest.approx(0.2)
    peak = 2.0 * math.pi / 2.0
    counts, edges = np.histogram(omega, bins=60, range=(0.5 * peak, 2.5 * peak))
    assert edges[int(np.argmax(counts))] == pytest.approx(peak, rel=0.08)


@pytest.mark.parametrize("sea", list(SeaState))
@pytest.mark.parametrize("kind", [Maker.piston, Maker.flap])
def test_paddles_move_smoothly(sea: SeaState, kind: Maker) -> None:
    """A paddle starts at rest, its speed is the rate of its place, it keeps within its travel."""
    if (sea, kind) == (SeaState.solitary, Maker.flap):
        with pytest.raises(ConfigError, match="solitary"):
            MakerSettings(kind=kind, sea=sea)
        return
    paddle = Paddle(MakerSettings(kind=kind, sea=sea, height=0.06, start=0.3), depth=0.5, gravity=G)
    assert paddle.stroke(0.3) == (0.0, 0.0)
    assert abs(paddle.stroke(0.301).place) < 0.05 * paddle.travel
    times = np.linspace(0.35, 12.0, 400)
    rate = [(paddle.stroke(t + 1e-6).place - paddle.stroke(t - 1e-6).place) / 2e-6 for t in times]
    assert [paddle.stroke(t).speed for t in times] == pytest.approx(rate, abs=1e-6)
    assert max(abs(paddle.stroke(t).place) for t in times) <= paddle.travel


def test_a_regular_paddle_has_the_stroke_of_theory() -> None:
    """Twice the amplitude of the motion is the wave height over the gain."""
    paddle = Paddle(MakerSettings(kind=Maker.piston, height=0.08, period=1.2), depth=0.5, gravity=G)
    k = wavenumber(2 * math.pi / 1.2, 0.5, G)
    swing = [paddle.stroke(t).place for t in np.linspace(5.0, 8.0, 2000)]
    assert np.ptp(swing) == pytest.approx(0.08 / piston_gain(k * 0.5), rel=1e-4)


def test_a_solitary_paddle_displaces_the_crest() -> None:
    """The water that the paddle pushes is the crest's: travel times depth is the area of sech^2."""
    h, high = 0.5, 0.15
    maker = MakerSettings(kind=Maker.piston, sea=SeaState.solitary, height=high)
    paddle = Paddle(maker, depth=h, gravity=G)
    area = 2.0 * high / math.sqrt(0.75 * high / h**3)
    assert paddle.stroke(100.0).place * h == pytest.approx(area, rel=2e-3)
    assert paddle.stroke(100.0).place == pytest.approx(paddle.travel, rel=2e-3)


@pytest.mark.parametrize(
    ("maker", "words"),
    [
        (MakerSettings(kind=Maker.piston, height=0.5, period=1.0), "steepness 1.0.*up to 0.3"),
        (MakerSettings(kind=Maker.piston, sea=SeaState.solitary, height=0.4), "0.80 of the depth"),
    ],
)
def test_impossible_waves_are_refused(maker: MakerSettings, words: str) -> None:
    """Waves beyond the theory are refused with the bound."""
    with pytest.raises(ConfigError, match=f"(?s){words}"):
        Paddle(maker, depth=0.5, gravity=G)


def test_a_flap_turns_about_its_foot() -> None:
    """The flap's point at the still surface stands where the stroke says and moves as it says."""
    maker = MakerSettings(kind=Maker.flap, height=0.06)
    paddle, foot = Paddle(maker, depth=0.5, gravity=G), np.array([1.0, 2.0, -0.5])
    t = 3.3
    board = PaddlePlate.of(Maker.flap, paddle.stroke(t), foot, 0.5)
    top = board.rotation @ np.array([0.0, 0.0, 0.5])
    assert top[0] / top[2] * 0.5 == pytest.approx(paddle.stroke(t).place)
    later = PaddlePlate.of(Maker.flap, paddle.stroke(t + 1e-6), foot, 0.5)
    rate = (later.rotation - board.rotation) @ np.array([0.0, 0.0, 0.5]) / 1e-6
    assert np.cross(board.spin, top) == pytest.approx(rate, abs=1e-5)


def test_basins_meet_their_depth() -> None:
    """The spacing gives way so that the depth is whole; the lattice fills the box."""
    tank = basin(spacing=0.065)
    assert tank.depth == pytest.approx(0.4)
    assert tank.spacing == pytest.approx(0.4 / 6)
    lattice = tank.lattice()
    assert len(lattice) * tank.spacing**3 == pytest.approx(np.prod(tank.upper - tank.lower))
    assert lattice[:, 2].max() == pytest.approx(0.3 - 0.5 * tank.spacing)
    assert basin(bottom=-0.3).depth == pytest.approx(0.6)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"spacing": 0.2}, "length of 1 m is too small for a spacing of 0.2 m"),
        ({"bottom": 0.4}, "depth of -0.1 m"),
        ({"open_sides": ("top",)}, "no side 'top'"),
    ],
)
def test_bad_basins_are_refused(changes: dict[str, object], words: str) -> None:
    """A basin too small for its particles, and unknown sides, are refused in words."""
    with pytest.raises(ConfigError, match=words):
        basin(**changes)


def test_too_many_particles_are_refused_before_memory_is() -> None:
    """More particles than allowed are refused with the numbers."""
    refuse_large(10, 10, 20)
    with pytest.raises(PhysicsError, match="holds 1,000,000 particles and 5 boundary"):
        refuse_large(1_000_000, 5, 1000)


def test_walls_are_solids_where_there_are_walls() -> None:
    """Bodies touch the floor and closed sides; open sides and a wave maker's are left out."""
    assert set(walls_of(basin())) == {
        "basin_floor",
        *(f"basin_{s}" for s in ("x_low", "x_high", "y_low", "y_high")),
    }
    fewer = walls_of(basin(open_sides=("y_high",), behind=0.3))
    assert set(fewer) == {"basin_floor", "basin_x_high", "basin_y_low"}
    floor: ObstacleSettings = fewer["basin_floor"]
    assert floor.position[2] + 0.5 * floor.size[2] == pytest.approx(-0.1)


def test_water_keeps_clear_of_bodies() -> None:
    """Places inside a body's samples are left out; a sample of little volume takes little room."""
    places = basin().lattice()
    middle = places[len(places) // 2]
    one = Samples(middle[None], np.array([0.05**3]))
    assert len(places) - len(clear_of(places, one, 0.05)) == 1
    small = Samples(middle[None] + 0.02, np.array([1e-3 * 0.05**3]))
    assert len(clear_of(places, small, 0.05)) == len(places)


def test_heights_of_flat_and_sloping_water() -> None:
    """The surface of lattice water is exact, drops do not lift it, a slope is followed."""
    tank = basin(spacing=0.025)
    field = HeightField(tank.lower, tank.upper, tank.spacing, 0.0)
    particles = tank.lattice()
    spray = np.array([[0.2, -0.1, 0.45], [0.21, -0.1, 0.42]])
    field.update(np.concatenate([particles, spray]), np.zeros((0, 3)))
    probe = np.random.default_rng(1).uniform(-0.2, 0.2, (50, 2)) + np.array([0.2, -0.1])
    assert np.abs(field.at(probe) - 0.3).max() < 0.03
    field.update(particles, np.zeros((0, 3)))
    assert field.at(probe) == pytest.approx(np.full(50, 0.3))
    surface = 0.2 + 0.1 * particles[:, 0]
    field.update(particles[particles[:, 2] < surface], np.zeros((0, 3)))
    assert np.abs(field.at(probe) - (0.2 + 0.1 * probe[:, 0])).max() < 0.6 * tank.spacing


def test_a_body_is_no_hole_in_the_surface() -> None:
    """Where a floating body takes the water's place, the surface is that around it."""
    tank = basin(spacing=0.025)
    particles = tank.lattice()
    hull = np.abs(particles - [0.2, -0.1, 0.28]).max(axis=1) < 0.08
    body = particles[hull]
    body = np.concatenate([body, body + np.array([0.0, 0.0, 0.1])])
    field = HeightField(tank.lower, tank.upper, tank.spacing, 0.0)
    field.update(particles[~hull], body)
    assert field.at(np.array([[0.2, -0.1]]))[0] == pytest.approx(0.3, abs=1e-9)
    # one that hangs in the air above the water hides nothing
    field.update(particles, body + np.array([0.0, 0.0, 0.4]))
    assert field.at(np.array([[0.2, -0.1]]))[0] == pytest.approx(0.3, abs=1e-9)


def test_a_beach_calms_the_same_at_any_step() -> None:
    """A sponge acts at its end only, vertical motion twice as fast, alike in one step or ten."""
    tank, beach = basin(), BeachSettings(length=0.4, rate=5.0)
    places, start = tank.lattice(), np.ones((len(tank.lattice()), 3))
    one = apply_beach(beach, tank, places, start, 0.1)
    ten = start
    for _ in range(10):
        ten = apply_beach(beach, tank, places, ten, 0.01)
    assert one == pytest.approx(ten)
    clear = places[:, 0] < tank.upper[0] - 0.4
    assert (one[clear] == 1.0).all()
    assert one[:, 2] == pytest.approx(one[:, 0] ** 2)


def test_wind_gives_stress_times_area() -> None:
    """The momentum that the wind gives in a step is stress times area times step."""
    tank, wind = basin(), WindSettings(stress_x=0.2, stress_y=-0.1)
    places = tank.lattice()
    over = np.full(len(places), 0.3)
    moved = apply_wind(wind, tank, over, places, np.zeros_like(places), 0.01 / 1000.0)
    given = 1000.0 * tank.spacing**3 * moved.sum(axis=0)
    assert given == pytest.approx([0.2 * 0.5 * 0.01, -0.1 * 0.5 * 0.01, 0.0])
    assert (moved[places[:, 2] < 0.25] == 0.0).all()


def test_solids_are_sampled_where_the_basin_is() -> None:
    """A huge slope gives samples inside the basin only, all within two layers of its face."""
    turn = quaternion_of_rpy(np.array([[0.0, -0.3, 0.0]]))[0]
    slope = Solid("slope", "box", (80.0, 60.0, 0.5), np.array([0.2, 0.0, -0.2]), turn, 0.5, 0.0)
    tank = basin()
    found = sample_solid(slope, 0.05, tank.lower, tank.upper)
    assert 100 < len(found.points) < 2000
    assert ((found.points > tank.lower) & (found.points < tank.upper)).all()
    depth = ((found.points - slope.position) @ matrix_of(turn[None])[0])[:, 2]
    assert depth.max() == pytest.approx(0.225)
    assert depth.min() > 0.25 - 0.11
