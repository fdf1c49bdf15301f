"""Speed of the particle water on a dam break: ``python benchmarks/fluid.py --size 50k``.

A block of water, 1.0 x 0.5 x 1.0 m, collapses in a tank of 3.2 x 0.5 x 2.0 m whose walls are
boundary samples, with XSPH and a fixed number of iterations. Prints a table and one JSON line.
Needs Taichi and NumPy only; it also runs from a checkout that is not installed.

    python benchmarks/fluid.py --device cuda --size 4m --variant list
    python benchmarks/fluid.py --device cuda --size 100k,1m,4m --solver pbf,dfsph --out speed.json
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
    parser.add_argument("--size", default="50k", help=f"one or more of {', '.join(SIZES)}")
    parser.add_argument("--solver", default="pbf", help="pbf, dfsph or both")
    parser.add_argument("--compression", type=float, default=1e-4, help="goal of dfsph")
    parser.add_argument("--divergence", type=float, default=1e-4, help="goal of dfsph")
    parser.add_argument("--out", type=Path, help="file that holds all cases, written after each")
    parser.add_argument("--limit", type=float, default=1e9, help="no case begins later [s]")
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
    from seals.plugins.fluids.solvers import device_pipeline

    if args.fine:
        device_pipeline.FINE_CPU = device_pipeline.FINE_CUDA = args.fine
    from seals.plugins.fluids.solver import Domain
    from seals.plugins.fluids.solvers.device_settings import Kernel, Search
    from seals.plugins.fluids.solvers.dfsph.settings import DfsphOptions, DfsphSettings
    from seals.plugins.fluids.solvers.pbf.settings import PbfSettings

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
    goals = DfsphOptions(compression=args.compression, divergence=args.divergence)
    chosen = settings if args.solver == "pbf" else DfsphSettings.of(settings, goals)
    water = chosen.build(
        Domain(
            spacing=spacing,
            lower=np.full(3, -spacing),
            upper=inside + spacing,
            capacity=len(points),
            boundary_capacity=len(samples),
            bodies=0,
        ),
        device=args.device,
        threads=args.threads,
    )
    water.add_boundary(body=0, points=samples)
    water.add_particles(points, trusted=True)
    return water


def alone(stage: Callable[[], None]) -> Any:
    """Return the kernel that runs one device function of a substep."""
    from seals.plugins.fluids.solvers.pbf.language import ti

    @ti.kernel
    def run():  # type: ignore[no-untyped-def]  # noqa: ANN202
        stage()

    return run


def stages(water: Any, sync: Callable[[], None], repeats: int = 10) -> dict[str, float]:
    """Return the shortest time of each stage of a substep [ms]; iterations once each."""
    pipeline = water.pipeline
    found: dict[str, list[float]] = {}
    calls: list[tuple[str, Callable[..., object], tuple[Any, ...]]] = [
        ("sort", alone(pipeline.sorting.begin), ()),
        ("neighbours", alone(pipeline.sorting.survey), ()),
    ]
    if pipeline.in_place:
        own = pipeline.incompressible
        calls += [
            ("factors", own.factors, ()),
            ("correct_divergence", own.correct_divergence, (0.5, 0.0)),
            ("correct_density", own.correct_density, (0.5, 0.0)),
            ("accelerate", own.accelerate, (0,)),
        ]
    else:
        calls += [
            ("open", alone(pipeline.pressure.open), ()),
            ("displace", alone(pipeline.pressure.displace), ()),
            ("iteration", pipeline.kernels.iteration, (1, False, False)),
        ]
    calls.append(("close", alone(pipeline.finish.close), ()))
    for _ in range(repeats):
        for name, call, given in calls:
            start = time.perf_counter()
            call(*given)
            sync()
            found.setdefault(name, []).append(1e3 * (time.perf_counter() - start))
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
    wall, done, cpu = [], [], time.process_time()
    for _ in range(args.steps):
        start = time.perf_counter()
        done.append(water.pipeline.substep(static_changed=False))
        ti.sync()
        wall.append(time.perf_counter() - start)
    cpu = (time.process_time() - cpu) / args.steps
    start = time.perf_counter()
    more = [water.pipeline.substep(static_changed=False) for _ in range(args.steps)]
    ti.sync()
    flow = (time.perf_counter() - start) / args.steps
    # iterations of a solver that stops by itself differ from substep to substep: means go together
    mean = min(statistics.fmean(wall), flow)
    best = min(*wall, flow) if args.solver == "pbf" else mean
    count, iterations = water.count, statistics.fmean(done + more)
    listed = "list" if water.pipeline.particles.longest else "cells"
    once, each = FLOOR[listed]
    squeezed = water.advance(step, substeps=1)
    front = round(float(water.positions()[:, 0].max()), 4)
    row = {
        "case": f"seals-{args.solver}",
        "size": args.size,
        "particles": count,
        "boundary": water.boundary.count,
        "device": args.device,
        "threads": args.threads or len(os.sched_getaffinity(0)),
        "variant": listed,
        "iterations": round(iterations, 2),
        "substep_ms": round(step * 1e3, 4),
        "best_ms": round(best * 1e3, 3),
        "median_ms": round(statistics.median(wall) * 1e3, 3),
        "pipelined_ms": round(flow * 1e3, 3),
        "seconds_per_simulated_second": round(mean / step, 2),
        "cpu_ms": round(cpu * 1e3, 2),
        "million_particle_iterations_per_s": round(count * iterations / best / 1e6, 2),
        "gigabytes_per_s_of_floor": round(count * (once + each * iterations) / best / 1e9, 1),
        "build_s": round(built - begin, 2),
        "first_step_s": round(first, 2),
        "peak_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024,
        "load": round(os.getloadavg()[0], 1),
        "mean_compression": round(squeezed.mean_compression, 6),
        "max_compression": round(squeezed.max_compression, 5),
        "front_m": front,
        # last: they leave the water in disorder
        "stages_ms": stages(water, ti.sync),
    }
    water.close()
    return row


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


def cases(args: argparse.Namespace) -> list[dict[str, Any]]:
    """Run every size by every solver; the file holds what is done after each."""
    found: list[dict[str, Any]] = []
    begin = time.perf_counter()
    for size in args.size.split(","):
        for solver in args.solver.split(","):
            one = argparse.Namespace(**{**vars(args), "size": size, "solver": solver})
            spent = time.perf_counter() - begin
            if spent > args.limit:
                found.append({"case": f"seals-{solver}", "size": size, "left_out_at_s": spent})
            else:
                try:
                    found.append(measure(one))
                except Exception as error:  # the other cases count as well
                    found.append({"case": f"seals-{solver}", "size": size, "error": repr(error)})
            for name, value in found[-1].items():
                print(f"{name:36s} {value}", flush=True)
            print(json.dumps(found[-1]), flush=True)
            if args.out is not None:
                args.out.parent.mkdir(parents=True, exist_ok=True)
                args.out.write_text(json.dumps(found, indent=1))
    return found


def main() -> int:
    """Run the benchmark, or a peer beside it."""
    args = options()
    if args.peer:
        return run_peer(args)
    install_free()
    for given, allowed in ((args.size, SIZES), (args.solver, ("pbf", "dfsph"))):
        for name in given.split(","):
            if name not in allowed:
                print(f"{name!r} is unknown.\nAllowed: {', '.join(allowed)}")
                return 2
    return int(any("error" in case for case in cases(args)))


if __name__ == "__main__":
    sys.exit(main())
