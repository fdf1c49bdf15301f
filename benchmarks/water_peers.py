"""Dam breaks of the validation by SPlisHSPlasH (DFSPH): ``python benchmarks/water_peers.py``.

Same column in spacings, walls and clock as `seals validate water martin_moyce` and `koshizuka_oka`;
prints their errors against the measurements as JSON, one line a case. Needs ``pip install
pysplishsplash`` (2.19.0; where its import crashes without a display, link the GL libraries that it
bundles to those of the system).

    python benchmarks/water_peers.py --across 16 --threads 2
    python benchmarks/water_peers.py --step 2e-3              a longer time step [s]
"""

from __future__ import annotations

import argparse
import json
import math
import os
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from seals.experiments.water_validation import dam_breaks
from seals.experiments.water_validation.dam_breaks import Course

CORNERS = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
FACES = ["124", "143", "578", "586", "156", "162", "348", "387", "137", "175", "268", "284"]
# length of the floor over the width, end over the root of width over gravity
CASES = {"martin_moyce": (8.0, 4.4), "koshizuka_oka": (4.0, 3.1 / math.sqrt(2.0))}
WIDTH = 1.0
"""Of the column [m]: without viscosity the fall is the same at every width, and lattices of 3.6 mm
(57 mm wide, 16 across) are thrown apart whatever the time step and the boundaries are."""


def scene(folder: Path, inside: np.ndarray, counts: tuple[int, ...], d: float, step: float) -> Path:
    """Write a scene: a closed box of ``inside`` [m] and a lattice in its corner; y is up."""
    lines = [f"v {x} {y} {z}" for x, y, z in CORNERS] + ["f " + " ".join(f) for f in FACES]
    (folder / "box.obj").write_text("\n".join(lines) + "\n")
    # samples lie on the box, half a spacing outside of the water's edge
    box = {
        "geometryFile": str(folder / "box.obj"),
        "translation": (inside / 2).tolist(),
        "rotationAxis": [1, 0, 0],
        "rotationAngle": 0,
        "scale": (inside + d).tolist(),
        "isDynamic": False,
        "isWall": True,
    }
    configuration = {
        "particleRadius": d / 2,
        "density0": 1000,
        "simulationMethod": 4,
        "gravitation": [0, -dam_breaks.GRAVITY, 0],
        "timeStepSize": step,
        "cflMethod": 0,
        "boundaryHandlingMethod": 0,
        "pause": False,
        "stopAt": -1,
        "sim2D": False,
        "maxIterations": 100,
        "maxError": 0.01,
        "maxErrorV": 0.1,
    }
    block = {"denseMode": 0, "start": [0.0] * 3, "end": [n * d for n in counts]}
    path = folder / "scene.json"
    path.write_text(
        json.dumps(
            {
                "Configuration": configuration,
                "Materials": [{"id": "Fluid", "viscosityMethod": 1, "viscosity": 0.0}],
                "RigidBodies": [box],
                "FluidBlocks": [block],
            }
        )
    )
    return path


def collapse(case: str, across: int, step: float) -> tuple[Course, dict[str, Any]]:
    """Let a column fall; return its course and what it cost."""
    import pysplishsplash as sph

    width, (length, end) = WIDTH, CASES[case]
    d = width / across
    counts = (across, 2 * across, dam_breaks.SLICE)
    inside = np.array([length * width, 4.0 * width, dam_breaks.SLICE * d])
    unit = math.sqrt(width / dam_breaks.GRAVITY)
    rows: list[tuple[float, float, float]] = []
    base = sph.Exec.SimulatorBase()
    folder = Path(tempfile.mkdtemp())
    base.init(
        sceneFile=str(scene(folder, inside, counts, d, step)),
        useGui=False,
        outputDir=str(folder / "out"),
        initialPause=False,
        useCache=False,
    )
    base.initSimulation()
    count = [0]
    each = max(1, round(1e-3 * math.sqrt(width / 0.057) / step))

    def look() -> None:
        count[0] += 1
        if count[0] % each:
            return
        model = sph.Simulation.getCurrent().getFluidModel(0)
        p = np.array([model.getPosition(i) for i in range(model.numActiveParticles())])
        ahead = np.sort(p[:, 0])[-2 * dam_breaks.SLICE :]
        at_wall = np.sort(p[p[:, 0] < 2.0 * d, 1])[-2 * dam_breaks.SLICE :]
        high = at_wall.mean() if len(at_wall) else 0.0
        rows.append((count[0] * step, ahead.mean() + 0.5 * d, high + 0.5 * d))

    base.setTimeStepCB(look)
    base.setValueFloat(base.STOP_AT, end * unit)
    begin = time.perf_counter()
    base.runSimulation()
    cost = {"seconds": round(time.perf_counter() - begin, 1), "steps": count[0]}
    at, front, high = np.array([(0.0, width, 2.0 * width), *rows]).T
    return Course(at, front, high, math.prod(counts)), cost


def main() -> int:
    """Run both cases and print their errors."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--case", choices=CASES, default="martin_moyce")
    parser.add_argument("--across", type=int, default=16, help="spacings of the column's width")
    parser.add_argument("--step", type=float, default=1e-3, help="time step [s]")
    parser.add_argument("--threads", type=int, default=2)
    args = parser.parse_args()
    os.environ["OMP_NUM_THREADS"] = str(args.threads)
    found, cost = collapse(args.case, args.across, args.step)
    width = WIDTH
    more: dict[str, float]
    lines = []
    if args.case == "martin_moyce":
        unit = math.sqrt(width / dam_breaks.GRAVITY)
        lines = list(dam_breaks.front_errors(found, width, unit))
        high = np.interp(np.array(dam_breaks.HEIGHT_T) * unit, found.time, found.height)
        off = abs(high / (2.0 * width) - np.array(dam_breaks.HEIGHT_H)).mean()
        more = {"height": round(float(off), 4)}
    else:
        unit = math.sqrt(width / (2.0 * dam_breaks.GRAVITY))
        front = np.interp(np.array(dam_breaks.KO_T) * unit, found.time, found.front) / width
        more = {
            "tip": round(float(np.abs(front[1:] / np.array(dam_breaks.KO_Z[1:]) - 1).mean()), 4)
        }
    errors = {line.what: round(line.error, 4) for line in lines}
    print(json.dumps({"case": args.case, "across": args.across, **errors, **more, **cost}))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
