"""Energy of a flight: from the battery through the rotors to the body."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad

from seals.effects import MediumKind
from seals.experiments.flight_energy import OVERRIDES, draw
from seals.experiments.flight_energy import fly as fly_manipulator
from seals.plugins.actuators.rotors import Rotors
from seals.plugins.effects.battery import Battery, cell_voltage
from seals.plugins.effects.quadratic_drag import DragQuadratic
from seals.run import build_world
from seals.run.build import run_settings

if TYPE_CHECKING:
    from tests.verification.conftest import Bench

Floats = NDArray[np.float64]
MASS, G, DRAG = 2.0, 9.81, 0.4
K_T, K_Q, RADIUS = 1.4e-5, 2.3e-7, 0.13
FRICTION, COPPER, ELECTRONICS = 0.005, 500.0, 8.0
CELLS, CAPACITY, RESISTANCE = 4.0, 1200.0, 0.03
ARM = [[0.2, 0.2, 0.0], [-0.2, 0.2, 0.0], [-0.2, -0.2, 0.0], [0.2, -0.2, 0.0]]
HOVER = float(np.sqrt(MASS * G / (4.0 * K_T)))


class Flight(NamedTuple):
    """A flight step by step: time, height, climb, rotor speeds, battery (V, I, charge), ledger."""

    time: Floats
    height: Floats
    climb: Floats
    speed: Floats
    battery: Floats
    force: dict[str, Floats]


def fly(bench: Bench, *, step: float = 0.004, duration: float = 20.0) -> Flight:
    """Climb, hover and sink with four equal rotors."""
    effects = {
        "rotors": Rotors(
            position=ARM,
            direction=[1.0, -1.0, 1.0, -1.0],
            thrust_coefficient=[K_T],
            torque_coefficient=[K_Q],
            time_constant=[0.04],
            spin_down=[0.08],
            radius=[RADIUS],
            max_speed=[1000.0],
            friction_torque=[FRICTION],
            copper_loss=[COPPER],
        ),
        "battery": Battery(
            cells=CELLS, capacity=CAPACITY, resistance=RESISTANCE, electronics=ELECTRONICS
        ),
        "drag": DragQuadratic(coefficient_z=DRAG, medium=MediumKind.any),
    }
    robot = bench.body(MASS, (0.02, 0.02, 0.03))
    settings = bench.settings(robot, effects, step=step, duration=duration)
    world = build_world(settings)
    actor, rows = world.actors["robot"], []
    try:
        actor.drive = np.full((1, 4), HOVER)
        for _ in range(round(duration / step)):
            at = actor.body.read()
            wanted = 3.0 * np.sin(2.0 * np.pi * world.time / 10.0)
            ask = HOVER + 60.0 * (wanted - at.velocity[2])
            actor.command = np.full((1, 4), ask)
            world.step()
            assert actor.drive is not None
            rows.append(
                (
                    world.time - step,
                    at.position[2],
                    at.velocity[2],
                    actor.drive[0],
                    actor.battery_state(),
                )
            )
        ledger = {name: actor.ledger.of(name)[:, 0, 2].copy() for name in actor.ledger.effects}
    finally:
        world.close()
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return Flight(*columns, ledger)


def total(values: Floats, time: Floats) -> float:
    """Integral over the flight."""
    return float(np.trapezoid(values, time))


def test_battery_rotors_and_work_agree_over_a_flight(bench: Bench) -> None:
    """Charge taken, terminal energy, rotor power, work and height: each balance within 2 %."""
    f = fly(bench)
    voltage, current, charge = f.battery.T
    # rotors: (k_Q w^2 + Q_0) w + c (k_Q w^2)^2, summed over four
    torque = K_Q * f.speed**2
    shaft = (torque * f.speed).sum(axis=1)
    loss = (FRICTION * f.speed + COPPER * torque**2).sum(axis=1)
    asked = total(shaft + loss + ELECTRONICS, f.time)
    given = total(voltage * current, f.time)
    # chemistry: the open-circuit voltage over the charge that is gone
    stored = CELLS * CAPACITY * quad(lambda s: float(cell_voltage(np.array(s))), charge[-1], 1.0)[0]
    heat = total(RESISTANCE * current**2, f.time)
    # mechanics: work of thrust and drag is the gain in kinetic and potential energy
    work = total(f.force["rotors"] * f.climb, f.time)
    dragged = -total(f.force["drag"] * f.climb, f.time)
    gained = 0.5 * MASS * (f.climb[-1] ** 2 - f.climb[0] ** 2) + MASS * G * (
        f.height[-1] - f.height[0]
    )
    moved = total(np.abs(f.force["rotors"] * f.climb), f.time)
    print(
        f"asked {asked:.0f} J, battery gave {given:.0f} J, took {stored:.0f} J, "
        f"{heat:.0f} J of it heat; shafts {total(shaft, f.time):.0f} J; thrust did {work:.1f} J: "
        f"{gained:.1f} J gained, {dragged:.1f} J into drag"
    )
    assert given == pytest.approx(asked, rel=0.02)
    assert stored == pytest.approx(given + heat, rel=0.02)
    assert abs(work - gained - dragged) < 0.02 * moved
    assert dragged > 0.05 * moved
    # momentum theory: no rotor hovers with less than T sqrt(T / (2 rho A))
    thrust = K_T * f.speed**2
    ideal = (thrust * (f.climb[:, None] + np.sqrt(thrust / (2.4 * np.pi * RADIUS**2)))).sum(axis=1)
    merit = total(ideal, f.time) / total(shaft, f.time)
    print(f"figure of merit {merit:.2f}")
    assert 0.4 < merit < 1.0


def test_a_tired_battery_limits_the_climb(bench: Bench) -> None:
    """The charge falls as current flows, the voltage under load stays below that at rest."""
    f = fly(bench, duration=6.0)
    voltage, current, charge = f.battery.T
    assert np.all(np.diff(charge) < 0.0)
    assert charge[-1] == pytest.approx(1.0 - current.sum() * 0.004 / CAPACITY, rel=1e-9)
    rest = CELLS * cell_voltage(charge)
    assert np.allclose(voltage, rest - RESISTANCE * current)
    assert current.max() > 1.3 * current.min()


@pytest.mark.thorough
def test_the_manipulator_balances_its_energy_in_a_controlled_flight(tmp_path: Path) -> None:
    """The experiment's table, on a climb of 3 s: all three balances within 2 %."""
    words = [*OVERRIDES, "time.duration=5.0"]
    balance = fly_manipulator(run_settings(words))
    found = balance.figures()
    off = {name: value for name, value in found.items() if name.endswith("[%]")}
    print(off)
    assert len(off) == 3
    assert all(abs(value) < 2.0 for value in off.values())
    assert found["gain of kinetic and potential energy [J]"] > 20.0
    draw(tmp_path / "figure.png", balance)
    assert (tmp_path / "figure.png").stat().st_size > 1000
