"""Downwash: momentum of the jet, published figures of round jets, symmetry, two hexacopters."""

from __future__ import annotations

import contextlib
from typing import Any

import numpy as np
import pytest

from seals.arrays import Floats
from seals.effects import bind_effects
from seals.effects.scene import Rotors
from seals.frames import matrix_of
from seals.motion import Motion
from seals.plugins.effects.downwash import Downwash
from seals.run import build_world
from seals.run.build import run_settings

DENSITY, THRUST, RADIUS = 1.2, 30.0, 0.127
_ANGLES = np.arange(6) * np.pi / 3.0
HUBS = 0.3 * np.stack([np.cos(_ANGLES), np.sin(_ANGLES), 0.0 * _ANGLES], axis=1)
AREA = 6.0 * np.pi * RADIUS**2


class Above:
    """A hovering hexacopter, turned and moved."""

    air_density = np.array([[DENSITY]])

    def __init__(self, turn: Floats | None = None, place: Floats | None = None) -> None:
        turn = np.eye(3) if turn is None else turn
        place = np.zeros(3) if place is None else place
        axis = np.tile(turn[:, 2], (6, 1))
        self.own = Rotors(HUBS @ turn.T + place, axis, np.full(6, RADIUS), np.full(6, THRUST / 6))

    def rotors(self) -> list[Rotors]:
        """Return the rotors."""
        return [self.own]


def air(places: Any, scene: Above | None = None) -> Floats:
    """Return the air's velocity at places [m/s], shape (N, 3)."""
    where = np.atleast_2d(np.asarray(places, dtype=float))
    none = np.zeros_like(where)
    motion = Motion(np.zeros((1, 1)), where, np.eye(3)[None], none, none, none, None)  # type: ignore[arg-type]
    params = bind_effects({"it": Downwash(links=["root"])}, ["base"]).bound[0].params
    given: Any = (motion, None, None, None, params, scene or Above())
    found: Floats = Downwash.flow(*given)[0]
    return found


@pytest.mark.parametrize("depth", [0.5, 2.0, 4.0, 9.0])
def test_the_momentum_of_the_jet_is_the_thrust(depth: float) -> None:
    """Integrated over a plane below the vehicle: rho int u^2 dA = T, wherever the plane is."""
    r = np.linspace(0.0, 40.0, 400_001)
    u = air(np.stack([r, 0.0 * r, 0.0 * r - depth], axis=1))[:, 2]
    momentum = DENSITY * np.trapezoid(u**2 * 2.0 * np.pi * r, r)
    assert momentum == pytest.approx(THRUST, rel=1e-4)


def test_it_decays_and_spreads_as_round_jets_were_measured() -> None:
    """u_c = B U d / z, B = 5.8 (Pope 2000) or 6.11; half of it at r = 0.094 z.

    B at a Reynolds number of 19,400: Abdel-Rahman et al. 1996, Mech. Res. Commun. 23, 313. A nozzle
    of diameter d and speed U has the momentum rho U^2 pi d^2 / 4; the virtual origin is neglected.
    """
    nozzle = np.sqrt(4.0 * THRUST / (np.pi * DENSITY))
    for z in (4.0, 8.0):
        middle = -air([0.0, 0.0, -z])[0, 2]
        assert 5.8 <= middle * z / nozzle <= 6.11
        assert -air([0.094 * z, 0.0, -z])[0, 2] == pytest.approx(0.5 * middle, rel=1e-7)


def test_near_the_rotors_the_air_is_that_of_the_far_wake() -> None:
    """Momentum theory: w = 2 v_h, v_h = sqrt(T / (2 rho A)); none above the rotors."""
    induced = np.sqrt(THRUST / (2.0 * DENSITY * AREA))
    assert air([0.0, 0.0, -0.6])[0] == pytest.approx([0.0, 0.0, -2.0 * induced], rel=1e-6)
    assert not air([[0.0, 0.0, 0.1], [0.5, 0.0, 2.0], [3.0, 0.0, 0.0]]).any()


def test_a_tilted_vehicle_turns_its_jet() -> None:
    """Flow at turned and moved places is the turned flow."""
    turn = matrix_of(np.array([[0.2, -0.1, 0.3, 0.9]]) / np.linalg.norm([0.2, -0.1, 0.3, 0.9]))[0]
    place = np.array([1.0, -2.0, 5.0])
    seen = np.array([[0.2, 0.1, -3.0], [0.0, 0.4, -1.5], [1.0, 1.0, -6.0]])
    moved = air(seen @ turn.T + place, Above(turn, place))
    assert moved == pytest.approx(air(seen) @ turn.T, abs=1e-9)


def pair(low: str, high: str, *words: str) -> Any:
    """Return a world of two hovering hexacopters with downwash."""
    own = "{{robot: hexacopter, guide: hover, initial: {{position: {}, drives: carrying}}}}"
    return build_world(
        run_settings(
            [
                "water=none",
                "+effect@effects.downwash=downwash",
                f"robots.low={own.format(low)}",
                f"robots.high={own.format(high)}",
                *words,
            ]
        )
    )


def pressed(world: Any, name: str) -> Floats:
    """Force of the air on the body of one vehicle in the last step [N]."""
    force: Floats = world.actors[name].ledger.of("air_drag")[-1, 0, :3]
    return force


@pytest.mark.filterwarnings("ignore:.*goes on uncompiled")
@pytest.mark.parametrize("backend", ["pybullet", "mujoco"])
def test_the_lower_of_two_hexacopters_is_pressed_down(backend: str) -> None:
    """3.5 m below: the drag of the body in the jet that its thrust, m g, makes; none above."""
    with contextlib.closing(pair("[0,0,10]", "[0,0,13.5]", f"backend={backend}")) as world:
        for _ in range(3):
            world.step()
        mass = float(world.actors["high"].robot.mass.sum())
        growth = (np.sqrt(2.0) - 1.0) / 0.094**2
        # from the plane of the rotors, 7 cm above the origins
        speed = np.sqrt(3.0 * growth * mass * 9.81 / (np.pi * 1.2)) / 3.57
        force = pressed(world, "low")
        assert force[2] == pytest.approx(-0.053 * speed**2, rel=0.03)
        assert np.abs(pressed(world, "high")).max() < 1e-3 * abs(force[2])


@pytest.mark.filterwarnings("ignore:.*goes on uncompiled")
def test_who_is_named_first_does_not_matter_and_snapshots_continue() -> None:
    """The same two vehicles with their names exchanged; a restored world makes the same steps."""
    found = []
    for below, places in (
        ("low", ("[0.2,0,10]", "[0,0,12]")),
        ("high", ("[0,0,12]", "[0.2,0,10]")),
    ):
        with contextlib.closing(pair(*places)) as world:
            for _ in range(40):
                world.step()
            found.append(world.actors[below].body.read().position.copy())
            kept = world.snapshot()
            ends = []
            for _ in range(2):
                world.restore(kept)
                for _ in range(10):
                    world.step()
                ends.append(world.actors[below].body.read().position.copy())
            assert np.array_equal(*ends)
    assert found[0] == pytest.approx(found[1], abs=1e-12)
