"""MuJoCo model and data of a scene: built from all robots, stepped together."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol
from xml.etree import ElementTree

import numpy as np

from seals.arrays import Floats
from seals.environment.ground import THICKNESS, Solid
from seals.environment.terrain import Terrain
from seals.errors import PhysicsError, RobotError
from seals.plugins.backends.mujoco.clearance import Clearance, strayed
from seals.plugins.backends.mujoco.contact_law import GRIP, set_pair
from seals.plugins.backends.mujoco.loading import (
    FAR,
    Description,
    describe,
    form,
    limits,
    principal,
)
from seals.plugins.backends.mujoco.sliding import Sliding
from seals.robot.model import RobotModel, Surface
from seals.scalar_compiler import Kernel, Program, compiled

PASSES = 8
"""Most solutions of one step: for joint drives at their limits, and for contacts that slide."""
ARENA = 1 << 26
"""Memory for contacts [bytes]."""
FLAT = 1e-3
"""Range of the heights of a terrain whose nodes are level [m]: the engine refuses none."""
CELL, SIDE = 0.05, 513
"""Edge of the cells of a terrain [m], and nodes along its sides at most to make them so small."""
USUAL = Surface(friction=0.5, rolling=0.0, spinning=0.0, restitution=0.0)
"""Coefficients of a link whose URDF states none."""

_FIELDS = {
    "lateral_friction": "friction",
    "rolling_friction": "rolling",
    "spinning_friction": "spinning",
    "restitution": "restitution",
}


class Stepped(Protocol):
    """Interface of a robot in the scene: binding, loads and drive limits of a step."""

    def bind(self) -> None:
        """Look up indices in the compiled model."""
        ...

    def load(self) -> None:
        """Write added inertia and generalised forces."""
        ...

    def saturate(self) -> bool:
        """Limit drives that exceed their largest force; return whether any did."""
        ...


class Scene:
    """One world of MuJoCo.

    Args:
        engine: the mujoco module.
        step: h [s].
        solids: what stands still.
        iterations: of the constraint solver.

    Attributes:
        model: compiled when it is first needed; robots cannot be added after that.
        data: state of the engine.
        stale: whether positions have changed since the poses of the bodies were found.
    """

    def __init__(self, engine: Any, step: float, solids: list[Solid], iterations: int) -> None:
        self.engine, self.step = engine, step
        self.model: Any = None
        self.data: Any = None
        self.stale = True
        self._robots: list[tuple[RobotModel, Description]] = []
        self._bodies: list[Stepped] = []
        self._spec = engine.MjSpec()
        self._settings(iterations)
        self._shapes: list[tuple[str, int, bool, Surface]] = [self._put(s) for s in solids]
        self._clearance: Clearance | None = None
        self._state_kind = int(engine.mjtState.mjSTATE_INTEGRATION)

    def _settings(self, iterations: int) -> None:
        e, spec = self.engine, self._spec
        option, off = spec.option, e.mjtDisableBit
        option.timestep, option.gravity = self.step, [0.0, 0.0, 0.0]
        option.integrator, option.solver = e.mjtIntegrator.mjINT_EULER, e.mjtSolver.mjSOL_NEWTON
        option.cone, option.impratio = e.mjtCone.mjCONE_ELLIPTIC, GRIP
        option.iterations, option.tolerance = iterations, 1e-10
        # islands keep a copy of the inertia; sensors, actuators and resets are not the engine's
        option.disableflags = off.mjDSBL_ISLAND | off.mjDSBL_AUTORESET | off.mjDSBL_SENSOR
        option.enableflags = e.mjtEnableBit.mjENBL_DIAGEXACT
        compiler = spec.compiler
        compiler.degree, compiler.fusestatic, compiler.alignfree = False, False, False
        compiler.usethread = False
        compiler.inertiafromgeom = e.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
        spec.memory = ARENA

    def _put(self, solid: Solid) -> tuple[str, int, bool, Surface]:
        """Describe a static solid."""
        name = f"/{solid.name}"
        x, y, z, w = solid.quaternion
        geom = self._spec.worldbody.add_geom(
            name=name, pos=solid.position, quat=[w, x, y, z], contype=0, conaffinity=0
        )
        if solid.terrain is not None:
            self._spread(geom, name, solid.terrain)
        else:
            geom.type, geom.size = form(self.engine, solid.kind, solid.size)
        surface = Surface(
            friction=solid.friction, rolling=0.0, spinning=0.0, restitution=solid.restitution
        )
        return name, -1, True, surface

    def _spread(self, geom: Any, name: str, terrain: Terrain) -> None:
        """Give a shape the heights of a terrain, in shares of their range.

        The engine's own collisions of convex shapes lift a box by millimetres at the seams of the
        prisms that a height map is made of; the older ones, on prisms as small as the box, do not.
        """
        self._spec.option.disableflags |= self.engine.mjtDisableBit.mjDSBL_NATIVECCD
        terrain = terrain.refined(CELL, SIDE)
        low = float(terrain.heights.min())
        span = max(float(terrain.heights.max()) - low, FLAT)
        rows, columns = terrain.heights.shape
        half = [0.5 * edge for edge in terrain.size]
        self._spec.add_hfield(
            name=name, nrow=rows, ncol=columns, size=[*half, span, THICKNESS],
            userdata=((terrain.heights - low) / span).ravel(),
        )  # fmt: skip
        geom.type, geom.hfieldname = self.engine.mjtGeom.mjGEOM_HFIELD, name
        geom.pos = [*geom.pos[:2], low]

    def add(self, robot: RobotModel, body: Stepped) -> Description:
        """Add a robot and its contact pairs with the shapes that are in the scene already.

        Raises:
            PhysicsError: the scene has been used already.
        """
        if self.model is not None:
            raise PhysicsError(
                f"robot '{robot.name}' is added too late: the scene is already in use.\n"
                "Add every robot before the first reset."
            )
        number = len(self._robots)
        found = describe(self.engine, self._spec, robot, number, self.step)
        surfaces, fixed = _surfaces_of(robot), robot.tree.fixed_base
        own = []
        for name, row in found.shapes:
            still = fixed and not robot.tree.moves[row].any()
            own.append((name, number, still, surfaces[row]))
            for other, _, stands, surface in self._shapes:
                if still and stands:
                    continue
                pair = self._spec.add_pair(geomname1=other, geomname2=name)
                set_pair(pair, _combined(surface, surfaces[row]), self.step)
        self._shapes += own
        self._robots.append((robot, found))
        self._bodies.append(body)
        return found

    def compile(self) -> None:
        """Compile model and data; set the robots' masses.

        Raises:
            PhysicsError: the engine refuses the scene.
        """
        if self.model is not None:
            return
        e = self.engine
        try:
            self.model = m = self._spec.compile()
        except ValueError as cause:
            text = " ".join(str(cause).split())[:200]
            raise PhysicsError(f"MuJoCo refuses the scene: {text}.\nCheck the robots.") from cause
        for robot, found in self._robots:
            for k, name in enumerate(found.bodies):
                row = m.body(name).id
                m.body_mass[row] = robot.mass[k]
                m.body_inertia[row] = principal(robot.inertia[k])[0]
            for name, stops in zip(found.joints, limits(robot), strict=True):
                m.jnt_range[m.joint(name).id] = np.clip(stops, -FAR, FAR)
        self.data = e.MjData(m)
        e.mj_setConst(m, self.data)
        e.mj_resetData(m, self.data)
        self.sliding = Sliding(e, m, self.data)
        if len(self._robots) > 1:
            roots = [m.body(found.bodies[0]).id for _, found in self._robots]
            self._clearance = Clearance(e, m, roots)
        for body in self._bodies:
            body.bind()

    def posed(self) -> None:
        """Update the poses of all bodies where positions have changed."""
        if self.stale:
            self.engine.mj_kinematics(self.model, self.data)
            self.stale = False

    def advance(self) -> None:
        """Advance by one step, all robots together."""
        self.compile()
        e, m, d = self.engine, self.model, self.data
        e.mj_kinematics(m, d)
        e.mj_comPos(m, d)
        e.mj_makeM(m, d)
        for body in self._bodies:
            body.load()
        e.mj_factorM(m, d)
        if self._clearance is not None:
            self._search(self._clearance.slack(self._clearance.places(d)) > 0.0)
        e.mj_collision(m, d)
        e.mj_makeConstraint(m, d)
        e.mj_projectConstraint(m, d)
        e.mj_fwdVelocity(m, d)
        sliding = self.sliding if d.ncon else None
        if sliding is not None:
            sliding.begin()
        e.mj_fwdAcceleration(m, d)
        for _ in range(PASSES):
            e.mj_fwdConstraint(m, d)
            again = sliding is not None and sliding.correct(self.step)
            held = [body.saturate() for body in self._bodies]
            if any(held):
                e.mj_factorM(m, d)
                e.mj_fwdAcceleration(m, d)
            elif not again:
                break
            # the engine itself keeps the solution at the end of a step alone
            d.qacc_warmstart[:] = d.qacc
        e.mj_Euler(m, d)
        self.stale = True

    def _search(self, clear: bool) -> None:
        """Switch the search for contacts off where nothing can touch."""
        off, flags = int(self.engine.mjtDisableBit.mjDSBL_CONTACT), self.model.opt.disableflags
        self.model.opt.disableflags = flags | off if clear else flags & ~off

    @cached_property
    def _straying(self) -> Kernel:
        """Machine code of `strayed`."""
        roots = (len(self._robots), 3)
        return compiled(strayed, [roots, roots, (1,)])

    def begin_loop(self) -> None:
        """Prepare for steps by a loop: none of several robots can touch anything in them."""
        bounds = self._clearance
        if bounds is not None:
            self.posed()
            _, began, slack = self._straying.places
            began[...] = bounds.places(self.data)
            slack[...] = max(bounds.slack(began), 0.0)
            self._search(clear=True)

    def write_bounds(self, program: Program) -> None:
        """Write that a step is refused where several robots may touch something."""
        if self._clearance is not None:
            for k, address in enumerate(self._clearance.addresses(self.data)):
                program.copy(program.given(self._straying, 3 * k), program.address(address), 3)
            program.run(self._straying)
            program.refuse_if(program.out(self._straying))

    def forget(self) -> None:
        """Clear the warm start of the solver, so that no earlier episode affects it."""
        self.compile()
        self.data.qacc_warmstart[:] = 0.0
        self.stale = True

    def state(self) -> Floats:
        """Return the complete state of the engine."""
        self.compile()
        m = self.model
        state: Floats = np.zeros(self.engine.mj_stateSize(m, self._state_kind))
        self.engine.mj_getState(m, self.data, state, self._state_kind)
        return state

    def put_back(self, state: Floats) -> None:
        """Restore a state of the engine.

        Raises:
            ValueError: it is not one of this scene.
        """
        self.compile()
        size = self.engine.mj_stateSize(self.model, self._state_kind)
        if np.shape(state) != (size,):
            raise ValueError(f"a state of shape {np.shape(state)}; {(size,)} is required")
        self.engine.mj_setState(self.model, self.data, state, self._state_kind)
        self.stale = True


def _surfaces_of(robot: RobotModel) -> list[Surface]:
    """Return the contact coefficients of every link: stated in the model, else URDF, else default.

    Raises:
        RobotError: a coefficient in the URDF is not a number.
    """
    stated = {
        link.get("name", ""): link.find("contact")
        for link in ElementTree.fromstring(Path(robot.urdf).read_bytes()).iter("link")
    }
    found = []
    for name in robot.links:
        surface, contact = USUAL, stated.get(name)
        for element in contact if contact is not None else ():
            if element.tag in _FIELDS:
                surface = replace(surface, **{_FIELDS[element.tag]: _value(robot, name, element)})
        given = (
            {}
            if robot.surface is None
            else {k: v for k, v in vars(robot.surface).items() if v is not None}
        )
        found.append(replace(surface, **given))
    return found


def _value(robot: RobotModel, link: str, element: ElementTree.Element) -> float:
    try:
        return float(element.get("value", ""))
    except ValueError as cause:
        raise RobotError(
            f"URDF {robot.urdf}: link '{link}': <{element.tag}> is not a number.\n"
            f'Write <{element.tag} value="0.5"/>.'
        ) from cause


def _combined(one: Surface, other: Surface) -> Surface:
    """Return the coefficients of two surfaces that touch.

    Equation:
        mu = mu_1 mu_2, e = e_1 e_2; the lever arms against rolling and spinning
        r = r_1 mu_2 + r_2 mu_1.

    Example:
        >>> _combined(Surface(friction=0.5, rolling=0.0, spinning=0.0, restitution=1.0), USUAL)
        Surface(friction=0.25, rolling=0.0, spinning=0.0, restitution=0.0)
    """
    a, b = ((s.friction or 0.0, s.rolling or 0.0, s.spinning or 0.0) for s in (one, other))
    return Surface(
        friction=a[0] * b[0],
        rolling=a[1] * b[0] + b[1] * a[0],
        spinning=a[2] * b[0] + b[2] * a[0],
        restitution=(one.restitution or 0.0) * (other.restitution or 0.0),
    )
