"""A flying base that carries three joints about its y axis: Newton and Euler for each link.

State rows 7-12 hold velocity and spin (body axes) instead of momentum; after the actuators follow
joint angles, joint rates, motor angles and motor rates, a row for each joint.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.validation.hidden import outsiders
from tests.validation.hidden.body import HEAD, Body
from tests.validation.hidden.forces import Motion
from tests.validation.hidden.plant import Plant
from tests.validation.hidden.rotation import Array, cross, matrix, rate, to_body, to_world

JOINTS = 3
# whether a joint (row) carries a member (column: base, three links, payload)
BEHIND = np.array([[0, 1, 1, 1, 1], [0, 0, 1, 1, 1], [0, 0, 0, 1, 1]], dtype=float)[:, :, None]
CREEP = 0.04  # rate over which dry friction turns over [rad/s]
CONTACT, CUSHION = 120.0, 0.35  # teeth in contact [N m/rad], [N m s/rad]


def about_y(v: Array) -> Array:
    """Cross product of the y axis with (3, ...)."""
    return np.stack((v[2], np.zeros_like(v[0]), -v[0]))


@dataclass
class Pose:
    """Where the links are, in base axes: origins of the joints, centres of mass, total angles."""

    origins: list[Array]
    centres: list[Array]
    angles: list[Array]


def pose(plant: Plant, angle: Array) -> Pose:
    """Forward kinematics of joint angles (3, n); the last centre is that of a payload."""
    origin = plant["joint_origin"][:, 0]
    total = np.zeros_like(angle[0])
    origins, centres, angles = [], [], []
    for i in range(JOINTS):
        if i:
            origin = origin + _hang(total, plant["link_length"][i - 1])
        total = total + angle[i]
        origins.append(origin)
        centres.append(origin + _hang(total, plant["link_centre"][i]))
        angles.append(total)
    x, y, z = plant["payload_place"]
    c, s = np.cos(total), np.sin(total)
    centres.append(origin + np.stack((c * x + s * z, y, c * z - s * x)))
    angles.append(total)
    return Pose(origins, centres, angles)


def _hang(angle: Array, length: Array) -> Array:
    """A length along the -z axis of a link turned about y."""
    return np.stack((-np.sin(angle) * length, np.zeros_like(angle), -np.cos(angle) * length))


def turned(inertia: Array, angle: Array) -> Array:
    """Inertia (3, 3, n) in base axes of a link with diagonal (3, n) turned about y."""
    c, s = np.cos(angle), np.sin(angle)
    out = np.zeros((3, 3, *angle.shape))
    out[0, 0] = c * c * inertia[0] + s * s * inertia[2]
    out[2, 2] = s * s * inertia[0] + c * c * inertia[2]
    out[0, 2] = out[2, 0] = c * s * (inertia[2] - inertia[0])
    out[1, 1] = inertia[1]
    return out


class ArmBody(Body):
    """Equations of motion of a base with an arm."""

    def __init__(self, plant: Plant, *, rotor: bool, ground: float | None, water: bool) -> None:
        super().__init__(plant, rotor=rotor, ground=ground, water=water)
        # gravity acts on every member of the chain, not on one body
        self._weight, self._moment = np.zeros(self.size), np.zeros((3, self.size))
        first, self.joints = HEAD + self.count, int(plant["joint_start"].shape[0])
        self.joint_rows = slice(first, first + self.joints)
        self.rate_rows = slice(first + self.joints, first + 2 * self.joints)
        self.motor_rows = slice(first + 2 * self.joints, first + 4 * self.joints)
        self.loose = plant["backlash"] > 0.0

    @property
    def commands(self) -> int:
        """Rotor speeds and joint angles."""
        return self.count + self.joints

    @property
    def band(self) -> Array:
        """Stiction of each command."""
        return np.concatenate((self.plant["stick_band"], np.zeros((self.joints, self.size))))

    def still(self, place: Array, q: Array, velocity: Array, spin: Array, act: Array) -> Array:
        """State of given motion with the joints where the plant says they begin."""
        head = super().still(place, q, velocity, spin, act)
        start = self.plant["joint_start"]
        none = np.zeros_like(start)
        return np.concatenate((head, start, none, start, none))

    def with_motion(self, state: Array, velocity: Array, spin: Array, t: Array) -> Array:
        """The state with another body velocity and spin."""
        state = state.copy()
        state[7:10], state[10:13] = velocity, spin
        return state

    def hold(self, state: Array) -> Array:
        """Commands that keep actuators and joints where they are."""
        return state[HEAD : HEAD + self.count + self.joints]

    def motion(self, state: Array, t: Array) -> tuple[Motion, Array, Array | None]:
        """Motion of the base."""
        turn, v, w = matrix(state[3:7]), state[7:10], state[10:13]
        air = v - to_body(turn, self.plant["wind"])
        wet, centroid, _ = self._wet(state[0:3], turn, t)
        zero, none = np.zeros(self.size), np.zeros((3, self.size))
        found = Motion(state[0:3], turn, v, w, to_world(turn, v), air, v, wet, zero, centroid)
        return found, none, None

    def _strange(
        self, state: Array, m: Motion, t: Array, out: Array, force: Array, torque: Array
    ) -> tuple[Array, Array]:
        if self.plant["paddle"].any():
            force = force + outsiders.paddle(self.plant, m, state[self.rate_rows].sum(0))
        return super()._strange(state, m, t, out, force, torque)

    def derivative(self, state: Array, command: Array, t: Array) -> Array:
        """Rate of the state under rotor speeds and joint angles (na + joints, n)."""
        plant, count = self.plant, self.count
        m = self.motion(state, t)[0]
        self.seen = m
        out = np.zeros_like(state)
        out[0:3], out[3:7] = m.world_velocity, rate(state[3:7], m.spin)
        force, torque = self._loads(state, m, t, out)
        act = state[HEAD : HEAD + count]
        lag = np.where(command[:count] > act, plant["lag_up"], plant["lag_down"])
        out[HEAD : HEAD + count] = (command[:count] - act) / lag
        drive, armature = self._drive(state, command[count:], out)
        mass, bias = self._chain(state, m)
        own = range(6, 6 + self.joints)
        mass[:, own, own] += armature.T
        right = np.concatenate((force, torque, drive)) - bias
        accel = np.linalg.solve(mass, right.T[..., None])[..., 0].T
        out[7:13] = accel[:6]
        out[self.joint_rows] = state[self.rate_rows]
        out[self.rate_rows] = accel[6:]
        return out

    def _drive(self, state: Array, wanted: Array, out: Array) -> tuple[Array, Array]:
        """Torque on each joint and the motor inertia that turns with it."""
        plant = self.plant
        angle, speed = state[self.joint_rows], state[self.rate_rows]
        motor, spin = np.split(state[self.motor_rows], 2)
        motor = np.where(self.loose, motor, angle)
        spin = np.where(self.loose, spin, speed)
        servo = plant["servo_stiff"] * (wanted - motor) - plant["servo_damp"] * spin
        servo = np.clip(servo, -plant["servo_limit"], plant["servo_limit"])
        gap = motor - angle
        deep = np.maximum(np.abs(gap) - 0.5 * plant["backlash"], 0.0)
        push = CONTACT * deep + CUSHION * np.sign(gap) * (spin - speed) * (deep > 0.0)
        push = np.sign(gap) * np.maximum(push, 0.0)
        first = self.motor_rows.start
        out[first : first + self.joints] = np.where(self.loose, spin, speed)
        out[first + self.joints : self.motor_rows.stop] = np.where(
            self.loose, (servo - push) / plant["armature"], 0.0
        )
        rub = friction(plant, speed, plant["rub"], plant["rub_viscous"])
        extra = friction(plant, speed, plant["hidden_rub"], plant["hidden_viscous"])
        drive = np.where(self.loose, push, servo) + rub + extra
        return drive, np.where(self.loose, 0.0, plant["armature"])

    def _chain(self, state: Array, m: Motion) -> tuple[Array, Array]:
        """Mass matrix (n, 9, 9) and the forces (9, n) of velocities and weight."""
        heavy, centre, inertia, origin = self._members(state)
        slope = about_y(centre[:, None] - origin[:, :, None]) * BEHIND
        fall = self.plant["gravity"] * m.turn[2]
        accel, load = _coasting(m, fall, state[self.rate_rows], centre, inertia, origin, slope)
        force = heavy * accel
        bias = np.zeros((9, self.size))
        bias[:3] = force.sum(1)
        bias[3:6] = (cross(centre, force) + load).sum(1)
        bias[6:] = (slope * force[:, None]).sum((0, 2)) + (BEHIND * load[1]).sum(1)
        return _mass_matrix(heavy, centre, inertia, slope), bias

    def _members(self, state: Array) -> tuple[Array, Array, Array, Array]:
        """Masses (5, n), centres (3, 5, n), inertias (3, 3, 5, n) and joint origins (3, 3, n)."""
        plant = self.plant
        where = pose(plant, state[self.joint_rows])
        heavy = np.stack((plant["mass"], *plant["link_mass"], plant["payload_mass"]))
        centre = np.stack((plant["com"], *where.centres), axis=1)
        inertia = np.zeros((3, 3, 5, self.size))
        inertia[range(3), range(3), 0] = plant["inertia"]
        inertia[:, :, 1:4] = turned(plant["link_inertia"], np.stack(where.angles[:JOINTS]))
        return heavy, centre, inertia, np.stack(where.origins, axis=1)


def _coasting(
    m: Motion,
    fall: Array,
    speed: Array,
    centre: Array,
    inertia: Array,
    origin: Array,
    slope: Array,
) -> tuple[Array, Array]:
    """Acceleration of each centre and torque on each member when no rate changes, (3, 5, n)."""
    w = m.spin[:, None]
    slide = (speed[:, None] * slope).sum(1)
    carried = np.zeros_like(origin)
    for j in range(1, JOINTS):
        for k in range(j):
            carried[:, j] += speed[k] * about_y(origin[:, j] - origin[:, k])
    swing = about_y(((slide[:, None] - carried[:, :, None]) * BEHIND * speed[:, None]).sum(1))
    accel = (cross(m.spin, m.velocity) + fall)[:, None] + cross(w, cross(w, centre))
    accel = accel + 2.0 * cross(w, slide) + swing
    twist = (BEHIND * speed[:, None]).sum(0)
    spin = np.stack(np.broadcast_arrays(w[0], w[1] + twist, w[2]))
    turning = np.stack((-w[2] * twist, np.zeros_like(twist), w[0] * twist))
    load = (inertia * turning).sum(1) + cross(spin, (inertia * spin).sum(1))
    return accel, load


def _mass_matrix(heavy: Array, centre: Array, inertia: Array, slope: Array) -> Array:
    """Mass matrix (n, 9, 9) of velocity, spin and joint rates."""
    n = heavy.shape[1]
    out = np.zeros((9, 9, n))
    x, y, z = (heavy * centre).sum(1)
    for a in range(3):
        out[a, a] = heavy.sum(0)
    out[0, 4], out[0, 5], out[1, 5] = z, -y, x
    out[1, 3], out[2, 3], out[2, 4] = -z, y, -x
    out[3:6, :3] = out[:3, 3:6].transpose(1, 0, 2)
    square = (centre**2).sum(0)
    about = inertia - heavy * centre[:, None] * centre[None]
    about[range(3), range(3)] += heavy * square
    out[3:6, 3:6] = about.sum(2)
    out[:3, 6:] = (heavy * slope).sum(2)
    moment = heavy * cross(centre[:, None], slope) + BEHIND * inertia[:, 1, None]
    out[3:6, 6:] = moment.sum(2)
    out[6:, :6] = out[:6, 6:].transpose(1, 0, 2)
    for i in range(JOINTS):
        for j in range(JOINTS):
            both = BEHIND[i] * BEHIND[j]
            out[6 + i, 6 + j] = (heavy * (slope[:, i] * slope[:, j]).sum(0)).sum(0)
            out[6 + i, 6 + j] += (both * inertia[1, 1]).sum(0)
    return out.transpose(2, 0, 1)


def friction(plant: Plant, speed: Array, dry: Array, viscous: Array) -> Array:
    """Torque of dry friction with a slight rise towards rest, and of grease."""
    rise = 1.0 + plant["stribeck"] * np.exp(-((speed / 0.15) ** 2))
    return -dry * rise * np.tanh(speed / CREEP) - viscous * speed


def centre_of_all(arm: Any, angle: Array) -> Array:
    """Nominal centre of gravity of the vehicle (3, n) at joint angles (3, n)."""
    where = pose(arm.as_plant(angle.shape[1]), angle)
    total = arm.base_mass * arm.base_centre[:, None]
    for i in range(JOINTS):
        total = total + arm.masses[i] * where.centres[i]
    return total / (arm.base_mass + arm.masses.sum())
