"""Pings and lidar turns a second: ``python benchmarks/sonar.py``.

One core, NumPy, in processor time; with ``--device cuda`` pings by PyTorch on a card, by the clock.
The scene: sea bed 3 m below, a wall, a pile, a crate, a rock, and a crab of 20
links as they stand in a run. A ping is casting, scattering, beam patterns, speckle and noise; its
files are not written. ``--check`` ends with 1 where 512 beams x 512 bins take longer than 0.1 s.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from typing import Any

from machine import describe, one_thread

WORDS = [
    *("robot=auv", "water=fossen", "environment.tank_bottom=-4", "initial.position=[0,0,-1]"),
    "environment.salinity=[[0,35]]",
    "+environment.obstacles.pile={type: cylinder, size: [0.15, 4], position: [5, 2.2, -2]}",
    "+environment.obstacles.crate={type: box, size: [0.8, 0.8, 0.6], position: [4, -1.2, -3.7]}",
    "+environment.obstacles.wall={type: box, size: [0.3, 5, 2], position: [8.2, -1, -3]}",
    "+environment.obstacles.rock={type: sphere, size: [0.35], position: [3.2, 0.8, -3.9]}",
    "+objects.crab={robot: crab, position: [3, -0.2, -3.97]}",
    *("+sensor@sensors.sonar=sonar", "+sensor@sensors.lidar=lidar", "time.duration=1"),
]
CASES: dict[str, dict[str, Any]] = {
    "forward, 512 x 512, 16 rays": {"beams": 512, "bins": 512, "rays": 16},
    "forward, 512 x 512, 32 rays": {"beams": 512, "bins": 512, "rays": 32},
    "shipped +sonar=forward, 64 rays": {"beams": 512, "bins": 512, "rays": 64},
    "512 x 512 x 32 with multipath": {"beams": 512, "bins": 512, "rays": 32, "multipath": True},
    "forward, 256 x 256, 32 rays": {},
    "side scan, 1 x 512, 256 rays": {
        **{"beams": 1, "bins": 512, "rays": 256, "sector": 0.0},
        **{"beam_width": 0.0087, "vertical_width": 0.8727},
    },
}


def rate(work: Callable[[], Any], seconds: float, clock: Callable[[], float]) -> float:
    """Calls a second: the best of blocks, for others use the machine as well."""
    work()
    best, end = 0.0, time.perf_counter() + seconds
    while time.perf_counter() < end:
        start = clock()
        for _ in range(5):
            work()
        best = max(best, 5.0 / (clock() - start))
    return best


def main() -> int:
    """Print the table."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--seconds", type=float, default=3.0, help="of each case")
    options.add_argument("--device", default="numpy", help="numpy, cpu or cuda")
    options.add_argument("--check", action="store_true", help="end with 1 below 10 pings a second")
    chosen = options.parse_args()
    one_thread()
    import numpy as np

    from seals.api import make
    from seals.plugins.sensors.lidar import SensorLidar
    from seals.plugins.sensors.sonar import SensorSonar
    from seals.sensors.protocol import SensorInput

    world = make(WORDS)
    world.step()
    around, zero = world.actors["robot"].sensor_suite.around, np.zeros(3)

    def felt(height: float) -> SensorInput:
        here = np.array([0.0, 0.0, height])
        return SensorInput(0.0, 0.01, here, np.eye(3), zero, zero, zero, zero, around=around)

    # one thread of NumPy is busy all the time; a card and torch's threads are not counted by it
    clock = time.process_time if chosen.device == "numpy" else time.perf_counter
    print(describe())
    rng, found = np.random.default_rng(0), {}
    for name, values in CASES.items():
        if "multipath" in values and chosen.device != "numpy":
            continue
        sonar = SensorSonar(farthest=10.0, device=chosen.device, **values)
        found[name] = rate(lambda sonar=sonar: sonar.ping(felt(-1.0), rng), chosen.seconds, clock)
    for rings, points in ((1, 360), (16, 900)):
        lidar = SensorLidar(rings=rings, points=points)
        name = f"lidar, {rings} x {points}"
        found[name] = rate(lambda lidar=lidar: lidar.scan(felt(1.0), rng), chosen.seconds, clock)
    for name, value in found.items():
        print(f"{name:<32}{value:>8.1f} Hz")
    world.close()
    return int(chosen.check and found["forward, 512 x 512, 32 rays"] < 10.0)


if __name__ == "__main__":
    sys.exit(main())
