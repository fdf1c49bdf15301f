"""Quadratic drag of spheres, slender hulls and boxes at any attitude."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from seals.effects import MediumKind, bind_effects
from seals.effects.drag_form import DragForm, HullAxis
from seals.frames import matrix_of, quaternion_of_rpy
from seals.motion import Inputs, Medium, Motion
from seals.plugins.effects.quadratic_drag import DragQuadratic

if TYPE_CHECKING:
    from tests.verification.conftest import Bench

Floats = NDArray[np.float64]

G = 9.81
ATTITUDES = (
    (0.0, 0.0, 0.0),
    (np.pi / 4.0, 0.0, 0.0),
    (np.pi / 4.0, np.arctan(np.sqrt(0.5)), 0.3),
    (2.0, -0.7, 1.1),
)
"""Upright, on an edge, on a corner, and any."""
EVEN = {f"coefficient_{axis}": 1.84 for axis in "xyz"}


def wrench(drag: DragQuadratic, velocity: Any, rate: Any = 0.0, like: Any = np) -> list[Floats]:
    """Return force and torque of bodies in water at rest, shape (N, 3) each."""
    v = np.atleast_2d(np.asarray(velocity, dtype=float))
    w = np.broadcast_to(np.asarray(rate, dtype=float), v.shape).copy()
    params = bind_effects({"drag": drag}, ["base"]).bound[0].params
    zero, one = np.zeros_like(v), np.ones((len(v), 1))
    arrays = [like.asarray(x) for x in (zero, v, w, one, 0.0 * one)]
    still, v, w, one, none = arrays
    motion = Motion(none[:1], still, none, still, v, w, None)  # type: ignore[arg-type]
    around = Medium(one, still, still, one, one, one, none, still, still, none, one[:1])
    given = {key: like.asarray(value) for key, value in params.items()}
    found, _ = drag.loads(motion, around, Inputs(0.004, none), none, given)
    return [np.zeros_like(zero) if part is None else np.asarray(part) for part in found]


@pytest.mark.parametrize("rpy", ATTITUDES)
def test_a_turned_sphere_feels_the_same_drag(rpy: Any) -> None:
    """F = -c abs(v) v in world axes, whatever the attitude."""
    velocity = np.array([1.3, -0.4, 2.1])
    turn = matrix_of(quaternion_of_rpy(np.array([rpy])))[0]
    force, torque = wrench(DragQuadratic(form=DragForm.isotropic, **EVEN), turn.T @ velocity)
    # rounding of a dozen operations
    expected = -1.84 * np.linalg.norm(velocity) * velocity
    assert_allclose(turn @ force[0], expected, rtol=1e-13)
    assert not torque.any()


@pytest.mark.thorough
@pytest.mark.parametrize("rpy", ATTITUDES)
@pytest.mark.parametrize("engine", ["world", "twin"])
def test_a_turned_sphere_sinks_alike(bench: Bench, engine: str, rpy: Any) -> None:
    """Speed v = vt tanh(g t / vt) with vt = sqrt(m g / c), and there is no drift."""
    mass, c, step = 0.4, 0.8, 0.004
    given = dict.fromkeys(EVEN, c)
    drag = DragQuadratic(form=DragForm.isotropic, medium=MediumKind.air, **given)
    body = bench.body(mass, (1e-3,) * 3)
    run = bench.run(engine, bench.settings(body, {"drag": drag}, step=step, duration=2.0, rpy=rpy))
    terminal = np.sqrt(mass * G / c)
    # v(n) of the world misses (rate h)^2 of the speed, the twin's is of fourth order: see
    # test_terminal_velocity.py
    bound = (2.0 * G / terminal * step) ** (2 if engine == "world" else 4) * terminal + 1e-12
    expected = -terminal * np.tanh(G * run.time / terminal)
    assert np.abs(run.velocity[:, 2] - expected).max() < bound
    assert np.abs(run.velocity[:, :2]).max() < 1e-12
    # after 2 s exp(-4 g / vt) = 2e-8 is left of the way there, and of its errors
    assert -run.velocity[-1, 2] == pytest.approx(terminal, rel=1e-6)


def test_the_speed_along_one_axis_is_the_same_in_every_form() -> None:
    """Without turning, motion along a body axis feels c v^2."""
    c = np.array([3.0, 5.0, 7.0])
    given: Any = {f"coefficient_{axis}": value for axis, value in zip("xyz", c, strict=True)}
    size: Any = {"size_x": 0.3, "size_y": 0.2, "size_z": 0.1}
    for form in DragForm:
        force, torque = wrench(DragQuadratic(form=form, **given, **size), 2.0 * np.eye(3))
        assert_allclose(force, -4.0 * np.diag(c), rtol=1e-13, atol=1e-15)
        assert_allclose(torque, 0.0, atol=1e-14)


def test_a_drag_that_acts_spread_brakes_the_rotation() -> None:
    """Torque of random twists is that of the corners of a box, while none of them turns back."""
    rng = np.random.default_rng(6)
    c, half = np.array([3.0, 5.0, 7.0]), np.array([0.4, 0.2, 0.1])
    v = rng.choice([-1.0, 1.0], (50, 3)) * rng.uniform(1.0, 3.0, (50, 3))
    w = rng.uniform(-1.0, 1.0, (50, 3))
    given: Any = {f"coefficient_{axis}": value for axis, value in zip("xyz", c, strict=True)}
    given |= {f"spread_{axis}": size**2 for axis, size in zip("xyz", half, strict=True)}
    force, torque = wrench(DragQuadratic(**given), v, w)
    corners = half * np.stack(np.meshgrid(*3 * [[-1.0, 1.0]]), axis=-1).reshape(-1, 3)
    flow = v[:, None] + np.cross(w[:, None], corners)
    assert np.all(np.sign(flow) == np.sign(v)[:, None])
    each = -c / 8.0 * abs(flow) * flow
    assert_allclose(torque, np.cross(corners, each).sum(axis=1), rtol=1e-12, atol=1e-14)
    # the rotation adds to the force in second order
    assert_allclose(force, -c * abs(v) * v, rtol=1e-13)
    assert np.all((torque * w).sum(axis=1) < 0.0)
    bare = {name: value for name, value in given.items() if name.startswith("c")}
    assert np.all(wrench(DragQuadratic(**bare), v, w)[1] == 0.0)


def strips(c: Floats, along: int, length: float, v: Floats, w: Floats) -> list[Floats]:
    """Cross-flow force and moment as a sum over 20,000 strips about the centre of the hull."""
    place = (np.arange(20000) + 0.5) / 20000 * length - 0.5 * length
    force, moment = np.zeros(3), np.zeros(3)
    axis = np.eye(3)[along]
    flow = v + np.cross(w, place[:, None] * axis)
    flow[:, along] = 0.0
    each = -c / 20000 * np.linalg.norm(flow, axis=1)[:, None] * flow
    force += each.sum(axis=0)
    moment += np.cross(place[:, None] * axis, each).sum(axis=0)
    force[along] -= c[along] * abs(v[along]) * v[along]
    return [force, moment]


@pytest.mark.parametrize("along", [0, 2])
def test_cross_flow_is_the_integral_over_the_hull(along: int) -> None:
    """Force and moment of random twists agree with a sum over strips within 1e-3 of their size."""
    rng, length = np.random.default_rng(3), 1.6
    c = np.roll([7.5, 90.0, 90.0], along)
    drag = DragQuadratic(
        form=DragForm.cross_flow,
        axis=list(HullAxis)[along],
        coefficient_x=c[0],
        coefficient_y=c[1],
        coefficient_z=c[2],
        **{f"size_{'xyz'[along]}": length},
    )
    for _ in range(20):
        v, w = rng.standard_normal(3), rng.standard_normal(3) * rng.choice([0.3, 1.0, 3.0])
        force, torque = wrench(drag, v, w)
        # what the fastest strip would feel on the whole hull
        top = 90.0 * (np.linalg.norm(v) + 0.5 * length * np.linalg.norm(w)) ** 2
        expected = strips(c, along, length, v, w)
        assert_allclose(force[0], expected[0], atol=1e-3 * top)
        assert_allclose(torque[0], expected[1], atol=1e-3 * 0.5 * length * top)


@pytest.mark.parametrize("sway", [0.0, 0.2, 0.9])
def test_a_yawing_hull_in_sway_has_the_closed_form(sway: float) -> None:
    """With u = v + r x, N = -(c/L) int abs(u) u x dx and Y likewise have antiderivatives."""
    c, length, yaw = 90.0, 1.6, 0.8
    drag = DragQuadratic(form=DragForm.cross_flow, coefficient_y=c, size_x=length)
    force, torque = wrench(drag, [0.0, sway, 0.0], [0.0, 0.0, yaw])
    ends = sway + yaw * 0.5 * length * np.array([-1.0, 1.0])
    # int abs(u) u dx = abs(u)^3 / (3 r)
    # int abs(u) u x dx = (u^3 abs(u) / 4 - v abs(u)^3 / 3) / r^2
    side = -c / length * np.diff(np.abs(ends) ** 3)[0] / (3.0 * yaw)
    turning = ends**3 * np.abs(ends) / 4.0 - sway * np.abs(ends) ** 3 / 3.0
    moment = -c / length * np.diff(turning)[0] / yaw**2
    size = c * np.abs(ends).max() ** 2
    assert force[0, 1] == pytest.approx(side, abs=1e-3 * size)
    assert torque[0, 2] == pytest.approx(moment, rel=1e-3)
    assert force[0, 0] == force[0, 2] == torque[0, 0] == torque[0, 1] == 0.0


def test_a_hull_in_pure_yaw_feels_c_length_cubed_over_32() -> None:
    """N = -c L^3 abs(r) r / 32, and no side force."""
    drag = DragQuadratic(form=DragForm.cross_flow, coefficient_y=90.0, size_x=1.6)
    force, torque = wrench(drag, np.zeros(3), [0.0, 0.0, -0.7])
    assert torque[0, 2] == pytest.approx(90.0 * 1.6**3 * 0.49 / 32.0, rel=1e-12)
    assert abs(force[0, 1]) < 1e-13


def test_a_hull_rolled_about_its_axis_feels_the_same_cross_flow() -> None:
    """A round hull knows no direction about its axis: F turns with the flow."""
    drag = DragQuadratic(
        form=DragForm.cross_flow, coefficient_x=7.5, coefficient_y=90.0, coefficient_z=90.0
    )
    angles = np.linspace(0.0, np.pi, 7)
    flow = np.stack((0.0 * angles, np.cos(angles), np.sin(angles)), axis=1)
    force, _ = wrench(drag, 1.5 * flow)
    assert_allclose(force, -90.0 * 1.5**2 * flow, rtol=1e-13, atol=1e-13)


def test_a_cube_on_edge_shows_two_faces() -> None:
    """Each face feels c abs(v) v_n: 4 N s^2/m^2 at 2 m/s and 45 degrees give 8 sqrt(2) N a face.

    Face on 16 N; on edge the two forces add up to 16 N against the motion, and on a corner, too.
    """
    drag = DragQuadratic(
        form=DragForm.faces,
        **dict.fromkeys(EVEN, 4.0),
        **dict.fromkeys(("size_x", "size_y", "size_z"), 0.1),
    )
    half, third = np.sqrt(0.5), np.sqrt(1.0 / 3.0)
    ways = np.array([[1.0, 0, 0], [half, half, 0], [-half, 0, half], [third, third, -third]])
    force, torque = wrench(drag, 2.0 * ways)
    assert_allclose(np.abs(force[1, :2]), 8.0 * np.sqrt(2.0), rtol=1e-13)
    assert_allclose(force, -16.0 * ways, rtol=1e-13, atol=1e-13)
    assert_allclose(torque, 0.0, atol=1e-13)


def test_a_turned_box_is_pushed_aside_by_its_larger_face() -> None:
    """Faces of 3 and 7 N s^2/m^2 at 2 m/s, 45 degrees: 6 sqrt(2) and 14 sqrt(2) N."""
    drag = DragQuadratic(form=DragForm.faces, coefficient_x=3.0, coefficient_y=7.0, size_x=0.3)
    half = 2.0 * np.sqrt(0.5)
    force, _ = wrench(drag, [[half, half, 0.0], [half, -half, 0.0]])
    root = np.sqrt(2.0)
    assert_allclose(force, [[-6 * root, -14 * root, 0], [-6 * root, 14 * root, 0]], rtol=1e-13)
    # against the motion: (6 + 14) sqrt(2) sqrt(1/2) = 20 N; across it 8 N
    across = (force[0, 0] - force[0, 1]) / root
    assert across == pytest.approx(8.0)


def test_a_turning_box_is_braked_by_all_its_faces() -> None:
    """The moment of a spin about z agrees with a sum over 40,000 tiles of each face."""
    size, c, rate = np.array([0.3, 0.2, 0.1]), np.array([10.5, 15.7, 31.4]), 4.0
    given: Any = {f"coefficient_{a}": value for a, value in zip("xyz", c, strict=True)}
    given |= {f"size_{a}": value for a, value in zip("xyz", size, strict=True)}
    force, torque = wrench(DragQuadratic(form=DragForm.faces, **given), np.zeros(3), [0, 0, rate])
    tiles = (np.arange(2000) + 0.5) / 2000 - 0.5
    # plates x and y through the centre: v_n = r y or r x is all their speed; z has none
    moment = sum(
        c[face] * np.mean(np.abs(rate * size[along] * tiles) ** 2 * np.abs(size[along] * tiles))
        for face, along in ((0, 1), (1, 0))
    )
    # the middle of 2,000 tiles misses the mean of abs(y)^3 by one in 2,000 squared
    assert torque[0, 2] == pytest.approx(-moment, rel=1e-6)
    assert_allclose(force, 0.0, atol=1e-13)


@pytest.mark.parametrize(("turning", "bound"), [(1.0, 0.001), (5.0, 0.001), (50.0, 0.001)])
def test_a_box_in_any_twist_is_near_the_integral_over_its_faces(
    turning: float, bound: float
) -> None:
    """Sixteen points a face against 60 x 60 tiles of each, by the fastest a face could feel."""
    size, c = np.array([0.3, 0.2, 0.15]), np.array([3.0, 5.0, 7.0])
    given: Any = {f"coefficient_{a}": value for a, value in zip("xyz", c, strict=True)}
    given |= {f"size_{a}": value for a, value in zip("xyz", size, strict=True)}
    rng, reach = np.random.default_rng(7), 0.5 * np.linalg.norm(size)
    v, w = rng.standard_normal((60, 3)), turning * rng.standard_normal((60, 3))
    force, torque = wrench(DragQuadratic(form=DragForm.faces, **given), v, w)
    tiles = (np.arange(60) + 0.5) / 60 - 0.5
    flat = np.stack((0.0 * np.ones(3600), *(g.ravel() for g in np.meshgrid(tiles, tiles))), axis=1)
    wanted = np.zeros((2, 60, 3))
    for k in range(3):
        place = np.roll(flat, k, axis=1) * size
        flow = v[:, None] + np.cross(w[:, None], place[None])
        each = np.zeros_like(flow)
        each[..., k] = -c[k] * np.linalg.norm(flow, axis=2) * flow[..., k]
        wanted += each.mean(axis=1), np.cross(place[None], each).mean(axis=1)
    top = (np.linalg.norm(v, axis=1) + reach * np.linalg.norm(w, axis=1))[:, None] ** 2 * c.max()
    assert np.abs((force - wanted[0]) / top).max() < bound
    assert np.abs((torque - wanted[1]) / (reach * top)).max() < bound


@pytest.mark.parametrize("form", DragForm)
def test_drag_never_adds_energy(form: DragForm) -> None:
    """F v + T w <= 0 for random bodies and twists, also off the centre."""
    rng = np.random.default_rng(11)
    for _ in range(40):
        given: Any = {f"coefficient_{a}": rng.uniform(0.0, 30.0) for a in "xyz"}
        given |= {f"size_{a}": rng.uniform(0.0, 2.0) for a in "xyz"}
        given |= {f"position_{a}": rng.uniform(-1.0, 1.0) for a in "xyz"}
        given |= {"axis": rng.choice(np.array(list(HullAxis)))}
        v, w = rng.standard_normal((50, 3)), 3.0 * rng.standard_normal((50, 3))
        force, torque = wrench(DragQuadratic(form=form, **given), v, w)
        power = np.sum(force * v, axis=1) + np.sum(torque * w, axis=1)
        assert power.max() <= 1e-12 * np.abs(power).max()
        assert power.min() < 0.0


@pytest.mark.parametrize("form", DragForm)
def test_a_batch_feels_what_each_body_feels(form: DragForm) -> None:
    """Rows of a batch in NumPy and in PyTorch agree with single bodies."""
    torch = pytest.importorskip("torch")
    rng = np.random.default_rng(5)
    given: Any = {"coefficient_x": 2.0, "coefficient_y": 5.0, "coefficient_z": 4.0}
    given |= {"size_x": 0.4, "size_y": 0.3, "size_z": 0.2, "position_y": 0.1}
    drag = DragQuadratic(form=form, **given)
    v, w = rng.standard_normal((200, 3)), rng.standard_normal((200, 3))
    batch = wrench(drag, v, w)
    for k in (0, 17, 199):
        for one, many in zip(wrench(drag, v[k], w[k]), batch, strict=True):
            assert_allclose(one[0], many[k], rtol=1e-12, atol=1e-14)
    for one, many in zip(wrench(drag, v, w, like=torch), batch, strict=True):
        assert_allclose(one, many, rtol=1e-12, atol=1e-14)
