"""Water of a tank as particles: walls, obstacles and shores, beach, tide, wind and wave maker.

The wave maker moves by linear theory, or after Goring for a solitary wave.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.environment.ground import Solid
from seals.environment.linear_waves import flap_gain, jonswap, piston_gain, wavenumber
from seals.environment.settings import EnvironmentSettings, ObstacleSettings
from seals.errors import ConfigError
from seals.field_roles import roles
from seals.fluid import BodyStates, FluidBody, Surrounding
from seals.frames import matrix_of
from seals.plugins.fluids.coupling import HeightField, ParticleFluid, Simulation, refuse_large
from seals.plugins.fluids.sampling import Samples, joined
from seals.plugins.fluids.sampling.shapes import (
    PITCH,
    SEEN,
    THICK,
    face_edge,
    fine_face,
    sample_shape,
)
from seals.plugins.fluids.solver import SolverSettings
from seals.plugins.fluids.solvers.pbf.settings import PbfSettings
from seals.plugins.fluids.tank.basin import Basin, build_basin, walls_of
from seals.plugins.fluids.tank.settings import (
    BeachSettings,
    Maker,
    MakerSettings,
    SeaState,
    TideSettings,
    WindSettings,
)
from seals.schema import setting, vector


def sample_solid(solid: Solid, spacing: float, lower: Floats, upper: Floats) -> Samples:
    """Sample the part of a solid inside a box; level planes, which are the floor, are skipped.

    Args:
        solid: that stands still.
        spacing: of the fluid [m].
        lower: corner of the box [m], shape (3,).
        upper: opposite corner [m], shape (3,).
    """
    if solid.kind == "plane":
        return Samples(np.zeros((0, 3)), np.zeros(0))
    turn = matrix_of(np.asarray(solid.quaternion, dtype=float)[None])[0]
    if solid.kind == "box":
        found = _box_near(solid, turn, spacing, lower, upper)
    elif 2.0 * solid.size[0] >= THICK * spacing and solid.size[-1] >= spacing:
        found = fine_face(solid.kind, solid.size, spacing)
    else:
        found = sample_shape(solid.kind, solid.size, spacing)
    # a static obstacle may displace a full cell: no buoyancy depends on it
    found = Samples(found.points, np.maximum(found.volumes, spacing**3))
    placed = found.placed(solid.position, turn)
    inside = ((placed.points > lower) & (placed.points < upper)).all(axis=1)
    return Samples(placed.points[inside], placed.volumes[inside])


def _box_near(solid: Solid, turn: Floats, spacing: float, lower: Floats, upper: Floats) -> Samples:
    """The two outer layers of a box, only where they may lie in another box."""
    corners = np.array(list(itertools.product(*zip(lower, upper, strict=True))))
    local = (corners - solid.position) @ turn
    axes, depth = [], []
    for k, edge in enumerate(solid.size):
        # thick boxes have a finer face, its outer samples where those of the lattice would be
        fine = PITCH * spacing if min(solid.size) >= THICK * spacing else spacing
        reach = 0.5 * face_edge(edge, spacing)
        count = round(2.0 * reach / fine) + 1
        step = 2.0 * reach / max(count - 1, 1)
        low, high = local[:, k].min() + reach, local[:, k].max() + reach
        first = int(np.clip(low // max(step, fine), 0, count))
        last = int(np.clip(high // max(step, fine) + 2, 0, count))
        index = np.arange(first, last)
        axes.append(index * step - reach)
        depth.append(np.minimum(index, count - 1 - index))
    deep = np.minimum.reduce(np.meshgrid(*depth, indexing="ij"))
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1)[deep < SEEN]
    return Samples(points, np.full(len(points), spacing**3))


STEEPEST = 0.3
"""Steepness k a above which linear wave-maker theory is not valid [1]."""
SHALLOWEST = 0.7
"""Largest solitary wave over depth; at 0.78 it breaks [1]."""
_TAIL = 3.8
"""Half width of a solitary wave's maker motion, as the argument of sech^2."""


class _Stroke(NamedTuple):
    """Displacement of the paddle at the still surface [m] and its rate [m/s]."""

    place: float
    speed: float


