"""Cable of lumped masses: a chain of segments with mass, buoyancy and drag between two ends."""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Array, as_like, namespace
from seals.effects.effect import Parameters
from seals.effects.scene import Fluid, Scene
from seals.motion import Medium

MOST_SEGMENTS = 60
_MOST_ROUNDS = 40
"""Most Newton iterations of a step; one or two are the rule."""
_MOST_HALVINGS = 12
"""Most halvings of the way of one iteration."""
_SETTLED = 1e-5
"""Last way of a node with which a step ends, in lengths of a segment [1]."""
_LAYING = tuple(np.geomspace(0.02, 50.0, 48).tolist())
"""Steps in which a cable that is laid comes to rest [s]: growing, for five minutes in all."""
_AT_REST = 5
"""Most segments of a cable that only hangs, as along a log: 2 % of the tension of a catenary."""
_TINY = 1e-9


class Cable(NamedTuple):
    """A cable of N rows at one instant; lengths in the world, about its fixed end.

    Args:
        end: of the moving end [m], shape (N, 3).
        end_velocity: [m/s], shape (N, 3).
        length: L, without tension [m], shape (1 or N, 1), as all that follow.
        stiffness: K = EA / L [N/m].
        diameter: d [m].
        density: mass by length [kg/m].
        across: C_n, drag coefficient across the cable, by d [1].
        along: C_t, along it, by pi d [1].
        added: C_a, added mass across it by the displaced mass [1].
        gravity: [m/s^2].
    """

    end: Array
    end_velocity: Array
    length: Array
    stiffness: Array
    diameter: Array
    density: Array
    across: Array
    along: Array
    added: Array
    gravity: Array


def memory_size_of(segments: int) -> int:
    """Return the numbers that a cable of some segments keeps.

    Example:
        >>> memory_size_of(3)
        13
    """
    return 1 + 6 * (segments - 1)


_OF_CABLE = ("length", "stiffness", "diameter", "line_density")
_OF_FLUID = ("drag_across", "drag_along", "added")


def pulled(  # noqa: PLR0917  arguments of a hook
    end: tuple[Array, Array],
    medium: Medium,
    step: float,
    memory: Array,
    params: Parameters,
    scene: Scene,
) -> tuple[Array, Array]:
    """Return the pull of the cable on its moving end, world axes [N], and its memory after a step.

    Args:
        end: place [m] and velocity [m/s] of the moving end, world axes, shape (N, 3).
        medium: of the effect.
        step: h [s]; zero, as along a log, for a cable at rest, whose memory stays.
        memory: of the effect, shape (N, `memory_size_of` its segments).
        params: ``anchor`` and the parameters of the material.
        scene: of the effect.
    """
    xp, anchor = namespace(memory), params["anchor"]
    parts = [params[n] for n in (*_OF_CABLE, *_OF_FLUID)]
    cable = Cable._make((end[0] - anchor, end[1], *parts, medium.gravity))
    height = anchor[:, 2:3]

    def around(place: Array) -> Fluid:
        both = xp.concat((place, cable.end[:, None, :]), axis=1)
        return scene.fluid(anchor[:, None, :] + both, medium)

    def at_rest(place: Array) -> tuple[Array, Array]:
        held, speed = cable._replace(end_velocity=0.0 * cable.end), 0.0 * place
        force = held.end_velocity
        for long in _LAYING:
            place, speed, force = advanced(held, place, speed, around(place), height, long)
        return place, force

    if not step:
        few = min(memory.shape[1], memory_size_of(_AT_REST))
        laid, _, _ = inner_of(0.0 * memory[:, :few], cable)
        return at_rest(laid)[1], memory
    place, speed, new = inner_of(memory, cable)
    if bool(xp.any(new)):
        place = xp.where(new[:, :, None], at_rest(place)[0], place)
    place, speed, force = advanced(cable, place, speed, around(place), height, step)
    flat = [xp.reshape(x, (memory.shape[0], -1)) for x in (place, speed)]
    return force, xp.concat((0.0 * memory[:, 0:1] + 1.0, *flat), axis=1)


