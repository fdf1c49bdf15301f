"""The ROV with an arm: its masses are those of its parts, it fetches a cube and passes a wall."""

from __future__ import annotations

import numpy as np
import pytest

from seals.run.assembly import build_model
from seals.run.build import run_settings
from seals.run.simulation import simulate

ENGINES = ("pybullet", "mujoco")
COARSE = ("time.step=0.01", "controller.rate=100", "guide.rate=100")


def test_it_weighs_and_displaces_what_its_parts_do() -> None:
    """The published vehicle, and the arm of the hexacopter."""
    robots = {}
    for name in ("rov", "hexacopter", "rov_arm"):
        robot, _ = build_model(run_settings([f"robot={name}", "water=fossen"]))
        body = robot.bodies(np.zeros(1))
        parts = zip(body.mass.ravel(), body.volume.ravel(), strict=True)
        robots[name] = dict(zip(robot.links, parts, strict=True))
    # frames such as the camera's have no mass
    limbs = {k: v for k, v in robots["hexacopter"].items() if k != "body" and v[0] > 0.0}
    assert len(limbs) == 10
    for link, own in {**limbs, "body": robots["rov"]["body"]}.items():
        assert robots["rov_arm"][link] == pytest.approx(own, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_it_fetches_a_cube_from_the_sea_bed(engine: str) -> None:
    """From the bed to the hand's goal 1 m above it, held within 5 cm for the last second."""
    run = run_settings(["experiment=rov_grasp", f"backend={engine}"])
    record = simulate(run)
    assert record.error is None
    log = record.log
    height = log.columns["object_cube_position_z"]
    assert height[0] == pytest.approx(-3.975)
    last = log.time > log.time[-1] - 1.0
    print(f"{engine}: held at {height[last].min():.3f} m after {log.time[-1]:.1f} s")
    assert np.abs(height[last] + 3.0).max() < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_it_passes_a_wall_at_a_fixed_distance(engine: str) -> None:
    """Its front is 1 m from the wall within 3 cm, by the truth and by the range finder."""
    run = run_settings(["experiment=rov_inspection", f"backend={engine}", *COARSE])
    record = simulate(run)
    assert record.error is None
    log = record.log
    # the wall's face is at x = 1.2 m, the front 0.2 m ahead of the origin
    gap = 1.2 - 0.2 - log.channel("position")[:, 0]
    assert np.abs(gap - 1.0).max() < 0.03
    seen = log.columns["range"]
    seen = seen[np.isfinite(seen)]
    # of a cone counts the nearest of 17 rays; noise of 1.1 cm
    assert np.median(seen) == pytest.approx(1.0, abs=0.03)
    for place in run.guide.places:
        assert np.linalg.norm(log.channel("position") - place, axis=1).min() < 0.05
