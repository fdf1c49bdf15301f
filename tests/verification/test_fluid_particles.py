"""Particle water around bodies of the rigid-body engine: lift, momentum, light bodies, waves."""

from __future__ import annotations

import contextlib
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.api import make
from seals.errors import ConfigError, PhysicsError
from seals.plugins.fluids.tank.fluid import FluidParticles
from seals.plugins.fluids.tank.settings import Maker, MakerSettings
from seals.run.build import run_settings
from seals.run.settings_remarks import find_unused
from seals.run.simulation import simulate
from seals.world import World

pytestmark = pytest.mark.filterwarnings("ignore:.*getdefaultlocale:DeprecationWarning")
Floats = NDArray[np.float64]
TANK = (
    "water=particles",
    "time.step=0.004",
    "environment.tank_bottom=-0.4",
    "environment.water_density=1000",
    "fluid.spacing=0.04",
    "fluid.size=[0.56,0.56,0.4]",
    "fluid.freeboard=0.3",
)


def ball(folder: Path, mass: float, radius: float = 0.1) -> str:
    """Write a robot folder of one ball and return its path."""
    moment = 0.4 * mass * radius**2
    inertia = " ".join(f'{k}="{moment}"' for k in ("ixx", "iyy", "izz"))
    (folder / "ball.urdf").write_text(
        f'<robot name="b"><link name="base"><inertial><mass value="{mass}"/>'
        f'<inertia {inertia} ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry>'
        f'<sphere radius="{radius}"/></geometry></collision></link></robot>'
    )
    (folder / "robot.yaml").write_text(
        "summary: a ball\nurdf: ball.urdf\n"
        f"hulls: {{base: {{shapes: [{{type: sphere, size: [{radius}]}}]}}}}\n"
    )
    return str(folder)


def world_of(*words: str) -> World:
    """Build a world in a small tank."""
    return make([*TANK, *words])


def heights(world: World, steps: int) -> Floats:
    """Heights of the robot's origin, and the largest gap of momentum, at every step."""
    rows = []
    for _ in range(steps):
        world.step()
        assert world.fluid is not None
        balance = world.fluid.momentum_balance()
        assert balance is not None
        gap = float(np.abs(balance.gap).max()) / balance.gross
        rows.append((float(world.actors["robot"].body.read().position[2]), gap))
    return np.array(rows)


@pytest.mark.thorough
def test_a_ball_floats_and_no_momentum_is_lost(tmp_path: Path) -> None:
    """Half as dense as water, five spacings across: half submerged within a tenth of its height.

    Fluid, body, walls and gravity balance in every step to 1e-4 of what was exchanged.
    """
    radius = 0.1
    mass = 0.5 * 1000.0 * 4.0 / 3.0 * math.pi * radius**3
    with contextlib.closing(
        world_of(f"robot={ball(tmp_path, mass)}", "initial.position=[0,0,0.01]")
    ) as world:
        found = heights(world, 200)
        assert found[:, 1].max() < 1e-4
        figures = world.fluid.diagnostics()  # type: ignore[union-attr]
        level = (figures["particles"] * 0.04**3 + mass / 1000.0) / 0.56**2 - 0.4
        assert found[-100:, 0].mean() - level == pytest.approx(0.0, abs=0.1 * 2.0 * radius)


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [0.1, 1.5])
def test_light_bodies_are_stable_and_heavy_ones_sink(tmp_path: Path, ratio: float) -> None:
    """A tenth of the water's density pops up and stays; one and a half sinks to the floor."""
    mass = ratio * 1000.0 * 4.0 / 3.0 * math.pi * 0.1**3
    with contextlib.closing(
        world_of(f"robot={ball(tmp_path, mass)}", "initial.position=[0,0,-0.2]")
    ) as world:
        found = heights(world, 250)
        end = found[-50:, 0]
        if ratio < 1.0:
            # by Archimedes 0.061 above the level; it still bobs a little
            assert end.min() > 0.0
            assert end.max() < 0.1
        else:
            assert end == pytest.approx(np.full(50, -0.3), abs=0.01)


@pytest.mark.slow
def test_water_settles_around_a_held_body(tmp_path: Path) -> None:
    """It moves less after the first steps than water that was just filled; the body stays put."""
    energies = []
    for settle in (0.0, 0.3):
        words = ("initial.position=[0,0,-0.2]", f"fluid.settle={settle}")
        with contextlib.closing(world_of(f"robot={ball(tmp_path, 4.2)}", *words)) as world:
            assert world.actors["robot"].body.read().position[2] == -0.2
            heights(world, 5)
            energies.append(world.fluid.simulation.water.kinetic_energy())  # type: ignore[union-attr]
    assert energies[1] < 0.3 * energies[0]


