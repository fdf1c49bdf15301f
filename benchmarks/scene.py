"""Test models of the benchmarks: an eight-link chain and a rigid vehicle, with eight effects."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from seals.effects import Effect, MediumKind
from seals.environment.settings import EnvironmentSettings
from seals.plugins.backends.pybullet import BackendPybullet
from seals.plugins.effects.added_mass import AddedMass
from seals.plugins.effects.angular_drag import DragAngular
from seals.plugins.effects.buoyancy import Buoyancy
from seals.plugins.effects.current import Current
from seals.plugins.effects.gravity import Gravity
from seals.plugins.effects.linear_drag import DragLinear
from seals.plugins.effects.quadratic_drag import DragQuadratic
from seals.plugins.effects.slamming import Slamming
from seals.plugins.sensors.imu import SensorImu
from seals.plugins.waves.still import WaveStill
from seals.robot.settings import HullSettings, RobotSettings, ShapeSettings, ShapeType
from seals.run.settings import InitialSettings, RunSettings, TimeSettings

AXES = ("1 0 0", "0 1 0")


def effects(*, added_mass: bool, scale: float = 1.0) -> dict[str, Effect]:
    """Return eight effects on all links, seven without added mass, scaled with the body."""
    every = ["*"]
    found: dict[str, Effect] = {
        "gravity": Gravity(links=every),
        "buoyancy": Buoyancy(links=every),
        "current": Current(velocity_x=0.2, links=every),
        "linear_drag": DragLinear(
            coefficient_x=scale,
            coefficient_y=scale,
            coefficient_z=scale,
            medium=MediumKind.water,
            links=every,
        ),
        "quadratic_drag": DragQuadratic(
            coefficient_x=4 * scale, coefficient_y=4 * scale, coefficient_z=8 * scale, links=every
        ),
        "angular_drag": DragAngular(
            coefficient_x=0.01 * scale,
            coefficient_y=0.01 * scale,
            coefficient_z=0.01 * scale,
            links=every,
        ),
        "slamming": Slamming(coefficient=0.5, links=every),
    }
    if added_mass:
        found["added_mass"] = AddedMass(
            mass_x=0.3 * scale,
            mass_y=0.6 * scale,
            mass_z=0.9 * scale,
            inertia_x=0.001 * scale,
            inertia_y=0.002 * scale,
            inertia_z=0.002 * scale,
            links=every,
        )
    return found


def _link(name: str, mass: float, moment: float, centre: str) -> str:
    inertia = f'ixx="{moment}" ixy="0" ixz="0" iyy="{moment}" iyz="0" izz="{moment}"'
    return (
        f'<link name="{name}"><inertial><origin xyz="{centre}"/><mass value="{mass}"/>'
        f"<inertia {inertia}/></inertial></link>"
    )


def _hull(
    kind: str, size: Sequence[float], position: Sequence[float] = (0.0, 0.0, 0.0)
) -> HullSettings:
    shape = ShapeSettings(type=ShapeType(kind), size=list(size), position=list(position))
    return HullSettings(shapes=[shape])


def chain(folder: Path, links: int = 8) -> RobotSettings:
    """Write a base with a row of revolute links, a hull on each."""
    parts, hulls = [_link("base", 3.0, 0.03, "0 0 0")], {"base": _hull("box", (0.3, 0.2, 0.1))}
    for k in range(1, links):
        parts.append(_link(f"link_{k}", 0.1, 2e-4, "0.06 0 0"))
        hulls[f"link_{k}"] = _hull(
            "sphere" if k % 2 else "cylinder", (0.03,) if k % 2 else (0.02, 0.1), (0.06, 0, 0)
        )
        parent, origin = ("base", "0.15 0 0") if k == 1 else (f"link_{k - 1}", "0.12 0 0")
        parts.append(
            f'<joint name="joint_{k}" type="continuous"><parent link="{parent}"/>'
            f'<child link="link_{k}"/><origin xyz="{origin}"/><axis xyz="{AXES[k % 2]}"/></joint>'
        )
    return _robot(folder, "chain", parts, hulls)


def vehicle(folder: Path, kind: str, size: Sequence[float], mass: float) -> RobotSettings:
    """Write one rigid body with one hull."""
    return _robot(
        folder,
        "vehicle",
        [_link("base", mass, 0.01 * mass, "0 0 -0.01")],
        {"base": _hull(kind, size)},
    )


def _robot(
    folder: Path, name: str, parts: list[str], hulls: dict[str, HullSettings]
) -> RobotSettings:
    text = f'<?xml version="1.0"?><robot name="{name}">{"".join(parts)}</robot>'
    (folder / f"{name}.urdf").write_text(text, encoding="utf-8")
    return RobotSettings(name=name, folder=str(folder), urdf=f"{name}.urdf", hulls=hulls)


def settings(
    robot: RobotSettings, chosen: dict[str, Effect], *, height: float, step: float = 0.004
) -> RunSettings:
    """Return a run in the sea with a noisy IMU, the base at ``height`` above the surface."""
    sensors: dict[str, Any] = {"imu": SensorImu(accelerometer_noise=0.01)}
    return RunSettings(
        robot=robot,
        backend=BackendPybullet(),
        wave=WaveStill(),
        environment=EnvironmentSettings(water_level=0.0),
        effects=dict(chosen),
        sensors=sensors,
        initial=InitialSettings(position=[0.0, 0.0, height], rpy=[0.1, 0.05, 0.0]),
        time=TimeSettings(step=step, duration=4.0),
    )
