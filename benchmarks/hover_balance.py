"""Motor commands of a hovering multirotor after a change, by the laws of the effects.

All forces are in units of nominal thrust, so masses are in the same unit and gravity is one. The
healthy commands balance the healthy vehicle, whatever its model lacks; a change adds to them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.effects.effect import Effect, Parameters
from seals.motion import Body, Drives
from seals.plugins.effects.centre_of_gravity import CentreOfGravity
from seals.plugins.effects.payload import Payload
from seals.plugins.effects.thrust_coefficient import ThrustCoefficient
from seals.plugins.effects.weak_rotor import WeakRotor

SIZES: Floats = np.geomspace(0.01, 0.95, 90)
"""Sizes of an effect, log-uniform: one to 95 % of a rotor's thrust, the weight, or the arm."""
COMMON = "thrust_coefficient"
"""A change of all rotors alike, which air and battery make."""
_SHARES: Floats = np.linspace(0.0, 1.0, 6)
_PRESSED: Floats = np.linspace(0.0, 1.0, 4)
_LIGHTEST = 1000.0
"""Density [kg/m^3] of the bulkiest weight: plastic."""
_ANGLES: Floats = np.linspace(0.0, 0.5 * np.pi, 11)[1:-1]


@dataclass(frozen=True, kw_only=True)
class Airframe:
    """Rotors of a multirotor.

    Args:
        position: of the hubs from the centre of gravity [m], shape (n, 3).
        direction: sign of the reaction torque about z, shape (n,).
        torque: reaction torque over thrust [m].
        needed: command that true thrusts (sizes, n) take, of (healthy commands (n,), thrusts),
            where the thrust law is as flat as physics allows; see `lifts`.
        radius: of the rotors [m].
        unit: mass that one unit of thrust carries [kg].
    """

    position: Floats
    direction: Floats
    torque: float
    needed: Callable[[Floats, Floats], Floats]
    radius: float
    unit: float

    def wrench_of(self) -> Floats:
        """Return the map of thrusts to thrust and torques about x, y, z, shape (4, n)."""
        x, y = self.position[:, 0], self.position[:, 1]
        return np.stack([np.ones_like(x), y, -x, self.torque * self.direction])

    @property
    def neighbours(self) -> list[tuple[int, int]]:
        """Pairs of rotors side by side, numbered from 0."""
        pairs = list(combinations(range(len(self.position)), 2))
        apart = [float(np.linalg.norm(self.position[i] - self.position[j])) for i, j in pairs]
        return [pair for pair, far in zip(pairs, apart, strict=True) if far < 1.1 * min(apart)]


@dataclass(frozen=True, kw_only=True)
class Explanation:
    """Command changes over the sizes of one explanation; rows are equally probable.

    Args:
        name: the effect, ``@`` and the rotors, numbered from 1.
        changes: of the commands, shape (rows, n).
        within: explanations that this one contains as a limit: a second fault beside theirs.
    """

    name: str
    changes: Floats
    within: tuple[str, ...] = ()


def explanations(frame: Airframe, healthy: Floats) -> list[Explanation]:
    """Return all explanations, from the healthy commands of shape (n,)."""
    n = healthy.size
    found = []
    for k in range(n):
        found.append(Explanation(name=f"weak_rotor@{k + 1}", changes=_weak(healthy, k)))
        found.append(_load(frame, healthy, (k,)))
        found.append(_shifted(frame, healthy, k))
    found += [_load(frame, healthy, pair) for pair in frame.neighbours]
    found += [_weak_pair(healthy, i, j) for i, j in combinations(range(n), 2)]
    found.append(_thrust(healthy))
    return found


def _weak(healthy: Floats, rotor: int) -> Floats:
    """One rotor loses thrust, and reaction torque with it, as a shortened blade does.

    `WeakRotor` keeps the torque; a blade with less lift at equal drag would leave no change of
    the yaw balance, for the other rotors would compensate it like a payload's.
    """
    params = {
        "relative_loss": SIZES[:, None],
        "torque_share": np.zeros((1, 1)),
        "rotor": np.full((1, 1), rotor + 1.0),
    }
    return _restored(WeakRotor, healthy, params)


def _weak_pair(healthy: Floats, first: int, second: int) -> Explanation:
    """Two weak rotors of any ratio."""
    one, other = _weak(healthy, first), _weak(healthy, second)
    rows = [np.cos(a) * one + np.sin(a) * other for a in _ANGLES]
    return Explanation(
        name=f"weak_rotor@{first + 1}+{second + 1}",
        changes=np.concatenate(rows),
        within=(f"weak_rotor@{first + 1}", f"weak_rotor@{second + 1}"),
    )


