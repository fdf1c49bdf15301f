"""``seals new hydrodynamics``: added mass and radiation of a link, from the shape of its hull."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import Enum
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.check.floating import FloatingBody
from seals.errors import ConfigError, refuse_unlisted
from seals.hydrostatics import Hull, HullSamples
from seals.logs.atomic import write_text
from seals.robot.model import RobotModel
from seals.robot.robot_file import read_robot
from seals.robot.yaml_edit import refuse_braces, with_entry, without_entry
from seals.scaffold.hydrodynamics import (
    Ellipsoid,
    Panels,
    Radiation,
    deep_added_mass,
    ellipsoid_of_moments,
    extrapolated,
    fit_resonators,
    panels_of,
    positive,
    radiation_of,
    wave_frequencies,
)
from seals.scaffold.writing import flow

KINDS = ("added_mass", "radiation_memory")
FREQUENCIES = 24
"""Frequencies at which the radiation of a floating hull is computed."""
COARSER = 2.5
"""Ratio of the panels of the two computations whose limit is taken [1]."""
_SMALL = 2e-3
"""Cross term, by the root of its two diagonal ones, that is left out as an error of panels [1]."""
_NOTHING = 1e-4
"""Inertia of a motion, by that of the heaviest of its kind, that counts as none [1]."""


class Method(Enum):
    """Method by which added mass is computed from a shape."""

    bem = "bem"
    ellipsoid = "ellipsoid"


class Hydrodynamics(NamedTuple):
    """Added mass and radiation of one link.

    Args:
        entries: of ``effects`` in ``robot.yaml``, by kind of effect.
        source: of the numbers, in a few words.
        words: what was found, line by line.
    """

    entries: Mapping[str, dict[str, Any]]
    source: str
    words: list[str]


def hydrodynamics_of(
    robot: RobotModel,
    link: str,
    method: Method,
    *,
    density: float,
    panels: int = 500,
    tell: Callable[[int], object] = int,
) -> Hydrodynamics:
    """Return the added mass of a link, and the radiation memory of a floating base.

    Args:
        robot: with the hull.
        link: that has the hull; the base gets the radiation too where the robot floats.
        method: boundary elements, or the ellipsoid of equal volume and second moments.
        density: of the water [kg/m^3].
        panels: triangles of the finer surface.
        tell: called with the number of problems done, of `problems_of`.

    Raises:
        ConfigError: the link is unknown or has no hull.
        RobotError: the hull has no closed surface.
        MissingExtra: boundary elements are not installed.
    """
    refuse_unlisted(link, robot.links, f"there is no link '{link}'")
    index = robot.links.index(link)
    hull = robot.hulls[index]
    if hull is None:
        raise ConfigError(
            f"link '{link}' has no hull, so it has no added mass.\n"
            "Write it under hulls: in robot.yaml."
        )
    entry: dict[str, Any] = {"effect": "added_mass", "links": [link]}
    if method is Method.ellipsoid:
        body = _ellipsoid_of_hull(hull)
        entry |= added_mass_fields(body.added_mass(density))
        axes = " x ".join(f"{a:.4g}" for a in body.semi_axes)
        source = f"ellipsoid of semi-axes {axes} m, water of {density:g} kg/m^3"
        return Hydrodynamics({"added_mass": entry}, source, [f"{link}: {source}"])
    pair = panels_of(hull, max(60, round(panels / COARSER))), panels_of(hull, panels)
    deep, change = _limit([deep_added_mass(one, density) for one in pair], pair)
    entry |= added_mass_fields(deep)
    counts = f"{len(pair[0].faces)} and {len(pair[1].faces)} panels"
    source = f"boundary elements, limit of {counts}, water of {density:g} kg/m^3"
    words = [f"{link}: {source}; from the finer mesh to the limit {change:.1%}"]
    level = _floats(robot, density) if index == 0 else None
    if level is None:
        tell(problems_of(robot, link, density))
        return Hydrodynamics({"added_mass": entry}, source, words)
    share = hull.wetted((0.0, 0.0, 1.0), level).volume / hull.volume
    found, change = _radiation(pair, level, density, tell)
    model = fit_resonators(found)
    entry |= {"floating": _rows(found.limit), "floating_fraction": _figure(share)}
    memory = {
        "effect": "radiation_memory",
        "links": [link],
        "floating_fraction": _figure(share),
        "frequency": [_figure(x) for x in model.frequency],
        "damping": [[_figure(x) for x in row] for row in model.damping],
        "coupling": [[_figure(x) for x in row] for row in model.coupling],
    }
    band = f"{found.frequency[0]:.3g} to {found.frequency[-1]:.3g} rad/s"
    words.append(
        f"{link} afloat, {share:.1%} under water: radiation at {len(found.frequency)} frequencies "
        f"from {band}; from the finer mesh to the limit {change:.1%}"
    )
    words.append(
        f"{link} memory: {len(model.frequency)} resonators, misfit {model.misfit:.1%} of the "
        "radiation"
    )
    return Hydrodynamics({"added_mass": entry, "radiation_memory": memory}, source, words)


def problems_of(robot: RobotModel, link: str, density: float) -> int:
    """Return the number of problems that boundary elements solve for a link, for a progress bar."""
    afloat = link == robot.links[0] and _floats(robot, density) is not None
    return 2 * FREQUENCIES if afloat else 1


def _ellipsoid_of_hull(hull: Hull) -> Ellipsoid:
    """Return the ellipsoid that has the volume and the second moments of a hull.

    Args:
        hull: a primitive, a mesh, samples, or a compound of closed ones.
    """
    if isinstance(hull, HullSamples):
        apart = hull.points - hull.points.mean(axis=0)
        spread = apart.T @ apart / len(apart)
        return ellipsoid_of_moments(hull.volume, hull.points.mean(axis=0), spread)
    surface = panels_of(hull, 400)
    centre, spread = surface.moments()
    return ellipsoid_of_moments(surface.volume, centre, spread)


def refuse_stated(folder: Path, robot: RobotModel, link: str, *, replace: bool) -> None:
    """Refuse a link whose added mass or radiation is already in ``robot.yaml``.

    Args:
        folder: of the robot.
        robot: built from it.
        link: to be described.
        replace: whether effects of this link alone may be replaced.

    Raises:
        ConfigError: there is one that may not be replaced, or that other links share.
    """
    for kind in KINDS:
        name = _stated(folder, kind, link, robot.links[0])
        if name is not None and not replace:
            raise ConfigError(
                f"{folder / 'robot.yaml'}: effects.{name} states {kind} of '{link}' already.\n"
                "Add replace=true, or remove it."
            )


def write_hydrodynamics(folder: Path, robot: RobotModel, found: Hydrodynamics) -> list[str]:
    """Write effects into ``robot.yaml`` with their source, and return their names.

    They take the place of the added mass and radiation memory of the same link alone.
    """
    path = folder / "robot.yaml"
    text, names = path.read_text(encoding="utf-8"), []
    link = found.entries["added_mass"]["links"][0]
    stated = {kind: _stated(folder, kind, link, robot.links[0]) for kind in KINDS}
    for name in filter(None, stated.values()):
        text = without_entry(text, ["effects", name])
    for kind, entry in found.entries.items():
        name = stated[kind] or _free(folder, f"{link}_{kind}")
        text = _with_effect(text, name, f"{flow(entry)}  # {found.source}")
        names.append(name)
    write_text(path, text)
    return names


def _with_effect(text: str, name: str, value: str) -> str:
    """Text of a ``robot.yaml`` with one more effect."""
    import yaml

    keys = yaml.safe_load(text)
    if keys.get("effects"):
        refuse_braces(text, ["effects"])
        return with_entry(text, ["effects", name], value)
    rest = without_entry(text, ["effects"]) if "effects" in keys else text
    return f"{rest.rstrip()}\neffects:\n  {name}: {value}\n"


def _stated(folder: Path, kind: str, link: str, root: str) -> str | None:
    """Name of a link's own effect of a kind; a shared effect or a constant damping is refused."""
    for name, (effect, values) in read_robot(folder).parts["effects"].items():
        links = [root if one == "root" else one for one in values.get("links", ["root"])]
        if link not in links and "*" not in links:
            continue
        if kind == "radiation_memory" and effect == "radiation_damping":
            raise ConfigError(
                f"effects.{name} is a constant radiation damping of the same link.\n"
                "Remove it: the memory effect replaces it."
            )
        if effect == kind and links != [link]:
            raise ConfigError(
                f"effects.{name} is shared by the links {', '.join(links)}.\n"
                f"Write it once for each link, or remove '{link}' from its links."
            )
        if effect == kind:
            return name
    return None


