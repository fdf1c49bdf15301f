"""Thrusts that a vehicle commands after a change, by the laws of the effects.

The healthy thrusts balance the healthy vehicle, whatever its model lacks; a change adds to them.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.motion import Body, Drives
from seals.registry import get
from seals.sysid.healthy_flights.balance import DriveLayout

SMALLEST, LARGEST = 0.01, 0.95
"""Sizes of an effect, log-uniform: shares of a drive's thrust, the weight, or the arm."""
_SHARES: Floats = np.linspace(0.0, 1.0, 6)
_PRESSED: Floats = np.linspace(0.0, 1.0, 4)
_LIGHTEST = 1000.0
"""Density [kg/m^3] of the bulkiest weight: plastic."""
_SAME_PLACE = 1e-6
"""Level distance of drives at one place [m]."""
_ANGLES: Floats = np.linspace(0.0, 0.5 * np.pi, 11)[1:-1]
_UNITS = {"weak_rotor": "1", "thrust_coefficient": "1", "payload": "kg", "centre_of_gravity": "m"}
_PARAMETERS = {
    "weak_rotor": "relative_loss",
    "thrust_coefficient": "relative_change",
    "payload": "mass",
    "centre_of_gravity": "offset",
}


@dataclass(frozen=True, kw_only=True)
class Explanation:
    """Changes of the thrusts over the sizes of one explanation; rows are equally probable.

    Args:
        effect: its name.
        drives: at which it acts, numbered from 1; none for all.
        changes: of the thrusts [N], shape (rows, n).
        sizes: value of its parameter in each row, shape (rows,); empty where it has several.
        within: names of explanations that this one contains as a limit: a second fault beside them.
    """

    effect: str
    drives: tuple[int, ...]
    changes: Floats
    sizes: Floats
    within: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The effect, ``@`` and its drives joined by ``+``."""
        return self.effect + ("@" + "+".join(map(str, self.drives)) if self.drives else "")

    @property
    def parameter(self) -> str:
        """Name of its parameter."""
        return _PARAMETERS[self.effect]

    @property
    def unit(self) -> str:
        """Unit of its parameter."""
        return _UNITS[self.effect]


def explanations(layout: DriveLayout, healthy: Floats, count: int) -> list[Explanation]:
    """Return all explanations of a change.

    Args:
        layout: the drives.
        healthy: their thrusts [N], shape (n,).
        count: of the sizes of each effect.
    """
    every, sizes = range(healthy.size), np.geomspace(SMALLEST, LARGEST, count)
    found = []
    for k in every:
        # one drive loses thrust, and reaction torque with it, as a shortened blade does
        weak = get("effect", "weak_rotor").load()
        params = {
            "relative_loss": sizes[:, None],
            "torque_share": np.ones((1, 1)),
            "rotor": np.full((1, 1), k + 1.0),
        }
        rows = _restored(layout, weak, healthy, params)
        found.append(Explanation(effect="weak_rotor", drives=(k + 1,), changes=rows, sizes=sizes))
    found += [_load(layout, healthy, sizes, (k,)) for k in every]
    found += [_shifted(layout, healthy, sizes, k) for k in every]
    found += [_load(layout, healthy, sizes, pair) for pair in neighbours(layout)]
    found += [_pair(found[i], found[j]) for i, j in combinations(every, 2)]
    # all drives lose or gain the same share of thrust and torque
    both = np.concatenate([-sizes, sizes])
    law = get("effect", "thrust_coefficient").load()
    changes = _restored(layout, law, healthy, {"relative_change": both[:, None]})
    return [
        *found,
        _load(layout, healthy, sizes, ()),
        Explanation(effect="thrust_coefficient", drives=(), changes=changes, sizes=both),
    ]


def neighbours(layout: DriveLayout) -> list[tuple[int, int]]:
    """Return the pairs of drives side by side, numbered from 0.

    Distances are level ones. Drives closer than a radius, one above the other, are one place, for
    which the first of them stands.
    """
    level, near = layout.position[:, :2], np.maximum(layout.radius, _SAME_PLACE)
    places = list[int]()
    for k, place in enumerate(level):
        if all(float(np.linalg.norm(place - level[i])) > near[i] for i in places):
            places.append(k)
    pairs = list(combinations(places, 2))
    apart = [float(np.linalg.norm(level[i] - level[j])) for i, j in pairs]
    return [pair for pair, far in zip(pairs, apart, strict=True) if far < 1.1 * min(apart)]


def _pair(one: Explanation, other: Explanation) -> Explanation:
    """Two weak drives of any ratio."""
    rows = [np.cos(a) * one.changes + np.sin(a) * other.changes for a in _ANGLES]
    return Explanation(
        effect=one.effect,
        drives=one.drives + other.drives,
        changes=np.concatenate(rows),
        sizes=np.zeros(0),
        within=(one.name, other.name),
    )


def _restored(layout: DriveLayout, law: Any, healthy: Floats, params: dict[str, Any]) -> Floats:
    """Return the changes of the thrusts that restore the healthy wrench, shape (rows, n).

    The controller changes commands within the span of its wrenches only: h + P y with P the
    pseudo-inverse of the drives' map B, and B D (h + P y) = B h with D what is left of each thrust.
    """
    n, rows = healthy.size, next(iter(params.values())).shape[0]
    thrust = np.ones((rows, n))
    drives = Drives(
        position=np.zeros((n, 3)),
        axis=np.tile([0.0, 0.0, 1.0], (n, 1)),
        radius=np.ones(n),
        thrust=thrust,
        torque=0.0 * thrust,
    )
    # these laws need neither motion nor medium
    unused: Any = None
    left = np.asarray(law.actuation(drives, unused, unused, unused, params).thrust)
    wrench = layout.wrench
    inverse = np.linalg.pinv(wrench)
    lost = (1.0 - left) * healthy @ wrench.T
    felt = (wrench[None] * left[:, None, :]) @ inverse
    return np.asarray(np.einsum("ij,rjk,rk->ri", inverse, np.linalg.pinv(felt), lost))


def _load(layout: DriveLayout, healthy: Floats, sizes: Floats, at: tuple[int, ...]) -> Explanation:
    """A load under a drive, midway between two, or in the middle.

    A load under a rotor stands in its wake and is pressed down.
    """
    carried = _carried(layout, healthy)
    place = layout.position[list(at)].mean(axis=0) if at else np.zeros(3)
    law = get("effect", "payload").load()
    params = {"mass": carried * sizes[:, None], "position": np.tile(place, (sizes.size, 1))}
    changes = _lifts(
        layout, healthy, np.asarray(law.inertia_change(_body(carried, sizes.size), params))
    )
    values = np.tile(layout.mass * sizes, _SHARES.size if layout.signals else 1)
    if len(at) == 1 and layout.radius[at[0]] > 0.0:
        changes = _pressed_down(layout, healthy, changes, values, at[0])
        values = np.tile(values, _PRESSED.size)
    drives = tuple(k + 1 for k in at)
    return Explanation(effect="payload", drives=drives, changes=changes, sizes=values)


def _carried(layout: DriveLayout, healthy: Floats) -> float:
    """What the drives carry [N]: their lift where they hover, else the weight."""
    lift = float(layout.wrench[2] @ healthy)
    return lift if lift > 0.5 * layout.weight else layout.weight


def _pressed_down(
    layout: DriveLayout, healthy: Floats, changes: Floats, mass: Floats, drive: int
) -> Floats:
    """Return changes of the thrusts with the rotor's wake on the load as well, more rows.

    The pressure in the wake is at most thrust over disc, rho (2 v)^2 / 2 with v the induced
    velocity; on a blunt body (drag coefficient 1) of volume V its force is the share
    V^(2/3) / disc of the thrust. Between none of it, for a load beside the wake or a dense one, and
    the share of the bulkiest all are equally probable.
    """
    area = (mass / _LIGHTEST) ** (2.0 / 3.0)
    share = np.minimum(area / (np.pi * layout.radius[drive] ** 2), LARGEST)
    rows = []
    for part in _PRESSED:
        lost = part * share
        more = changes.copy()
        more[:, drive] += (healthy[drive] + changes[:, drive]) * lost / (1.0 - lost)
        rows.append(more)
    return np.concatenate(rows)


def _shifted(layout: DriveLayout, healthy: Floats, sizes: Floats, drive: int) -> Explanation:
    """The centre of gravity moves towards a drive."""
    arm = layout.position[drive]
    law = get("effect", "centre_of_gravity").load()
    offset = {"offset": sizes[:, None] * arm}
    inertia = np.asarray(law.inertia_change(_body(_carried(layout, healthy), sizes.size), offset))
    values = float(np.linalg.norm(arm)) * sizes
    return Explanation(
        effect="centre_of_gravity",
        drives=(drive + 1,),
        changes=_lifts(layout, healthy, inertia),
        sizes=np.tile(values, _SHARES.size if layout.signals else 1),
    )


def _lifts(layout: DriveLayout, healthy: Floats, inertia: Floats) -> Floats:
    """Return the changes of the commanded thrusts that carry a change of inertia, shape (rows, n).

    Of signals to the motors the thrust law is known between two bounds only. A signal is a share of
    the voltage, and nominally thrust goes with its square: a motor without resistance. A motor that
    is all resistance, V = R I with the torque and so the thrust in proportion to I, gives the
    least: thrust in proportion to the voltage. Both agree at the healthy commands, and every share
    of the way between them is equally probable. Commands end at full.
    """
    # the wrench of the weight in hover is the inertia times gravity, here one, downward
    load = inertia @ np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0])
    thrusts = -load @ np.linalg.pinv(layout.wrench).T
    if not layout.signals:
        return np.asarray(thrusts)
    more = np.maximum(healthy + thrusts, 0.0)
    flat = np.minimum(more**2 / healthy, layout.limit)
    flat = np.where(thrusts > 0.0, flat - healthy, thrusts)
    return np.concatenate([(1.0 - s) * thrusts + s * flat for s in _SHARES])


def _body(weight: float, rows: int) -> Body:
    one, centre = np.ones((rows, 1)), np.zeros((rows, 3))
    return Body(mass=weight * one, centre_of_mass=centre, volume=0.0 * one, plan_area=0.0 * one)
