"""Contract tests of robot folders."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from seals.contract import require
from seals.effects.binding import bind_effects
from seals.robot.build import build_robot
from seals.robot.model import RobotModel
from seals.run.build import run_settings


@dataclass(frozen=True, kw_only=True)
class RobotReport:
    """Result of `check_robot`.

    Args:
        name: of the robot.
        links: number of links.
        joints: number of movable joints.
        mass: [kg].
        volume: displaced by all hulls [m^3].
    """

    name: str
    links: int
    joints: int
    mass: float
    volume: float

    def table(self) -> str:
        """Return the figures as text."""
        return (
            f"{self.name}: {self.links} links, {self.joints} joints, {self.mass:.4g} kg, "
            f"displaces {self.volume * 1e3:.4g} l"
        )


def check_robot(robot: str | Path) -> RobotReport:
    """Check that a robot folder composes, builds, and is physically possible.

    Args:
        robot: name of an installed robot, or a folder.

    Raises:
        ContractError: a mass, an inertia, a joint or a hull cannot be; also an AssertionError.
        SealsError: the folder cannot be composed or built.
    """
    settings = run_settings([f"robot={robot}", "water=fossen"])
    model = build_robot(settings.robot)
    bind_effects(settings.effects, model.links)
    name = settings.robot.name
    require(
        bool(settings.robot.summary), name, "has no summary", "Add a line 'summary:' to robot.yaml."
    )
    _check_masses(name, model)
    # check unit axes and ordered limits
    axes = np.linalg.norm(model.tree.axis, axis=1)
    require(
        bool(np.allclose(axes, 1.0)), name, f"has joint axes of length {axes}", "Give unit axes."
    )
    require(
        bool((model.lower < model.upper).all()),
        name,
        "has a joint without travel",
        "Make it fixed, or widen it.",
    )
    volume = 0.0
    for link, hull in zip(model.links, model.hulls, strict=True):
        if hull is not None:
            good = hull.volume > 0.0 and hull.reach > 0.0 and bool(np.isfinite(hull.centroid).all())
            require(
                good,
                name,
                f"the hull of '{link}' displaces {hull.volume:.2g} m^3",
                "Give its shapes a size.",
            )
            volume += hull.volume
    return RobotReport(
        name=name,
        links=len(model.links),
        joints=model.tree.joints,
        mass=float(model.mass.sum()),
        volume=volume,
    )


def _check_masses(name: str, model: RobotModel) -> None:
    """Check that the whole has mass, and every link with mass a possible inertia."""
    require(
        float(model.mass.sum()) > 0.0, name, "has no mass", "Add <inertial> elements to the URDF."
    )
    for link, mass, inertia in zip(model.links, model.mass, model.inertia, strict=True):
        low, middle, high = np.linalg.eigvalsh(inertia)
        where = (
            f"the link '{link}' of {mass:.3g} kg has the principal moments "
            f"{low:.2g}, {middle:.2g}, {high:.2g} kg m^2"
        )
        require(
            mass >= 0.0 and low >= -1e-12 * high, name, where, "Mass and moments are not negative."
        )
        require(
            high <= (low + middle) * 1.001 + 1e-15,
            name,
            where,
            "The largest is at most the sum of the others.",
        )
        require(
            mass == 0.0 or low > 0.0,
            name,
            where,
            "A link with mass needs an inertia about every axis.",
        )
