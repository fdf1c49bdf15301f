"""Speed of the particle water on a dam break: ``python benchmarks/fluid.py --size 50k``.

A block of water, 1.0 x 0.5 x 1.0 m, collapses in a tank of 3.2 x 0.5 x 2.0 m whose walls are
boundary samples, with XSPH and a fixed number of iterations. Prints a table and one JSON line.
Needs Taichi and NumPy only; it also runs from a checkout that is not installed.

    python benchmarks/fluid.py --device cuda --size 4m --variant list
    python benchmarks/fluid.py --size 50k --peer genesis        (pip install genesis-world torch)
    python benchmarks/fluid.py --size 50k --peer splish         (pip install pysplishsplash)
    python benchmarks/fluid.py --size 50k --peer warp           (pip install warp-lang)
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).parents[1]
TANK = np.array([3.2, 0.5, 2.0])
# spacing [m] and particles along x, y, z
SIZES = {
    "10k": (0.0365, (27, 13, 27)),
    "50k": (0.0215, (46, 23, 46)),
    "100k": (0.0170, (58, 29, 58)),
    "1m": (0.0079, (127, 63, 127)),
    "4m": (0.0050, (200, 100, 200)),
    "16m": (0.00315, (317, 158, 317)),
}
STEP_50K = 2e-3
# bytes that a substep must move per particle: once, and for each iteration (list, cells)
FLOOR = {"list": (480, 292), "cells": (220, 44)}


def options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", choices=SIZES, default="50k")
    parser.add_argument("--device", choices=("cpu", "cuda"), default="cpu")
    parser.add_argument("--variant", choices=("list", "cells", "auto"), default="auto")
    parser.add_argument("--threads", type=int, default=0, help="0: all")
    parser.add_argument("--iterations", type=int, default=4)
    parser.add_argument("--kernel", default="spline")
    parser.add_argument("--steps", type=int, default=20, help="substeps timed")
    parser.add_argument("--skip", type=int, default=20, help="substeps before")
    parser.add_argument("--deterministic", action="store_true")
    parser.add_argument("--fine", type=int, default=0, help="cells per support along z; 0: default")
    parser.add_argument(
        "--plain", action="store_true", help="XSPH alone: pressure not made even, flow not calmed"
    )
    parser.add_argument("--peer", choices=("genesis", "splish", "warp"))
    parser.add_argument("--peers", default="", help="folder of the peers' scripts")
    return parser.parse_args()


def install_free() -> None:
    """Make ``seals.plugins`` importable from a checkout that is not installed."""
    if importlib.util.find_spec("seals") is None:
        sys.path.insert(0, str(ROOT))
    import seals

    if importlib.util.find_spec("seals.plugins") is None:
        folder = ROOT / "plugins"
        spec = importlib.util.spec_from_file_location(
            "seals.plugins", folder / "__init__.py", submodule_search_locations=[str(folder)]
        )
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules["seals.plugins"] = module
        spec.loader.exec_module(module)
        seals.plugins = module  # type: ignore[attr-defined]


def block(counts: tuple[int, int, int], spacing: float) -> NDArray[np.float64]:
    """Return the water's lattice, in the corner of the tank."""
    axes = [spacing * (np.arange(n) + 0.5) for n in counts]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)


def walls(inside: NDArray[np.float64], spacing: float) -> NDArray[np.float64]:
    """Return one layer of samples half a spacing outside of a box that stands at the origin."""
    counts = np.round(inside / spacing).astype(int)
    axes = [spacing * (np.arange(n + 2) - 0.5) for n in counts]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    shell = np.ones(grid.shape[:3], dtype=bool)
    shell[1:-1, 1:-1, 1:-1] = False
    return np.asarray(grid[shell])


def build(args: argparse.Namespace) -> Any:
    """Return the water of the chosen size."""
    from seals.plugins.fluids.solvers.pbf import pipeline

    if args.fine:
        pipeline.FINE_CPU = pipeline.FINE_CUDA = args.fine
    from seals.plugins.fluids.solver import Domain
    from seals.plugins.fluids.solvers.pbf.choices import Kernel, Search
    from seals.plugins.fluids.solvers.pbf.engine import Engine
    from seals.plugins.fluids.solvers.pbf.settings import PbfSettings
    from seals.plugins.fluids.solvers.pbf.solver import SolverPbf

    spacing, counts = SIZES[args.size]
    inside = np.round(TANK / spacing) * spacing
    inside[1] = counts[1] * spacing
    points, samples = block(counts, spacing), walls(inside, spacing)
    plain = (
        {"stress_correction": 0.0, "artificial_viscosity": 0.0, "viscosity": 30.0}
        if args.plain
        else {}
    )
    settings = PbfSettings(
        iterations=args.iterations,
        kernel=Kernel(args.kernel),
        search=Search(args.variant),
        deterministic=args.deterministic,
        **plain,
    )
    water = SolverPbf(
        Domain(
            spacing=spacing,
            lower=np.full(3, -spacing),
            upper=inside + spacing,
            capacity=len(points),
            boundary_capacity=len(samples),
            bodies=0,
        ),
        settings=settings,
        engine=Engine(device=args.device, threads=args.threads, cache=False),
    )
    water.add_boundary(body=0, points=samples)
    water.add_particles(points, trusted=True)
    return water


