"""MuJoCo backend: opening of a scene, ground, stepping, snapshots."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from seals.backend import RigidBody, checked_choice
from seals.coupling import CoupledBody
from seals.environment.ground import solids_of
from seals.environment.settings import EnvironmentSettings
from seals.errors import optional_import
from seals.field_roles import roles
from seals.plugins.backends.mujoco.body import MujocoBody
from seals.plugins.backends.mujoco.scene import Scene
from seals.robot.model import RobotModel
from seals.schema import count


@roles(data="second_order compiled")
@dataclass(kw_only=True)
class BackendMujoco:
    """Rigid bodies by MuJoCo, with second-order steps and added mass inside its equations.

    Equation:
        (M + J^T A J + gains of the drives) a = forces + J_c^T f, semi-implicit Euler steps;
        contacts and stops f solve a convex problem with elliptic friction cones, iterated to
        Coulomb's law. Added mass A and joint drives are solved with the contacts of the step
        itself. Velocities are kept half a step back (leapfrog) while nothing touches.

    Args:
        solver_iterations: most iterations of the contact solver.
        second_order: whether to use half-step velocities.
        compiled: whether to compile the laws of all robots to machine code, once for each robot and
            its effects, in seconds: ``true``, which needs llvmlite, ``false``, or ``auto`` for runs
            of 2,500 steps or more where llvmlite is installed and the laws can be compiled. Robots
            in a simulated fluid go without.

    Assumptions:
        Rigid links, meshes as convex hulls, Coulomb contacts; links of one robot do not touch each
        other. Coefficients of two surfaces combine as in PyBullet: products.

    Limitations:
        Contacts give way: 1e-3 of the acceleration that pushes a body into another one is let
        through; it leaves an impact with up to a tenth of its speed.

    References:
        Todorov, Erez and Tassa 2012, doi:10.1109/IROS.2012.6386109; Todorov 2014,
        doi:10.1109/ICRA.2014.6907751.

    Example:
        >>> BackendMujoco().second_order
        True
    """

    solver_iterations: int = count(100, bounds=(1, 10_000))
    second_order: bool = True
    compiled: str = "auto"

    def __post_init__(self) -> None:
        """Keep the engine closed until `open`."""
        self.compiled = checked_choice(self.compiled)
        self._scene: Scene | None = None
        self._bodies: list[CoupledBody] = []

    @property
    def _opened(self) -> Scene:
        assert self._scene is not None
        return self._scene

    def open(self, environment: EnvironmentSettings, step: float) -> None:
        """Start an empty scene with ground or bottom."""
        self.step = step
        self._bodies = []
        self._scene = Scene(engine(), step, solids_of(environment), self.solver_iterations)

    def add(self, robot: RobotModel) -> RigidBody:
        """Add a robot to the scene."""
        engine = MujocoBody(self._opened, robot, len(self._bodies))
        body = CoupledBody(engine, robot, second_order=self.second_order)
        self._bodies.append(body)
        return body

    def advance(self) -> None:
        """Advance the scene by one step."""
        self._opened.advance()
        for body in self._bodies:
            body.after_step(self.step)

    def snapshot(self) -> Any:
        """Return the state of the engine and the half-step velocities."""
        return self._opened.state(), [body.snapshot() for body in self._bodies]

    def restore(self, snapshot: Any) -> None:
        """Restore the scene to a snapshot."""
        state, bodies = snapshot
        self._opened.put_back(state)
        for body, kept in zip(self._bodies, bodies, strict=True):
            body.restore(kept)

    def store(self, path: Path) -> Any:
        """Write an empty marker file; return the states, which need no file."""
        path.write_bytes(b"")
        return self.snapshot()

    def recall(self, path: Path, bodies: Any) -> Any:
        """Return a snapshot from the result of `store`."""
        return bodies

    def close(self) -> None:
        """Release the scene; a second call does nothing."""
        self._scene = None
        self._bodies = []


def engine() -> Any:
    """Import the engine."""
    with optional_import(
        "backend=mujoco needs the package mujoco", "Install it: pip install 'mujoco==3.17.*'"
    ):
        import mujoco
    return mujoco