def inner_of(memory: Array, cable: Cable) -> tuple[Array, Array, Array]:
    """Return places and velocities of the inner nodes, shape (N, n, 3), and which rows are new.

    A cable that has no shape yet, whose memory is zero, is laid in two straight lines of its
    length, which sag below the line between its ends.
    """
    xp = namespace(memory)
    rows, n = memory.shape[0], (memory.shape[1] - 1) // 6
    new = memory[:, 0:1] < 0.5
    place = xp.reshape(memory[:, 1 : 1 + 3 * n], (rows, n, 3))
    speed = xp.reshape(memory[:, 1 + 3 * n :], (rows, n, 3))
    share = as_like(((np.arange(n) + 1.0) / (n + 1.0))[None, :, None], memory)
    span = xp.sqrt(xp.sum(cable.end**2, axis=1, keepdims=True))
    sag = 0.5 * xp.sqrt(xp.clip(cable.length**2 - span**2, 0.0, None))
    way = cable.end / xp.clip(span, _TINY, None)
    down = as_like([[0.0, 0.0, -1.0]], memory) + 0.0 * way
    side = as_like([[1.0, 0.0, 0.0]], memory) + 0.0 * way
    down = down - way * xp.sum(way * down, axis=1, keepdims=True)
    side = side - way * xp.sum(way * side, axis=1, keepdims=True)
    steep = xp.sum(down * down, axis=1, keepdims=True) < 1e-6
    down = xp.where(steep, side, down)
    down = down / xp.sqrt(xp.sum(down * down, axis=1, keepdims=True) + _TINY**2)
    tent = 1.0 - abs(2.0 * share - 1.0)
    straight = share * cable.end[:, None, :] + tent * (sag * down)[:, None, :]
    return xp.where(new[:, :, None], straight, place), speed, new


def advanced(  # noqa: PLR0917  state and surroundings of one step
    cable: Cable, place: Array, speed: Array, fluid: Fluid, height: Array, step: float
) -> tuple[Array, Array, Array]:
    """Advance the inner nodes by one implicit Euler step, and return the force on the moving end.

    Equation:
        (m + m_a) (w - u) = h F(x + h w, w), w the velocity after the step, by Newton's method.

    Args:
        cable: ends and material.
        place: x of the inner nodes about the fixed end [m], shape (N, n, 3).
        speed: u, likewise [m/s].
        fluid: at the inner nodes and the moving end, (N, n + 1).
        height: z of the fixed end in the world [m], shape (1 or N, 1).
        step: h [s].

    Returns:
        x and u after the step, and the force on the moving end, world axes [N], shape (N, 3).
    """
    xp, n = namespace(place), place.shape[1]
    nodes = _nodes(cable, place, fluid, height)
    inner = nodes.at(slice(0, n))
    end = (cable.end + step * cable.end_velocity)[:, None, :]
    part = cable.length[:, :, None] / (n + 1)

    def energy(now: Array) -> Array:
        # its gradient is the momentum that a step lacks: convex, so that Newton's way descends
        reached, gained = place + step * now, now - speed
        moving = 0.5 * gained * xp.matmul(inner.mass, gained[..., None])[..., 0]
        own = xp.sum(moving - step * inner.weight * now, axis=2, keepdims=True)
        own = own + step * inner.rubbed(now) + inner.rested(reached, now, step)
        stored = _stored(cable, reached, end)
        return xp.sum(own, axis=1, keepdims=True) + xp.sum(stored, axis=1, keepdims=True)

    now = speed
    for _ in range(_MOST_ROUNDS):
        reached = place + step * now
        pull, slope = _tensions(cable, reached, end)
        rub, resistance = inner.drag(now)
        lift, firmness = inner.floor(reached, now, step)
        force = pull[:, 1:] - pull[:, :-1] + inner.weight + rub + lift
        lack = xp.matmul(inner.mass, (now - speed)[..., None]) - step * force[..., None]
        matrix = _assembled(inner.mass + step * resistance + firmness, step**2 * slope)
        change = xp.linalg.solve(matrix, xp.reshape(lack, (lack.shape[0], 3 * n, 1)))
        change = xp.reshape(change, now.shape)
        gain = xp.sum(change * lack[..., 0], axis=(1, 2), keepdims=True)
        share, before = 0.0 * gain + 1.0, energy(now)
        for _ in range(_MOST_HALVINGS):
            rise = energy(now - share * change) - before + 1e-4 * share * gain
            worse = rise > 1e-11 * abs(before)
            if not bool(xp.any(worse)):
                break
            share = xp.where(worse, 0.5 * share, share)
        now = now - share * change
        if bool(xp.all(step * xp.abs(change) < _SETTLED * part)):
            break
    pull, _ = _tensions(cable, place + step * now, end)
    last = nodes.at(slice(n, n + 1))
    # half a segment hangs at the moving end
    own = 0.5 * (last.weight + last.drag(cable.end_velocity[:, None, :])[0])
    return place + step * now, now, own[:, 0] - pull[:, n]


