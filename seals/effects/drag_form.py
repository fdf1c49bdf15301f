"""Forms of drag: where it acts on the body, the speed in each component, and candidates in logs.

Candidates of a diagnosis are powers of the speed, at the centre or spread along the body.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import Enum
from functools import cache
from typing import Any

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.effects.binding import has_hook
from seals.effects.discrepancy import DragExponent
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.effects.identification import Addition, Freed, Stage, Subject, along_axes
from seals.hydrostatics import HullBox, HullCapsule, HullCylinder, HullSphere
from seals.hydrostatics.wetted import Hull

STRIPS = 16
"""Strips along a slender hull: force and moment within 2e-4 of the integral over it."""
_ROWS = 4
"""Rows of points across a face."""
_ALIGNED = 1e-3
"""Largest direction cosine between axes that count as perpendicular [1]."""


class DragForm(Enum):
    """Form of quadratic drag: where it acts on the body, and the speed |v| in -c |v| v_i."""

    per_axis = "per_axis"
    isotropic = "isotropic"
    cross_flow = "cross_flow"
    faces = "faces"


class HullAxis(Enum):
    """Body axis along which a slender hull lies."""

    x = "x"
    y = "y"
    z = "z"


def speed_squares(form: DragForm, axis: HullAxis) -> Floats:
    """Return S, shape (3, 3): (v_x^2, v_y^2, v_z^2) S is the squared speed for each axis.

    Example:
        >>> speed_squares(DragForm.cross_flow, HullAxis.x)
        array([[1., 0., 0.],
               [0., 1., 1.],
               [0., 1., 1.]])
    """
    if form is DragForm.per_axis:
        return np.eye(3)
    if form is not DragForm.cross_flow:
        return np.ones((3, 3))
    across = 1.0 - np.eye(3)[_INDEX[axis]]
    return np.outer(across, across) + np.diag(1.0 - across)


@cache
def drag_points(form: DragForm, axis: HullAxis) -> tuple[Floats, Floats]:
    """Return points of application and their weights along each axis, shape (K, 3) each.

    Points are in units of the body's size from its centre; weights sum to one along each axis.

    Example:
        >>> points, weights = drag_points(DragForm.isotropic, HullAxis.x)
        >>> points, weights
        (array([[0., 0., 0.]]), array([[1., 1., 1.]]))
    """
    if form is DragForm.cross_flow:
        place, share = _gauss(STRIPS)
        points = np.outer(place, np.eye(3)[_INDEX[axis]])
        return points, np.repeat(share[:, None], 3, axis=1)
    if form is not DragForm.faces:
        return np.zeros((1, 3)), np.ones((1, 3))
    place, share = _gauss(_ROWS)
    first, second = (grid.ravel() for grid in np.meshgrid(place, place))
    area = np.outer(share, share).ravel()
    pair = np.stack((np.zeros_like(first), first, second), axis=1)
    # opposite faces share their normal velocity: one plate through the centre for each axis
    points = np.concatenate([np.roll(pair, k, axis=1) for k in range(3)])
    return points, np.concatenate([np.outer(area, np.eye(3)[k]) for k in range(3)])


def form_of_hull(hull: Hull | None) -> dict[str, Any]:
    """Return the options of quadratic drag for a hull of one shape aligned with the link axes.

    Spheres are isotropic, cylinders and capsules in cross-flow, boxes have faces; empty for
    everything else.

    Example:
        >>> form_of_hull(HullSphere(radius=0.05))["form"]
        <DragForm.isotropic: 'isotropic'>
        >>> form_of_hull(HullCapsule(radius=0.1, length=1.0))["size_z"]
        1.2
    """
    if isinstance(hull, HullSphere):
        return {"form": DragForm.isotropic, **_along("position", hull.position)}
    if isinstance(hull, HullBox):
        form, own = DragForm.faces, np.asarray(hull.size, dtype=float)
    elif isinstance(hull, HullCylinder | HullCapsule):
        caps = 2.0 * hull.radius if isinstance(hull, HullCapsule) else 0.0
        form, own = DragForm.cross_flow, np.array([0.0, 0.0, hull.length + caps])
    else:
        return {}
    turn = np.abs(np.asarray(hull.axes))
    if np.abs(turn - np.round(turn)).max() > _ALIGNED:
        return {}
    size = own @ np.round(turn)
    longest = list(HullAxis)[int(np.argmax(size))]
    lies = {"axis": longest} if form is DragForm.cross_flow else {}
    return {"form": form, **lies, **_along("size", size), **_along("position", hull.position)}


_INDEX = {axis: k for k, axis in enumerate(HullAxis)}


def _along(stem: str, values: Any) -> dict[str, float]:
    return {f"{stem}_{a.value}": float(x) for a, x in zip(HullAxis, values, strict=True)}


def _gauss(count: int) -> tuple[Floats, Floats]:
    """Gauss-Legendre nodes within -1/2 ... 1/2 and their weights, one rule for each half.

    Squares of a speed that changes its sign in the middle, as in turning, are integrated exactly.
    """
    place, weight = np.polynomial.legendre.leggauss(count // 2)
    ahead, share = 0.25 * (1.0 + place), 0.25 * weight
    return np.concatenate((-ahead[::-1], ahead)), np.concatenate((share[::-1], share))


_EXPONENT = 0.05
"""1-sigma of the exponents of drag laws."""


def power_law_additions(
    law: type[Effect],
    name: str,
    subject: Subject,
    *,
    power: int,
    share: Mapping[MediumKind, float],
    forms: Sequence[DragForm] = (),
) -> list[Addition]:
    """Return the candidates: drag in each medium; its exponent has a tolerance.

    Where nothing is known of the body's shape, the drag may act spread along the vehicle, or have
    another form.

    Args:
        law: class with ``coefficient_x``, ``coefficient_y``, ``coefficient_z`` and ``medium``.
        name: under which it is installed.
        subject: the vehicle.
        power: of the speed, 1 or 2.
        share: of the weight that the drag has at 1 m/s, by medium, at most.
        forms: tried besides where neither a stated drag nor the hull says how it acts.
    """
    found: list[Addition] = []
    made: Any = law
    for index, medium in enumerate(subject.media):
        water = medium is MediumKind.water
        size = share[medium] * (subject.mass * subject.environment.gravity)
        nominal = subject.nominal(name, "coefficient", medium)
        least = 0.25 * size if power == 1 and water else 0.3 * size
        scale = np.maximum(0.5 * nominal, least)
        drawn = subject.spread("drag_coefficient") * nominal
        coefficients = along_axes("coefficient", drawn, scale, low=-nominal)
        order = (Stage.flow, index, power - 1)
        options = law.options_on(subject.robot, subject.effects, medium)
        effect = made(medium=medium, **options)
        squares = effect.constants().get("squares")
        beside = _fitted_spread(subject) if squares is None else {}
        found.append(
            Addition(
                instance=f"{name}_{medium.value}_change",
                effect=effect,
                parameters={**coefficients, **beside},
                nuisance=tuple(beside),
                variant={"medium": int(water)},
                order=order,
            )
        )
        if squares is None and not nominal.any():
            usual = replace(found[-1], parameters=coefficients, nuisance=())
            found += [_in_form(usual, f, made(medium=medium, form=f)) for f in forms]
        if nominal.any():
            shape = DragExponent(
                power=power,
                coefficients=tuple(nominal),
                speeds=tuple(subject.speeds),
                medium=medium,
                squares=squares,
            )
            # tolerance of the exponent of a stated drag; no candidate
            found.append(
                Addition(
                    instance=f"{name}_{medium.value}_shape",
                    effect=shape,
                    parameters={"exponent": Freed(tolerance=_EXPONENT, scale=0.1)},
                    named=(),
                    order=order,
                )
            )
    return found


def _in_form(usual: Addition, form: DragForm, effect: Effect) -> Addition:
    """Return a candidate in another form of its law."""
    instance = usual.instance.removesuffix("change") + form.value
    return replace(usual, instance=instance, effect=effect, law=form.value)


DRAWING: dict[str, Any] = {
    "bounds": (0.0, 1e3),
    "tolerance": 0.0,
    "source": "the body's drawing",
    "fit": False,
    "later": True,
}
"""Declaration of a size of the body that no fit moves by itself: spread, extent."""
OTHERS = 1.0 - np.eye(3)[None]
"""Sums over the other two axes of each."""
_NAMES = tuple(f"spread_{axis}" for axis in "xyz")
_PLAUSIBLE = 0.1
"""Spread of a drag of which nothing is known, of the vehicle's length squared: a rod has 1/12."""


