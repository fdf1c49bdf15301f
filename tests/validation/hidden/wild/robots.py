"""Random robots of a user's own: nominal vehicle, fixed parts, sensors; the families in the air."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.validation.hidden.rotation import Array
from tests.validation.hidden.vehicles import GRAVITY, Vehicle, six
from tests.validation.hidden.wild.tree import Tree

Rng = np.random.Generator


@dataclass
class Part:
    """A link that is fixed to the body: place (3,), mass, diagonal inertia (3,) about it."""

    name: str
    place: Array
    mass: float
    inertia: Array


@dataclass
class Robot:
    """A nominal robot.

    Attributes:
        family: Name of its kind.
        summary: One line.
        vehicle: Numbers of the whole (of the base and the whole where it has arms).
        parts: Links that are fixed to the body link.
        channels: Noise and period in rows of every sensor.
        air: Whether the ground, and not water, is below.
        waves: Baseline waves: amplitude, period, direction; None for still water.
    """

    family: str
    summary: str
    vehicle: Vehicle
    parts: list[Part]
    channels: dict[str, tuple[float, int]]
    waves: dict[str, float] | None = None
    box: Array = field(default_factory=lambda: np.array([0.2, 0.2, 0.09]))

    @property
    def tree(self) -> Tree | None:
        """Its arms."""
        return self.vehicle.arm


def noise(rng: Rng, *, slow: int = 1, velocity: bool = False, joints: bool = False) -> Any:
    """Channels (sigma, period in rows); slow ones every `slow` rows."""

    def about(value: float) -> float:
        return float(f"{value * rng.uniform(0.75, 1.35):.2g}")

    out = {
        "angular_velocity": (about(0.006 if velocity else 0.01), 1),
        "specific_force": (about(0.04 if velocity else 0.08), 1),
        "position": (about(0.006 if velocity else 0.004), slow),
        "orientation": (about(0.004), 1),
    }
    if velocity:
        out |= {"velocity": (about(0.008), 2 * slow), "depth": (about(0.004), slow)}
    if joints:
        out["joint_position"] = (0.001, 1)
    return out


def ring(rng: Rng, n: int, mass: float, reach: float) -> dict[str, Any]:
    """Fields of n rotors in a ring, every other one turning the other way."""
    turn = 2.0 * np.pi * (np.arange(n) + 0.5 * (rng.random() < 0.5)) / n
    hover = rng.uniform(420.0, 560.0)
    thrust = mass * GRAVITY / n / hover**2
    height = rng.uniform(0.02, 0.06)
    flip = rng.choice([-1.0, 1.0])
    return {
        "positions": six(np.stack((reach * np.cos(turn), reach * np.sin(turn), height + 0 * turn))),
        "axes": np.tile(np.array([[0.0], [0.0], [1.0]]), (1, n)),
        "directions": flip * np.where(np.arange(n) % 2, -1.0, 1.0),
        "thrust": six(thrust),
        "torque": six(thrust * rng.uniform(0.014, 0.021)),
        "lag": six(rng.uniform(0.03, 0.055)),
        "limit": six(1.8 * hover),
        "radius": six(0.8 * reach * np.sin(np.pi / n)),
    }


def air_drag(rng: Rng, mass: float) -> dict[str, Any]:
    """Fields of the drag in air."""
    x = mass**0.67 * rng.uniform(0.18, 0.28)
    out: dict[str, Any] = {"air_linear": six(x * np.array([1.0, rng.uniform(0.93, 1.07), 1.0]))}
    if rng.random() < 0.6:
        x = mass**0.67 * rng.uniform(0.02, 0.035)
        out["air_quadratic"] = six(x * np.array([1.0, rng.uniform(0.9, 1.1), 1.8]))
    return out


def off_centre(rng: Rng, size: float, low: float, high: float) -> Array:
    """A centre of gravity a little beside the origin, below it by low to high."""
    return np.array([*rng.uniform(-size, size, 2), -rng.uniform(low, high)])


def multirotor(rng: Rng, family: str) -> Robot:
    """A hexacopter or an octocopter: body, rotor discs, a battery."""
    n = {"hexa": 6, "octo": 8}[family]
    mass = six(rng.uniform(2.2, 4.5) if n == 6 else rng.uniform(4.5, 9.0))
    reach = rng.uniform(0.15, 0.19) * mass ** (1 / 3) * (1.35 if n == 6 else 1.5)
    xx = mass * reach**2 * rng.uniform(0.17, 0.24)
    yy = xx * rng.uniform(1.0, 1.18)
    rotors = ring(rng, n, mass, reach)
    disc = mass * rng.uniform(0.003, 0.005)
    flat = disc * rotors["radius"] ** 2 / 4.0 * np.array([1.0, 1.0, 2.0])
    parts = [
        Part(f"rotor_{i + 1}", rotors["positions"][:, i], six(disc), six(flat)) for i in range(n)
    ]
    pack = six(mass * rng.uniform(0.1, 0.2))
    own = pack * np.array([0.0006, 0.0014, 0.0016])
    place = six([rng.uniform(-0.02, 0.02), rng.uniform(-0.01, 0.01), -rng.uniform(0.03, 0.06)])
    parts.append(Part("battery", place, pack, six(own)))
    vehicle = Vehicle(
        kind=family,
        mass=mass,
        inertia=six([xx, yy, (xx + yy) * rng.uniform(0.75, 0.92)]),
        products=six(xx * rng.uniform(-0.01, 0.01, 3)),
        centre=six(off_centre(rng, 0.005, 0.01, 0.03)),
        imu=six([*rng.uniform(-0.04, 0.04, 2), rng.uniform(0.0, 0.04)]),
        ground=0.0,
        gust_force=six(0.018 * mass),
        gust_torque=six(0.00025 * mass),
        **rotors,
        **air_drag(rng, mass),
    )
    text = f"{'Hexa' if n == 6 else 'Octo'}copter of {mass:.1f} kg"
    return Robot(family, text, vehicle, parts, noise(rng), box=six([0.6 * reach] * 2 + [0.09]))


def _rod(mass: float, length: float) -> list[float]:
    return [mass * length**2 / 12.0 + 1e-6] * 2 + [mass * 0.0002]


def manipulator(rng: Rng, family: str) -> Robot:
    """A hexacopter with arms of two joints: one with a gripper of two jaws, or two arms."""
    arms = 1 if family == "grip" else 2
    base, reach = six(rng.uniform(2.4, 3.4)), rng.uniform(0.24, 0.3)
    links: list[dict[str, Any]] = []
    for a in range(arms):
        side = 0.0 if arms == 1 else (0.07 if a == 0 else -0.07)
        word = "" if arms == 1 else ("left_" if a == 0 else "right_")
        upper, fore = rng.uniform(0.13, 0.17), rng.uniform(0.12, 0.16)
        top = len(links)
        start = [rng.uniform(-0.01, 0.02), side, -rng.uniform(0.05, 0.07)]
        links.append(_link(rng, word + "upper", word + "shoulder", -1, start, upper, 9.0, 3.0))
        below = [0.0, 0.0, -upper]
        links.append(_link(rng, word + "fore", word + "elbow", top, below, fore, 8.0, 2.5))
        if arms == 1:
            for name, y in (("jaw_left", 0.024), ("jaw_right", -0.024)):
                links.append(_jaw(rng, name, top + 1, [0.0, y, -fore]))
    tree = _tree(links, rng, base, reach, arms)
    mass = six(base + tree.mass.sum())
    # angles of a working pose, about which the controller knows its inertia
    stowed = np.array(([0.5, -1.0] * arms + [0.2, -0.2])[: len(links)])
    whole = np.diag(tree.whole_inertia(stowed))
    vehicle = Vehicle(
        kind=family,
        mass=mass,
        inertia=six(whole),
        centre=six(tree.centre(stowed[:, None])[:, 0]),
        imu=six([rng.uniform(-0.03, 0.03), rng.uniform(-0.02, 0.02), rng.uniform(0.0, 0.04)]),
        ground=0.0,
        gust_force=six(0.02 * mass),
        gust_torque=six(0.0004 * mass),
        arm=tree,
        **ring(rng, 6, mass, reach),
        **air_drag(rng, mass),
    )
    text = "Hexacopter with " + (
        "an arm and a gripper of two jaws" if arms == 1 else "two arms of two joints"
    )
    return Robot(family, text, vehicle, [], noise(rng, joints=True))


def _link(
    rng: Rng,
    name: str,
    joint: str,
    parent: int,
    place: list[float],
    length: float,
    stiff: float,
    limit: float,
) -> dict[str, Any]:
    mass = rng.uniform(0.12, 0.18)
    return {
        "name": name,
        "joint": joint,
        "parent": parent,
        "origin": place,
        "axis": [0.0, 1.0, 0.0],
        "mass": mass,
        "com": [0.0, 0.0, -length * rng.uniform(0.45, 0.6)],
        "inertia": _rod(mass, length),
        "stiff": stiff * rng.uniform(0.85, 1.15),
        "limit": limit,
        "damp": 0.03 * stiff * rng.uniform(0.9, 1.15),
        "armature": 0.002,
        "length": length,
        "lower": -2.4,
        "upper": 2.4,
        "width": 0.024,
    }


def _jaw(rng: Rng, name: str, parent: int, place: list[float]) -> dict[str, Any]:
    mass = rng.uniform(0.025, 0.04)
    return {
        "name": name,
        "joint": name,
        "parent": parent,
        "origin": place,
        "axis": [1.0, 0.0, 0.0],
        "mass": mass,
        "com": [0.0, 0.0, -0.035],
        "inertia": _rod(mass, 0.07),
        "stiff": 1.2,
        "limit": 0.4,
        "damp": 0.03,
        "armature": 0.0002,
        "length": 0.07,
        "lower": -0.7,
        "upper": 0.7,
        "width": 0.01,
    }


def _tree(links: list[dict[str, Any]], rng: Rng, base: float, reach: float, arms: int) -> Tree:
    xx = base * reach**2 * rng.uniform(0.19, 0.26)
    yy = xx * rng.uniform(1.0, 1.12)
    column = {
        k: six(np.array([link[k] for link in links], dtype=float).T)
        for k in (
            "origin",
            "axis",
            "mass",
            "com",
            "inertia",
            "stiff",
            "damp",
            "limit",
            "armature",
            "lower",
            "upper",
        )
    }
    blocks: dict[str, Any] = {
        "arms": {
            link["name"].removesuffix("fore") + "arm": {
                "joints": [links[link["parent"]]["joint"], link["joint"]],
                "tool": link["name"],
                "stowed": [1.3, -2.2],
            }
            for link in links
            if link["name"].endswith("fore")
        }
    }
    if arms == 1:
        blocks["grippers"] = {
            "gripper": {
                "joints": ["jaw_left", "jaw_right"],
                "open": [0.5, -0.5],
                "closed": [-0.1, 0.1],
                "tips": ["jaw_left", "jaw_right"],
            }
        }
    return Tree(
        names=[link["name"] for link in links],
        joint_names=[link["joint"] for link in links],
        parents=[link["parent"] for link in links],
        box=six(np.array([[link["width"], link["width"], link["length"]] for link in links]).T),
        base_mass=base,
        base_centre=six(off_centre(rng, 0.006, -0.01, 0.01)),
        base_inertia=six([xx, yy, (xx + yy) * rng.uniform(0.78, 0.92)]),
        tool=1,
        tip=six([0.0, 0.0, -links[1]["length"] - rng.uniform(0.02, 0.05)]),
        joints=2 * arms,
        blocks=blocks,
        **column,
    )
