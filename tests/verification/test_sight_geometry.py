"""Where things appear in pictures, and how far away, against pinhole and ray formulae.

All expectations are written out here: nothing of the renderers is used to make them.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.frames import matrix_of, quaternion_of_rpy
from seals.plugins.viewers.bullet import RendererTiny
from seals.plugins.viewers.raycast import RendererRaycast
from seals.rendering import Cameras, Lens, Light, Picture, Poses, Scene, Shape
from seals.run import build_world
from seals.run.build import run_settings

Floats = NDArray[np.float64]
RENDERERS = {"tiny": RendererTiny, "raycast": RendererRaycast}
WHITE = (1.0, 1.0, 1.0)
LENS = Lens(width=160, height=120, fov=1.1, near=0.05, far=30.0)


@pytest.fixture(params=list(RENDERERS))
def renderer(request: pytest.FixtureRequest) -> Any:
    """Each renderer that runs on a processor."""
    if request.param == "raycast":
        pytest.importorskip("torch")
    return RENDERERS[request.param]()


def turned(*rpy: float) -> Floats:
    """Rotation matrix of roll, pitch, yaw."""
    return matrix_of(quaternion_of_rpy(np.array([rpy])))[0]


def seen(
    renderer: Any,
    shapes: list[Shape],
    origin: Floats,
    axes: Floats,
    *,
    lens: Lens = LENS,
    normals: bool = False,
) -> Picture:
    """One picture of shapes that stand still."""
    names = ("nothing", *(f"world/{k}" for k in range(len(shapes))))
    scene = Scene(tuple(s._replace(part=k + 1) for k, s in enumerate(shapes)), names, ())
    renderer.open(scene, Light())
    try:
        cameras = Cameras(origin[None, None], axes[None, None])
        picture: Picture = renderer.render(Poses.nowhere(), cameras, lens, normals=normals)
        return picture.of(0, 0)
    finally:
        renderer.close()


def shape(kind: str, size: tuple[float, ...], position: Floats, rotation: Floats) -> Shape:
    """A white shape in the world."""
    return Shape(kind, size, position, rotation, WHITE, 1)


def looking(rng: np.random.Generator) -> tuple[Floats, Floats]:
    """A camera somewhere, looking anywhere; optical axes right, down, ahead as columns."""
    link = turned(*rng.uniform(-1.5, 1.5, 3))
    return rng.uniform(-3.0, 3.0, 3), np.stack([-link[:, 1], -link[:, 2], link[:, 0]], axis=1)


def pixel(point: Floats, origin: Floats, axes: Floats) -> tuple[float, float, float]:
    """Column, row and depth of a world point, by the pinhole formula."""
    x, y, z = (point - origin) @ axes
    focal = 0.5 * LENS.width / math.tan(0.5 * LENS.fov)
    return focal * x / z + 0.5 * LENS.width, focal * y / z + 0.5 * LENS.height, z


def rays(axes: Floats) -> Floats:
    """World directions whose third optical component is one, shape (H, W, 3)."""
    focal = 0.5 * LENS.width / math.tan(0.5 * LENS.fov)
    out = np.ones((LENS.height, LENS.width, 3))
    out[..., 0] = ((np.arange(LENS.width) + 0.5) - 0.5 * LENS.width) / focal
    out[..., 1] = (((np.arange(LENS.height) + 0.5) - 0.5 * LENS.height) / focal)[:, None]
    return out @ axes.T


def test_small_balls_appear_where_the_pinhole_puts_them(renderer: Any) -> None:
    """The middle of a small ball's mask is within half a pixel of its projection."""
    rng = np.random.default_rng(1)
    errors = []
    for _ in range(40):
        origin, axes = looking(rng)
        depth = rng.uniform(0.8, 3.0)
        aside = rng.uniform(-0.4, 0.4, 2) * depth
        point = origin + axes @ np.array([*aside, depth])
        picture = seen(renderer, [shape("sphere", (0.02 * depth,), point, np.eye(3))], origin, axes)
        rows, columns = np.nonzero(picture.parts == 1)
        column, row, _ = pixel(point, origin, axes)
        errors.append((columns.mean() + 0.5 - column, rows.mean() + 0.5 - row))
    assert np.abs(errors).max() < 0.5
    # no shift of all pictures: a convention that is half a pixel off shows here
    assert np.abs(np.mean(errors, axis=0)).max() < 0.06