def states_spread(drag: Effect) -> bool:
    """Return whether a drag states a spread."""
    return any(getattr(drag, name) for name in _NAMES)


def is_spread(drag: Effect) -> bool:
    """Return whether a drag acts spread, or may: as a candidate or a found correction."""
    return drag.correction or states_spread(drag)


def turning_slope(slope: Array, params: Parameters) -> Array:
    """Return torque over angular velocity [N m s/rad], shape (N, 3).

    Args:
        slope: dF_i / dv_i of the whole drag, negative [N s/m], shape (N, 3).
        params: of the drag, with ``spread`` and `OTHERS` as ``others``.
    """
    xp, spread, others = namespace(slope), params["spread"], params["others"][0]
    product = xp.matmul(slope, others) * xp.matmul(spread, others)
    return product - xp.matmul(slope * spread, others)


def _fitted_spread(subject: Subject) -> dict[str, Freed]:
    """Return the parameters of a drag of unknown shape that are fitted beside its coefficients.

    A drag acts on the body, or at the drives: what a rotor loses with the speed of the air through
    it brakes the rotation, too, and that is no effect of its own.
    """
    sizes = np.full(3, _PLAUSIBLE * subject.length**2)
    drives = [e for e in subject.effects.values() if has_hook(e, "drives")]
    if drives:
        at = (np.reshape(e.position, (-1, 3)) for e in drives)  # type: ignore[attr-defined]
        places = np.concatenate(list(at))
        sizes = np.maximum(sizes, np.square(places).mean(axis=0))
    return {
        name: Freed(scale=float(size), bounds=DRAWING["bounds"])
        for name, size in zip(_NAMES, sizes, strict=True)
    }
