"""A submerged body with added mass, pressed on the bottom: the contact force is the applied one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.plugins.effects.added_mass import AddedMass
from seals.plugins.effects.buoyancy import Buoyancy
from seals.run import build_world

if TYPE_CHECKING:
    from tests.verification.conftest import Bench

Floats = NDArray[np.float64]
G, RHO, MASS, NET = 9.81, 1000.0, 0.3, 2.0
EDGE = 0.1
SLOP = 1e-5
"""Depth that the contact solver leaves uncorrected [m]; one step of acceleration comes on top."""
COUPLED = np.zeros((6, 6))
COUPLED[0, 4] = COUPLED[4, 0] = 0.02
COUPLED[1, 3] = COUPLED[3, 1] = -0.02
ADDED: dict[str, dict[str, Any]] = {
    "none": {},
    "isotropic": {
        "mass_x": 3.3,
        "mass_y": 3.3,
        "mass_z": 3.3,
        "inertia_x": 0.01,
        "inertia_y": 0.01,
        "inertia_z": 0.01,
    },
    "anisotropic": {
        "mass_x": 0.5,
        "mass_y": 1.5,
        "mass_z": 3.3,
        "inertia_x": 0.01,
        "inertia_y": 0.02,
        "inertia_z": 0.005,
    },
    "heavy along x": {"mass_x": 3.3, "mass_y": 1.5, "mass_z": 0.0, "inertia_x": 0.01},
    "coupled": {
        "mass_x": 0.5,
        "mass_y": 1.5,
        "mass_z": 3.3,
        "inertia_x": 0.01,
        "inertia_y": 0.02,
        "inertia_z": 0.005,
        "coupling": COUPLED.tolist(),
    },
}


def pressed(bench: Bench, kind: str, step: float, gap: float = 0.0) -> tuple[Floats, Floats]:
    """Return contact forces (N, 3) and heights (N,) of a body let go ``gap`` above its rest."""
    # m g - rho V g = 2 N; the hull is a small box inside the body, the body itself a cube of 0.1 m
    inside = ((MASS - NET / G) / RHO) ** (1.0 / 3.0)
    robot = bench.body(
        MASS,
        (5e-4,) * 3,
        hull="box",
        size=[inside] * 3,
        collision=f'<box size="{EDGE} {EDGE} {EDGE}"/>',
    )
    settings = bench.settings(
        robot,
        {"buoyancy": Buoyancy(), "added": AddedMass(**ADDED[kind])},
        step=step,
        duration=1.5,
        environment={"water_level": 0.0, "water_density": RHO, "tank_bottom": -2.0},
        position=[0, 0, -2.0 + EDGE / 2 + gap],
    )
    world = build_world(settings)
    body = world.actors["robot"].body
    forces, heights = [], []
    for _ in range(round(1.5 / step)):
        world.step()
        forces.append(body.contact_wrenches()[0, :3].copy())
        heights.append(float(body.read().position[2]))
    world.close()
    return np.array(forces), np.array(heights)


@pytest.mark.parametrize("step", [0.001, 0.004])
@pytest.mark.parametrize("kind", list(ADDED))
def test_contact_force_is_the_applied_one(bench: Bench, kind: str, step: float) -> None:
    """A body pressed down by 2 N feels 2 N, whatever its added mass, and stays put."""
    forces, heights = pressed(bench, kind, step)
    last = forces[len(forces) // 3 :]
    moved = np.abs(heights - heights[0]).max()
    print(
        f"{kind}, {step * 1e3:g} ms: force {last.mean(axis=0)} N, "
        f"spread {last[:, 2].std():.1e} N, moved {moved:.1e} m"
    )
    # statics: N = m g - rho V g; the contact solver is iterative, one per cent is asked for
    assert last[:, 2].mean() == pytest.approx(NET, rel=0.01)
    assert np.abs(last[:, :2]).max() < 0.01 * NET
    assert moved < NET / MASS * step**2 + SLOP


@pytest.mark.parametrize("kind", ["none", "anisotropic"])
def test_landing_ends_in_the_same_force(bench: Bench, kind: str) -> None:
    """A body that sinks on the bottom ends with the applied force too."""
    gap = 0.02
    forces, heights = pressed(bench, kind, 0.004, gap)
    # free until sqrt(2 gap / a) at the earliest, a without added mass: 77 ms or 19 steps
    assert np.abs(forces[:18]).max() == 0.0
    assert forces[len(forces) // 2 :, 2].mean() == pytest.approx(NET, rel=0.01)
    # it came down by the gap and rests there: the box neither hovers nor sinks in
    print(f"landing, {kind}: fell {heights[0] - heights[-1]:.6f} m of {gap} m")
    assert heights[0] - heights[-1] == pytest.approx(gap, abs=NET / MASS * 0.004**2 + SLOP)
