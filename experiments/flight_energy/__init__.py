"""Energy balance of a waypoint flight of the manipulator, from battery to body."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.experiments.command import figure_table, folder_of, parser_of, show_table
from seals.motion import Inputs
from seals.multibody.kinematics import Kinematics
from seals.report.figures import lines
from seals.report.pictures import write_picture
from seals.run import build_world
from seals.run.build import run_settings
from seals.run.settings import RunSettings
from seals.world import Actor

OVERRIDES = (
    "robot=aam",
    "water=none",
    "controller=cascade",
    "guide=waypoints",
    "guide.places=[[0.0,0.0,3.0],[2.0,0.0,3.0],[2.0,1.0,1.5],[0.0,0.0,1.5]]",
    "guide.speed=1.0",
    "initial.position=[0,0,1.5]",
    # the arm is stowed from the start: the work of its servos is not in the ledger
    "initial.joint_position=[1.55,0,0,-0.6,-0.6,-0.6]",
    "name=flight_energy",
    "time.duration=30",
)


class Balance(NamedTuple):
    """Powers over a flight [W] and the energies at its ends [J].

    Args:
        time: [s], shape (T,).
        rotors: electrical power of the rotors by the square and cube of their speed, (T,).
        shaft: mechanical power of the rotors, (T,).
        battery: voltage [V], current [A] and state of charge [1], shape (T, 3).
        work: power of every effect on the robot, weight aside, by name.
        mechanical: kinetic and potential energy, (T,).
        electronics: power beside the rotors [W].
        chemical: energy that left the cells [J], by the charge that is gone.
        resistance: of the battery [ohm].
    """

    time: Floats
    rotors: Floats
    shaft: Floats
    battery: Floats
    work: dict[str, Floats]
    mechanical: Floats
    electronics: float
    chemical: float
    resistance: float

    def figures(self) -> dict[str, float]:
        """Return the balance by name, unit in the name."""
        voltage, current, _ = self.battery.T
        asked = _over(self.rotors + self.electronics, self.time)
        given = _over(voltage * current, self.time)
        heat = _over(self.resistance * current**2, self.time)
        done = sum(_over(power, self.time) for power in self.work.values())
        gained = float(self.mechanical[-1] - self.mechanical[0])
        moved = _over(np.abs(self.work["rotors"]), self.time)
        return {
            "rotors [J]": _over(self.rotors, self.time),
            "of it at the shafts [J]": _over(self.shaft, self.time),
            "electronics [J]": self.electronics * float(self.time[-1]),
            "battery, at its terminals [J]": given,
            "battery, heat inside [J]": heat,
            "battery, charge that is gone [J]": self.chemical,
            "work of the rotors on the robot [J]": _over(self.work["rotors"], self.time),
            "work of all effects on the robot, weight aside [J]": done,
            "gain of kinetic and potential energy [J]": gained,
            "terminals against what was asked for [%]": 100.0 * (given / asked - 1.0),
            "charge against terminals and heat [%]": 100.0 * (self.chemical / (given + heat) - 1.0),
            "work against gain, by the energy that the rotors moved [%]": 100.0
            * (done - gained)
            / moved,
        }


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the experiment from the command line."""
    given = parser_of("flight_energy").parse_args(arguments)
    out = folder_of(given, "flight_energy")
    balance = fly(run_settings([*OVERRIDES, *given.overrides]))
    show_table(out, figure_table(balance.figures()))
    draw(out / "figure.png", balance)
    return 0


def fly(settings: RunSettings) -> Balance:
    """Simulate a flight in air and keep its powers."""
    world = build_world(settings)
    try:
        actor, step = world.actors["robot"], settings.time.step
        rows, twists = [], []
        for _ in range(round(settings.time.duration / step)):
            poses = actor.body.poses()
            kinematics = Kinematics(actor.robot.tree, poses.origins, poses.rotations)
            moving = kinematics.move(poses.speed)
            twists.append(moving.twists[0])
            speeds = moving.twists[0]
            robot = actor.robot
            kinetic = 0.5 * np.einsum("lk,lkm,lm->", speeds, robot.spatial_inertia, speeds)
            heights = poses.origins[0][:, 2] + (poses.rotations[0][:, 2] * robot.centre).sum(axis=1)
            energy = float(kinetic + actor.gravity * (robot.mass @ heights))
            world.step()
            rows.append((world.time - step, energy, *_rotors(actor), actor.battery_state()))
        columns = [np.array(column) for column in zip(*rows, strict=True)]
        time, mechanical, rotors, shaft, battery = columns
        pushed = {
            name: np.einsum("tlk,tlk->t", actor.ledger.of(name), np.array(twists))
            for name in actor.ledger.effects
            if name != "gravity"
        }
        cells: Any = actor.battery
        return Balance(
            time=time,
            rotors=rotors,
            shaft=shaft,
            battery=battery,
            work=pushed,
            mechanical=mechanical,
            electronics=float(cells.electronics),
            chemical=_chemical(actor, float(battery[-1, 2])),
            resistance=float(cells.resistance),
        )
    finally:
        world.close()


def _rotors(actor: Actor) -> tuple[float, float]:
    """Electrical and mechanical power of the rotors at their speeds [W]."""
    total, shaft = 0.0, 0.0
    for b in actor.effects.actuators:
        inputs = Inputs(0.0, actor.joint_torque, actor.drive)
        drives = b.hooks.drives(inputs, b.params)
        total += float(b.hooks.power(drives, b.params).sum())
        shaft += float(np.abs(drives.torque * drives.speed).sum())
    return total, shaft


def _chemical(actor: Actor, left: float) -> float:
    """Energy between the charge at the start and that at the end, by the cells' own curve [J]."""
    cells: Any = actor.battery
    b = actor.effects.batteries[0]
    charge = np.linspace(left, float(cells.charge), 2001)
    # the terminal voltage without a current is that of the cells
    taken = ((float(cells.charge) - charge) * float(cells.capacity))[:, None]
    memory = np.concatenate([taken, taken * 0.0], axis=1)
    voltage = b.hooks.state(memory, b.params)[0][:, 0]
    return float(np.trapezoid(voltage, charge) * float(cells.capacity))


def _over(power: Floats, time: Floats) -> float:
    return float(np.trapezoid(power, time))


def draw(path: Path, b: Balance) -> None:
    """Draw powers and cumulative energies."""
    voltage, current, _ = b.battery.T
    powers = {
        "battery": voltage * current,
        "rotors, electrical": b.rotors,
        "rotors, shafts": b.shaft,
    }
    work = sum(b.work.values(), np.zeros(len(b.time)))
    gains = {
        "work of all effects": _growing(work, b.time),
        "kinetic and potential": b.mechanical - b.mechanical[0],
        "work of the rotors": _growing(b.work["rotors"], b.time),
    }
    write_picture(
        path,
        [
            lines("Power", "power [W]", b.time, powers),
            lines("What the robot gained", "energy [J]", b.time, gains),
            lines("Battery", "voltage [V]", b.time, {"terminals": voltage}),
        ],
    )


def _growing(power: Floats, time: Floats) -> Floats:
    steps = 0.5 * (power[1:] + power[:-1]) * np.diff(time)
    return np.concatenate([[0.0], np.cumsum(steps)])
