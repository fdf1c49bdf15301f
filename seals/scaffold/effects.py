"""Effects of a new robot in its medium: stated in its file, or chosen from its shapes."""

from __future__ import annotations

import enum
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.control.plant import ROTOR
from seals.robot.model import RobotModel
from seals.scaffold.estimates import AIR, WATER, LinkDrag, added_mass, drag_of, short
from seals.scaffold.hydrodynamics.link import added_mass_fields
from seals.scaffold.plug_ins import Hydrodynamics
from seals.scaffold.rotors import GRAVITY, Drives
from seals.scaffold.shapes import LinkHull, stated_link
from seals.scaffold.takeover import Takeover
from seals.scaffold.writing import plain

BACKWARDS = 0.7
"""Thrust of an air propeller turned backwards by that forwards [1]."""
SPARE = 1.2
"""Torque that a motor can give by that of full speed in air [1]."""
AFLOAT = 0.9
"""Submerged share below which a vehicle is a boat: its file states the floating hull [1]."""
_AXES = "xyz"


class RobotMedium(enum.Enum):
    """Medium in which a robot works: ``air``, ``water`` or ``both``."""

    air = "air"
    water = "water"
    both = "both"

    @property
    def wet(self) -> bool:
        """Whether the robot works in water."""
        return self is not RobotMedium.air

    @property
    def dry(self) -> bool:
        """Whether the robot works in air."""
        return self is not RobotMedium.water


class Entry(NamedTuple):
    """One effect of ``robot.yaml``: its values and their source."""

    values: dict[str, Any]
    source: str


def medium_of(given: str | None, drives: Sequence[Drives], source: Takeover) -> RobotMedium:
    """Return the medium: the given one; else water for vehicles with thrusters only, else both."""
    if given is not None:
        return RobotMedium(given)
    rotors = any(each.kind == ROTOR for each in drives)
    wet = bool(source.stated.hydrodynamics) or bool(drives)
    return RobotMedium.water if wet and not rotors else RobotMedium.both


def effects_of(
    robot: RobotModel,
    hulls: Mapping[str, LinkHull],
    source: Takeover,
    drives: Sequence[Drives],
    medium: RobotMedium,
) -> dict[str, Entry]:
    """Return the effects of a new robot by instance name.

    Args:
        robot: as its URDF now reads.
        hulls: by link.
        source: the file that was taken over, with what its plug-ins state.
        drives: rotors and thrusters.
        medium: in which it works.

    Raises:
        RobotError: a plug-in names a link that is not there.
    """
    out: dict[str, Entry] = {}
    if medium.wet:
        rows = source.stated.hydrodynamics
        stated = {stated_link(each, robot, source): each for each in rows}
        for link, each in stated.items():
            word = "hull" if link == robot.links[0] else plain(link)
            out |= dict(_of_file(word, link, _afloat(each, robot, hulls)))
        out |= _chosen(robot, hulls, stated)
    if medium.dry:
        out |= dict(_in_air(robot, hulls))
    return out | dict(_of_drives(robot, drives))


def _in_air(robot: RobotModel, hulls: Mapping[str, LinkHull]) -> Iterator[tuple[str, Entry]]:
    """Drag of the base in air; of the links fixed to it where the base itself is a bare frame."""
    base, still = robot.links[0], _still(robot)
    for name in [base] if base in hulls else [name for name in hulls if name in still]:
        drag = drag_of([hulls[name]])
        where = {} if name == base else {"links": [name]}
        values = {"effect": "quadratic_drag", "medium": "air", **where, **_shaped(drag, AIR)}
        word = "air_drag" if name == base else f"{plain(name)}_air_drag"
        yield word, Entry(values, f"chosen: {drag.source}, in air")


def _still(robot: RobotModel) -> list[str]:
    """Return the base and the links fixed to it."""
    moves = robot.tree.moves
    return [n for k, n in enumerate(robot.links) if not (robot.tree.joints and moves[k].any())]


def share_afloat(robot: RobotModel, hulls: Mapping[str, LinkHull]) -> float:
    """Return the submerged share of a vehicle that floats with much of its hull in air, else 1."""
    volume = sum(hull.volume for hull in hulls.values())
    share = float(robot.mass.sum()) / (WATER * volume) if volume > 0.0 else 1.0
    return share if share < AFLOAT else 1.0


def _afloat(each: Hydrodynamics, robot: RobotModel, hulls: Mapping[str, LinkHull]) -> Hydrodynamics:
    """Return the coefficients of the wholly submerged hull.

    A boat's file states those of the hull at its draught. The effects are scaled by the submerged
    share, so that they are divided by it here.
    """
    share = share_afloat(robot, hulls)
    if share == 1.0:
        return each
    rows = {
        key: value / share
        for key in ("added", "linear", "quadratic")
        if (value := getattr(each, key)) is not None
    }
    said = f"{each.source}, times the submerged share {share:.3g} of its hull when afloat"
    return each._replace(source=said, **rows)


