"""Sub-grid drag: terminal speed by stated coefficients, whatever a fluid resolves of it."""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.backend import Configuration
from seals.effects.binding import bind_effects
from seals.environment.settings import EnvironmentSettings
from seals.experiments.water_validation.bodies import Shape, write_body
from seals.fluid import BodyStates, Surrounding
from seals.plugins.backends.free import BackendFree
from seals.plugins.effects.buoyancy import Buoyancy
from seals.plugins.effects.formula import EffectFormula
from seals.plugins.effects.gravity import Gravity
from seals.plugins.waves.still import WaveStill
from seals.robot.build import build_robot
from seals.run.assembly import build_world
from seals.run.build import run_settings
from seals.world import Actor, World
from seals.world.subgrid import MOST
from tests.unit.still_water import StillWater

Floats = NDArray[np.float64]
STEP = 0.016
WATER = EnvironmentSettings(water_level=0.0, water_density=1000.0)
DRAG, TURNING, ADDED = 1.84, 1e-4, 0.26
"""Stated coefficients [N s^2/m^2, N m s/rad], and added mass [kg]."""


@dataclass(kw_only=True)
class Braking(StillWater):
    """Still water that brakes by a share of the stated drag and by v, and carries a mass along."""

    share: float = 0.0
    viscous: float = 0.0
    carried: float = 0.0

    def initialise(self, states: BodyStates) -> None:
        """Begin at rest."""
        super().initialise(states)
        self.last = np.zeros(3)

    def exchange(self, states: BodyStates, time: float, step: float) -> Floats:
        """Lift, drag of the body as it moves, and the reaction of what it carries along."""
        out = super().exchange(states, time, step)
        v, w = states.velocity[0], states.spin[0]
        out[0, :3] -= step * (self.share * DRAG * np.linalg.norm(v) + self.viscous) * v
        out[0, 3:] -= step * self.share * TURNING * w
        out[0, :3] -= self.carried * (v - self.last)
        self.last = v.copy()
        return out


def opened(fluid: Braking, *, depth: float = 5.0, speed: float = 0.0, **pull: float) -> World:
    """Return a world in which a sphere with stated drag, which weighs nothing, is pulled."""
    settings = run_settings(["robot=ball", "water=fossen"])
    robot, backend = build_robot(settings.robot), BackendFree()
    backend.open(WATER, STEP)
    lift = 9.81 * (1000.0 * robot.hulls[0].volume - float(robot.mass.sum()))
    own = {"weight": Gravity(), "pull": EffectFormula(hold_z=-lift, **pull)}
    names = ("water_drag", "spin_drag", "added_mass")
    stated = {name: settings.effects[name] for name in names}
    actor = Actor(
        *(robot, bind_effects(own, robot.links), {}, backend, WATER),
        waves=WaveStill(),
        steps=100,
        fluid=fluid,
        stated=bind_effects({**stated, "lift": Buoyancy()}, robot.links),
    )
    assert actor.immersion is not None
    bodies = [g.body for g in actor.immersion.groups]
    fluid.open(Surrounding(WATER, WaveStill(), (), STEP), bodies)
    world = World(backend, {"it": actor}, WATER, step=STEP, seed=0, fluid=fluid)
    still, none, ahead = np.zeros(3), np.zeros(0), np.array([speed, 0.0, 0.0])
    place, turn = np.array([0.0, 0.0, -depth]), np.array([0.0, 0.0, 0.0, 1.0])
    world.reset({"it": Configuration(place, turn, ahead, still, none, none)})
    return world


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0, 2.5])
def test_drag_is_the_stated_one_whatever_share_is_resolved(share: float) -> None:
    """The speed settles where F = c v^2; the water's torque and the term add up to d w."""
    force, torque = 1.84, 2e-4
    fluid = Braking(share=share, carried=0.5 * ADDED)
    with contextlib.closing(opened(fluid, hold_x=force, twist_x=torque)) as world:
        for _ in range(800):
            world.step()
        actor = world.actors["it"]
        now = actor.body.read()
        added, water = (actor.ledger.of(n)[-1, 0] for n in ("subgrid_drag", "still_water"))
    assert now.velocity[0] == pytest.approx(math.sqrt(force / DRAG), rel=0.01)
    assert added[0] == pytest.approx((share - 1.0) * force, abs=0.03 * force)
    # turning has not settled: while it gets faster no more than what braked it so far is taken out
    turned = -(added[3] + water[3]) / (TURNING * now.angular_velocity[0])
    assert turned == pytest.approx(1.0, rel=0.02) if share <= 1.0 else 0.98 < turned < 0.6 * share


