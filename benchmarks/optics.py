"""Images a second of underwater optics alone: ``python benchmarks/optics.py``.

``--torch`` takes PyTorch instead of NumPy, ``--device cuda`` an accelerator, ``--batch`` the
numbers of views taken together. Pictures of 128 x 128 pixels: a camera under water that looks at
the floor, and, as ``split``, one half in the water, for which every step of the chain is needed.
"""

from __future__ import annotations

import argparse
import math
import time
from typing import Any

from machine import describe, median, one_thread

SIZE = 128
TARGETS = {"attenuation": 1500.0, "full": 500.0}
KINDS: dict[str, dict[str, Any]] = {
    "attenuation": {"blur": False, "caustics": False, "surface": False, "noise": False},
    "full": {},
    "split": {},
}


def view(kind: str, count: int) -> Any:
    """Return views of a floor: ranges, directions, colours and normals, in NumPy, float32."""
    import numpy as np

    from seals.rendering.optics import Sight

    half = math.tan(0.65)
    across = (np.arange(SIZE) + 0.5 - 0.5 * SIZE) * (2.0 * half / SIZE)
    right, up = np.meshgrid(across, -across)
    # as in a catch: the camera 1.2 m above the floor, looking 50 degrees down, or straight ahead
    height, tilt = (-2.0, math.radians(-50.0)) if kind != "split" else (0.01, -0.1)
    line = np.stack(
        [
            math.cos(tilt) - up * math.sin(tilt),
            -right,
            math.sin(tilt) + up * math.cos(tilt),
        ],
        axis=-1,
    )
    line /= np.linalg.norm(line, axis=-1, keepdims=True)
    down = np.where(line[..., 2] < -1e-3, line[..., 2], np.nan)
    ranges = np.nan_to_num((-3.2 - height) / down, nan=np.inf)
    rng = np.random.default_rng(0)
    colour = rng.uniform(0.1, 0.9, (count, SIZE, SIZE, 3))
    normals = np.broadcast_to((0.0, 0.0, 1.0), colour.shape)
    place = np.column_stack([rng.uniform(-1.0, 1.0, (count, 2)), np.full(count, height)])
    parts = (
        colour,
        np.tile(ranges, (count, 1, 1)),
        place,
        np.tile(line, (count, 1, 1, 1)),
        normals,
    )
    return Sight(*(np.ascontiguousarray(part, dtype=np.float32) for part in parts))


def rate(kind: str, count: int, *, torch: bool, device: str) -> float:
    """Return images a second, once."""
    import numpy as np

    from seals.rendering.optics import Optics, Sight, SurfaceAiry, SurfaceStill, SurfaceSum, ripples

    optics, views = Optics(water_type="coastal_5", **KINDS[kind]), view(kind, count)
    sea = SurfaceSum(SurfaceAiry([0.03], [[2.0, 0.6]], [4.5], [0.3]), ripples(wind=2.0, seed=3))
    surface = sea if optics.surface else SurfaceStill()
    rng: Any = np.random.default_rng(1)
    if torch:
        import torch as library

        views = Sight(*(library.from_numpy(part).to(device) for part in views))
        rng = library.Generator(device=device).manual_seed(1) if optics.noise else None
    repeats = max(1, (64 if device == "cpu" else 4096) // count)
    times: Any = np.linspace(0.0, 1.0, count, dtype=np.float32)
    if torch:
        times = library.from_numpy(times).to(device)

    def run(number: int) -> None:
        for _ in range(number):
            seen = optics.look(views, surface, times, rng)
        if device != "cpu":
            float(seen.sum())

    run(1)
    start = time.perf_counter()
    run(repeats)
    return repeats * count / (time.perf_counter() - start)


def main() -> None:
    """Print a table of images a second: median, lowest and highest of five."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--torch", action="store_true")
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--batch", type=int, nargs="+", default=[1, 4, 32])
    given = parser.parse_args()
    torch = given.torch or given.device != "cpu"
    if torch and given.device == "cpu":
        import torch as library

        library.set_num_threads(1)
    print(f"{describe()}, {'torch on ' + given.device if torch else 'numpy'}, {SIZE} x {SIZE}")
    print(f"{'chain':12} {'batch':>6} {'images/s':>9} {'from':>8} {'to':>8} {'target':>7}")
    for kind in KINDS:
        for count in given.batch:

            def once(kind: str = kind, count: int = count) -> float:
                return rate(kind, count, torch=torch, device=given.device)

            middle, low, high = median(once, 5)
            goal = f"{TARGETS[kind]:7.0f}" if kind in TARGETS else ""
            print(f"{kind:12} {count:6} {middle:9.0f} {low:8.0f} {high:8.0f} {goal}")


if __name__ == "__main__":
    one_thread()
    main()