def _of_file(word: str, link: str, each: Hydrodynamics) -> Iterator[tuple[str, Entry]]:
    """Effects with the numbers of a plug-in; none for rows of zeros."""
    where: dict[str, Any] = {"links": [link]}
    if each.added is not None and np.any(each.added):
        yield f"{word}_added_mass", Entry({**_added(each.added), **where}, each.source)
    if each.linear is not None and np.any(each.linear[:3]):
        row = _row("coefficient", each.linear[:3], exact=True)
        yield (
            f"{word}_linear_drag",
            Entry({"effect": "linear_drag", "medium": "water", **where, **row}, each.source),
        )
    if each.quadratic is not None and np.any(each.quadratic[:3]):
        row = _row("coefficient", each.quadratic[:3], exact=True)
        yield (
            f"{word}_drag",
            Entry({"effect": "quadratic_drag", "medium": "water", **where, **row}, each.source),
        )
    turning: dict[str, float] = {}
    for key, values in (("coefficient", each.linear), ("quadratic", each.quadratic)):
        if values is not None and np.any(values[3:]):
            turning |= _row(key, values[3:], exact=True)
    if turning:
        entry = {"effect": "angular_drag", "medium": "water", **where, **turning}
        yield f"{word}_turning", Entry(entry, each.source)


def _chosen(
    robot: RobotModel, hulls: Mapping[str, LinkHull], stated: Mapping[str, Hydrodynamics]
) -> dict[str, Entry]:
    """Drag and added mass from shapes, for links without values from a plug-in.

    Numbers of a file for the base, or for a link fixed to it, are those of the whole vehicle: the
    others fixed to it have none.
    """
    base, out = robot.links[0], {}
    still = _still(robot)
    own = next((stated[name] for name in still if name in stated), None)
    for name, hull in hulls.items():
        each = stated.get(name)
        if name != base and each is None and own and name in still:
            each = own
        word = "hull" if name == base else plain(name)
        if each is None or each.added is None:
            source = "chosen: ellipsoid with the volume and extent of the hull"
            row = {"effect": "added_mass", **added_mass_fields(added_mass(hull)), "links": [name]}
            out[f"{word}_added_mass"] = Entry(row, source)
        if each is None or (each.linear is None and each.quadratic is None):
            drag = drag_of([hull])
            rows = {"drag": {"effect": "quadratic_drag", **_shaped(drag, WATER)}}
            if drag.turning.any():
                rows["turning"] = {"effect": "angular_drag", **_row("quadratic", drag.turning)}
            for key, row in rows.items():
                entry = {**row, "medium": "water", "links": [name]}
                out[f"{word}_{key}"] = Entry(entry, f"chosen: {drag.source}")
    return _joined(out, base)


def _shaped(drag: LinkDrag, density: float) -> dict[str, Any]:
    """Return form, size and coefficients of a drag in a medium of given density [kg/m^3]."""
    form = {k: short(v) if isinstance(v, float) else v for k, v in drag.options.items()}
    return {**form, **_row("coefficient", density / WATER * drag.coefficients)}


def _joined(entries: Mapping[str, Entry], base: str) -> dict[str, Entry]:
    """Merge the entries of links with the same numbers."""
    found: dict[str, tuple[str, Entry]] = {}
    for name, entry in entries.items():
        bare = {k: v for k, v in entry.values.items() if k != "links"}
        key = repr(bare) if base not in entry.values["links"] else name
        if key in found:
            first = found[key][1]
            first.values["links"] += entry.values["links"]
        else:
            found[key] = (name, entry)
    return dict(found.values())


def _of_drives(robot: RobotModel, drives: Sequence[Drives]) -> Iterator[tuple[str, Entry]]:
    """Effects of water on rotors, and of air on thrusters."""
    for each in drives:
        if each.kind != ROTOR:
            wide = short(float(each.radius.mean()))
            source = each.sources.get("radius", "chosen: radius of a propeller with this force")
            values: dict[str, Any] = {"effect": "thruster_medium", "radius": wide}
            if len(drives) > 1:
                # it leaves rotors alone, as the other leaves thrusters
                values["correction"] = True
            yield "thruster_medium", Entry(values, source)
            continue
        limit = short(SPARE * float(np.max(each.torque * each.max_speed**2)))
        yield (
            "rotor_medium",
            Entry(
                {"effect": "rotor_medium", "torque_limit": max(limit, 1e-6)},
                f"chosen: {SPARE:g} times the torque of full speed in air",
            ),
        )
        if np.any(each.drag > 0.0):
            hover = GRAVITY * float(robot.mass.sum()) / (len(each.links) * each.thrust)
            row = each.drag / (each.thrust * np.sqrt(hover))
            source = f"{each.sources.get('drag', '')} (rotorDragCoefficient, at hover)"
            yield (
                "rotor_drag",
                Entry(
                    {"effect": "rotor_drag", "coefficient": min(short(float(row.mean())), 1.0)},
                    source,
                ),
            )


def _added(matrix: Floats) -> dict[str, Any]:
    """Values of ``added_mass`` for a matrix; couplings that make it indefinite are left out."""
    diagonal = np.abs(np.diag(matrix))
    values: dict[str, Any] = {"effect": "added_mass"}
    values |= _row("mass", diagonal[:3], exact=True) | _row("inertia", diagonal[3:], exact=True)
    rest = matrix - np.diag(np.diag(matrix))
    if np.any(rest) and float(np.linalg.eigvalsh(rest + np.diag(diagonal))[0]) >= 0.0:
        values["coupling"] = [[float(f"{x:.6g}") for x in row] for row in rest]
    return values


def _row(stem: str, values: Floats, *, exact: bool = False) -> dict[str, float]:
    digits = (lambda x: float(f"{x:.6g}")) if exact else short
    return {f"{stem}_{axis}": digits(float(x)) for axis, x in zip(_AXES, values, strict=True)}