def test_it_never_drives_a_body_that_starts_or_coasts() -> None:
    """In water that brakes as v, water and term together oppose the motion at any time."""
    for words, speed in (({"hold_x": 4.0}, 0.0), ({}, 1.5)):
        with contextlib.closing(opened(Braking(viscous=4.0), speed=speed, **words)) as world:
            actor, pushed = world.actors["it"], []
            for _ in range(100):
                world.step()
                rows = [actor.ledger.of(n)[-1, 0, 0] for n in ("subgrid_drag", "still_water")]
                pushed.append(sum(rows))
        # at rest both are zero
        assert max(pushed) <= 1e-9
        assert min(pushed) < -0.3


def test_the_part_of_the_resolved_drag_that_counts_is_bounded() -> None:
    """Of water that brakes ten times as much as stated, `MOST` - 1 stated drags are taken out."""
    with contextlib.closing(opened(Braking(share=10.0), hold_x=1.84)) as world:
        for _ in range(800):
            world.step()
        actor = world.actors["it"]
        stated = DRAG * actor.body.read().velocity[0] ** 2
        assert actor.ledger.of("subgrid_drag")[-1, 0, 0] == pytest.approx(
            (MOST - 1.0) * stated, rel=0.02
        )


def test_it_rests_at_the_surface() -> None:
    """A body that is not wholly submerged gets nothing, on way enough to bring up the term."""
    with contextlib.closing(opened(Braking(), depth=0.0, speed=2.0)) as world:
        for _ in range(3):
            world.step()
        assert not world.actors["it"].ledger.of("subgrid_drag").any()


def test_it_goes_on_from_a_snapshot_bit_for_bit() -> None:
    """Its memory is that of the robot."""
    with contextlib.closing(opened(Braking(share=0.3), hold_x=1.0)) as world:
        for _ in range(40):
            world.step()
        kept, ends = world.snapshot(), []
        for _ in range(2):
            world.restore(kept)
            for _ in range(40):
                world.step()
            ends.append(world.actors["it"].ledger.of("subgrid_drag")[-1].copy())
    assert ends[0].any()
    assert np.array_equal(*ends)


@pytest.mark.parametrize(
    ("more", "there"),
    [((), True), (("fluid.subgrid_drag=false",), False), (("fluid.maker.kind=piston",), False)],
)
def test_a_run_in_particles_has_it_where_the_drag_is_stated(
    more: tuple[str, ...], there: bool
) -> None:
    """A row of the ledger of its own; not if switched off, nor in the waves of a maker."""
    words = ["robot=ball", "water=particles", "fluid.spacing=0.05", "fluid.size=[1.2,0.4,0.4]"]
    place = "initial.position=[0,0,-0.2]"
    with contextlib.closing(build_world(run_settings([*words, place, *more]))) as world:
        assert ("subgrid_drag" in world.actors["robot"].ledger.effects) == there
        world.step()


@pytest.mark.slow
def test_a_sphere_of_five_spacings_keeps_its_speed_in_particles(tmp_path: Path) -> None:
    """Pulled by its stated drag at 1 m/s; water of five spacings alone drags thrice as much."""
    volume, speeds = math.pi / 6.0 * 0.1**3, {}
    write_body(tmp_path, Shape("sphere", (0.05,), volume, 0.1), 1000.0 * volume)
    sheet, axes = tmp_path / "robot.yaml", "xyz"
    drag = ", ".join(f"coefficient_{axis}: {DRAG}" for axis in axes)
    mass = ", ".join(f"mass_{axis}: {500.0 * volume}" for axis in axes)
    effects = f"""effects:
  water_drag: {{effect: quadratic_drag, medium: water, form: isotropic, {drag}}}
  added_mass: {{effect: added_mass, {mass}}}
"""
    sheet.write_text(sheet.read_text(encoding="utf-8") + effects, encoding="utf-8")
    for added in ("true", "false"):
        words = [f"robot={tmp_path}", "backend=free", "water=particles", "fluid.spacing=0.02"]
        words += ["fluid.size=[0.9,0.4,0.4]", "fluid.settle=0.3", f"fluid.subgrid_drag={added}"]
        words += ["environment.water_density=1000", "initial.position=[-0.3,0,-0.2]"]
        words += ["initial.velocity=[1,0,0]", "+effect@effects.pull=formula"]
        words += [f"effects.pull.hold_x={DRAG}"]
        with contextlib.closing(build_world(run_settings(words))) as world:
            body, places = world.actors["robot"].body, []
            while len(places) < 300 and body.read().position[0] < 0.3:
                world.step()
                places.append(body.read().position[0])
        late = places[len(places) // 2 :]
        speeds[added] = (late[-1] - late[0]) / (world.step_size * (len(late) - 1))
    assert speeds["false"] < 1.0 / math.sqrt(3.0)
    assert 0.75 < speeds["true"] < 1.05