@pytest.mark.slow
def test_an_early_maker_sends_its_crest_behind_a_held_body(tmp_path: Path) -> None:
    """The crest comes as much earlier as the maker begins; the body has not moved meanwhile."""
    arrivals = []
    for start, settle in ((0.0, 0.4), (-0.4, 0.8)):
        words = ("fluid.size=[1.2,0.25,0.25]", "fluid.maker.kind=piston", "fluid.freeboard=0.5")
        words += ("fluid.maker.sea=solitary", "fluid.maker.height=0.1", "fluid.spacing=0.03")
        words += ("environment.tank_bottom=-0.25", f"fluid.settle={settle}", "time.step=0.005")
        words += (
            f"fluid.maker.start={start}",
            "initial.position=[0,0,9]",
            "fluid.beach.length=0.3",
        )
        with contextlib.closing(world_of(f"robot={ball(tmp_path, 4.2)}", *words)) as world:
            assert world.actors["robot"].body.read().position[2] == 9.0
            surface, level = world.fluid.simulation.heights, []  # type: ignore[union-attr]
            for _ in range(round((1.2 + start) / 0.005)):
                world.step()
                level.append(float(surface.at(np.array([[0.2, 0.0]]))[0]))
        arrivals.append(0.005 * (1 + int(np.argmax(level))))
    assert arrivals[0] - arrivals[1] == pytest.approx(0.4, abs=0.08)


@pytest.mark.parametrize("start", [-0.5, -2.0])
def test_a_maker_that_begins_before_the_water_settles_is_refused(start: float) -> None:
    """Refused with what to set."""
    with pytest.raises(ConfigError, match=f"Use settle={1.0 - start:g} or more"):
        FluidParticles(settle=0.4, maker=MakerSettings(kind=Maker.piston, start=start))


@pytest.mark.thorough
def test_a_run_says_what_rests_and_writes_the_fluid(tmp_path: Path) -> None:
    """Coefficients of the robot's folder rest, the user is told, figures of the fluid are kept."""
    words = [*TANK, "robot=ball", "time.duration=0.02", "+fluid.gauges.side=[0.2,0.2]"]
    settings = run_settings(words)
    (remark,) = find_unused(settings, words)
    assert "water_drag, spin_drag, added_mass, slamming of ball are disabled" in remark
    assert "is added as subgrid_drag" in remark
    record = simulate(settings)
    assert record.error is None
    assert set(record.ledger.effects) == {"gravity", "air_drag", "subgrid_drag", "particles"}
    rows = len(record.log.time)
    assert {len(values) for values in record.fluid.values()} == {rows}
    assert record.fluid["gauge side [m]"][-1] == pytest.approx(0.0, abs=0.02)
    assert np.nanmax(record.fluid["momentum balance gap [1]"]) < 1e-4


@pytest.mark.parametrize(
    ("words", "error", "match"),
    [
        (["robot=ball", "fluid.spacing=0.06"], PhysicsError, "too coarse for 'ball'.*0.05 m"),
        (["robot=ball", "wave=airy"], ConfigError, "wave: the sea around a basin"),
        (["robot=ball", "fluid.most=100"], PhysicsError, "fluid.most: 100"),
        (["robot=ball", "fluid.size=[0.1,0.1,0.4]"], ConfigError, "length of 0.1 m is too small"),
        (["robot=ball", "environment.water_level=null"], ConfigError, "no water level"),
        (
            ["robot=ball", "+effect@effects.mine=added_mass", "effects.mine.mass_x=1"],
            ConfigError,
            "'particles' and 'mine' both account for added mass",
        ),
    ],
)
def test_rough_edges_are_refused_in_words(words: list[str], error: Any, match: str) -> None:
    """What cannot work is refused before the first step, with what would work."""
    with pytest.raises(error, match=f"(?s){match}"):
        world_of(*words)


@pytest.mark.thorough
def test_a_world_of_particles_goes_on_from_a_snapshot() -> None:
    """A snapshot holds the particles: one thread and kept order repeat to the last bit."""
    more = ("fluid.physics.deterministic=true", "initial.position=[0,0,0.06]")
    with contextlib.closing(world_of("robot=ball", "initial.velocity=[0,0,-1]", *more)) as world:
        heights(world, 20)
        kept = world.snapshot()
        first = heights(world, 10)
        world.restore(kept)
        assert heights(world, 10)[:, 0].tolist() == first[:, 0].tolist()


@pytest.mark.slow
def test_the_manipulator_falls_into_the_water() -> None:
    """Seven bodies on a limp chain enter the water, slow down and stay whole."""
    with contextlib.closing(
        make(
            [
                "robot=aam",
                "water=particles",
                "time.step=0.004",
                "fluid.spacing=0.04",
                "fluid.size=[0.9,0.9,0.7]",
                "fluid.freeboard=1.0",
                "initial.position=[0,0,0.45]",
                "initial.velocity=[0,0,-2]",
                "initial.joint_position=[0,0,0,-0.6,-0.6,-0.6]",
            ]
        )
    ) as world:
        found = heights(world, 200)
        assert np.abs(np.diff(found[-50:, 0])).max() < 0.001
        assert np.abs(world.actors["robot"].body.read().joint_velocity).max() < 20.0
