"""Two renderers that share no line of geometry see one scene: triangles against rays.

Masks: intersection over union of every part that covers at least 60 pixels, and of all solids
together, edges included. Depth: inside the common mask of a part, edges included as well; only
pixels that the two give to different parts are left out, and they count against the mask.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seals.frames import matrix_of, quaternion_of_rpy
from seals.plugins.viewers.bullet import RendererTiny
from seals.plugins.viewers.raycast import RendererRaycast
from seals.rendering import OPTICAL, Cameras, Detail, Lens, Light, Picture, Poses, Scene, Shape
from seals.rendering.optics import to_bytes
from seals.run import build_world
from seals.run.build import run_settings

pytest.importorskip("torch")

LEAST = 60
KINDS = ("box", "sphere", "cylinder", "capsule")


def pair(scene: Scene, poses: Poses, cameras: Cameras, lens: Lens) -> list[tuple[Picture, Picture]]:
    """Both renderers' pictures, camera by camera."""
    found = []
    for renderer in (RendererTiny(), RendererRaycast()):
        renderer.open(scene, Light())
        found.append(renderer.render(poses, cameras, lens))
        renderer.close()
    count = np.shape(cameras.origin)[1]
    return [(found[0].of(0, c), found[1].of(0, c)) for c in range(count)]


def agree(a: Picture, b: Picture, skip: int = 1) -> tuple[float, list[float], Any, Any]:
    """Overlap of all solids, of every large part, and differences of depth and colour."""
    solid = (a.parts > skip, b.parts > skip)
    whole = (solid[0] & solid[1]).sum() / max((solid[0] | solid[1]).sum(), 1)
    overlaps, depths, colours = [], [], []
    for part in np.unique(a.parts):
        one, other = a.parts == part, b.parts == part
        both = one & other
        if part == 0 or not both.any():
            continue
        depths.append(np.abs(a.depth[both] - b.depth[both]))
        shown = to_bytes(a.colour[both]).astype(int) - to_bytes(b.colour[both]).astype(int)
        colours.append(np.abs(shown).ravel())
        if one.sum() >= LEAST:
            overlaps.append(float(both.sum() / (one | other).sum()))
    return float(whole), overlaps, np.concatenate(depths), np.concatenate(colours)


def heap(seed: int) -> tuple[Scene, Poses, Cameras]:
    """Ten shapes at random before a camera, over level ground."""
    rng = np.random.default_rng(seed)
    names = ["nothing", "world/ground"]
    ground = (0.5, 0.5, 0.4)
    shapes = [Shape("plane", (), np.array([0.0, 0.0, -1.2]), np.eye(3), ground, 1, tile=0.25)]
    places, turns = rng.uniform(-1.0, 1.0, (10, 3)), rng.uniform(-3.0, 3.0, (10, 3))
    for k in range(10):
        kind = KINDS[k % 4]
        low, high = rng.uniform(0.08, 0.3), rng.uniform(0.2, 0.7)
        size = {"box": (low, high, 0.3), "sphere": (low,)}.get(kind, (low, high))
        own = np.array([0.1, 0.0, 0.05])
        shade = tuple(float(x) for x in rng.uniform(0.2, 0.9, 3))
        red, green, blue = shade
        shapes.append(Shape(kind, size, own, np.eye(3), (red, green, blue), 2 + k, k))
        names.append(f"heap/{k}")
    scene = Scene(tuple(shapes), tuple(names), tuple(names[2:]))
    poses = Poses(places[None], matrix_of(quaternion_of_rpy(turns))[None])
    link = matrix_of(quaternion_of_rpy(np.array([[0.1, 0.3, 0.2]])))[0]
    origin = -3.2 * link[:, 0]
    return scene, poses, Cameras(origin[None, None], (link @ OPTICAL)[None, None])


@pytest.mark.parametrize(
    "seed", [0, 1, 2, *(pytest.param(k, marks=pytest.mark.slow) for k in range(3, 8))]
)
def test_random_scenes_look_alike(seed: int) -> None:
    """Masks overlap by 97 %, depth differs by less than 1 cm in the median and at 99 %."""
    for a, b in pair(*heap(seed), Lens(width=160, height=128, fov=0.9)):
        whole, overlaps, depth, colour = agree(a, b)
        assert whole > 0.985
        assert min(overlaps) > 0.97
        assert np.median(depth) < 1e-3
        assert np.percentile(depth, 99.0) < 0.01
        # one level of 8 bits, more where a polygon's outline or a tile's edge is another
        assert np.median(colour) <= 1.0
        assert colour.mean() < 3.0