def test_depth_is_metric(renderer: Any) -> None:
    """A wall across the view at 1 m reads 1 m in all pixels, within 1 mm; at 5 m likewise."""
    for distance in (0.3, 1.0, 5.0):
        wall = shape("box", (0.2, 20.0, 20.0), np.array([distance + 0.1, 0.0, 0.0]), np.eye(3))
        axes = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
        picture = seen(renderer, [wall], np.zeros(3), axes)
        assert (picture.parts == 1).all()
        assert np.abs(picture.depth - distance).max() < 1e-3


def test_depth_is_metric_far_from_the_origin(renderer: Any) -> None:
    """Ten kilometres from the origin of the world a wall at 1 m still reads 1 m."""
    place = np.array([1.0e4, -7.0e3, 50.0])
    wall = shape("box", (0.2, 20.0, 20.0), place + np.array([1.1, 0.0, 0.0]), np.eye(3))
    axes = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    picture = seen(renderer, [wall], place, axes)
    assert np.abs(picture.depth - 1.0).max() < 1e-3


def ball(o: Floats, d: Floats, radius: float) -> Floats:
    """Nearest root of |o + t d| = radius."""
    a, b, c = (d * d).sum(-1), 2.0 * (d @ o), o @ o - radius**2
    root = b * b - 4.0 * a * c
    t = (-b - np.sqrt(np.maximum(root, 0.0))) / (2.0 * a)
    return np.where((root > 0.0) & (t > 0.0), t, np.inf)


def brick(o: Floats, d: Floats, edges: tuple[float, ...]) -> Floats:
    """Nearest of the six faces that is hit inside the face."""
    best = np.full(d.shape[:-1], np.inf)
    half = 0.5 * np.array(edges)
    for axis in range(3):
        for side in (-1.0, 1.0):
            with np.errstate(divide="ignore", invalid="ignore"):
                t = (side * half[axis] - o[axis]) / d[..., axis]
                p = o + t[..., None] * d
                others = [k for k in range(3) if k != axis]
                inside = (np.abs(p[..., others]) <= half[others]).all(-1) & (t > 0.0)
            best = np.where(inside & (t < best), t, best)
    return best


def rod(o: Floats, d: Floats, radius: float, length: float) -> Floats:
    """Nearest hit of the mantle between the ends, or of an end inside the circle."""
    a = (d[..., :2] ** 2).sum(-1)
    b, c = 2.0 * (d[..., :2] @ o[:2]), o[:2] @ o[:2] - radius**2
    root = b * b - 4.0 * a * c
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (-b - np.sqrt(np.maximum(root, 0.0))) / (2.0 * a)
        on = (root > 0.0) & (t > 0.0) & (np.abs(o[2] + t * d[..., 2]) <= 0.5 * length)
        best = np.where(on, t, np.inf)
        for side in (-0.5, 0.5):
            t = (side * length - o[2]) / d[..., 2]
            p = o[:2] + t[..., None] * d[..., :2]
            on = ((p**2).sum(-1) <= radius**2) & (t > 0.0)
            best = np.where(on & (t < best), t, best)
    return best


def pill(o: Floats, d: Floats, radius: float, length: float) -> Floats:
    """A cylinder with a ball at either end."""
    end = np.array([0.0, 0.0, 0.5 * length])
    return np.minimum.reduce(
        [rod(o, d, radius, length), ball(o - end, d, radius), ball(o + end, d, radius)]
    )


CLOSED = {
    "sphere": (ball, (0.3,)),
    "box": (brick, (0.4, 0.6, 0.3)),
    "cylinder": (rod, (0.2, 0.7)),
    "capsule": (pill, (0.15, 0.5)),
}


@pytest.mark.parametrize("kind", CLOSED)
def test_rays_meet_primitives_where_the_formulae_say(kind: str) -> None:
    """Depth of the ray caster within 2e-5 m of the closed form, and the same pixels are met."""
    pytest.importorskip("torch")
    law, size = CLOSED[kind]
    rng, met = np.random.default_rng(2), 0
    for _ in range(12):
        origin, axes = looking(rng)
        turn = turned(*rng.uniform(-3.0, 3.0, 3))
        place = origin + axes @ np.array([0.2, -0.1, rng.uniform(1.0, 3.0)])
        picture = seen(RendererRaycast(), [shape(kind, size, place, turn)], origin, axes)
        true = law((origin - place) @ turn, rays(axes) @ turn, *_args(kind, size))
        hit = picture.parts == 1
        # rounding decides along the rim only
        assert np.mean(hit != np.isfinite(true)) < 2e-4
        both = hit & np.isfinite(true)
        # a grazing ray's depth is as sensitive as its slope is steep
        error = np.abs(picture.depth[both] - true[both])
        assert np.percentile(error, 99.0) < 2e-5
        assert error.max() < 2e-3
        met += int(both.sum())
    assert met > 3000