def _free(folder: Path, name: str) -> str:
    taken = read_robot(folder).parts["effects"]
    while name in taken:
        name += "_2"
    return name


def _floats(robot: RobotModel, density: float) -> float | None:
    """Height of the water surface above the base origin [m]; None for a robot that sinks."""
    body = FloatingBody(robot)
    if robot.tree.fixed_base or body.mass <= 0.0 or body.mass > 0.995 * density * body.volume:
        return None
    return body.level_of(np.array([0.0, 0.0, 1.0]), body.mass / density)


def _limit(found: list[Floats], pair: tuple[Panels, Panels]) -> tuple[Floats, float]:
    """Limit of many panels, and its largest relative difference from the finer mesh's diagonal."""
    ratio = len(pair[1].faces) / len(pair[0].faces)
    limit = positive(extrapolated(found[0], found[1], ratio))
    fine, last = (np.diagonal(x, axis1=-2, axis2=-1) for x in (found[1], limit))
    # motions of like size only: what an axis of symmetry moves is an error of panels
    blocks = [slice(0, 3), slice(3, 6)]
    return limit, max(float(np.abs(last - fine)[b].max() / np.abs(fine)[b].max()) for b in blocks)


def _radiation(
    pair: tuple[Panels, Panels], level: float, density: float, tell: Callable[[int], object]
) -> tuple[Radiation, float]:
    """Radiation extrapolated from a coarse and a fine mesh to many panels, and its change."""
    w = wave_frequencies(pair[1], level, FREQUENCIES)
    coarse = radiation_of(pair[0], level, w, density, tell=tell)
    fine = radiation_of(pair[1], level, w, density, tell=lambda k: tell(FREQUENCIES + k))
    ratio = len(pair[1].faces) / len(pair[0].faces)
    limit, change = _limit([coarse.limit, fine.limit], pair)
    mass = extrapolated(coarse.added_mass, fine.added_mass, ratio)
    damping = extrapolated(coarse.damping, fine.damping, ratio)
    return (
        Radiation(
            w,
            0.5 * (mass + np.swapaxes(mass, 1, 2)),
            np.array([positive(one) for one in damping]),
            limit,
            fine.length,
        ),
        change,
    )


