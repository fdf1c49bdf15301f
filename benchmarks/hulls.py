"""Time of one hull query, alone and in a batch: ``python benchmarks/hulls.py``."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from seals.hydrostatics import (
    Hull,
    HullBox,
    HullCapsule,
    HullCompound,
    HullCylinder,
    HullMesh,
    HullSamples,
    HullSphere,
    HullTable,
)

BATCH = 1000
TARGETS = {"sphere": 5.0, "cylinder": 25.0, "box": 60.0, "mesh, 512 faces": 200.0}


def hulls() -> dict[str, Hull]:
    """Return one hull of each kind."""
    import trimesh

    pill = trimesh.creation.capsule(radius=0.1, height=0.4, count=[16, 16])
    box = HullBox(size=(0.4, 0.2, 0.1), rpy=(0.1, 0.2, 0.3))
    can = HullCylinder(radius=0.1, length=0.4, rpy=(0.1, 0.2, 0.3))
    ball = HullSamples.inside(
        lambda p: (p * p).sum(axis=1) < 0.01, low=(-0.1, -0.1, -0.1), high=(0.1, 0.1, 0.1)
    )
    return {
        "sphere": HullSphere(radius=0.1),
        "cylinder": can,
        "capsule": HullCapsule(radius=0.1, length=0.4),
        "box": box,
        "box and two cylinders": HullCompound(parts=[box, can, can]),
        f"mesh, {len(pill.faces)} faces": HullMesh(vertices=pill.vertices, faces=pill.faces),
        f"{len(ball.points)} samples": ball,
    }


def poses() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return normals (N, 3), Fortran-ordered, and levels (N, 1) at which hulls are partly wet."""
    rng = np.random.default_rng(0)
    up = rng.normal(size=(BATCH, 3))
    up /= np.sqrt((up * up).sum(axis=1))[:, None]
    return np.asfortranarray(up), rng.uniform(-0.04, 0.04, (BATCH, 1))


def fastest(call: Callable[[], object], repeats: int) -> float:
    """Return the shortest time of a call [us]."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return min(times) * 1e6


def main() -> None:
    """Print microseconds per call for each hull."""
    up, level = poses()
    rows = list(zip(list(np.ascontiguousarray(up)), level[:, 0].tolist(), strict=True))
    print(f"{'hull':24} {'one query [us]':>15} {'target':>8} {'build [ms]':>11} {'1000 [us]':>10}")
    for name, hull in hulls().items():

        def each(hull: Hull = hull) -> None:
            for normal, height in rows:
                hull.wetted(normal, height)

        def build(hull: Hull = hull) -> HullTable:
            return HullTable.build(hull)

        def batch(hull: Hull = hull) -> object:
            return HullTable.build(hull).lookup(up, level)

        one = fastest(each, 5) / BATCH
        built = fastest(build, 1) / 1e3
        many = fastest(batch, 30)
        target = TARGETS.get(name)
        goal = f"{target:8.0f}" if target else f"{'':8}"
        print(f"{name:24} {one:15.1f} {goal} {built:11.1f} {many:10.0f}")


if __name__ == "__main__":
    main()
