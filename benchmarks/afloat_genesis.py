"""Floating sphere in the particle fluid of Genesis, the case of `seals validate water`.

Run with an interpreter that has Genesis (``pip install genesis-world torch``):

    python benchmarks/afloat_genesis.py --solver pbd
    python benchmarks/afloat_genesis.py --solver sph

It prints the draught over the last third against Archimedes', and the time it took.
"""

from __future__ import annotations

import argparse
import json
import time
from typing import Any

import numpy as np

RADIUS, RATIO, TANK = 0.1, 0.5, (0.6, 0.6, 0.4)
ABOVE = 0.01
"""Height above its rest at which the sphere is let go [m]."""


def options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--solver", choices=("pbd", "sph"), default="pbd")
    parser.add_argument("--spacing", type=float, default=0.02)
    parser.add_argument("--until", type=float, default=2.4)
    parser.add_argument("--device", choices=("cpu", "cuda"), default="cpu")
    return parser.parse_args()


def scene_of(args: argparse.Namespace, gs: Any) -> tuple[Any, Any, Any, float]:
    """Build tank, water and sphere; return scene, water, sphere and step [s]."""
    half = np.array(TANK[:2]) / 2
    bounds = {
        "lower_bound": (-half[0], -half[1], -TANK[2]),
        "upper_bound": (half[0], half[1], 0.6),
        "particle_size": args.spacing,
    }
    if args.solver == "pbd":
        step, substeps = 4e-3, 4
        more = {"pbd_options": gs.options.PBDOptions(max_density_solver_iterations=4, **bounds)}
        material = gs.materials.PBD.Liquid(sampler="regular", rho=1000.0)
    else:
        step, substeps = 4e-3, 10
        more = {"sph_options": gs.options.SPHOptions(**bounds)}
        material = gs.materials.SPH.Liquid(sampler="regular", rho=1000.0)
    scene = gs.Scene(
        sim_options=gs.options.SimOptions(dt=step, substeps=substeps), show_viewer=False, **more
    )
    edge = 0.5 * args.spacing
    sphere = scene.add_entity(
        material=gs.materials.Rigid(rho=1000.0 * RATIO, needs_coup=True),
        morph=gs.morphs.Sphere(pos=(0.0, 0.0, ABOVE), radius=RADIUS),
    )
    water = scene.add_entity(
        material=material,
        morph=gs.morphs.Box(
            lower=(-half[0] + edge, -half[1] + edge, -TANK[2] + edge),
            upper=(half[0] - edge, half[1] - edge, 0.0),
        ),
    )
    scene.build()
    return scene, water, sphere, step


def main() -> None:
    """Simulate the floating sphere and print the result."""
    args = options()
    import genesis as gs

    gs.init(
        backend=gs.cuda if args.device == "cuda" else gs.cpu,
        logging_level="warning",
        precision="32",
    )
    scene, water, sphere, step = scene_of(args, gs)
    begun, heights = time.perf_counter(), []
    for _ in range(round(args.until / step)):
        scene.step()
        heights.append(float(sphere.get_pos().cpu().numpy().ravel()[2]))
    seconds = time.perf_counter() - begun
    places = np.asarray(water.get_particles_pos().cpu()).reshape(-1, 3)
    height = float(np.mean(heights[-len(heights) // 3 :]))
    # the level that the particles and the sphere fill together
    sunk = RATIO * 4.0 / 3.0 * np.pi * RADIUS**3
    level = (len(places) * args.spacing**3 + sunk) / (TANK[0] * TANK[1]) - TANK[2]
    highest = float(np.sort(places[:, 2])[-len(places) // 20 :].mean())
    found = {
        "peer": f"genesis {gs.__version__} {args.solver}",
        "particles": len(places),
        "height of the sphere [m]": round(height, 4),
        "level by volume [m]": round(level, 4),
        "highest twentieth of the particles [m]": round(highest, 4),
        "draught by the level [m]": round(RADIUS - height + level, 4),
        "Archimedes [m]": RADIUS,
        "spread of the last third [m]": round(float(np.ptp(heights[-len(heights) // 3 :])), 4),
        "seconds": round(seconds, 1),
    }
    print(json.dumps(found))


if __name__ == "__main__":
    main()
