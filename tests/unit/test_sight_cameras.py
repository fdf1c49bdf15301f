"""Lenses, scenes, picture files, and cameras that cannot be had: refused in words."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals import registry
from seals.api import make
from seals.errors import ConfigError, MissingExtra, PhysicsError, SealsError
from seals.plugins.sensors.camera import SensorCamera
from seals.plugins.viewers.bullet import RendererEgl, RendererTiny
from seals.plugins.viewers.bullet import renderer as egl_module
from seals.plugins.viewers.bullet.drawing import normals_of
from seals.plugins.viewers.raycast import RendererRaycast
from seals.rendering import OPTICAL, Cameras, Lens, Light, Poses, Renderer, Scene, Shape
from seals.rendering.light import TABLE
from seals.rendering.optics import to_linear
from seals.rendering.picture import millimetres, png
from seals.rendering.scene import check_scene
from seals.run.sight import renderer_of
from seals.testing.inertial import felt

WHITE = (1.0, 1.0, 1.0)
FACE = """
import numpy as np
from seals.plugins.viewers.bullet import RendererTiny
from seals.rendering import OPTICAL, Cameras, Lens, Light, Poses, Scene, Shape
sides = [(-0.1, y, z) for y in (-0.3, 0.3) for z in (-0.3, 0.3)]
white = (1.0, 1.0, 1.0)
boxes = [Shape("box", (0.2, 0.2, 0.2), np.array(at), np.eye(3), white, 1) for at in sides]
renderer = RendererTiny()
renderer.open(Scene(tuple(boxes), ("nothing", "a"), ()), Light())
print(renderer.render(Poses.nowhere(), Cameras.single(np.zeros(3), OPTICAL), Lens()).parts.max())
"""
"""A camera in the very plane of faces that lie aside of it on all sides."""


def test_the_optical_axes_are_those_of_a_picture() -> None:
    """On a link with x ahead, y left, z up the picture's x is right, y down, z ahead."""
    np.testing.assert_array_equal(OPTICAL @ [1.0, 0.0, 0.0], [0.0, -1.0, 0.0])
    np.testing.assert_array_equal(OPTICAL @ [0.0, 1.0, 0.0], [0.0, 0.0, -1.0])
    np.testing.assert_array_equal(OPTICAL @ [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])


def test_a_lens_spans_its_field_of_view() -> None:
    """The edges of the picture are half the field of view off the axis; pixels are square."""
    lens = Lens(width=200, height=80, fov=1.0)
    edge = lens.project(np.array([math.tan(0.5), 0.0, 1.0]))
    assert edge[0] == pytest.approx(200.0)
    assert lens.fx == lens.fy
    tall = Lens(width=200, height=80, fov=1.0, fov_vertical=1.2)
    assert tall.project(np.array([0.0, math.tan(0.6), 1.0]))[1] == pytest.approx(80.0)


def test_rays_go_through_the_middles_of_pixels() -> None:
    """A pixel's ray projects onto the pixel's middle."""
    lens = Lens(width=7, height=5, fov=0.8, fov_vertical=1.3)
    middles = lens.project(lens.rays().astype(float))
    np.testing.assert_allclose(middles[2, 3], [3.5, 2.5], atol=1e-6)
    np.testing.assert_allclose(middles[4, 0], [0.5, 4.5], atol=1e-6)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"width": 0}, "width=0 pixels"),
        ({"height": -3}, "height=-3 pixels"),
        ({"width": 100000}, "from 1 to 4096"),
        ({"fov": 0.0}, "fov=0 rad"),
        ({"fov": 70.0}, "degrees"),
        ({"fov_vertical": 3.1}, "fov_vertical=3.1"),
        ({"near": 0.0}, "near=0"),
        ({"near": 2.0, "far": 1.0}, "near < far"),
        ({"far": math.inf}, "finite"),
    ],
)
def test_a_lens_that_no_picture_comes_of_is_refused(values: dict[str, Any], words: str) -> None:
    """Size 0, angles out of range and depths in the wrong order are named."""
    with pytest.raises(ConfigError, match=words):
        Lens(**values)


def test_a_camera_names_the_images_it_gives() -> None:
    """An unknown image is refused with the nearest name; none at all, too."""
    with pytest.raises(ConfigError, match=r"Did you mean 'segmentation'"):
        SensorCamera(what=["rgb", "segmentaton"])
    with pytest.raises(ConfigError, match="no images"):
        SensorCamera(what=[])


