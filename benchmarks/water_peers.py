"""Dam breaks beside SPlisHSPlasH (DFSPH): ``python benchmarks/water_peers.py --solver splish``.

A block of n diameters holds one particle less a side in SPlisHSPlasH, and a lattice that fits
between two walls is thrown apart there: both solvers get the column that stands, one row less a
side in the tank of `seals validate water martin_moyce`. It holds a fifth less water than that which
was measured, so errors are those of one column beside each other, not the solvers' own. Prints one
line of JSON. Needs ``pip install pysplishsplash`` (2.19.0; where its import crashes without a
display, link the GL libraries that it bundles to those of the system).

    python benchmarks/water_peers.py --solver pbf --across 8
    python benchmarks/water_peers.py --solver splish --case koshizuka_oka --threads 2
"""

from __future__ import annotations

import argparse
import json
import math
import os
import tempfile
import time
from pathlib import Path

import numpy as np

from seals.experiments.water_validation import dam_breaks
from seals.experiments.water_validation.box import advance, filled_box
from seals.experiments.water_validation.case import Grade
from seals.experiments.water_validation.dam_breaks import Course
from seals.plugins.fluids.coupling import Method

CORNERS = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
FACES = ["124", "143", "578", "586", "156", "162", "348", "387", "137", "175", "268", "284"]
# length of the floor over the width, end over the root of width over gravity
CASES = {"martin_moyce": (8.0, 4.4), "koshizuka_oka": (4.0, 3.1 / math.sqrt(2.0))}
SLICE = dam_breaks.SLICE
WIDTH = 1.0
"""Width of the tank's unit by the peer [m]: without viscosity the fall is alike at every width."""


def scene(folder: Path, inside: np.ndarray, counts: tuple[int, ...], d: float, step: float) -> Path:
    """Write a scene: a closed box of ``inside`` [m], and a lattice in its corner; y is up."""
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
    block = {"denseMode": 0, "start": [0.0] * 3, "end": [(n + 1) * d for n in counts]}
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


def counts_of(across: int) -> tuple[int, int, int]:
    """Particles along the floor, upwards and across the slice."""
    return across - 1, 2 * across - 1, SLICE - 1


class Record:
    """Course of a column, from the places of its particles with the height in the last row.

    Args:
        width: of the tank's unit [m].
        d: spacing [m].
    """

    def __init__(self, width: float, d: float) -> None:
        self.d, self.rows = d, [(0.0, width, 2.0 * width)]

    def look(self, at: float, p: np.ndarray) -> None:
        """Add a row."""
        ahead = np.sort(p[:, 0])[-2 * SLICE :]
        high = np.sort(p[p[:, 0] < 2.0 * self.d, 2])[-2 * SLICE :]
        top = high.mean() if len(high) else 0.0
        self.rows.append((at, ahead.mean() + 0.5 * self.d, top + 0.5 * self.d))

    def course(self, count: int) -> Course:
        """Return what was recorded."""
        return Course(*np.array(self.rows).T, count)


def seals(case: str, across: int, solver: str, threads: int) -> tuple[Course, float]:
    """Let the column fall by SEALS; return its course and its width [m]."""
    width = {"martin_moyce": dam_breaks.MARTIN_MOYCE, "koshizuka_oka": 0.146}[case]
    length, end = CASES[case]
    d, counts = width / across, counts_of(across)
    edge = np.array([counts[0], counts[2], counts[1]]) * d
    water = filled_box(
        (length * width, SLICE * d, 4.0 * width),
        d,
        lambda p: (p < edge).all(axis=1),
        grade=Grade(quick=True, threads=threads, solver=Method(solver)),
    )
    record, step = Record(width, d), 1e-3 * math.sqrt(width / 0.057)
    for k in range(1, round(end * math.sqrt(width / dam_breaks.GRAVITY) / step) + 1):
        advance(water, step)
        record.look(k * step, water.positions())
    water.close()
    return record.course(math.prod(counts)), width


def splish(case: str, across: int, step: float) -> tuple[Course, float]:
    """Let the column fall by SPlisHSPlasH; return its course and its width [m]."""
    import pysplishsplash as sph

    (length, end), d, counts = CASES[case], WIDTH / across, counts_of(across)
    inside = np.array([length * WIDTH, 4.0 * WIDTH, SLICE * d])
    base, folder = sph.Exec.SimulatorBase(), Path(tempfile.mkdtemp())
    base.init(
        sceneFile=str(scene(folder, inside, counts, d, step)),
        useGui=False,
        outputDir=str(folder / "out"),
        initialPause=False,
        useCache=False,
    )
    base.initSimulation()
    model = sph.Simulation.getCurrent().getFluidModel(0)
    assert model.numActiveParticles() == math.prod(counts)
    record, done = Record(WIDTH, d), [0]
    each = max(1, round(1e-3 * math.sqrt(WIDTH / 0.057) / step))

    def look() -> None:
        done[0] += 1
        if done[0] % each == 0:
            model = sph.Simulation.getCurrent().getFluidModel(0)
            p = np.array([model.getPosition(i) for i in range(model.numActiveParticles())])
            record.look(done[0] * step, p[:, [0, 2, 1]])

    base.setTimeStepCB(look)
    base.setValueFloat(base.STOP_AT, end * math.sqrt(WIDTH / dam_breaks.GRAVITY))
    base.runSimulation()
    return record.course(math.prod(counts)), WIDTH


def errors(case: str, found: Course, width: float) -> dict[str, float]:
    """Return the errors against the measurement [1]."""
    if case == "martin_moyce":
        unit = math.sqrt(width / dam_breaks.GRAVITY)
        lines = found.front_errors(width, unit)
        high = np.interp(np.array(dam_breaks.HEIGHT_T) * unit, found.time, found.height)
        off = abs(high / (2.0 * width) - np.array(dam_breaks.HEIGHT_H)).mean()
        return {line.what: round(line.error, 4) for line in lines} | {"height": round(off, 4)}
    unit = math.sqrt(width / (2.0 * dam_breaks.GRAVITY))
    front = np.interp(np.array(dam_breaks.KO_T) * unit, found.time, found.front) / width
    return {"tip": round(float(abs(front[1:] / np.array(dam_breaks.KO_Z[1:]) - 1.0).mean()), 4)}


def main() -> int:
    """Run a case and print its errors."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--solver", choices=("pbf", "dfsph", "splish"), default="pbf")
    parser.add_argument("--case", choices=CASES, default="martin_moyce")
    parser.add_argument("--across", type=int, default=16, help="spacings of the tank's unit")
    parser.add_argument("--step", type=float, default=1e-3, help="of SPlisHSPlasH [s]")
    parser.add_argument("--threads", type=int, default=2)
    args = parser.parse_args()
    os.environ["OMP_NUM_THREADS"] = str(args.threads)
    begin = time.perf_counter()
    if args.solver == "splish":
        found, width = splish(args.case, args.across, args.step)
    else:
        found, width = seals(args.case, args.across, args.solver, args.threads)
    row = {"solver": args.solver, "case": args.case, "across": args.across}
    row |= errors(args.case, found, width) | {"seconds": round(time.perf_counter() - begin, 1)}
    print(json.dumps(row))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
