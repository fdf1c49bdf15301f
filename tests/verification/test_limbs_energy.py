"""Floating bodies with limbs at their stops and on the bottom: nothing drives, nothing gains."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view

from seals import make
from seals.arrays import Floats
from seals.backend import Dynamics
from seals.robot.model import RobotModel
from seals.scaffold.robot import scaffold_robot

RHO, G = 1000.0, 9.80665
STEP, SECONDS = 0.004, 60.0
SEEDS = range(20)
QUICK = {2: 1.5, 3: 2.5}
"""Seeds of the default run, and seconds: joints meet their stops, nothing touches the bottom."""
BOUND = 2e-3
"""Largest rise, over the energy that was lost."""
IMPACT = 6
"""Rows that an impact takes [1]. PyBullet foretells contact forces from the last step: a contact
stops the engine's part of the mass in one step, that of the water follows in the next ones."""


class Energies(NamedTuple):
    """Energy of one run: of motion, with the water that moves along, and of place [J], shape (n,).

    Args:
        kinetic: of links and added mass.
        potential: of weight and displaced water.
        stopped: share of the time that a joint stood at its limit.
        touched: share of the time that a link touched the bottom.
    """

    kinetic: Floats
    potential: Floats
    stopped: float
    touched: float

    @property
    def rise(self) -> float:
        """Largest rise of the whole above an earlier value, over the energy that was lost.

        Of two rows the lesser counts: added mass enters the inertia with the row at which a hull is
        found in the water, the load that takes its momentum from the body acts in the step after.
        Of the rows of an impact the largest counts, for what was stopped in the midst of it is not
        yet what is lost. What stays longer than that is seen.
        """
        whole = self.kinetic + self.potential
        lesser = np.minimum(whole[:-1], whole[1:])
        settled = sliding_window_view(lesser, IMPACT).max(axis=1)
        return float((settled - np.minimum.accumulate(settled)).max() / (whole[0] - whole.min()))


def random_urdf(seed: int) -> tuple[str, float]:
    """Return a hull of foam with one to three limbs of hinges with narrow stops, and its reach.

    The reach is that of its lowest point below its origin [m].
    """
    rng = np.random.default_rng(seed)
    links: list[str] = []
    joints: list[str] = []
    reach = 0.0

    def link(name: str, size: Floats, density: float, centre: Floats) -> None:
        mass = density * float(size.prod())
        x, y, z = size**2
        moments = mass / 12.0 * np.array([y + z, x + z, x + y])
        at = " ".join(f"{c:.4f}" for c in centre)
        box = " ".join(f"{s:.4f}" for s in size)
        links.append(
            f'<link name="{name}"><inertial><origin xyz="{at}"/><mass value="{mass:.6f}"/>'
            f'<inertia ixx="{moments[0]:.8f}" iyy="{moments[1]:.8f}" izz="{moments[2]:.8f}" '
            'ixy="0" ixz="0" iyz="0"/></inertial><collision><origin '
            f'xyz="{at}"/><geometry><box size="{box}"/></geometry></collision></link>'
        )

    hull = rng.uniform([0.5, 0.3, 0.12], [1.0, 0.6, 0.3])
    link("hull", hull, rng.uniform(200.0, 500.0), np.zeros(3))
    for limb in range(rng.integers(1, 4)):
        parent = "hull"
        side = np.array([rng.uniform(-0.4, 0.4), rng.uniform(-0.4, 0.4), -0.6]) * hull
        depth = -float(side[2])
        for part in range(rng.integers(1, 3)):
            name = f"limb_{limb}_{part}"
            size = rng.uniform([0.04, 0.04, 0.2], [0.15, 0.15, 0.4])
            link(name, size, rng.uniform(400.0, 1600.0), np.array([0.0, 0.0, -0.55 * size[2]]))
            axis = rng.normal(size=3)
            low, high = rng.uniform(-0.8, -0.1), rng.uniform(0.1, 0.8)
            joints.append(
                f'<joint name="{name}_joint" type="revolute"><parent link="{parent}"/>'
                f'<child link="{name}"/><origin xyz="{side[0]:.4f} {side[1]:.4f} {side[2]:.4f}"/>'
                f'<axis xyz="{axis[0]:.4f} {axis[1]:.4f} {axis[2]:.4f}"/>'
                f'<limit lower="{low:.3f}" upper="{high:.3f}" effort="1" velocity="100"/></joint>'
            )
            parent, side = name, np.array([0.0, 0.0, -1.15 * size[2]])
            depth += 1.15 * float(size[2])
        reach = max(reach, depth)
    return f'<robot name="limbs_{seed}">{"".join(links + joints)}</robot>', reach