class Paddle:
    """Wave maker paddle in water of a given depth.

    Args:
        settings: of the maker.
        depth: of the still water [m].
        gravity: [m/s^2].

    Raises:
        ConfigError: the waves are too steep or too high for the theory.
    """

    def __init__(self, settings: MakerSettings, *, depth: float, gravity: float) -> None:
        self.settings, self.depth, self.gravity = settings, depth, gravity
        self._solitary = settings.sea is SeaState.solitary
        if self._solitary:
            self._omega = self._stroke = self._phase = np.zeros(0)
            high = self.settings.height / self.depth
            if not 0.0 < high <= SHALLOWEST:
                raise ConfigError(
                    f"maker: a solitary wave of {self.settings.height:g} m on {self.depth:.3g} m "
                    f"of water is {high:.2f} of the depth.\n"
                    f"Allowed: above 0, up to {SHALLOWEST:g}; it breaks at 0.78."
                )
            self.length = 2.0 * _TAIL * self.depth / math.sqrt(0.75 * high)
        else:
            self._components()

    def _components(self) -> None:
        s = self.settings
        if s.sea is SeaState.jonswap:
            self._omega, amplitude = jonswap(
                s.height, s.period, peakedness=s.peakedness, components=s.components
            )
            self._phase = np.random.default_rng(s.seed).uniform(0.0, 2.0 * math.pi, s.components)
        else:
            self._omega, amplitude = np.array([2.0 * math.pi / s.period]), np.array([s.height / 2])
            self._phase = np.zeros(1)
        k = np.array([wavenumber(w, self.depth, self.gravity) for w in self._omega])
        gain = flap_gain if s.kind is Maker.flap else piston_gain
        self._stroke = amplitude / np.array([gain(x) for x in k * self.depth])
        peak = wavenumber(2.0 * math.pi / s.period, self.depth, self.gravity)
        self.length = 2.0 * math.pi / peak
        steep = 0.5 * peak * s.height
        if steep > STEEPEST:
            raise ConfigError(
                f"maker: a height of {s.height:g} m at {s.period:g} s on {self.depth:.3g} m of "
                f"water has the steepness {steep:.2f}.\nAllowed: up to {STEEPEST:g}, that is "
                f"{2.0 * STEEPEST / peak:.3g} m; lower the height or raise the period."
            )

    @property
    def travel(self) -> float:
        """Largest displacement of the paddle at the still surface to either side [m]."""
        if self._solitary:
            return 2.0 * math.sqrt(self.settings.height * self.depth / 0.75)
        if len(self._stroke) == 1:
            return float(self._stroke[0])
        # three standard deviations and a little more
        return float(3.5 * math.sqrt(0.5 * (self._stroke**2).sum()))

    def stroke(self, time: float) -> _Stroke:
        """Return displacement and rate at ``time`` [s]; negative is away from the water."""
        t = time - self.settings.start
        if t <= 0.0:
            return _Stroke(0.0, 0.0)
        if self._solitary:
            return self._goring(t)
        angle = self._omega * t + self._phase
        # amplitude of the displacement is half the stroke, and amplitude/gain is just that
        place = float(self._stroke @ np.sin(angle))
        speed = float((self._stroke * self._omega) @ np.cos(angle))
        # an irregular sea does not begin at rest: it always comes up
        least = 1.0 if len(self._phase) > 1 else 0.0
        # multiply a motion by a smooth start-up ramp
        ramp = max(self.settings.ramp, least) * self.settings.period
        if ramp <= 0.0 or t >= ramp:
            return _Stroke(place, speed)
        u = t / ramp
        share, rate = u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u) / ramp
        return _Stroke(share * place, share * speed + rate * place)

    def _goring(self, t: float) -> _Stroke:
        """Goring 1978: the paddle moves with the water's mean velocity, dX/dt = c eta/(h + eta)."""
        h, high = self.depth, self.settings.height
        k, c = math.sqrt(0.75 * high / h**3), math.sqrt(self.gravity * (h + high))
        # the crest passes the paddle once its motion is half done
        middle = (_TAIL + high / h) / (k * c)
        place = self._solved(k, c, t - middle, h, high)
        eta = high / math.cosh(k * (c * (t - middle) - place)) ** 2
        start = self._solved(k, c, -middle, h, high)
        return _Stroke(place - start, c * eta / (h + eta))

    @staticmethod
    def _solved(k: float, c: float, t: float, h: float, high: float) -> float:
        """X of X = (H / k h) tanh(k (c t - X)), by Newton's method."""
        place = 0.0
        for _ in range(50):
            tanh = math.tanh(k * (c * t - place))
            error = place - high / (k * h) * tanh
            change = error / (1.0 + high / h * (1.0 - tanh * tanh))
            place -= change
            if abs(change) < 1e-14:
                break
        return place


