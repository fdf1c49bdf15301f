"""Rigid body in air and water, integrated in its momentum by the midpoint rule.

State rows: place 0-2, quaternion 3-6, momentum (linear, angular about the origin, body axes, fluid
included) 7-12, spent charge 13, shedding phase 14, slung load 15-20, entry impulse 21 (true) and
22 (textbook), actuators 23 onwards.
"""

from __future__ import annotations

import numpy as np

from tests.validation.hidden import forces, outsiders, surroundings
from tests.validation.hidden.forces import Motion
from tests.validation.hidden.hull import filling_rate, submerged
from tests.validation.hidden.plant import Plant
from tests.validation.hidden.rotation import Array, cross, matrix, rate, to_body, to_world

HEAD = 23
CHARGE, PHASE, IMPULSE = 13, 14, slice(21, 23)


def rigid_mass(plant: Plant) -> Array:
    """Mass matrices (n, 6, 6) about the origin, payload included."""
    n = plant["mass"].shape[0]
    out = np.zeros((n, 6, 6))
    inertia = np.zeros((n, 3, 3))
    inertia[:, range(3), range(3)] = plant["inertia"].T
    for value, (i, j) in zip(plant["products"], ((0, 1), (0, 2), (1, 2)), strict=True):
        inertia[:, i, j] = inertia[:, j, i] = value
    bodies = [(plant["mass"], plant["com"], inertia)]
    bodies.append((plant["payload_mass"], plant["payload_place"], np.zeros((n, 3, 3))))
    for mass, centre, own in bodies:
        skew = np.zeros((n, 3, 3))
        x, y, z = centre
        skew[:, 0, 1], skew[:, 0, 2], skew[:, 1, 2] = -z, y, -x
        skew[:, 1, 0], skew[:, 2, 0], skew[:, 2, 1] = z, -y, x
        heavy = mass[:, None, None]
        out[:, :3, :3] += heavy * np.eye(3)
        out[:, :3, 3:] -= heavy * skew
        out[:, 3:, :3] += heavy * skew
        out[:, 3:, 3:] += own - heavy * skew @ skew
    return out