def test_depth_noise_grows_with_the_square_of_the_distance() -> None:
    """The deviation is floor + growth z^2; what is not met stays infinite."""

    class Wall:
        """Sees a wall at 1, 2 and 4 m, and nothing."""

        def __init__(self) -> None:
            self.shot: Any = None

        def see(self, camera: Any, lens: Lens, time: float, rng: Any, *, normals: bool) -> Any:
            from seals.rendering import Picture

            depth = np.tile(np.array([1.0, 2.0, 4.0, np.inf], dtype=np.float32), (20000, 1))
            return Picture(np.zeros((*depth.shape, 3)), depth, np.ones(depth.shape))

        def keep(self, shot: Any) -> None:
            self.shot = shot

    wall, camera = Wall(), SensorCamera(depth_floor=0.002, depth_growth=0.003)
    instant = felt(
        force=(0, 0, 9.81), angular_velocity=(0, 0, 0), angular_acceleration=(0, 0, 0), time=0.1
    )
    rng = np.random.default_rng(0)
    reading, memory = camera.sense(instant._replace(camera=wall), 7, rng, due=True)
    assert reading is not None
    assert (reading["picture"].tolist(), memory, wall.shot.number) == ([7.0], 8, 7)
    depth = wall.shot.picture.depth
    assert np.isinf(depth[:, 3]).all()
    spread = depth[:, :3].std(axis=0)
    np.testing.assert_allclose(spread, [0.005, 0.014, 0.05], rtol=0.03)
    np.testing.assert_allclose(depth[:, :3].mean(axis=0), [1, 2, 4], atol=2e-3)


@pytest.mark.parametrize("name", ["tiny", "egl", "raycast"])
def test_viewers_for_cameras_are_renderers(name: str) -> None:
    """Each can be closed unopened, and says so when it is asked for a picture without a scene."""
    renderer = registry.get("viewer", name).load()()
    assert isinstance(renderer, Renderer)
    renderer.close()
    with pytest.raises(PhysicsError, match="no scene"):
        renderer.render(Poses.nowhere(), Cameras.single(np.zeros(3), np.eye(3)), Lens())


def test_a_camera_in_the_plane_of_a_face_gives_a_picture(tmp_path: Path) -> None:
    """TinyRenderer loops for ever where a triangle lies in the camera's plane; here it returns."""
    done = subprocess.run(
        [sys.executable, "-c", FACE],
        capture_output=True,
        timeout=60.0,
        check=False,
        text=True,
        # from elsewhere: what is installed is tested, not the folder that tests run in
        cwd=tmp_path,
    )
    assert (done.returncode, done.stdout.strip()) == (0, "0"), done.stderr


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kind": "cone"}, "a 'cone'"),
        ({"size": (1.0,)}, "3 lengths above zero"),
        ({"size": (1.0, 0.0, 1.0)}, "above zero"),
        ({"kind": "mesh", "size": ()}, "vertices and faces"),
        ({"part": 2}, "parts 1 to 1"),
        ({"part": 0}, "parts 1 to 1"),
        ({"frame": 0}, "frames up to -1"),
    ],
)
def test_a_scene_that_cannot_be_drawn_is_refused(change: dict[str, Any], words: str) -> None:
    """Unknown kinds, sizes that do not fit, parts and frames that are not there."""
    box = Shape("box", (1.0, 1.0, 1.0), np.zeros(3), np.eye(3), WHITE, 1)
    with pytest.raises(ConfigError, match=words):
        check_scene(Scene((box._replace(**change),), ("nothing", "a"), ()))


def test_what_is_missing_for_the_ray_caster_is_named(absent: Callable[..., None]) -> None:
    """Without torch: the extra and the other renderer. Unknown devices: the known ones."""
    with pytest.raises(ConfigError, match="cpu, cuda"):
        RendererRaycast(device="gpu")
    absent("torch")
    with pytest.raises(MissingExtra, match=r"aam-seals\[learn\]"):
        RendererRaycast().open(Scene((), ("nothing",), ()), Light())


def test_a_graphics_card_that_is_not_there_is_refused() -> None:
    """A card beyond those of the machine is named, and the way out."""
    pytest.importorskip("torch")
    with pytest.raises(ConfigError, match=r"sees \d+ graphics cards"):
        RendererRaycast(device="cuda:99").open(Scene((), ("nothing",), ()), Light())


def test_egl_says_how_its_trial_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    """A trial that fails in its own process becomes words; a machine with a driver draws."""
    with pytest.raises(MissingExtra, match="trial picture ended with code"):
        egl_module.try_out("/nowhere/eglRenderer.so")
    monkeypatch.setattr(egl_module, "find_spec", lambda name: None)
    with pytest.raises(MissingExtra, match="eglRenderer"):
        RendererEgl().open(Scene((), ("nothing",), ()), Light())


def test_a_viewer_that_does_not_draw_is_refused() -> None:
    """No viewer, and one that is no renderer: the installed ones are named."""
    for viewer in (None, object()):
        with pytest.raises(ConfigError, match="raycast, tiny"):
            renderer_of(viewer)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["sensors.front.link=camera_fron"], "Did you mean 'camera_front'"),
        (["sensors.front.width=0"], "width=0"),
        (["sensors.front.fov=4"], "fov=4"),
        (["viewer=tinny"], "tiny"),
        (["water_type=costal_5"], "coastal_5"),
        (["sight.detail=fine"], "simple"),
    ],
)
def test_runs_with_senseless_cameras_are_refused(words: list[str], message: str) -> None:
    """Unknown links, sizes, angles, renderers, waters and details, each with what is allowed."""
    base = ["robot=aam", "+cameras=aam", "water=fossen"]
    with pytest.raises(SealsError) as refusal:
        make([*base, *words])
    assert message in str(refusal.value)