def added_mass_fields(matrix: Floats) -> dict[str, Any]:
    """Return the fields of `added_mass` for a matrix about the link origin.

    Args:
        matrix: symmetric, order [linear, angular], shape (6, 6) [kg, kg m, kg m^2].
    """
    rows = np.array(_rows(matrix))
    names = [f"{stem}_{axis}" for stem in ("mass", "inertia") for axis in "xyz"]
    out: dict[str, Any] = dict(zip(names, np.diag(rows).tolist(), strict=True))
    cross = rows - np.diag(np.diag(rows))
    if np.any(cross):
        out["coupling"] = cross.tolist()
    return out


def _rows(matrix: Floats) -> list[list[float]]:
    """A matrix with rounded numbers, without entries as small as the error of the mesh."""
    diagonal = np.diag(matrix)
    floor = np.repeat([diagonal[:3].max(), diagonal[3:].max()], 3) * _NOTHING
    scale = np.sqrt(np.maximum(diagonal, floor))
    kept = positive(np.where(np.abs(matrix) > _SMALL * np.outer(scale, scale), matrix, 0.0))
    # six figures would leave a ball beside the origin, which turns without water, below zero
    return [[float(f"{x:.9g}") + 0.0 for x in row] for row in np.where(abs(kept) > 1e-15, kept, 0)]


def _figure(value: float) -> float:
    return float(f"{value:.6g}") + 0.0
