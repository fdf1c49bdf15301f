"""Robot model: links, mass properties, joints and hulls."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from seals.arrays import Array, Floats, as_like
from seals.hydrostatics import Hull
from seals.hydrostatics.entry import ELLIPSOID, entry_shares
from seals.motion import Body
from seals.multibody.spatial import rigid_inertia
from seals.multibody.tree import Tree
from seals.robot.limbs import Arm, Gripper, Leg


@dataclass(frozen=True, kw_only=True)
class Surface:
    """Contact coefficients of all links that override the URDF; None leaves one unchanged.

    Args:
        friction: lateral friction coefficient [1].
        rolling: lever arm that resists rolling [m].
        spinning: lever arm that resists spinning about the contact normal [m].
        restitution: coefficient of restitution [1].
    """

    friction: float | None = None
    rolling: float | None = None
    spinning: float | None = None
    restitution: float | None = None


@dataclass(frozen=True, kw_only=True)
class RobotModel:
    """Mass properties, joints and hulls of a robot.

    Link 0 is the base; parents come before children.

    Args:
        name: of the robot.
        urdf: path of the URDF file.
        links: names of the links.
        joints: names of the movable joints, in the order of their coordinates.
        tree: structure.
        mass: [kg], shape (L,).
        centre: centres of mass in link axes [m], shape (L, 3).
        inertia: about the centres of mass, link axes [kg m^2], shape (L, 3, 3).
        lower: joint limits [rad or m], shape (J,).
        upper: joint limits [rad or m], shape (J,).
        hulls: one per link, None for a link that displaces no water.
        has_collision: whether a link has collision geometry, shape (L,).
        arms: by name.
        grippers: by name.
        legs: by name.
        surface: contact coefficients in place of those in the URDF, or None.
        held: whether its joints are held, see `seals.robot.fusing`.

    Example:
        >>> from seals import load_robot
        >>> ball = load_robot("ball")
        >>> ball.mass.shape, ball.joints
        ((1,), ())
    """

    name: str
    urdf: str
    links: tuple[str, ...]
    joints: tuple[str, ...]
    tree: Tree
    mass: Floats
    centre: Floats
    inertia: Floats
    lower: Floats
    upper: Floats
    hulls: tuple[Hull | None, ...]
    has_collision: tuple[bool, ...]
    arms: Mapping[str, Arm] = field(default_factory=dict)
    grippers: Mapping[str, Gripper] = field(default_factory=dict)
    legs: Mapping[str, Leg] = field(default_factory=dict)
    surface: Surface | None = None
    held: bool = False

    @cached_property
    def spatial_inertia(self) -> Floats:
        """Inertia matrices about the link origins, order [linear, angular], shape (L, 6, 6)."""
        rows = zip(self.mass, self.centre, self.inertia, strict=True)
        return np.array([rigid_inertia(float(m), c, i) for m, c, i in rows])

    @property
    def degrees(self) -> int:
        """Number of generalised velocities."""
        return self.tree.joints + (0 if self.tree.fixed_base else 6)

    @cached_property
    def _sizes(self) -> tuple[Floats, Floats, Floats]:
        """Volumes [m^3], plan areas [m^2] and entry shares of the hulls, from many cuts each.

        Shapes (L, 1), (L, 1) and (L, 6).
        """
        volumes = [0.0 if h is None else h.volume for h in self.hulls]
        plans = [0.0 if h is None else h.plan_area for h in self.hulls]
        entries = [ELLIPSOID if h is None else entry_shares(h) for h in self.hulls]
        return np.array(volumes)[:, None], np.array(plans)[:, None], np.array(entries)

    def bodies(self, like: Array, batch: int = 1) -> Body:
        """Return the constant properties of all links, in the library of ``like``.

        Rows are link by link: all bodies of the batch for the first link, then for the next.
        """
        table = (self.mass[:, None], self.centre, *self._sizes)
        if len(self.links) == 1:
            return Body(*(as_like(x, like) for x in table))
        return Body(*(as_like(np.repeat(x, batch, axis=0), like) for x in table))