class PaddlePlate(NamedTuple):
    """Pose and twist of the paddle: position (3,), rotation (3, 3), velocities (3,) each."""

    position: Floats
    rotation: Floats
    velocity: Floats
    spin: Floats

    @classmethod
    def of(cls, kind: Maker, stroke: _Stroke, foot: Floats, depth: float) -> PaddlePlate:
        """Return pose and twist of the paddle at a stroke.

        Args:
            kind: piston or flap.
            stroke: at the still surface.
            foot: lower edge of the paddle at rest, world [m], shape (3,).
            depth: of the still water [m].
        """
        still = np.zeros(3)
        if kind is not Maker.flap:
            push = np.array([stroke.place, 0.0, 0.0])
            return cls(foot + push, np.eye(3), np.array([stroke.speed, 0.0, 0.0]), still)
        tangent = stroke.place / depth
        angle = math.atan(tangent)
        rate = stroke.speed / depth / (1.0 + tangent * tangent)
        c, s = math.cos(angle), math.sin(angle)
        turn = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        return cls(foot.copy(), turn, still, np.array([0.0, rate, 0.0]))


REST_RATE = 20.0
"""Damping rate of the velocities while the water settles [1/s]."""
REST_SHARE = 0.7
"""Share of the settling time with damping; the rest is free [1]."""


class TankSimulation(Simulation):
    """Simulation of water particles in a basin.

    Args:
        settings: options of the fluid.
        basin: its sizes.
        physics: options of the solver.
        around: environment, solids and step.
        bodies: in the water.

    Raises:
        SealsError: the spacing is too coarse for a body, or there would be too many particles.
    """

    settings: FluidParticles

    def __init__(
        self,
        settings: FluidParticles,
        basin: Basin,
        physics: SolverSettings,
        around: Surrounding,
        bodies: Sequence[FluidBody],
    ) -> None:
        refuse_large(math.prod(basin.counts), basin.boundary, settings.most)
        super().__init__(settings, physics, bodies, basin.spacing)
        self.basin, self._step = basin, around.step
        e = around.environment
        self.paddle = _paddle_of(settings, e)
        high = np.array([*basin.upper[:2], basin.top])
        self._solids = joined(
            [sample_solid(s, basin.spacing, basin.lower, high) for s in around.solids]
        )
        walls = basin.walls(floor=not self._tidal, paddle=self.paddle is not None)
        moved = [] if self.paddle is None else [basin.paddle()]
        moved += [basin.floor()] if self._tidal else []
        level = float(e.water_level or 0.0)
        self._allocate(
            basin.domain(settings.tide.amplitude),
            joined([walls, self._solids]),
            moved,
            capacity=math.prod(basin.counts),
            surface=HeightField(basin.lower, basin.upper, basin.spacing, level),
        )

    @property
    def _tidal(self) -> bool:
        return bool(self.settings.tide.amplitude > 0.0)

    def _lattice(self) -> Floats:
        return self.basin.lattice()

    def _occupied(self, states: BodyStates) -> Samples:
        return joined([self._solids, self.immersed.volumes(states)])

    def _settle(self, states: BodyStates) -> None:
        """Let the water come to rest around bodies that are held, and an early maker begin."""
        steps = round(self.settings.settle / self._step)
        early = 0 if self.paddle is None else max(round(-self.settings.maker.start / self._step), 0)
        free = int(REST_SHARE * (steps - early))
        held = states._replace(
            velocity=np.zeros_like(states.velocity),
            spin=np.zeros_like(states.spin),
            inverse_mass=np.zeros_like(states.inverse_mass),
            inverse_inertia=np.zeros_like(states.inverse_inertia),
            acceleration=np.zeros_like(states.acceleration),
        )
        for k in range(steps):
            time = (k - steps) * self._step if early else 0.0
            self._place(held, time, self._step)
            self.water.advance(self._step, substeps=self._substeps(self._step))
            if k >= steps - early:
                self._treat(held, time, self._step)
            if k < free:
                self.water.set_particles(
                    velocities=self.water.velocities() * math.exp(-REST_RATE * self._step)
                )

    def _place(self, states: BodyStates, time: float, step: float) -> None:
        """Place all bodies and kinematic boundaries."""
        boards = self._boards(time)
        if not self.bodies + len(boards):
            return
        s = states
        none, still = np.zeros(len(boards)), np.zeros((len(boards), 3))
        self.water.place_bodies(
            position=_with(s.position, [b.position for b in boards]),
            rotation=_with(s.rotation, [b.rotation for b in boards]),
            velocity=_with(s.velocity, [b.velocity for b in boards]),
            spin=_with(s.spin, [b.spin for b in boards]),
            inverse_mass=np.concatenate([s.inverse_mass, none]),
            inverse_inertia=np.concatenate([s.inverse_inertia, np.zeros((len(boards), 3, 3))]),
            acceleration=np.concatenate([s.acceleration, still]),
        )

    def _boards(self, time: float) -> list[PaddlePlate]:
        """Poses of paddle and moving floor."""
        out = []
        if self.paddle is not None:
            kind, depth = self.settings.maker.kind, self.basin.depth
            out.append(PaddlePlate.of(kind, self.paddle.stroke(time), self.basin.foot, depth))
        if self._tidal:
            tide = self.settings.tide
            rate = 2.0 * math.pi / tide.period
            up = np.array([0.0, 0.0, tide.amplitude])
            place = self.basin.middle + up * math.sin(rate * time)
            out.append(
                PaddlePlate(place, np.eye(3), up * rate * math.cos(rate * time), np.zeros(3))
            )
        return out

    def _treat(self, states: BodyStates, time: float, step: float) -> None:
        s = self.settings
        windy = s.wind.stress_x != 0.0 or s.wind.stress_y != 0.0
        if s.beach.length > 0.0 or windy:
            places, velocities = self.water.positions(), self.water.velocities()
            velocities = apply_beach(s.beach, self.basin, places, velocities, step)
            over = self.heights.at(places) if windy else np.zeros(0)
            velocities = apply_wind(
                s.wind, self.basin, over, places, velocities, step / self.physics.density
            )
            self.water.set_particles(velocities=velocities)

    def diagnostics(self) -> dict[str, float]:
        """Return diagnostics of solver and tank: lost particles, wave gauges."""
        out = super().diagnostics()
        out["left through open sides"] = float(self.left)
        for name, place in self.settings.gauges.items():
            out[f"gauge {name} [m]"] = float(self.heights.at(np.array([place]))[0])
        return out


