"""Dam break of Martin and Moyce by SEALS' two solvers and by SPlisHSPlasH, in one run.

Same column, spacing and measurement for all: a slice six spacings thick, the front as the mean of
the foremost two rows, its error against the tables of 1952, also with the clock moved to fit.

    pip install pysplishsplash==2.19.0
    python benchmarks/water_peers.py --method pbf,dfsph,splish-dfsph --across 16

The wheel of SPlisHSPlasH ends in a segmentation fault at import where its GL libraries meet others:
in ``pysplishsplash.libs`` put links to libGLU, libGLX, libGLdispatch and libOpenGL of the system in
their place. No GL is used.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from seals.experiments.water_validation import dam_breaks as dam
from seals.experiments.water_validation.case import Grade
from seals.plugins.fluids.coupling import Device, Method

WIDTH = 0.05715
UNIT = float(np.sqrt(WIDTH / dam.GRAVITY))
UNTIL, EVERY, STEP = 4.4 * UNIT, 1e-3, 5e-4
"""End [s], time between rows, and step of the peer [s]."""
METHODS = {"splish-pbf": 2, "splish-dfsph": 4}
CUBE = """\
v -.5 -.5 -.5
v -.5 -.5 .5
v -.5 .5 -.5
v -.5 .5 .5
v .5 -.5 -.5
v .5 -.5 .5
v .5 .5 -.5
v .5 .5 .5
f 1 2 4
f 1 4 3
f 5 7 8
f 5 8 6
f 1 5 6
f 1 6 2
f 3 4 8
f 3 8 7
f 1 3 7
f 1 7 5
f 2 6 8
f 2 8 4
"""


def size_of(spacing: float) -> tuple[float, float, float]:
    """Return length, height and width of the tank [m]."""
    return 8.0 * WIDTH, 4.0 * WIDTH, dam.SLICE * spacing


def scene_of(method: int, spacing: float, folder: Path) -> dict[str, Any]:
    """Return the scene of the peer; its y axis points up."""
    r, size = 0.5 * spacing, size_of(spacing)
    return {
        "Configuration": {
            "particleRadius": r, "density0": 1000, "simulationMethod": method,
            "gravitation": [0, -dam.GRAVITY, 0], "timeStepSize": STEP, "cflMethod": 0,
            "boundaryHandlingMethod": 0, "pause": False, "stopAt": UNTIL, "sim2D": False,
            "enableZSort": True, "maxIterations": 100, "maxError": 0.01,
        },
        "Materials": [{"id": "Fluid", "viscosityMethod": 1, "viscosity": 0.01}],
        "RigidBodies": [{
            "geometryFile": str(folder / "box.obj"), "translation": [0.5 * x for x in size],
            "rotationAxis": [1, 0, 0], "rotationAngle": 0,
            "scale": [x + spacing for x in size], "isDynamic": False, "isWall": True,
            "mapInvert": True, "mapThickness": 0.0, "mapResolution": [20, 20, 5],
        }],
        "FluidBlocks": [{"denseMode": 0, "start": [0.0, 0.0, 0.0],
                         "end": [WIDTH, 2.0 * WIDTH, dam.SLICE * spacing]}],
    }  # fmt: skip


def peer(name: str, spacing: float) -> dam.Course:
    """Simulate the collapse with SPlisHSPlasH."""
    import pysplishsplash as sph

    rows: list[tuple[float, float, float]] = []
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "box.obj").write_text(CUBE, encoding="utf-8")
        scene = folder / "scene.json"
        scene.write_text(json.dumps(scene_of(METHODS[name], spacing, folder)), encoding="utf-8")
        base = sph.Exec.SimulatorBase()
        base.init(sceneFile=str(scene), useGui=False, outputDir=place, initialPause=False,
                  useCache=False)  # fmt: skip
        base.initSimulation()
        count, lost = [0], [0]

        def look() -> None:
            """Note front and height after a step."""
            now = sph.TimeManager.getCurrent().getTime()
            if len(rows) * EVERY > now + 1e-9:
                return
            model = sph.Simulation.getCurrent().getFluidModel(0)
            count[0] = model.numActiveParticles()
            p = np.array([model.getPosition(i) for i in range(count[0])])
            # what got through the walls is no front
            p = p[((p > -spacing) & (p < np.array(size_of(spacing)) + spacing)).all(axis=1)]
            lost[0] = count[0] - len(p)
            ahead = np.sort(p[:, 0])[-2 * dam.SLICE :]
            top = np.sort(p[p[:, 0] < 2.0 * spacing, 1])[-2 * dam.SLICE :]
            high = float(top.mean()) if len(top) else 0.0
            rows.append((now, float(ahead.mean()) + 0.5 * spacing, high + 0.5 * spacing))

        base.setTimeStepCB(look)
        base.setValueFloat(base.STOP_AT, UNTIL)
        base.runSimulation()
    if lost[0]:
        print(f"{name}: {lost[0]} of {count[0]} particles got through the walls", flush=True)
    when, front, high = np.array(rows).T
    return dam.Course(when, front, high, count[0])


def figures(name: str, across: float, threads: int) -> dict[str, Any]:
    """Return errors and cost of one method."""
    spacing, begin, cpu = WIDTH / across, time.perf_counter(), time.process_time()
    if name in METHODS:
        found = peer(name, spacing)
    else:
        grade = Grade(True, Device.cpu, threads, Method(name))
        found = dam.collapse(WIDTH, 2.0 * WIDTH, 8.0 * WIDTH, spacing, UNTIL, grade)
    front, shifted = dam.front_errors(found, WIDTH, UNIT)
    return {
        "method": name,
        "particles": found.particles,
        "spacing_mm": round(1e3 * spacing, 3),
        "front_error": round(front.error, 4),
        "clock_moved": shifted.what,
        "front_error_clock_moved": round(shifted.error, 4),
        "wall_s": round(time.perf_counter() - begin, 1),
        "cpu_s": round(time.process_time() - cpu, 1),
    }


def main() -> int:
    """Run the methods one after the other."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--method", default="pbf,dfsph,splish-dfsph")
    parser.add_argument("--across", type=float, default=16.0, help="spacings across the column")
    parser.add_argument("--threads", type=int, default=0)
    args = parser.parse_args()
    known = [*(m.value for m in Method), *METHODS]
    for name in args.method.split(","):
        if name not in known:
            print(f"{name!r} is unknown.\nAllowed: {', '.join(known)}")
            return 2
    if len(set(args.method.split(",")) & set(METHODS)) > 1:
        print("SPlisHSPlasH holds one simulation a process.\nName one method of it a run.")
        return 2
    for name in args.method.split(","):
        print(json.dumps(figures(name, args.across, args.threads)), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