def _thrust(healthy: Floats) -> Explanation:
    """All rotors lose or gain the same share of thrust and torque."""
    sizes = np.concatenate([-SIZES, SIZES])
    changes = _restored(ThrustCoefficient, healthy, {"relative_change": sizes[:, None]})
    return Explanation(name=COMMON, changes=changes)


def _restored(effect: type[Effect], healthy: Floats, params: Parameters) -> Floats:
    """Return the changes of the commands that restore the healthy thrusts, shape (rows, n)."""
    n, rows = healthy.size, next(iter(params.values())).shape[0]
    thrust = np.tile(healthy, (rows, 1))
    drives = Drives(
        position=np.zeros((n, 3)),
        axis=np.tile([0.0, 0.0, 1.0], (n, 1)),
        radius=np.ones(n),
        thrust=thrust,
        torque=0.0 * thrust,
    )
    # these laws need neither motion nor medium
    unused: Any = None
    left = np.asarray(effect.actuation(drives, unused, unused, unused, params).thrust) / healthy
    return np.asarray(healthy / left - healthy)


def _load(frame: Airframe, healthy: Floats, rotors: tuple[int, ...]) -> Explanation:
    """A load under a rotor, or midway between two.

    A load under a rotor stands in its wake and is pressed down.
    """
    weight = float(healthy.sum())
    mass = weight * SIZES[:, None]
    place = np.tile(frame.position[list(rotors)].mean(axis=0), (SIZES.size, 1))
    inertia = Payload.inertia_change(_body(weight), {"mass": mass, "position": place})
    at = "+".join(str(k + 1) for k in rotors)
    changes = lifts(frame, healthy, np.asarray(inertia))
    if len(rotors) == 1:
        changes = _pressed_down(frame, healthy, changes, np.tile(mass[:, 0], _SHARES.size), *rotors)
    return Explanation(name=f"payload@{at}", changes=changes)


def _pressed_down(
    frame: Airframe, healthy: Floats, changes: Floats, mass: Floats, rotor: int
) -> Floats:
    """Return changes of the commands with the rotor's wake on the load as well, more rows.

    The pressure in the wake is at most thrust over disc, rho (2 v)^2 / 2 with v the induced
    velocity; on a blunt body (drag coefficient 1) of volume V its force is the share
    V^(2/3) / disc of the thrust. Between none of it, for a load beside the wake or a dense one, and
    the share of the bulkiest all are equally probable.
    """
    area = (mass * frame.unit / _LIGHTEST) ** (2.0 / 3.0)
    share = np.minimum(area / (np.pi * frame.radius**2), SIZES[-1])
    rows = []
    for part in _PRESSED:
        lost = part * share
        more = changes.copy()
        more[:, rotor] += (healthy[rotor] + changes[:, rotor]) * lost / (1.0 - lost)
        rows.append(more)
    return np.concatenate(rows)


def _shifted(frame: Airframe, healthy: Floats, rotor: int) -> Explanation:
    """The centre of gravity moves towards a rotor."""
    weight = float(healthy.sum())
    offset = SIZES[:, None] * frame.position[rotor]
    inertia = CentreOfGravity.inertia_change(_body(weight), {"offset": offset})
    return Explanation(
        name=f"centre_of_gravity@{rotor + 1}",
        changes=lifts(frame, healthy, np.asarray(inertia)),
    )


def lifts(frame: Airframe, healthy: Floats, inertia: Floats) -> Floats:
    """Return the changes of the commands that carry a change of inertia, shape (rows, n).

    Between the nominal thrust law and the flattest one the law is not known: every share of the
    way is equally probable.

    Args:
        frame: the rotors.
        healthy: commands of the healthy vehicle, shape (n,).
        inertia: changes about the reference point, shape (sizes, 6, 6).
    """
    # the wrench of the weight in hover is the inertia times gravity, here one, downward
    load = inertia @ np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0])
    thrusts = -load[:, [2, 3, 4, 5]] @ np.linalg.pinv(frame.wrench_of()).T
    flat = frame.needed(healthy, healthy + thrusts) - healthy
    return np.concatenate([(1.0 - s) * thrusts + s * flat for s in _SHARES])


def _body(weight: float) -> Body:
    one = np.ones((SIZES.size, 1))
    centre = np.zeros((SIZES.size, 3))
    return Body(mass=weight * one, centre_of_mass=centre, volume=0.0 * one, plan_area=0.0 * one)
