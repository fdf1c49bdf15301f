"""A flying base that carries three joints about its y axis: Newton and Euler for each link.

State rows 7-12 hold velocity and spin (body axes) instead of momentum; after the actuators follow
joint angles, joint rates, motor angles and motor rates, three rows each.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.validation.hidden.body import HEAD, Body
from tests.validation.hidden.forces import Motion
from tests.validation.hidden.plant import Plant
from tests.validation.hidden.rotation import Array, cross, matrix, rate, to_body, to_world

JOINTS = 3
CREEP = 0.04  # rate over which dry friction turns over [rad/s]
CONTACT, CUSHION = 120.0, 0.35  # teeth in contact [N m/rad], [N m s/rad]


def about_y(v: Array) -> Array:
    """Cross product of the y axis with (3, n)."""
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
        first = HEAD + self.count
        self.joint_rows = slice(first, first + JOINTS)
        self.rate_rows = slice(first + 3, first + 6)
        self.motor_rows = slice(first + 6, first + 12)
        self.loose = plant["backlash"] > 0.0

    @property
    def commands(self) -> int:
        """Rotor speeds and joint angles."""
        return self.count + JOINTS

    @property
    def band(self) -> Array:
        """Stiction of each command."""
        return np.concatenate((self.plant["stick_band"], np.zeros((JOINTS, self.size))))

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
        return state[HEAD : HEAD + self.count + JOINTS]

    def motion(self, state: Array, t: Array) -> tuple[Motion, Array, Array | None]:
        """Motion of the base."""
        turn, v, w = matrix(state[3:7]), state[7:10], state[10:13]
        air = v - to_body(turn, self.plant["wind"])
        zero, none = np.zeros(self.size), np.zeros((3, self.size))
        found = Motion(state[0:3], turn, v, w, to_world(turn, v), air, v, zero, zero, none)
        return found, none, None

    def derivative(self, state: Array, command: Array, t: Array) -> Array:
        """Rate of the state under rotor speeds and joint angles (na + 3, n)."""
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
        mass[:, range(6, 9), range(6, 9)] += armature.T
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
        motor, spin = state[self.motor_rows][:3], state[self.motor_rows][3:]
        motor = np.where(self.loose, motor, angle)
        spin = np.where(self.loose, spin, speed)
        servo = plant["servo_stiff"] * (wanted - motor) - plant["servo_damp"] * spin
        servo = np.clip(servo, -plant["servo_limit"], plant["servo_limit"])
        gap = motor - angle
        deep = np.maximum(np.abs(gap) - 0.5 * plant["backlash"], 0.0)
        push = CONTACT * deep + CUSHION * np.sign(gap) * (spin - speed) * (deep > 0.0)
        push = np.sign(gap) * np.maximum(push, 0.0)
        first = self.motor_rows.start
        out[first : first + 3] = np.where(self.loose, spin, speed)
        out[first + 3 : first + 6] = np.where(self.loose, (servo - push) / plant["armature"], 0.0)
        rub = friction(plant, speed, plant["rub"], plant["rub_viscous"])
        extra = friction(plant, speed, plant["hidden_rub"], plant["hidden_viscous"])
        drive = np.where(self.loose, push, servo) + rub + extra
        return drive, np.where(self.loose, 0.0, plant["armature"])

    def _chain(self, state: Array, m: Motion) -> tuple[Array, Array]:
        """Mass matrix (n, 9, 9) and the forces (9, n) of velocities and weight."""
        plant, n = self.plant, self.size
        speed = state[self.rate_rows]
        where = pose(plant, state[self.joint_rows])
        fall = plant["gravity"] * m.turn[2]
        origin_accel = cross(m.spin, m.velocity) + fall
        mass, bias = np.zeros((9, 9, n)), np.zeros((9, n))
        inertia = np.zeros((3, 3, n))
        inertia[range(3), range(3)] = plant["inertia"]
        self._member(mass, bias, m, origin_accel, plant["mass"], plant["com"], inertia, where, speed, 0)
        for i in range(JOINTS + 1):
            joints = min(i + 1, JOINTS)
            heavy = plant["link_mass"][i] if i < JOINTS else plant["payload_mass"]
            own = plant["link_inertia"][:, i] if i < JOINTS else np.zeros((3, n))
            inertia = turned(own, where.angles[i])
            self._member(
                mass, bias, m, origin_accel, heavy, where.centres[i], inertia, where, speed, joints
            )
        return mass.transpose(2, 0, 1), bias

    def _member(
        self, mass: Array, bias: Array, m: Motion, origin_accel: Array, heavy: Array,
        centre: Array, inertia: Array, where: Pose, speed: Array, joints: int,
    ) -> None:
        """Add one member that hangs behind the given number of joints."""
        n, w = self.size, m.spin
        move, turn = np.zeros((3, 9, n)), np.zeros((3, 9, n))
        for a in range(3):
            move[a, a] = 1.0
            turn[a, 3 + a] = 1.0
        x, y, z = centre
        move[0, 4], move[0, 5], move[1, 3] = z, -y, -z
        move[1, 5], move[2, 3], move[2, 4] = x, y, -x
        slide = np.zeros((3, n))
        for j in range(joints):
            move[:, 6 + j] = about_y(centre - where.origins[j])
            turn[1, 6 + j] = 1.0
            slide = slide + speed[j] * move[:, 6 + j]
        twist = speed[:joints].sum(0)
        swing = np.zeros((3, n))
        for j in range(joints):
            own = np.zeros((3, n))
            for k in range(j):
                own = own + speed[k] * about_y(where.origins[j] - where.origins[k])
            swing = swing + speed[j] * about_y(slide - own)
        accel = origin_accel + cross(w, cross(w, centre)) + 2.0 * cross(w, slide) + swing
        spin = w.copy()
        spin[1] = spin[1] + twist
        turning = cross(w, np.stack((0.0 * twist, twist, 0.0 * twist)))
        momentum = (inertia * spin).sum(1)
        load = (inertia * turning).sum(1) + cross(spin, momentum)
        mass += heavy * np.einsum("iap,ibp->abp", move, move)
        mass += np.einsum("iap,ijp,jbp->abp", turn, inertia, turn, optimize=True)
        bias += (move * (heavy * accel)[:, None]).sum(0) + (turn * load[:, None]).sum(0)


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
    out: Array = total / (arm.base_mass + arm.masses.sum())
    return out
