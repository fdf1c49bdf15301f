"""Tether of segments: catenary, cable in a current, string, convergence, engines, checkpoints."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from seals.arrays import Floats
from seals.effects.cable import Cable, advanced, inner_of, memory_size_of, pulled
from seals.effects.scene import Fluid
from seals.errors import ConfigError
from seals.plugins.effects.tether import Tether
from seals.run import build_world
from seals.run.build import run_settings
from seals.run.simulation import simulate

GRAVITY, WATER = 9.81, 1000.0


class Sea:
    """Water of one velocity everywhere, its surface far above."""

    def __init__(
        self, velocity: Sequence[float] = (0.0, 0.0, 0.0), bottom: float | None = None
    ) -> None:
        self.velocity, self.bottom = np.array(velocity), bottom

    def fluid(self, places: Floats, medium: Any) -> Fluid:
        """Return the water at places."""
        none = np.zeros_like(places)
        density = np.array([[[WATER]]]), np.array([[[1.2]]])
        return Fluid(
            none[:, :, :1] + 100.0, none + self.velocity, density[0], none, density[1], self.bottom
        )


class Still:
    """The medium at the link: a cable asks it for gravity alone."""

    gravity = np.array([[GRAVITY]])


def hung(
    tether: Tether, end: Sequence[float], sea: Sea, *, steps: int = 3, step: float = 0.01
) -> tuple[Floats, Floats, Floats]:
    """Return pull on the end at rest [N], places of the nodes about the anchor [m], memory."""
    names = (
        *("length", "stiffness", "diameter", "line_density"),
        *("drag_across", "drag_along", "added"),
    )
    params: dict[str, Any] = {n: np.array([[getattr(tether, n)]]) for n in names}
    params["anchor"] = np.array([[tether.anchor_x, tether.anchor_y, tether.anchor_z]])
    memory = np.zeros((1, tether.memory_size))
    there = np.array([end], dtype=float), np.zeros((1, 3))
    force = np.zeros((1, 3))
    for _ in range(steps):
        force, memory = pulled(there, Still(), step, memory, params, sea)  # type: ignore[arg-type]
    inner = (tether.memory_size - 1) // 2
    return force[0], memory[0, 1 : 1 + inner].reshape(-1, 3), memory


def weight_of(tether: Tether) -> float:
    """Weight of the cable in water by its length [N/m]."""
    displaced = WATER * np.pi * tether.diameter**2 / 4.0
    return float((tether.line_density - displaced) * GRAVITY)


@pytest.mark.parametrize(("segments", "error"), [(10, 4e-3), (20, 1.1e-3), (40, 3e-4)])
def test_a_cable_in_still_water_hangs_in_a_catenary(segments: int, error: float) -> None:
    """Ends at one height, 8 m apart, 10 m of cable: z = a cosh(x / a), tension w y at the end.

    The error of the horizontal tension falls with the square of the segments: 3.1e-3, 8e-4, ...
    """
    tether = Tether(length=10.0, stiffness=2e5, segments=segments, line_density=0.2)
    force, places, _ = hung(tether, [8.0, 0.0, 0.0], Sea())
    w = weight_of(tether)
    a = brentq(lambda a: 2.0 * a * np.sinh(4.0 / a) - 10.0, 0.5, 50.0)
    assert force[0] == pytest.approx(-w * a, rel=error)
    assert force[2] == pytest.approx(-w * 5.0, rel=1e-4)
    assert np.linalg.norm(force) == pytest.approx(w * a * np.cosh(4.0 / a), rel=error)
    line = a * (np.cosh((places[:, 0] - 4.0) / a) - np.cosh(4.0 / a))
    assert places[:, 2] == pytest.approx(line, abs=2.0 / segments**2 + 1e-3)


def test_the_error_falls_with_the_square_of_the_segments() -> None:
    """Twice the segments, a quarter of the error of the end tension against the catenary."""
    a = brentq(lambda a: 2.0 * a * np.sinh(4.0 / a) - 10.0, 0.5, 50.0)
    found = []
    for segments in (8, 16, 32):
        tether = Tether(length=10.0, stiffness=1e6, segments=segments, line_density=0.2)
        force, _, _ = hung(tether, [8.0, 0.0, 0.0], Sea())
        found.append(abs(force[0] + weight_of(tether) * a))
    assert found[0] / found[1] == pytest.approx(4.0, rel=0.15)
    assert found[1] / found[2] == pytest.approx(4.0, rel=0.15)


@pytest.mark.parametrize("segments", [4, 30])
def test_without_a_step_the_cable_hangs_at_rest(segments: int) -> None:
    """Along a log there is no step: a catenary of few segments, memory as it was."""
    tether = Tether(length=10.0, stiffness=2e5, segments=segments, line_density=0.2)
    force, _, memory = hung(tether, [8.0, 0.0, 0.0], Sea(), steps=1, step=0.0)
    a = brentq(lambda a: 2.0 * a * np.sinh(4.0 / a) - 10.0, 0.5, 50.0)
    assert force[0] == pytest.approx(-weight_of(tether) * a, rel=0.03)
    assert not memory.any()


def in_current(tether: Tether, speed: float, tension: float, angle: float) -> tuple[Floats, Floats]:
    """Integrate the cable in a current along x from its anchor.

    T' = w sin(p) - f_t, T p' = w cos(p) - f_n, with p the angle of the cable over the horizontal
    and f the drag along it and across it by length; w its weight in water.

    Args:
        tether: material and length.
        speed: of the water [m/s].
        tension: at the anchor [N].
        angle: p there [rad].

    Returns:
        Place of the end (x, z) [m], and the force of the cable on what holds it there [N].
    """
    half, w = 0.5 * WATER * tether.diameter, weight_of(tether)

    def slopes(_: float, state: Floats) -> list[float]:
        t, p, _x, _z = state
        along, across = speed * np.cos(p), -speed * np.sin(p)
        f_t = half * np.pi * tether.drag_along * abs(along) * along
        f_n = half * tether.drag_across * abs(across) * across
        # equilibrium of an element: d(T t)/ds + (drag) - w z = 0
        return [w * np.sin(p) - f_t, (w * np.cos(p) - f_n) / t, np.cos(p), np.sin(p)]

    found = solve_ivp(slopes, (0.0, tether.length), [tension, angle, 0.0, 0.0], rtol=1e-10)
    t, p, x, z = found.y[:, -1]
    return np.array([x, z]), -t * np.array([np.cos(p), np.sin(p)])


@pytest.mark.parametrize(
    ("speed", "tension", "angle"), [(0.5, 20.0, -1.2), (0.8, 40.0, -1.4), (0.3, 6.0, 0.9)]
)
def test_a_cable_in_a_current_takes_the_shape_of_the_cable_equations(
    speed: float, tension: float, angle: float
) -> None:
    """The end is held where the integrated equations have it: the same pull there."""
    made = {"length": 20.0, "stiffness": 1e6, "line_density": 0.06, "segments": 40}
    tether = Tether(**made, anchor_x=3.0, anchor_z=-2.0)  # type: ignore[arg-type]
    place, pull = in_current(tether, speed, tension, angle)
    end = [3.0 + place[0], 0.0, -2.0 + place[1]]
    force, _, _ = hung(tether, end, Sea((speed, 0.0, 0.0)))
    assert force[[0, 2]] == pytest.approx(pull, abs=2e-3 * np.linalg.norm(pull))
    assert force[1] == pytest.approx(0.0, abs=1e-9)


def test_the_side_pull_grows_with_the_length_of_the_cable() -> None:
    """A neutral cable across a current: the drag of half of it pulls each end, sag 5 % or so.

    By the parabola of a shallow cable its chord takes q c / 2 at each end, q = rho d C_n U^2 / 2.
    """
    pulls = []
    for chord in (10.0, 20.0, 40.0):
        neutral = WATER * np.pi * 0.0076**2 / 4.0
        tether = Tether(
            length=1.005 * chord,
            stiffness=1e6,
            segments=30,
            line_density=neutral,
            drag_along=0.0,
        )
        force, _, _ = hung(tether, [0.0, 0.0, -chord], Sea((0.4, 0.0, 0.0)))
        pulls.append(force[0] / chord)
    half = 0.5 * 0.5 * WATER * 0.0076 * 1.2 * 0.4**2
    assert pulls == pytest.approx([half] * 3, rel=0.02)


def test_a_taut_cable_swings_as_a_string() -> None:
    """Lowest frequency sqrt(T / mu) / (2 L) of a string between two points, in a vacuum."""
    length, tension, line, n = 10.0, 50.0, 0.2, 30
    stiffness = 1e5
    column = np.array([[1.0]])
    cable = Cable(
        *(np.array([[length + tension / stiffness, 0.0, 0.0]]), np.zeros((1, 3))),
        *(x * column for x in (length, stiffness, 0.0076, line, 0.0, 0.0, 0.0, 0.0)),
    )
    vacuum = Fluid(None, *(np.zeros((1, n, 3)), np.zeros((1, 1, 1))) * 2, None)
    place, speed, _ = inner_of(np.zeros((1, memory_size_of(n))), cable)
    s = np.arange(1, n) / n
    place = place + 0.001 * np.sin(np.pi * s)[None, :, None] * np.array([0.0, 0.0, 1.0])
    step, heights, energy = 5e-4, [], []
    for _ in range(2500):
        place, speed, _ = advanced(cable, place, speed, vacuum, np.zeros((1, 1)), step)
        heights.append(float(place[0, n // 2 - 1, 2]))
        nodes = np.concatenate([np.zeros((1, 3)), place[0], cable.end])
        stretch = np.linalg.norm(np.diff(nodes, axis=0), axis=1) - length / n
        stored = 0.5 * stiffness * n * np.sum(stretch**2)
        energy.append(stored + 0.5 * line * length / n * np.sum(speed**2))
    signs = np.flatnonzero(np.diff(np.sign(heights)))
    found = 0.5 / (np.diff(signs).mean() * step)
    whole = length + tension / stiffness
    speed_of_waves = np.sqrt(tension * whole / (line * length))
    assert found == pytest.approx(speed_of_waves / (2.0 * whole), rel=3e-3)
    # implicit steps lose energy and never gain any
    assert np.all(np.diff(energy) <= 1e-12 * energy[0])


def test_on_the_bottom_a_cable_lies_and_the_rest_is_a_catenary() -> None:
    """The end is lifted 3 m above the bottom that the anchor lies on."""
    tether = Tether(length=10.0, stiffness=1e5, segments=40, line_density=0.2)
    force, places, _ = hung(tether, [9.0, 0.0, 3.0], Sea(bottom=0.0), steps=200)
    w = weight_of(tether)
    lying = places[:, 2] < 0.01
    assert 5 < lying.sum() < 35
    # what hangs is as long as its weight pulls down: V = w l, and h = sqrt(a^2 + l^2) - a
    hanging = -force[2] / w
    a = -force[0] / w
    assert np.hypot(a, hanging) - a == pytest.approx(3.0, abs=0.03)
    reach = a * np.arcsinh(hanging / a)
    assert tether.length - hanging == pytest.approx(9.0 - reach, abs=0.03)


def test_a_chain_without_length_or_of_one_segment_is_refused() -> None:
    """In two lines that say what is allowed."""
    with pytest.raises(ConfigError, match=r"length=0 m.*\nAllowed: both above zero"):
        Tether(segments=10, stiffness=100.0)
    with pytest.raises(ConfigError, match=r"segments=1 .*\nAllowed: 0 .* or 2 and more"):
        Tether(segments=1, length=5.0, stiffness=100.0)


ROV = (
    *("robot=rov", "water=fossen", "guide=hover", "initial.position=[0,0,-5]"),
    "+effect@effects.tether=tether",
    *("effects.tether.length=7", "effects.tether.stiffness=500", "effects.tether.segments=8"),
    *("+effect@effects.current=current", "effects.current.velocity_y=0.3"),
)


def flown(*words: str) -> Any:
    """Run the ROV with its tether, without machine code."""
    return simulate(run_settings([*ROV, "backend.compiled=false", *words]))


@pytest.mark.parametrize("backend", ["pybullet", "mujoco"])
def test_a_tethered_vehicle_goes_on_from_a_snapshot_as_before(backend: str) -> None:
    """Both engines; the places of the nodes are part of the state."""
    settings = run_settings([*ROV, f"backend={backend}", "backend.compiled=false"])
    with contextlib.closing(build_world(settings)) as world:
        for _ in range(50):
            world.step()
        kept = world.snapshot()
        actor = world.actors["robot"]
        ends = []
        for _ in range(2):
            world.restore(kept)
            for _ in range(50):
                world.step()
            ends.append((actor.body.read().position.copy(), actor.memory["tether"].copy()))
        assert np.array_equal(ends[0][0], ends[1][0])
        assert np.array_equal(ends[0][1], ends[1][1])
        pull = actor.ledger.of("tether")[-1, 0, :3]
    assert 0.1 < np.linalg.norm(pull) < 20.0


def test_both_engines_agree_about_a_tethered_vehicle() -> None:
    """Half a second of station keeping: to a tenth of a millimetre."""
    found = [
        flown(f"backend={name}", "time.duration=0.5").log.channel("position")[-1]
        for name in ("pybullet", "mujoco")
    ]
    assert found[0] == pytest.approx(found[1], abs=1e-4)


def test_with_machine_code_asked_for_the_chain_is_refused_in_words() -> None:
    """``true`` refuses, and says which effect has no machine code."""
    with pytest.raises(ConfigError, match=r"effects\.tether asks for its scene"):
        simulate(run_settings([*ROV, "backend=mujoco", "backend.compiled=true"]))