def stages(water: Any, sync: Callable[[], None], repeats: int = 10) -> dict[str, float]:
    """Return the shortest time of each stage of a substep [ms]."""
    from seals.plugins.fluids.solvers.pbf.fields import buffers

    pipeline = water.pipeline
    found: dict[str, list[float]] = {}

    def timed(name: str, call: Callable[..., object], *given: object) -> None:
        start = time.perf_counter()
        call(*given)
        sync()
        found.setdefault(name, []).append(1e3 * (time.perf_counter() - start))

    for _ in range(repeats):
        timed("sort", pipeline.sorting.begin)
        timed("neighbours", pipeline.sorting.survey)
        for sweep, (gain, memory) in enumerate(pipeline.schedule):
            src, dst = buffers(sweep)
            timed("multipliers", pipeline.pressure.multipliers, src, gain, memory)
            timed("displace", pipeline.pressure.displace, src, dst)
        timed("close", pipeline.finish.close, buffers(len(pipeline.schedule))[0])
    return {name: round(min(times), 3) for name, times in found.items()}


def measure(args: argparse.Namespace) -> dict[str, Any]:
    """Run the case and return its figures."""
    begin = time.perf_counter()
    water = build(args)
    from seals.plugins.fluids.solvers.pbf.language import ti

    built = time.perf_counter()
    step = STEP_50K * water.spacing / SIZES["50k"][0]
    water.advance(step, substeps=1)
    first = time.perf_counter() - built
    water.advance(step * args.skip, substeps=args.skip)
    ti.sync()
    wall, cpu = [], time.process_time()
    for _ in range(args.steps):
        start = time.perf_counter()
        water.pipeline.substep(static_changed=False)
        ti.sync()
        wall.append(time.perf_counter() - start)
    cpu = (time.process_time() - cpu) / args.steps
    start = time.perf_counter()
    for _ in range(args.steps):
        water.pipeline.substep(static_changed=False)
    ti.sync()
    flow = (time.perf_counter() - start) / args.steps
    best = min(*wall, flow)
    count = water.count
    listed = "list" if water.pipeline.particles.longest else "cells"
    once, each = FLOOR[listed]
    return {
        "case": "seals-pbd",
        "size": args.size,
        "particles": count,
        "boundary": water.boundary.count,
        "device": args.device,
        "threads": args.threads or len(os.sched_getaffinity(0)),
        "variant": listed,
        "iterations": args.iterations,
        "best_ms": round(best * 1e3, 3),
        "median_ms": round(statistics.median(wall) * 1e3, 3),
        "pipelined_ms": round(flow * 1e3, 3),
        "cpu_ms": round(cpu * 1e3, 2),
        "million_particle_iterations_per_s": round(count * args.iterations / best / 1e6, 2),
        "gigabytes_per_s_of_floor": round(count * (once + each * args.iterations) / best / 1e9, 1),
        "build_s": round(built - begin, 2),
        "first_step_s": round(first, 2),
        "peak_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024,
        "load": round(os.getloadavg()[0], 1),
        "stages_ms": stages(water, ti.sync),
        "mean_compression": round(water.advance(step, substeps=1).mean_compression, 5),
        "front_m": round(float(water.positions()[:, 0].max()), 4),
    }


def run_peer(args: argparse.Namespace) -> int:
    """Run a peer's script of the same dam break, with this interpreter."""
    folder = Path(args.peers or os.environ.get("SEALS_PEERS", ROOT.parent / "shared" / "peers"))
    script = folder / f"fluid_{args.peer}.py"
    if not script.exists():
        print(f"No peer script {script}.\nName its folder with --peers or SEALS_PEERS.")
        return 2
    command = [sys.executable, str(script), "--size", args.size, "--device", args.device]
    command += ["--threads", str(args.threads or len(os.sched_getaffinity(0)))]
    if args.peer == "genesis":
        command += ["--iters", str(args.iterations), "--dt", str(STEP_50K)]
    return subprocess.call(command)


def main() -> int:
    """Run the benchmark, or a peer beside it."""
    args = options()
    if args.peer:
        return run_peer(args)
    install_free()
    found = measure(args)
    for name, value in found.items():
        print(f"{name:36s} {value}")
    print(json.dumps(found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