def _args(kind: str, size: tuple[float, ...]) -> tuple[Any, ...]:
    return (size,) if kind == "box" else size


@pytest.mark.parametrize("kind", CLOSED)
def test_rasterised_primitives_are_those_of_the_formulae(kind: str) -> None:
    """TinyRenderer's triangles: 97 % of the pixels, depth within 1 cm."""
    law, size = CLOSED[kind]
    rng = np.random.default_rng(3)
    for _ in range(6):
        origin, axes = looking(rng)
        turn = turned(*rng.uniform(-3.0, 3.0, 3))
        place = origin + axes @ np.array([0.2, -0.1, rng.uniform(1.2, 2.5)])
        picture = seen(RendererTiny(), [shape(kind, size, place, turn)], origin, axes)
        true = law((origin - place) @ turn, rays(axes) @ turn, *_args(kind, size))
        hit, real = picture.parts == 1, np.isfinite(true)
        assert (hit & real).sum() / (hit | real).sum() > 0.97
        error = np.abs(picture.depth[hit & real] - true[hit & real])
        assert np.percentile(error, 99.0) < 0.01


def test_normals_of_a_ball_point_from_its_middle() -> None:
    """The ray caster's normal is the unit vector from the middle to the point that is met."""
    pytest.importorskip("torch")
    rng = np.random.default_rng(4)
    origin, axes = looking(rng)
    place = origin + axes @ np.array([0.1, 0.1, 2.0])
    balls = [shape("sphere", (0.5,), place, turned(0.3, 0.2, 0.1))]
    picture = seen(RendererRaycast(), balls, origin, axes, normals=True)
    hit = picture.parts == 1
    points = origin + rays(axes)[hit] * picture.depth[hit][:, None]
    assert picture.normals is not None
    true = (points - place) / 0.5
    assert np.abs(picture.normals[hit] - true).max() < 1e-3
    assert not picture.normals[~hit].any()


def test_level_ground_is_met_at_its_height(renderer: Any) -> None:
    """Every pixel that looks down meets the plane at height h: depth (h - o_z) / d_z."""
    plane = Shape("plane", (), np.array([0.0, 0.0, -1.5]), np.eye(3), WHITE, 1, tile=0.25)
    rng = np.random.default_rng(5)
    for _ in range(4):
        origin, axes = looking(rng)
        origin[2] = abs(origin[2])
        picture = seen(renderer, [plane], origin, axes)
        down = rays(axes)[..., 2]
        with np.errstate(divide="ignore"):
            true = np.where(down < 0.0, (-1.5 - origin[2]) / down, np.inf)
        true = np.where((true >= LENS.near) & (true <= LENS.far), true, np.inf)
        both = np.isfinite(true) & np.isfinite(picture.depth)
        assert np.mean(np.isfinite(true) != np.isfinite(picture.depth)) < 1e-3
        error = np.abs(picture.depth[both] - true[both])
        assert (error <= 2e-6 * true[both] ** 2 + 1e-5).all()


def test_shading_follows_the_sun() -> None:
    """A ball shows ambient + diffuse n . l of its colour, the same in both renderers."""
    pytest.importorskip("torch")
    rng = np.random.default_rng(6)
    origin, axes = looking(rng)
    place = origin + axes @ np.array([0.0, 0.0, 1.5])
    light = Light()
    sun = np.array(light.direction)
    ball_ = shape("sphere", (0.5,), place, np.eye(3))._replace(colour=(0.8, 0.4, 0.2))
    # TinyRenderer rounds down to 8 bits, and its ball has flat faces between smooth normals
    for one, tolerance in ((RendererRaycast(), 1e-4), (RendererTiny(), 8e-3)):
        picture = seen(one, [ball_], origin, axes)
        hit = picture.parts == 1
        points = origin + rays(axes)[hit] * picture.depth[hit][:, None]
        facing = np.maximum(((points - place) / 0.5) @ sun, 0.0)
        shown = np.array([0.8, 0.4, 0.2]) * (0.5 + 0.5 * facing)[:, None]
        linear = np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)
        assert np.abs(picture.colour[hit] - linear).mean() < tolerance


