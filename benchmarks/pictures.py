"""Pairs of RGB-D pictures a second: ``python benchmarks/pictures.py``.

The scene is that of a catch: the aerial-aquatic manipulator a metre above the floor of a pool, arm
half lowered, a cube of 40 mm on the floor in reach, water above both. A pair is one picture of its
front camera and one of its belly camera, 128 x 128 pixels with colour and depth.

Case ``tiny``: TinyRenderer, links as they are drawn (some 4,900 triangles), one camera after the
other as in a run. Case ``raycast``: the batched ray caster, links as the primitives that displace
water (16 primitives with cube and floor), many environments at once, each in a posture of its own.
Optics: ``none``, ``attenuation`` (attenuation, veil, fall of light with depth) or ``full`` (blur,
caustics, a surface of eight ripples seen from below, noise), water of the type coastal_5.

``python benchmarks/pictures.py --case raycast --device cuda --fused --environments 1024`` needs no
PyBullet, only torch, numpy, scipy, array-api-compat, hydra-core, omegaconf, trimesh and yourdfpy.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

from machine import describe, one_thread

ROOT = Path(__file__).parents[1]
SIZE, FOV, DEPTH = 128, 1.22, 3.0
ARM = (0.0, -0.8, -0.8, -0.6, -0.6, -0.6)
"""Posture about which those of the environments lie [rad]."""
CHAINS: dict[str, dict[str, Any] | None] = {
    "none": None,
    "attenuation": {"blur": False, "caustics": False, "surface": False, "noise": False},
    "full": {},
}
TARGETS = {
    ("tiny", "attenuation"): 100.0,
    ("tiny", "full"): 70.0,
    ("cuda", "full"): 20_000.0,
}
"""Pairs a second that are asked for."""


def find_rooms() -> None:
    """Make ``seals.plugins`` and ``seals.robots`` importable where nothing is installed."""
    sys.path.insert(0, str(ROOT))
    import seals

    if str(ROOT) not in seals.__path__:
        seals.__path__.append(str(ROOT))


def robot_of(name: str) -> Any:
    """Return a robot of the repository."""
    from seals.robot.build import build_robot
    from seals.robot.robot_file import read_robot
    from seals.robot.settings import HullSettings, RobotSettings, ShapeSettings, ShapeType

    found = read_robot(ROOT / "robots" / name)
    hulls = {
        link: HullSettings(
            shapes=[ShapeSettings(**{**s, "type": ShapeType(s["type"])}) for s in hull["shapes"]]
        )
        for link, hull in found.hulls.items()
    }
    settings = RobotSettings(
        name=name, folder=found.settings.folder, urdf=found.settings.urdf, hulls=hulls
    )
    return build_robot(settings)


def catch(environments: int, detail: str) -> tuple[Any, Any, Any]:
    """Return scene, poses and cameras of a catch; every environment stands otherwise."""
    import numpy as np

    from seals.environment.ground import Solid
    from seals.frames import matrix_of, quaternion_of_rpy
    from seals.multibody.tree import forward
    from seals.rendering import OPTICAL, Cameras, Detail, Poses
    from seals.rendering.gather import build_scene

    rng = np.random.default_rng(0)
    robots = {"robot": robot_of("aam"), "cube": robot_of("cube")}
    still, level = np.array([0.0, 0.0, -DEPTH]), np.array([0.0, 0.0, 0.0, 1.0])
    floor = Solid("tank_bottom", "plane", (), still, level, 1.0, 0.0)
    scene = build_scene(robots, [floor], detail=Detail(detail))

    def somewhere(centre: tuple[float, ...], spread: float) -> Any:
        return np.array(centre) + spread * rng.uniform(-1.0, 1.0, (environments, len(centre)))

    joints = somewhere(ARM, 0.2)
    turn = matrix_of(quaternion_of_rpy(somewhere((0.0, 0.0, 0.0), 0.1)))
    body = forward(robots["robot"].tree, somewhere((0.0, 0.0, 0.8 - DEPTH), 0.1), turn, joints)
    lying = matrix_of(quaternion_of_rpy(somewhere((0.0, 0.0, 0.0), 1.0) * [0.0, 0.0, 1.0]))
    cube = forward(
        robots["cube"].tree, somewhere((0.35, 0.0, 0.02 - DEPTH), 0.05), lying, joints[:, :0]
    )
    places, turns = (np.concatenate([a, b], axis=1) for a, b in zip(body, cube, strict=True))
    at = [scene.frames.index(f"robot/camera_{name}") for name in ("front", "belly")]
    return scene, Poses(places, turns), Cameras(places[:, at], turns[:, at] @ OPTICAL)


def chain(name: str) -> Any:
    """Return the optics of a chain, None for none."""
    from seals.rendering.optics import Optics

    values = CHAINS[name]
    return None if values is None else Optics(water_type="coastal_5", **values)


def water(optics: Any) -> Any:
    """Return the surface: ripples where the chain looks at it."""
    from seals.rendering.optics import SurfaceStill, ripples

    made = ripples(wind=3.0, seed=1, components=8)
    return made if optics is not None and optics.surface else SurfaceStill()


def tiny(name: str, seconds: float) -> float:
    """Return pairs a second of TinyRenderer, as the cameras of a run take them."""
    import numpy as np

    from seals.plugins.viewers.bullet import RendererTiny
    from seals.rendering import Lens, Poses, SceneView
    from seals.rendering.optics import Optics

    scene, poses, cameras = catch(8, "visual")
    now = [0]

    def present() -> Any:
        return Poses(poses.position[now[0] % 8][None], poses.rotation[now[0] % 8][None])

    optics = chain(name) or Optics(noise=False)
    surface = None if name == "none" else water(optics)
    watch = SceneView(RendererTiny(), scene, present, optics=optics, surface=surface)
    lens, rng = Lens(width=SIZE, height=SIZE, fov=FOV), np.random.default_rng(0)

    def pair() -> None:
        now[0] += 1
        for c in range(2):
            where = cameras.origin[now[0] % 8, c], cameras.rotation[now[0] % 8, c]
            watch.see(where, lens, 0.01 * now[0], rng)

    return rate(pair, seconds, lambda: None)


def raycast(name: str, args: argparse.Namespace) -> float:
    """Return pairs a second of the ray caster."""
    import torch

    from seals.plugins.viewers.raycast import RendererRaycast
    from seals.rendering import Lens, Light
    from seals.rendering.camera import lengths
    from seals.rendering.optics import Sight

    scene, poses, cameras = catch(args.environments, args.detail)
    poses, cameras = (
        type(x)(*(torch.as_tensor(y).to(args.device) for y in x)) for x in (poses, cameras)
    )
    renderer = RendererRaycast(device=args.device, fused=args.fused, block=args.block)
    renderer.open(scene, Light())
    lens = Lens(width=SIZE, height=SIZE, fov=FOV)
    stretch = torch.as_tensor(lengths(lens).copy(), device=args.device)
    rays = torch.as_tensor(lens.rays().copy(), device=args.device) / stretch[..., None]
    optics = chain(name)
    surface = water(optics)
    noise = torch.Generator(device=args.device).manual_seed(0)
    axes = cameras.rotation.to(torch.float32).reshape(-1, 1, 3, 3)
    origins = cameras.origin.to(torch.float32).reshape(-1, 3)
    clock = [0]

    def through(picture: Any, some: slice) -> Any:
        ways = rays @ axes[some].transpose(-1, -2)
        view = Sight(
            picture.colour.flatten(0, 1)[some],
            picture.depth.flatten(0, 1)[some] * stretch,
            origins[some],
            ways,
        )
        return optics.look(view, surface, 0.01 * clock[0], noise)

    def batch() -> None:
        clock[0] += 1
        picture = renderer.render(poses, cameras, lens)
        if optics is not None:
            for k in range(0, 2 * args.environments, args.views):
                through(picture, slice(k, k + args.views))

    def settle() -> None:
        if args.device.startswith("cuda"):
            torch.cuda.synchronize()

    with torch.no_grad():
        return args.environments * rate(
            batch, args.seconds, settle, accelerated=args.device != "cpu"
        )


def rate(work: Any, seconds: float, settle: Any, *, accelerated: bool = False) -> float:
    """Return calls a second: the best of three stretches after two calls to warm up.

    On a processor the time is that of this program, beside which others may run.
    """
    clock = time.perf_counter if accelerated else time.process_time
    for _ in range(2):
        work()
    settle()
    best = 0.0
    for _ in range(3):
        count, start = 0, clock()
        while clock() - start < seconds / 3.0:
            work()
            settle()
            count += 1
        best = max(best, count / (clock() - start))
    return best


def main() -> int:
    """Measure and compare with what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--case", choices=["tiny", "raycast"], action="append")
    parser.add_argument("--optics", choices=list(CHAINS), action="append")
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--detail", choices=["simple", "visual"], default="simple")
    parser.add_argument("--environments", type=int, default=8)
    parser.add_argument("--views", type=int, default=256, help="views that optics take together")
    parser.add_argument("--block", type=float, default=0.0, help="memory of one array [MB]")
    parser.add_argument("--fused", action="store_true", help="by torch.compile")
    parser.add_argument("--seconds", type=float, default=6.0)
    args = parser.parse_args()
    if args.device == "cpu":
        one_thread()
    find_rooms()
    cases = args.case or (["tiny", "raycast"] if args.device == "cpu" else ["raycast"])
    print(describe())
    missed = 0
    for case in cases:
        for name in args.optics or list(CHAINS):
            start = time.perf_counter()
            found = tiny(name, args.seconds) if case == "tiny" else raycast(name, args)
            where = args.device if case == "raycast" else "cpu"
            asked = TARGETS.get((case if case == "tiny" else where.partition(":")[0], name))
            words = "" if asked is None else f"  asked: {asked:,.0f}"
            missed += asked is not None and found < asked
            print(
                f"{case:<8} {where:<5} optics {name:<12} {found:12,.1f} pairs/s{words}"
                f"  ({time.perf_counter() - start:.0f} s)",
                flush=True,
            )
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())