def _paddle_of(settings: FluidParticles, environment: EnvironmentSettings) -> Paddle | None:
    """Return the wave maker of the tank, or None.

    Raises:
        ConfigError: its waves are too high for the theory.
    """
    e = environment
    if settings.maker.kind is Maker.none:
        return None
    depth = (
        settings.size[2] if e.tank_bottom is None else float(e.water_level or 0.0) - e.tank_bottom
    )
    return Paddle(settings.maker, depth=depth, gravity=e.gravity)


def _with(array: Floats, more: Sequence[Floats]) -> Floats:
    return np.concatenate([array, np.array(more)]) if more else array


def apply_beach(
    beach: BeachSettings, basin: Basin, places: Floats, velocities: Floats, step: float
) -> Floats:
    """Return the velocities after one step of the sponge layer [m/s], shape (n, 3).

    Args:
        beach: its settings.
        basin: that it lies in.
        places: of the particles [m], shape (n, 3).
        velocities: [m/s], shape (n, 3).
        step: [s].
    """
    if beach.length <= 0.0:
        return velocities
    s = np.clip((places[:, 0] - basin.upper[0] + beach.length) / beach.length, 0.0, 1.0)
    keep = np.exp(-beach.rate * s * s * step)
    out: Floats = velocities * np.stack([keep, keep, keep * keep], axis=1)
    return out


def apply_wind(  # noqa: PLR0917  the water as it stands
    wind: WindSettings,
    basin: Basin,
    heights: Floats,
    places: Floats,
    velocities: Floats,
    share: float,
) -> Floats:
    """Return the velocities after one step of the wind stress [m/s], shape (n, 3).

    The stress acts on the particles of the uppermost spacing, each with the area of its column.

    Args:
        wind: its stress.
        basin: that holds the water.
        heights: of the surface over the particles [m], shape (n,).
        places: of the particles [m], shape (n, 3).
        velocities: [m/s], shape (n, 3).
        share: of the step over the density of the water [s m^3/kg].
    """
    if wind.stress_x == 0.0 and wind.stress_y == 0.0:
        return velocities
    top = places[:, 2] > heights - basin.spacing
    if not top.any():
        return velocities
    area = math.prod((basin.upper - basin.lower)[:2].tolist())
    gain = area * share / (top.sum() * basin.spacing**3)
    out: Floats = velocities.copy()
    out[top, 0] += wind.stress_x * gain
    out[top, 1] += wind.stress_y * gain
    return out


_CHOSEN = "chosen"