@pytest.mark.parametrize("name", ["camera_front", "camera_belly"])
def test_the_cameras_of_the_manipulator_are_those_of_its_urdf(name: str) -> None:
    """A ball placed by the URDF's numbers appears in the middle of the view, and upright."""
    # from the URDF: fixed to the body at these places, the belly camera pitched down by 1.25 rad
    mounts = {
        "camera_front": (np.array([0.097, 0.0, 0.01]), 0.0),
        "camera_belly": (np.array([0.02, 0.055, -0.052]), 1.25),
    }
    at, pitch = mounts[name]
    words = ["robot=aam", "initial.position=[1,2,3]", "initial.rpy=[0.2,-0.1,0.7]"]
    camera = [
        "+sensor@sensors.eye=camera",
        f"sensors.eye.link={name}",
        "sensors.eye.depth_floor=0",
        "sensors.eye.depth_growth=0",
        "sensors.eye.rate=250",
        "sensors.eye.what=[rgb,depth,segmentation]",
    ]
    body = turned(0.2, -0.1, 0.7)
    ahead = np.array([math.cos(pitch), 0.0, -math.sin(pitch)])
    above = np.array([math.sin(pitch), 0.0, math.cos(pitch)])
    place = np.array([1.0, 2.0, 3.0]) + body @ (at + 0.5 * ahead + 0.1 * above)
    ball_at = f"+objects.mark.position=[{place[0]},{place[1]},{place[2]}]"
    marks = ["+objects.mark.robot=ball", ball_at]
    settings = run_settings([*words, *camera, *marks, "time.step=1e-5"])
    world = build_world(settings)
    try:
        eye = world.actors["robot"].sensor_suite.cameras["eye"]
        pose = world.actors["robot"].body.poses()
        link = world.actors["robot"].robot.links.index(name)
        np.testing.assert_allclose(
            pose.origins[0, link], np.array([1.0, 2.0, 3.0]) + body @ at, atol=1e-9
        )
        turn = np.asarray(pose.rotations[0, link])
        np.testing.assert_allclose(turn[:, 0], body @ ahead, atol=1e-9)
        axes = np.stack([-turn[:, 1], -turn[:, 2], turn[:, 0]], axis=1)
        camera_pose = np.asarray(pose.origins[0, link]), axes
        picture = eye.see(camera_pose, Lens(fov=1.2), 0.0, world.rngs["robot"])
        rows, columns = np.nonzero(picture.parts == eye.view.scene.part("mark/base"))
        focal = 64.0 / math.tan(0.6)
        assert columns.mean() + 0.5 == pytest.approx(64.0, abs=0.5)
        # a ball above the axis appears in the upper half; its outline is an ellipse about the axis
        assert rows.mean() + 0.5 < 64.0 - 0.8 * focal * 0.2
    finally:
        world.close()


def test_frames_carry_their_shapes(renderer: Any) -> None:
    """A shape on a frame appears where pose and mounting put it, in every environment."""
    origin, axes = np.zeros(3), np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    box = Shape("box", (0.1, 0.1, 0.1), np.array([0.5, 0.0, 0.0]), np.eye(3), WHITE, 1, 0)
    renderer.open(Scene((box,), ("nothing", "a/b"), ("a/b",)), Light())
    angles = (0.0, 0.3, -0.2)
    poses = Poses(
        np.array([[[1.0, 0.0, 0.0]]] * 3), np.stack([turned(0.0, 0.0, a)[None] for a in angles])
    )
    cameras = Cameras(np.zeros((3, 1, 3)), np.tile(axes, (3, 1, 1, 1)))
    picture = renderer.render(poses, cameras, LENS)
    renderer.close()
    for k, angle in enumerate(angles):
        point = np.array([1.0, 0.0, 0.0]) + 0.5 * np.array([math.cos(angle), math.sin(angle), 0.0])
        column, row, depth = pixel(point, origin, axes)
        one = picture.of(k, 0)
        rows, columns = np.nonzero(one.parts == 1)
        assert columns.mean() + 0.5 == pytest.approx(column, abs=1.5)
        assert rows.mean() + 0.5 == pytest.approx(row, abs=0.5)
        assert one.depth[one.parts == 1].mean() == pytest.approx(depth - 0.05, abs=0.03)