def test_png_holds_the_picture() -> None:
    """Colour of 8 and depth of 16 bits come back as they were, 16 bits stay 16 in the file."""
    import io

    from PIL import Image as image

    rng = np.random.default_rng(0)
    colour = rng.integers(0, 256, (5, 9, 3), dtype=np.uint8)
    depth = millimetres(rng.uniform(0.0, 60.0, (5, 9)).astype(np.float32))
    for given in (colour, depth):
        data = png(given)
        assert data[:8] == b"\x89PNG\r\n\x1a\n"
        assert data[24] == 8 * given.itemsize
        np.testing.assert_array_equal(np.array(image.open(io.BytesIO(data))), given)
    with pytest.raises(ConfigError, match="cannot be written as PNG"):
        png(np.zeros((3, 3), dtype=np.int64))  # type: ignore[arg-type]


def test_the_table_of_levels_is_srgb() -> None:
    """Level 128 is 0.2159 of full light; the ends are 0 and 1."""
    assert TABLE[[0, 255]].tolist() == [0.0, 1.0]
    assert float(TABLE[128]) == pytest.approx(0.21586, abs=1e-5)
    np.testing.assert_allclose(TABLE, to_linear(np.arange(256) / 255.0), atol=1e-6)


def test_normals_of_a_depth_picture_are_those_of_its_planes() -> None:
    """A tilted plane's normal is found from depth alone, also beside an edge."""
    lens = Lens(width=40, height=40, fov=1.0)
    true = np.array([0.3, -0.4, -0.866])
    true /= np.linalg.norm(true)
    rays = lens.rays().astype(float)
    depth = (2.0 * true[2] / (rays @ true)).astype(np.float32)
    parts = np.ones((40, 40), dtype=np.int32)
    depth[:, 20:], parts[:, 20:] = np.inf, 0
    found = normals_of(depth, parts, np.eye(3), lens)
    assert not found[:, 20:].any()
    assert np.abs(found[:, :20] - true).max() < 5e-3


def test_the_ray_caster_takes_many_sided_pieces_for_what_they_stand_for() -> None:
    """Balls, rods and boxes of triangles become primitives; a wedge keeps its faces."""
    from seals.plugins.viewers.raycast.solids import solids_of
    from seals.rendering.meshes import triangles

    made = {
        "sphere": (0.3,),
        "cylinder": (0.2, 0.9),
        "box": (0.2, 0.3, 0.5),
    }
    for kind, size in made.items():
        vertices, faces = triangles(Shape(kind, size, np.zeros(3), np.eye(3), WHITE, 1))
        moved = vertices + np.array([1.0, 2.0, 3.0])
        [solid] = solids_of(moved, faces)
        assert solid.kind == kind
        np.testing.assert_allclose(solid.position, [1.0, 2.0, 3.0], atol=1e-3)
        np.testing.assert_allclose(sorted(solid.size), sorted(size), rtol=6e-3)
    wedge = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1.0]])
    sides = [[0, 2, 1], [3, 4, 5], [0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5]]
    [solid] = solids_of(wedge, np.array(sides))
    assert (solid.kind, len(solid.offsets)) == ("convex", 5)


def test_two_pieces_that_touch_in_a_corner_stay_two() -> None:
    """Cubes that share one corner are two solids, not the hull of both."""
    from seals.plugins.viewers.raycast.solids import solids_of
    from seals.rendering.meshes import triangles

    vertices, faces = triangles(Shape("box", (1.0, 1.0, 1.0), np.zeros(3), np.eye(3), WHITE, 1))
    both = np.concatenate([vertices, vertices + 1.0])
    found = solids_of(both, np.concatenate([faces, faces + len(vertices)]))
    assert [s.kind for s in found] == ["box", "box"]


def test_cameras_of_one_call_share_a_batch() -> None:
    """C cameras in N environments make pictures of shape (N, C, H, W)."""
    ball = Shape("sphere", (0.5,), np.array([3.0, 0.0, 0.0]), np.eye(3), WHITE, 1)
    renderer = RendererTiny()
    renderer.open(Scene((ball,), ("nothing", "a"), ()), Light())
    cameras = Cameras(np.zeros((2, 3, 3)), np.tile(OPTICAL, (2, 3, 1, 1)))
    picture = renderer.render(Poses.nowhere(2), cameras, Lens(width=8, height=6), normals=True)
    renderer.close()
    assert picture.colour.shape == (2, 3, 6, 8, 3)
    assert picture.parts[1, 2, 3, 4] == 1
    assert picture.normals is not None