class Body:
    """Equations of motion of a batch of cases of one kind of vehicle."""

    def __init__(self, plant: Plant, *, rotor: bool, ground: float | None, water: bool) -> None:
        self.plant, self.rotor, self.ground, self.water = plant, rotor, ground, water
        self.size = plant["mass"].shape[0]
        self.count = int(plant["act_place"].shape[1])
        self._rigid = rigid_mass(plant)
        self._added = plant["added"]
        self._dry = np.ascontiguousarray(np.linalg.inv(self._rigid).transpose(1, 2, 0))
        self._whole = np.ascontiguousarray(
            np.linalg.inv(self._mass_with(np.ones(self.size))).transpose(1, 2, 0)
        )
        self._weight = plant["mass"] + plant["payload_mass"]
        self._moment = plant["mass"] * plant["com"] + plant["payload_mass"] * plant["payload_place"]
        place, axis = plant["act_place"], plant["act_axis"]
        self._mixing = np.concatenate((axis, cross(place, axis)))
        self._on = {key: bool(np.any(value)) for key, value in plant.items()}
        self._wavy = bool(plant["wave"][0].any())
        self._reach = (
            float(np.sqrt((plant["cell_place"] ** 2).sum(0)).max()) + 0.1 if water else 0.0
        )
        self._swell = 0.02 + float(plant["wave"][0].max()) * 1.2
        self._zero, self._one = np.zeros(self.size), np.ones(self.size)
        self.gust = np.zeros((6, self.size))
        self.seen: Motion | None = None

    def _mass_with(self, wet: Array) -> Array:
        out: Array = self._rigid.copy()
        out[:, range(6), range(6)] += (wet * self._added).T
        return out

    def still(self, place: Array, q: Array, velocity: Array, spin: Array, act: Array) -> Array:
        """State (k, n) of given motion; place, velocity (world) and spin (body) are (3, n)."""
        state = np.zeros((HEAD + self.count, self.size))
        q = q / np.sqrt((q**2).sum(0))
        state[0:3], state[3:7] = place, q
        state[15:18], state[18:21] = place, velocity
        state[17] -= self.plant["sling_length"]
        state[HEAD:] = act
        return self.with_motion(state, to_body(matrix(q), velocity), spin, self._zero)

    def with_motion(self, state: Array, velocity: Array, spin: Array, t: Array) -> Array:
        """The state with the momentum that belongs to a body velocity and spin (3, n)."""
        state = state.copy()
        place, turn = state[0:3], matrix(state[3:7])
        wet = self._wet(place, turn, t)[0]
        stream = self._stream(place, turn, t)[0]
        mass = self._mass_with(wet)
        state[7:13] = np.einsum("nij,jn->in", mass, np.concatenate((velocity, spin)))
        state[7:10] -= wet * self._added[:3] * stream
        return state

    def _wet(self, place: Array, turn: Array, t: Array) -> tuple[Array, Array, Array | None]:
        if not self.water:
            return self._zero, np.zeros((3, self.size)), None
        shift = self.plant["cob_shift"]
        height = place[2]
        if height.max() < -self._reach:
            return self._one, self.plant["centroid_whole"], None
        if height.min() > self._reach:
            return self._zero, shift, None
        cell = self.plant["cell_place"]
        up = (turn[2][:, None] * cell).sum(0) + height
        # the surface is worth its cosines only where it may cut a hull
        near = np.flatnonzero((up.min(0) < self._swell) & (up.max(0) > -self._swell))
        surface = np.zeros_like(up)
        if near.size and (self._wavy or self._on["ripple"]):
            some = cell[:, :, near]
            x = place[0, near] + (turn[0][:, None, near] * some).sum(0)
            y = place[1, near] + (turn[1][:, None, near] * some).sum(0)
            water = {key: self.plant[key][..., near] for key in ("wave", "ripple", "gravity")}
            surface[:, near] = surroundings.elevation(water, x, y, t[near])
        wet, centroid, layer = submerged(
            cell, self.plant["cell_share"], up, surface=surface, thick=self.plant["cell_thick"]
        )
        return wet, centroid + shift, layer

    def _stream(self, place: Array, turn: Array, t: Array) -> tuple[Array, Array | None]:
        """Water velocity in body axes and, with waves, the acceleration in body axes."""
        if not self._wavy:
            if not self._on["current"]:
                return np.zeros((3, self.size)), None
            return to_body(turn, self.plant["current"]), None
        u, a = surroundings.orbital(self.plant, place, t)
        return to_body(turn, u + self.plant["current"]), to_body(turn, a)

    def motion(self, state: Array, t: Array) -> tuple[Motion, Array, Array | None]:
        """Motion, water velocity (body axes) and water acceleration (body axes) of a state."""
        place, turn = state[0:3], matrix(state[3:7])
        wet, centroid, layer = self._wet(place, turn, t)
        stream, surge = self._stream(place, turn, t)
        momentum = state[7:13].copy()
        momentum[:3] += wet * self._added[:3] * stream
        if layer is None:
            inverse = self._whole if wet is self._one else self._dry
            nu = (inverse * momentum).sum(1)
        else:
            nu = np.linalg.solve(self._mass_with(wet), momentum.T[..., None])[..., 0].T
        v, w = nu[:3], nu[3:]
        filling = self._zero
        if layer is not None:
            filling = filling_rate(self.plant["cell_place"], layer, turn, v, w)
        through_air = v - to_body(turn, self.plant["wind"]) if self._on["wind"] else v
        found = Motion(
            place, turn, v, w, to_world(turn, v), through_air, v - stream, wet, filling, centroid
        )
        return found, stream, surge

    def derivative(self, state: Array, command: Array, t: Array) -> Array:
        """Rate of the state under actuator commands (na, n)."""
        plant = self.plant
        m, stream, surge = self.motion(state, t)
        self.seen = m
        out = np.zeros_like(state)
        out[0:3] = m.world_velocity
        out[3:7] = rate(state[3:7], m.spin)
        force, torque = self._loads(state, m, t, out)
        added = m.wet * self._added
        fluid = added[:3] * m.through_water
        if surge is not None:
            force = force + m.wet * plant["density"] * plant["volume"] * surge
        if self.water:
            emptying = np.minimum(m.filling, 0.0) * self._added
            force = force + emptying[:3] * m.through_water
            torque = torque + emptying[3:] * m.spin + cross(stream, fluid)
        out[7:10] = force - cross(m.spin, state[7:10])
        out[10:13] = torque - cross(m.spin, state[10:13]) - cross(m.velocity, state[7:10])
        if self.count:
            lag = np.where(
                command > state[HEAD : HEAD + self.count], plant["lag_up"], plant["lag_down"]
            )
            out[HEAD : HEAD + self.count] = (command - state[HEAD : HEAD + self.count]) / lag
        return out

    def voltage(self, state: Array) -> Array:
        """Terminal voltage under load."""
        plant = self.plant
        return plant["full_voltage"] - state[CHARGE] - plant["resistance"] * self._load(state)

    def _load(self, state: Array) -> Array:
        act = state[HEAD : HEAD + self.count]
        if not self.count:
            return self._zero
        if not self.rotor:
            return np.minimum((np.abs(act) / 3.0).mean(0), 4.0)
        # current as the power of the thrust: three halves
        thrust = self.plant["act_gain"] * act * np.abs(act) / self.plant["hover_thrust"]
        return (np.abs(thrust) ** 1.5).mean(0)

    def thrusts(self, state: Array, m: Motion) -> tuple[Array, Array]:
        """Thrust and reaction torque of each actuator, (na, n) each."""
        plant = self.plant
        act = state[HEAD : HEAD + self.count]
        size = act * np.abs(act) if self.rotor else act
        common = plant["act_common"]
        if self._on["sag"]:
            common = common * forces.sag_factor(plant, self.voltage(state))
        factor = np.broadcast_to(common, act.shape)
        if self.rotor and self.water:
            factor = factor * forces.water_factor(plant, m, 0.0)
        thrust = plant["act_gain"] * plant["act_weak"] * size * factor
        if self.ground is not None and self._on["ground_gain"]:
            thrust = thrust * forces.ground_factor(plant, m, self.ground)
        return thrust, plant["act_torque"] * size * factor

    def _loads(self, state: Array, m: Motion, t: Array, out: Array) -> tuple[Array, Array]:
        """All forces and torques about the origin; also the rates of the charge and outsiders."""
        plant, on = self.plant, self._on
        down = -plant["gravity"] * m.turn[2]
        force, torque = self._weight * down, cross(self._moment, down)
        force = force + to_body(m.turn, self.gust[:3])
        torque = torque + self.gust[3:] + forces.angular(plant, m)
        if self.count:
            thrust, reaction = self.thrusts(state, m)
            wrench = (self._mixing * thrust).sum(1)
            force, torque = force + wrench[:3], torque + wrench[3:]
            if self.rotor:
                torque = torque - (plant["act_axis"] * reaction).sum(1)
            if on["rotor_drag"]:
                extra = forces.rotor_drag(plant, m, thrust)
                force, torque = force + extra[0], torque + extra[1]
            out[CHARGE] = plant["discharge"] * self._load(state)
        if on["air_linear"] or on["air_quadratic"]:
            force = force + forces.baseline_air(plant, m)
        if on["hidden_linear"] or on["hidden_quadratic"]:
            extra = forces.spread_drag(plant, m)
            force, torque = force + extra[0], torque + extra[1]
        if on["tether_gain"]:
            force = force + forces.tether(plant, m)
        if self.water:
            extra = forces.lift(plant, m)
            force, torque = force + extra[0] + forces.baseline_water(plant, m), torque + extra[1]
            if on["slam"]:
                pushes = forces.slamming(plant, m)
                out[IMPULSE] = pushes
                force = force + m.turn[2] * pushes[0]
        return self._strange(state, m, t, out, force, torque)

    def _strange(
        self, state: Array, m: Motion, t: Array, out: Array, force: Array, torque: Array
    ) -> tuple[Array, Array]:
        plant, on = self.plant, self._on
        for key, law in (
            ("magnet_gain", outsiders.magnet),
            ("field", outsiders.region),
            ("cubic", outsiders.cubic),
            ("sway_by_yaw", outsiders.sway_by_yaw),
        ):
            if on[key]:
                force = force + law(plant, m)
        if on["wheel"]:
            torque = torque + outsiders.wheel(plant, m)
        if on["hum"]:
            torque = torque + outsiders.hum(plant, t)
        if on["vortex_gain"]:
            force = force + outsiders.vortices(plant, m, state[PHASE])
            out[PHASE] = outsiders.shedding_rate(plant, m)
        if on["sling_mass"]:
            pull, accel = outsiders.sling(plant, m, state[15:18], state[18:21])
            force = force + pull
            out[15:18], out[18:21] = state[18:21], accel
        return force, torque

    @property
    def commands(self) -> int:
        """Number of commands per row."""
        return self.count

    @property
    def band(self) -> Array:
        """Stiction of each command."""
        return self.plant["stick_band"]

    def hold(self, state: Array) -> Array:
        """Commands that keep the actuators where they are."""
        return state[HEAD : HEAD + self.count]

    def watch(self, state: Array, out: Array, t: Array) -> None:
        """Write quaternion, velocity and spin of a state into (10, n)."""
        m = self.motion(state, t)[0]
        out[:4], out[4:7], out[7:] = state[3:7], m.velocity, m.spin