def fallen(seed: int, engine: str, folder: Path, seconds: float) -> Energies:
    """Let a random robot fall into water over a bottom that its limbs can reach."""
    urdf = folder / f"limbs_{seed}.urdf"
    text, reach = random_urdf(seed)
    urdf.write_text(text)
    made = scaffold_robot(f"limbs_{seed}", urdf, parent=folder, medium="water")
    rng = np.random.default_rng(1000 + seed)
    turning = rng.uniform(-1.0, 1.0, size=3).round(3).tolist()
    height = 0.15 if seed % 4 else 0.5
    # every other one falls on a bottom that it cannot yet touch, turned as it may be by then
    bottom = height - round(reach + float(rng.uniform(0.1, 0.3)), 3) if seed % 2 else -20.0
    words = (
        *(f"robot={made.folder}", f"backend={engine}", "water=fossen", "~actuators.servos"),
        *(f"environment.water_density={RHO}", f"environment.ground_level={bottom}"),
        *(f"time.step={STEP}", f"initial.position=[0,0,{height}]"),
        *(f"initial.angular_velocity={turning}".replace(" ", ""), "backend.compiled=false"),
    )
    world = make(words)
    actor = world.actors["robot"]
    rows: list[tuple[float, float, bool, bool]] = []
    body: Any = actor.body
    apply = body.apply

    def heard(dynamics: Dynamics, step: float) -> None:
        rows.append((*energy(dynamics, actor.robot), at_limit(actor.robot, body), touches(body)))
        apply(dynamics, step)

    body.apply = heard
    try:
        for _ in range(round(seconds / STEP)):
            world.step()
    finally:
        world.close()
    table = np.array(rows, dtype=float)
    return Energies(table[:, 0], table[:, 1], table[:, 2].mean(), table[:, 3].mean())


def at_limit(robot: RobotModel, body: Any) -> bool:
    """Return whether a joint stands at one of its limits."""
    q = body.joint_positions()
    return bool(((q < robot.lower + 1e-3) | (q > robot.upper - 1e-3)).any())


def touches(body: Any) -> bool:
    """Return whether a link touched something in the last step."""
    return bool(body.contact_normals().any())


def energy(dynamics: Dynamics, robot: RobotModel) -> tuple[float, float]:
    """Return energies of motion and of place [J].

    Equation:
        T = nu (I + s A + e h h^T) nu / 2 over the links. V = m g z_c - rho g V_s z_b: the work of
        lifting the weight, and of pushing the submerged volume V_s under water, z_b its centre.
    """
    twists, motion = dynamics.moving.twists[0], dynamics.motion
    inertia = robot.spatial_inertia.copy()
    place = np.zeros(len(robot.mass))
    for _, rows, added, medium in dynamics.found.inertias:
        picked = slice(None) if rows is None else rows
        inertia[picked] += added.weight[:, :, None] * added.matrix
        if added.more is not None:
            inertia[picked] += added.more
        centre = np.einsum("lij,lj->li", motion.rotation[picked], medium.buoyancy_centre)
        depth = -(motion.position[picked, 2] + centre[:, 2])
        volume = motion.body.volume[picked, 0] * medium.submersion[:, 0]
        # the entry of a hull is an inertia of its own: its water is displaced once
        place[picked] = RHO * G * volume * depth
    kinetic = 0.5 * float(np.einsum("lk,lkm,lm->", twists, inertia, twists))
    centres = motion.position[:, 2] + np.einsum("li,li->l", motion.up, robot.centre)
    return kinetic, float(place.sum()) + G * float(robot.mass @ centres)


@pytest.mark.thorough
@pytest.mark.parametrize("engine", ["mujoco", "pybullet"])
@pytest.mark.parametrize(
    "seed", [*QUICK, *(pytest.param(k, marks=pytest.mark.slow) for k in SEEDS if k not in QUICK)]
)
def test_nothing_gains_energy(tmp_path: Path, seed: int, engine: str) -> None:
    """Limbs at their stops and on the bottom take energy from a floating body, and give none."""
    pytest.importorskip(engine)
    found = fallen(seed, engine, tmp_path, QUICK.get(seed, SECONDS))
    whole = found.kinetic + found.potential
    print(
        f"{seed} {engine}: rise {found.rise:.1e}, lost {whole[0] - whole.min():.3g} J, motion at "
        f"the end {found.kinetic[-1]:.1e} J, at stops {found.stopped:.2f} of the time, on the "
        f"bottom {found.touched:.2f}"
    )
    assert found.stopped > 0.0
    assert found.rise < BOUND
    if seed not in QUICK:
        assert found.kinetic[-1] < 0.02 * (whole[0] - whole.min())


def test_a_gain_that_stays_is_seen() -> None:
    """A row that is too high and an impact's rows that are too low are none, a step up is one."""
    falling = np.linspace(2.0, 1.0, 100)
    none = np.zeros(100)
    spike, dip, gain = falling.copy(), falling.copy(), falling.copy()
    spike[40] += 0.5
    dip[40 : 40 + IMPACT - 2] -= 0.5
    gain[40:] += 0.1
    rises = [Energies(row, none, 0.0, 0.0).rise for row in (falling, spike, dip, gain)]
    assert rises[:3] == [0.0, 0.0, 0.0]
    assert rises[3] > BOUND
