"""Arms that branch: joints about any axis on a flying base, and their equations of motion."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.validation.hidden.arm import ArmBody
from tests.validation.hidden.forces import Motion
from tests.validation.hidden.plant import Deviations, Plant
from tests.validation.hidden.rotation import Array, cross

Chain = list[tuple[Array, Array, Array]]  # turn, place and axis of each link, base axes


@dataclass
class Tree:
    """Nominal links and joints; arrays run over the joints along the last axis.

    Attributes:
        names: Names of the links; `joint_names` those of the joints above them.
        parents: Index of the link above each joint, -1 for the base.
        origin: Place of each joint in its parent's frame, (3, m).
        axis: Axis of each joint, (3, m).
        mass: Masses (m,); `com` (3, m) in the link's frame, `inertia` (3, m) about it.
        tool: Link that carries a payload, and `tip` the place of it there.
        first_jaw: Number of joints that belong to arms; the others are jaws.
    """

    names: list[str]
    joint_names: list[str]
    parents: list[int]
    origin: Array
    axis: Array
    mass: Array
    com: Array
    inertia: Array
    stiff: Array
    damp: Array
    limit: Array
    armature: Array
    lower: Array
    upper: Array
    box: Array
    base_mass: float
    base_centre: Array
    base_inertia: Array
    tool: int
    tip: Array
    joints: int
    blocks: dict[str, Any] = field(default_factory=dict)

    def chain(self, angle: Array) -> Chain:
        """Forward kinematics of joint angles (m, n)."""
        n = angle.shape[1]
        origin, axis = (np.repeat(v[..., None], n, axis=-1) for v in (self.origin, self.axis))
        return chain(self.parents, origin, axis, angle)

    def centre(self, angle: Array) -> Array:
        """Nominal centre of gravity of the vehicle (3, n) at joint angles (m, n)."""
        total = self.base_mass * self.base_centre[:, None]
        for i, (turn, place, _) in enumerate(self.chain(angle)):
            total = total + self.mass[i] * (place + np.einsum("ijn,j->in", turn, self.com[:, i]))
        return total / (self.base_mass + self.mass.sum())

    def whole_inertia(self, angle: Array) -> Array:
        """Nominal inertia (3, 3) of the vehicle about its centre of gravity; angles (m,)."""
        centre = self.centre(angle[:, None])[:, 0]
        out = np.diag(self.base_inertia) + self.base_mass * _steiner(self.base_centre - centre)
        for i, (turn, place, _) in enumerate(self.chain(angle[:, None])):
            r = turn[..., 0]
            own = r @ np.diag(self.inertia[:, i]) @ r.T
            out = out + own + self.mass[i] * _steiner(place[:, 0] + r @ self.com[:, i] - centre)
        return out

    def truth(self, plant: Plant, off: Deviations, rng: np.random.Generator) -> None:
        """True parameters of base and links about the nominal ones."""
        share, m = 1.0 + off("link_mass", len(self.names)), len(self.names)
        plant["mass"] = self.base_mass * (1.0 + off("mass"))
        plant["com"] = self.base_centre + off("centre_of_gravity", 3)
        plant["inertia"] = self.base_inertia * (1.0 + off("inertia", 3))
        plant["link_mass"], plant["link_com"] = self.mass * share, self.com
        plant["link_inertia"] = self.inertia * share
        plant["joint_origin"], plant["joint_axis"] = self.origin, self.axis
        plant["servo_stiff"] = self.stiff * (1.0 + off("joint_kp"))
        plant["servo_damp"] = self.damp * (1.0 + off("joint_kd"))
        jaw = np.arange(m) >= self.joints
        plant["rub"] = np.abs(off("joint_friction", m)) * np.where(jaw, 0.1, 1.0)
        plant["rub_viscous"] = 0.3 * plant["rub"]
        plant["hidden_rub"] = plant["hidden_viscous"] = plant["backlash"] = np.zeros(m)
        plant["stribeck"] = np.array(rng.uniform(0.0, 0.15))
        plant["servo_limit"], plant["armature"] = self.limit, self.armature
        plant["joint_start"] = np.zeros(m)
        plant["payload_link"] = np.array(-1.0)


def _steiner(r: Array) -> Array:
    return float(r @ r) * np.eye(3) - np.outer(r, r)


def chain(parents: list[int], origin: Array, axis: Array, angle: Array) -> Chain:
    """Turn (3, 3, n), place (3, n) and axis (3, n) of each link in base axes."""
    n = angle.shape[1]
    base = (np.repeat(np.eye(3)[..., None], n, axis=-1), np.zeros((3, n)), np.zeros((3, n)))
    sine, cosine = np.sin(angle), np.cos(angle)
    x, y, z = axis
    none = np.zeros_like(x)
    skew = np.stack((np.stack((none, -z, y)), np.stack((z, none, -x)), np.stack((-y, x, none))))
    eye = np.eye(3)[:, :, None, None]
    own = eye + sine * skew + (1.0 - cosine) * (axis[:, None] * axis[None] - eye)
    out: Chain = []
    for i, parent in enumerate(parents):
        turn, place, _ = out[parent] if parent >= 0 else base
        here = place + (turn * origin[:, i]).sum(1)
        out.append((_times(turn, own[:, :, i]), here, (turn * axis[:, i]).sum(1)))
    return out


def _times(a: Array, b: Array) -> Array:
    """Products of matrices (3, 3, ...)."""
    return (a[:, :, None] * b[None]).sum(1)


class TreeBody(ArmBody):
    """Equations of motion of a flying base with a tree of links."""

    def __init__(self, plant: Plant, parents: list[int], *, ground: float | None) -> None:
        super().__init__(plant, rotor=True, ground=ground, water=False)
        self.parents, m = parents, len(parents)
        self._behind = np.zeros((m, m + 1, 1))
        for i in range(m):
            above = i
            while above >= 0:
                self._behind[above, i + 1] = 1.0
                above = parents[above]
        self._heavy, self._centre, self._own = _members(plant, m)

    def _chain(self, state: Array, m: Motion) -> tuple[Array, Array]:
        """Mass matrix (n, 6 + m, 6 + m) and the forces (6 + m, n) of velocities and weight."""
        plant, n, speed = self.plant, self.size, state[self.rate_rows]
        links = chain(
            self.parents, plant["joint_origin"], plant["joint_axis"], state[self.joint_rows]
        )
        turn = np.stack([np.repeat(np.eye(3)[..., None], n, axis=-1), *(k[0] for k in links)], 2)
        place = np.stack([np.zeros((3, n)), *(k[1] for k in links)], axis=1)
        axis = np.stack([k[2] for k in links], axis=1)
        spin, twist, accel = self._coast(m, place, axis, speed)
        arm = (turn * self._centre).sum(1)
        own = _times(_times(turn, self._own), turn.swapaxes(0, 1))
        centre, heavy = place + arm, self._heavy
        slope = cross(axis[:, :, None], centre[:, None] - place[:, 1:, None]) * self._behind
        push = heavy * (accel + cross(twist, arm) + cross(spin, cross(spin, arm)))
        load = (own * twist).sum(1) + cross(spin, (own * spin).sum(1))
        about = axis[:, :, None] * self._behind
        bias = np.concatenate(
            (
                push.sum(1),
                (cross(centre, push) + load).sum(1),
                (slope * push[:, None]).sum((0, 2)) + (about * load[:, None]).sum((0, 2)),
            )
        )
        return _mass_matrix(heavy, centre, own, slope, about), bias

    def _coast(
        self, m: Motion, place: Array, axis: Array, speed: Array
    ) -> tuple[Array, Array, Array]:
        """Spin, twist and acceleration (3, 1 + m, n) of each frame when no rate changes."""
        spin, twist = [m.spin], [np.zeros_like(m.spin)]
        accel = [cross(m.spin, m.velocity) + self.plant["gravity"] * m.turn[2]]
        for i, parent in enumerate(self.parents):
            p = parent + 1
            r = place[:, i + 1] - place[:, p]
            accel.append(accel[p] + cross(twist[p], r) + cross(spin[p], cross(spin[p], r)))
            rate = axis[:, i] * speed[i]
            twist.append(twist[p] + cross(spin[p], rate))
            spin.append(spin[p] + rate)
        return np.stack(spin, axis=1), np.stack(twist, axis=1), np.stack(accel, axis=1)


def _members(plant: Plant, m: int) -> tuple[Array, Array, Array]:
    """Masses (1 + m, n), centres (3, 1 + m, n) and inertias (3, 3, 1 + m, n), payload included."""
    mass = np.concatenate((plant["mass"][None], plant["link_mass"]))
    com = np.concatenate((plant["com"][:, None], plant["link_com"]), axis=1)
    own = np.zeros((3, 3, *mass.shape))
    own[range(3), range(3)] = np.concatenate(
        (plant["inertia"][:, None], plant["link_inertia"]), axis=1
    )
    for value, (i, j) in zip(plant["products"], ((0, 1), (0, 2), (1, 2)), strict=True):
        own[i, j, 0] = own[j, i, 0] = value
    load = plant["payload_mass"] * (plant["payload_link"] == np.arange(-1, m)[:, None])
    away = plant["payload_place"][:, None] - com
    both = mass + load
    # two bodies as one: the reduced mass at their distance
    far = (away**2).sum(0) * np.eye(3)[:, :, None, None] - away[:, None] * away[None]
    return both, com + load / both * away, own + mass * load / both * far


def _mass_matrix(heavy: Array, centre: Array, own: Array, slope: Array, about: Array) -> Array:
    """Mass matrix (n, 6 + m, 6 + m) of velocity, spin and joint rates."""
    m, n = slope.shape[1], heavy.shape[1]
    out = np.zeros((6 + m, 6 + m, n))
    x, y, z = (heavy * centre).sum(1)
    for a in range(3):
        out[a, a] = heavy.sum(0)
    out[0, 4], out[0, 5], out[1, 5] = z, -y, x
    out[1, 3], out[2, 3], out[2, 4] = -z, y, -x
    out[3:6, :3] = out[:3, 3:6].transpose(1, 0, 2)
    far = own - heavy * centre[:, None] * centre[None]
    far[range(3), range(3)] += heavy * (centre**2).sum(0)
    out[3:6, 3:6] = far.sum(2)
    out[:3, 6:] = (heavy * slope).sum(2)
    spun = (own[:, :, None] * about[None]).sum(1)
    out[3:6, 6:] = (heavy * cross(centre[:, None], slope) + spun).sum(2)
    out[6:, :6] = out[:6, 6:].transpose(1, 0, 2)
    weighed = heavy * slope
    for i in range(m):
        out[6 + i, 6:] = (slope[:, i, None] * weighed + about[:, i, None] * spun).sum((0, 2))
    return out.transpose(2, 0, 1)
