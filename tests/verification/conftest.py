"""The bench of the verification tests: small robots, and one way to run them in both engines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from seals.environment.settings import EnvironmentSettings
from seals.frames import matrix_of
from seals.plugins.backends.pybullet import BackendPybullet
from seals.plugins.effects.gravity import Gravity
from seals.plugins.waves.still import WaveStill
from seals.robot.settings import HullSettings, RobotSettings, ShapeSettings, ShapeType
from seals.run import build_twin, build_world
from seals.run.settings import InitialSettings, RunSettings, TimeSettings
from seals.world import World

Floats = NDArray[np.float64]
Vector = Sequence[float] | Floats


class Trajectory(NamedTuple):
    """Motion of the base origin and of the joints; world axes, one row a step, the start included.

    Args:
        time: [s], shape (N,).
        position: [m], shape (N, 3).
        rotation: R_WB, shape (N, 3, 3).
        velocity: [m/s], shape (N, 3).
        angular_velocity: [rad/s], shape (N, 3).
        joints: [rad], shape (N, J).
        joint_velocity: [rad/s], shape (N, J).
    """

    time: Floats
    position: Floats
    rotation: Floats
    velocity: Floats
    angular_velocity: Floats
    joints: Floats
    joint_velocity: Floats

    def path(self) -> float:
        """Length of the way of the origin [m]."""
        return float(np.linalg.norm(np.diff(self.position, axis=0), axis=1).sum())


class Bench:
    """Builds robots in a folder and runs them in the world (PyBullet) or in the twin.

    Args:
        folder: where URDF files are written.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._count = 0

    def link(
        self,
        name: str,
        mass: float,
        inertia: ArrayLike,
        *,
        centre: Vector = (0, 0, 0),
        collision: str = "",
    ) -> str:
        """Return a link as URDF; ``inertia``: three moments or 3x3, about the centre of mass."""
        table = np.asarray(inertia, dtype=float)
        table = np.diag(table) if table.ndim == 1 else table
        names = {
            "ixx": (0, 0),
            "ixy": (0, 1),
            "ixz": (0, 2),
            "iyy": (1, 1),
            "iyz": (1, 2),
            "izz": (2, 2),
        }
        moments = " ".join(f'{key}="{float(table[at])!r}"' for key, at in names.items())
        origin = " ".join(repr(float(c)) for c in centre)
        shape = f"<collision><geometry>{collision}</geometry></collision>" if collision else ""
        return (
            f'<link name="{name}"><inertial><origin xyz="{origin}"/><mass value="{float(mass)!r}"/>'
            f"<inertia {moments}/></inertial>{shape}</link>"
        )

    def robot(
        self,
        *parts: str,
        hulls: Mapping[str, Sequence[tuple[str, Vector, Vector]]] | None = None,
        fixed_base: bool = False,
    ) -> RobotSettings:
        """Write a URDF of links and joints; hulls are lists of (type, size, position) by link."""
        self._count += 1
        path = self.folder / f"body_{self._count}.urdf"
        path.write_text(
            f'<?xml version="1.0"?><robot name="body">{"".join(parts)}</robot>', encoding="utf-8"
        )
        found = {
            link: HullSettings(
                shapes=[
                    ShapeSettings(type=ShapeType(t), size=list(s), position=list(p))
                    for t, s, p in shapes
                ]
            )
            for link, shapes in (hulls or {}).items()
        }
        return RobotSettings(
            name="body", folder=str(self.folder), urdf=path.name, hulls=found, fixed_base=fixed_base
        )

    def body(
        self,
        mass: float,
        inertia: ArrayLike,
        *,
        centre: Vector = (0, 0, 0),
        hull: str = "sphere",
        size: Vector = (),
        at: Vector = (0, 0, 0),
        collision: str = "",
    ) -> RobotSettings:
        """Return a robot of one link with at most one hull of the kind ``hull`` at ``at``."""
        hulls = {"base": [(hull, size, at)]} if len(size) else None
        return self.robot(
            self.link("base", mass, inertia, centre=centre, collision=collision), hulls=hulls
        )

    def settings(
        self,
        robot: RobotSettings,
        effects: Mapping[str, Any] | None = None,
        *,
        step: float = 0.004,
        duration: float = 1.0,
        environment: Mapping[str, Any] | None = None,
        sensors: Mapping[str, Any] | None = None,
        weight: bool = True,
        seed: int = 0,
        **initial: Any,
    ) -> RunSettings:
        """Return the settings of a run; gravity acts unless ``weight`` is False."""
        start = InitialSettings(
            **{key: [float(x) for x in value] for key, value in initial.items()}
        )
        return RunSettings(
            seed=seed,
            robot=robot,
            backend=BackendPybullet(),
            wave=WaveStill(),
            environment=EnvironmentSettings(**(environment or {})),
            effects=({"gravity": Gravity()} if weight else {}) | dict(effects or {}),
            sensors=dict(sensors or {}),
            initial=start,
            time=TimeSettings(step=step, duration=duration),
        )

    def run(self, engine: str, settings: RunSettings) -> Trajectory:
        """Run the settings in the engine ``world`` or ``twin``."""
        if engine == "twin":
            return _run_twin(settings)
        world = build_world(settings)
        try:
            return self.record(world, settings)
        finally:
            world.close()

    def record(self, world: World, settings: RunSettings) -> Trajectory:
        """Step a world over the duration of the run."""
        body = world.actors["robot"].body
        rows = [body.read()]
        for _ in range(_steps(settings)):
            world.step()
            rows.append(body.read())
        table = [np.array(column) for column in zip(*rows, strict=True)]
        position, quaternion, velocity, spin, joints, rates = table
        time = settings.time.step * np.arange(len(rows), dtype=np.float64)
        return Trajectory(time, position, matrix_of(quaternion), velocity, spin, joints, rates)


def _steps(settings: RunSettings) -> int:
    return round(settings.time.duration / settings.time.step)


def _run_twin(settings: RunSettings) -> Trajectory:
    """Step the twin over the duration of the run."""
    twin, state = build_twin(settings)
    step, rows = settings.time.step, [state]
    for k in range(_steps(settings)):
        state, _ = twin.step(state, k * step, step)
        rows.append(state)
    table = [np.array([row[0] for row in column]) for column in zip(*rows, strict=True)]
    position, quaternion, velocity, spin, joints, rates = table
    rotation = matrix_of(quaternion)
    linear, angular = (np.einsum("nij,nj->ni", rotation, x) for x in (velocity, spin))
    return Trajectory(
        step * np.arange(len(rows), dtype=np.float64),
        position,
        rotation,
        linear,
        angular,
        joints,
        rates,
    )


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    """Return a bench that writes into a folder of its own."""
    return Bench(tmp_path)