@roles(data="open_sides gauges")
@dataclass(kw_only=True)
class FluidParticles(ParticleFluid):
    """Water as particles in a tank, two-way coupled with bodies.

    Equation:
        Density constraint of Macklin and Mueller 2013 with compliance (XPBD), or with
        ``solver=dfsph`` constant density and zero divergence (Bender and Koschier 2015); bodies as
        samples with volumes (Akinci et al. 2012), their mass and inertia in the iterations. It is
        filled to ``environment.water_level``; its floor is ``environment.tank_bottom``, else the
        depth is ``size[2]``.

    Args:
        spacing: of the particles at rest [m]; the nearest one that divides the depth is taken.
        size: length (x), width (y) and depth of the water [m].
        centre: of the basin, east and north [m].
        freeboard: room above the water in which particles may fly [m].
        open_sides: sides without a wall (x_low, x_high, y_low, y_high): particles that leave there
            are gone, and counted.
        maker: of waves, in place of the wall at low x.
        beach: sponge layer at high x.
        tide: slow change of the mean level.
        wind: over the water.
        gauges: of the surface height, by name, each [east, north] in m.
        settle: for how long the water comes to rest around held bodies before the first step [s].

    Assumptions:
        No air: it exerts no force. A particle is a blob of water of the size of its spacing.

    Valid range:
        Bodies of ten spacings and more for forces within 5 %; two spacings at least.

    Limitations:
        Eddies below the spacing and the boundary layer are not resolved: pressure drag on the scale
        of the spacing is there; friction and the drag of thin parts are not. The
        viscosity of the method keeps the effective Reynolds number at some hundreds. Add what is
        missing as an effect with ``correction: true``. No cavity pressure, no air
        cushion. The basin stands still and is alone: ``wave`` must be still, a paddle has no solid
        that bodies touch.

    References:
        Macklin and Mueller 2013, doi:10.1145/2461912.2461984; Akinci et al. 2012,
        doi:10.1145/2185520.2185558; Macklin et al. 2014, doi:10.1145/2601097.2601152; Bender and
        Koschier 2015, doi:10.1145/2786784.2786796.

    Example:
        >>> FluidParticles(spacing=0.05).name
        'particles'
    """

    spacing: float = setting(0.04, "m", bounds=(1e-3, 5.0), source=_CHOSEN)
    physics: PbfSettings = field(default_factory=PbfSettings)
    centre: list[float] = vector((0.0, 0.0), "m", bounds=(-1e5, 1e5), source=_CHOSEN)
    open_sides: list[str] = field(default_factory=list)
    maker: MakerSettings = field(default_factory=MakerSettings)
    beach: BeachSettings = field(default_factory=BeachSettings)
    tide: TideSettings = field(default_factory=TideSettings)
    wind: WindSettings = field(default_factory=WindSettings)
    gauges: dict[str, list[float]] = field(default_factory=dict)
    settle: float = setting(0.0, "s", bounds=(0.0, 60.0), source=_CHOSEN)

    name: ClassVar[str] = "particles"

    def __post_init__(self) -> None:
        """Check counts and gauges; nothing is allocated yet."""
        super().__post_init__()
        for name, place in self.gauges.items():
            if len(place) != 2:
                raise ConfigError(
                    f"gauges.{name}={place} is not a position.\nAllowed: [east, north] in m."
                )
        if -self.maker.start > self.settle:
            raise ConfigError(
                f"maker.start={self.maker.start:g} s is before the water settles "
                f"(settle={self.settle:g} s).\nUse settle={1.0 - self.maker.start:g} or more."
            )

    @property
    def lacks_drag(self) -> bool:
        """Whether stated drag is added, see `seals.fluid`: not in the waves of a maker."""
        return self.subgrid_drag and self.maker.kind is Maker.none

    def solids(self, environment: EnvironmentSettings) -> Mapping[str, ObstacleSettings]:
        """Return walls and floor of the basin."""
        return walls_of(self._basin(environment))

    def _basin(self, environment: EnvironmentSettings) -> Basin:
        """Sizes of the basin in a given environment."""
        paddle = _paddle_of(self, environment)
        return build_basin(
            spacing=self.spacing,
            size=self.size,
            centre=self.centre,
            level=float(environment.water_level or 0.0),
            bottom=environment.tank_bottom,
            freeboard=self.freeboard,
            behind=0.0 if paddle is None else paddle.travel + 4.0 * self.spacing,
            open_sides=self.open_sides,
        )

    def open(self, around: Surrounding, bodies: Sequence[FluidBody]) -> None:
        """Create the basin and its boundaries."""
        environment = around.environment
        if around.waves.at(np.zeros((1, 3)), np.zeros((1, 1)), 0.0).normal is not None:
            raise ConfigError(
                "wave: the sea around a basin of particles is still.\n"
                "Leave wave out and make waves in the basin: fluid.maker.kind=piston"
            )
        outflow = bool(self.open_sides) or self.physics.outflow
        physics = self._physics(environment, outflow=outflow)
        self._simulation = TankSimulation(self, self._basin(environment), physics, around, bodies)