class _Nodes(NamedTuple):
    """Inner nodes and the moving end, each with one segment's length of cable.

    Args:
        tangent: unit vectors along the cable [1], shape (N, k, 3).
        mass: with the added mass [kg], shape (N, k, 3, 3).
        weight: less buoyancy [N], shape (N, k, 3).
        across: rho C_n d l / 2 [kg/m], shape (N, k, 1).
        along: rho C_t pi d l / 2 [kg/m], likewise.
        flow: velocity of the fluid [m/s], shape (N, k, 3).
        bed: height of the bottom about the fixed end [m], shape (N, 1, 1); None for none.
        firm: stiffness of the bottom [N/m], shape (N, k, 1).
        damped: damping of the bottom [N s/m], likewise.
    """

    tangent: Array
    mass: Array
    weight: Array
    across: Array
    along: Array
    flow: Array
    bed: Array | None
    firm: Array
    damped: Array

    def at(self, chosen: slice) -> _Nodes:
        """Return some of the nodes."""
        parts = [None if x is None else x[:, chosen] for x in self]
        return _Nodes(*parts)._replace(bed=self.bed)

    def _past(self, velocity: Array) -> tuple[Array, Array, Array]:
        """Speed along the cable, velocity across it and its size, against the fluid [m/s]."""
        xp = namespace(velocity)
        past = velocity - self.flow
        along = xp.sum(past * self.tangent, axis=2, keepdims=True)
        across = past - along * self.tangent
        size = xp.sqrt(xp.sum(across * across, axis=2, keepdims=True) + _TINY**2)
        return along, across, size

    def drag(self, velocity: Array) -> tuple[Array, Array]:
        """Return the drag [N], (N, k, 3), and its slope [N s/m], (N, k, 3, 3)."""
        along, across, size = self._past(velocity)
        skin, way = self.along * abs(along), across / size
        side = self.across * size
        slope = _split(self.tangent, 2.0 * skin, side)
        slope = slope + side[..., None] * way[..., :, None] * way[..., None, :]
        return -side * across - skin * along * self.tangent, slope

    def rubbed(self, velocity: Array) -> Array:
        """Return the potential of the drag over the velocity [N m/s], shape (N, k, 1)."""
        along, _, size = self._past(velocity)
        return (self.across * size**3 + self.along * abs(along) ** 3) / 3.0

    def _sunk(self, place: Array) -> Array:
        """Depth in the bottom [m], shape (N, k, 1)."""
        return namespace(place).clip(self.bed - place[:, :, 2:3], 0.0, None)

    def floor(self, place: Array, velocity: Array, step: float) -> tuple[Array, Array]:
        """Return the force of the bottom [N], (N, k, 3), and h c + h^2 k of it, (N, k, 3, 3)."""
        xp = namespace(place)
        up = as_like([0.0, 0.0, 1.0], place)
        square = as_like(np.diag([0.0, 0.0, 1.0]), place)
        if self.bed is None:
            return 0.0 * place, 0.0 * square
        sunk = self._sunk(place)
        rests = xp.where(sunk > 0.0, self.firm, 0.0 * sunk)
        force = self.firm * sunk - self.damped * velocity[:, :, 2:3]
        share = step * self.damped + step**2 * rests
        return force * up, share[..., None] * square

    def rested(self, place: Array, velocity: Array, step: float) -> Array:
        """Return the energy of the bottom, that lost in the step included [J], (N, k, 1)."""
        if self.bed is None:
            return 0.0 * place[:, :, 2:3]
        lost = 0.5 * step * self.damped * velocity[:, :, 2:3] ** 2
        return 0.5 * self.firm * self._sunk(place) ** 2 + lost


def _split(tangent: Array, along: Array, across: Array) -> Array:
    """Matrices along t t^T + across (1 - t t^T), shape (N, k, 3, 3)."""
    square = tangent[..., :, None] * tangent[..., None, :]
    one = as_like(np.eye(3), tangent)
    return along[..., None] * square + across[..., None] * (one - square)