def manipulator(detail: Detail, arm: str, height: float) -> tuple[Scene, Poses, Cameras]:
    """The manipulator with a cube before it, over the bottom of a tank."""
    from seals.environment.ground import solids_of
    from seals.rendering.gather import build_scene
    from seals.run.sight import poses_of

    words = [
        "robot=aam",
        "water=fossen",
        "environment.tank_bottom=-1.0",
        "+objects.cube.robot=cube",
    ]
    words += ["+objects.cube.position=[0.3,0.05,-0.975]", f"initial.position=[0,0,{height}]"]
    settings = run_settings([*words, f"initial.joint_position={arm}"])
    world = build_world(settings)
    robots = {name: actor.robot for name, actor in world.actors.items()}
    scene = build_scene(robots, solids_of(settings.environment), detail=detail)
    poses = poses_of(world.actors)
    world.close()
    places = [scene.frames.index(f"robot/camera_{name}") for name in ("front", "belly")]
    turns = np.asarray(poses.rotation)[0, places] @ OPTICAL
    return scene, poses, Cameras(np.asarray(poses.position)[:, places], turns[None])


@pytest.mark.thorough
@pytest.mark.parametrize("detail", list(Detail), ids=lambda d: d.value)
@pytest.mark.parametrize(
    "arm",
    [pytest.param("[0,0,0,0,0,0]", marks=pytest.mark.slow), "[0.3,-1.0,-0.4,-0.6,-0.6,-0.6]"],
)
def test_the_cameras_of_the_manipulator_see_alike(detail: Detail, arm: str) -> None:
    """Front and belly camera: masks, depth and colour as in random scenes."""
    for a, b in pair(*manipulator(detail, arm, -0.5), Lens(width=112, height=112, fov=1.4)):
        whole, overlaps, depth, colour = agree(a, b, skip=0)
        assert whole > 0.985
        assert min(overlaps) > 0.97
        assert np.median(depth) < 1e-3
        assert np.percentile(depth, 99.0) < 0.01
        assert np.median(colour) <= 1.0


def test_the_belly_camera_sees_hand_and_target() -> None:
    """In working posture fingers, palm and the cube on the bottom are in the belly camera's view.

    The front camera sees neither arm nor body: it sits in the foremost face of the body.
    """
    scene, poses, cameras = manipulator(Detail.visual, "[0,-0.8,-0.8,0,0,0]", -0.65)
    renderer = RendererTiny()
    renderer.open(scene, Light())
    picture = renderer.render(poses, cameras, Lens(fov=1.22))
    renderer.close()
    belly = {scene.names[k] for k in np.unique(picture.of(0, 1).parts)}
    assert {"robot/palm", "cube/base"} <= belly
    assert len({name for name in belly if "finger" in name}) >= 2
    front = {scene.names[k] for k in np.unique(picture.of(0, 0).parts)}
    assert "robot/body" not in front


def test_blocks_do_not_change_a_picture() -> None:
    """Rays traced in small blocks give the picture of large ones, but for rounding."""
    scene, poses, cameras = heap(3)
    found = []
    for block in (0.02, 50.0):
        renderer = RendererRaycast(block=block)
        renderer.open(scene, Light())
        found.append(renderer.render(poses, cameras, Lens(), normals=True))
        renderer.close()
    np.testing.assert_array_equal(found[0].parts, found[1].parts)
    # vectors and their remainders round differently in single precision
    np.testing.assert_allclose(found[0].depth, found[1].depth, rtol=5e-7)
    np.testing.assert_allclose(found[0].colour, found[1].colour, atol=2e-6)


def test_environments_do_not_mix() -> None:
    """A batch of scenes gives what each gives alone, for NumPy arrays and for tensors."""
    import torch

    scene, one, cameras = heap(1)
    other = Poses(heap(2)[1].position, heap(2)[1].rotation)
    renderer = RendererRaycast()
    renderer.open(scene, Light())
    alone = [renderer.render(p, cameras, Lens()) for p in (one, other)]
    both = Poses(
        np.concatenate([one.position, other.position]),
        np.concatenate([one.rotation, other.rotation]),
    )
    twice = Cameras(*(np.concatenate([x, x]) for x in cameras))
    batch = renderer.render(both, twice, Lens())
    tensors = renderer.render(
        Poses(*map(torch.as_tensor, both)), Cameras(*map(torch.as_tensor, twice)), Lens()
    )
    renderer.close()
    assert isinstance(tensors.colour, torch.Tensor)
    for k in range(2):
        np.testing.assert_allclose(batch.depth[k], alone[k].depth[0], rtol=1e-6)
        np.testing.assert_array_equal(batch.parts[k], alone[k].parts[0])
        np.testing.assert_array_equal(batch.colour[k], tensors.colour[k].numpy())