def _nodes(cable: Cable, place: Array, fluid: Fluid, height: Array) -> _Nodes:
    """Inner nodes and the moving end in the fluid around them."""
    xp, n = namespace(place), place.shape[1]
    length, d, line, c_n, c_t, c_a = (x[:, :, None] for x in cable[2:9] if x is not cable.stiffness)
    part, area = length / (n + 1), 0.25 * math.pi * d * d
    end = cable.end[:, None, :]
    before = xp.concat((0.0 * end, place), axis=1)
    after = xp.concat((place[:, 1:], end, end), axis=1)
    gap = after - before
    tangent = gap / xp.sqrt(xp.sum(gap * gap, axis=2, keepdims=True) + _TINY**2)
    air, flow = fluid.air_density, fluid.air_velocity
    density = air + 0.0 * flow[:, :, 0:1]
    wet = 0.0 * density
    if fluid.depth is not None:
        # the surface passes over a segment within its length
        wet = xp.clip(0.5 + fluid.depth / part, 0.0, 1.0)
        wet_mass, dry_mass = wet * fluid.water_density, (1.0 - wet) * air
        density = wet_mass + dry_mass
        moved = wet_mass * fluid.water_velocity + dry_mass * flow
        flow = moved / xp.clip(density, _TINY, None)
    none = 0.0 * density
    displaced = density * area * part
    inertia = line * part + none
    gravity = cable.gravity[:, :, None]
    down = as_like([0.0, 0.0, -1.0], place)
    firm = inertia * gravity / d
    damped = 2.0 * xp.sqrt(firm * inertia)
    bed = None if fluid.bottom is None else fluid.bottom - height[:, :, None]
    if bed is not None:
        # of the nodes that lie on it as the step begins
        damped = xp.where(bed > xp.concat((place, end), axis=1)[:, :, 2:3], damped, 0.0 * damped)
    return _Nodes(
        tangent,
        _split(tangent, inertia, inertia + c_a * displaced),
        (inertia - displaced) * gravity * down,
        0.5 * density * c_n * d * part,
        0.5 * math.pi * density * c_t * d * part,
        flow,
        bed,
        firm,
        damped,
    )


def _tensions(cable: Cable, place: Array, end: Array) -> tuple[Array, Array]:
    """Pull of the segments toward the moving end [N], (N, n + 1, 3), and slopes, (N, n + 1, 3, 3).

    T = K n max(s - L / n, 0), n segments of length s.
    """
    xp, count = namespace(place), place.shape[1] + 1
    after = xp.concat((place, end), axis=1)
    span = after - xp.concat((0.0 * end, place), axis=1)
    size = xp.sqrt(xp.sum(span * span, axis=2, keepdims=True) + _TINY**2)
    way, part = span / size, cable.length[:, :, None] / count
    spring = cable.stiffness[:, :, None] * count
    stretch = xp.clip(size - part, 0.0, None)
    taut = xp.where(stretch > 0.0, spring + 0.0 * size, 0.0 * size)
    return spring * stretch * way, _split(way, taut, spring * stretch / size)


def _stored(cable: Cable, place: Array, end: Array) -> Array:
    """Energy of the segments [J], shape (N, n + 1, 1)."""
    xp, count = namespace(place), place.shape[1] + 1
    after = xp.concat((place, end), axis=1)
    span = after - xp.concat((0.0 * end, place), axis=1)
    size = xp.sqrt(xp.sum(span * span, axis=2, keepdims=True) + _TINY**2)
    stretch = xp.clip(size - cable.length[:, :, None] / count, 0.0, None)
    return 0.5 * cable.stiffness[:, :, None] * count * stretch**2


def _assembled(own: Array, between: Array) -> Array:
    """Matrix of all inner nodes, shape (N, 3 n, 3 n).

    Args:
        own: of each node alone, shape (N, n, 3, 3).
        between: of each segment, which its two ends feel in opposite senses, (N, n + 1, 3, 3).
    """
    xp, rows, n = namespace(between), between.shape[0], own.shape[1]
    both = xp.concat((own + between[:, :-1] + between[:, 1:], -between[:, 1:-1]), axis=1)
    flat = xp.reshape(both, (rows, (2 * n - 1) * 9))
    flat = xp.concat((0.0 * flat[:, :1], flat), axis=1)
    places = xp.asarray(_places(n))
    return xp.reshape(xp.take(flat, places, axis=1), (rows, 3 * n, 3 * n))


@functools.cache
def _places(n: int) -> NDArray[np.int64]:
    """Entries of the matrix of n nodes in a zero, n blocks of nodes and n - 1 blocks between."""
    out = np.zeros((n, 3, n, 3), dtype=np.int64)
    block = np.arange(9).reshape(3, 3) + 1
    for i in range(n):
        out[i, :, i, :] = block + 9 * i
    for i in range(n - 1):
        # symmetric: each block of the segments is
        out[i, :, i + 1, :] = out[i + 1, :, i, :] = block + 9 * (n + i)
    return out.ravel()
