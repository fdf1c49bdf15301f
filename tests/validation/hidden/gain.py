"""How much of a hidden effect no admissible change of the stated model can explain.

Linear in the tolerances and in the initial state of each window; gusts are left out. The result is
a chi-square: the square of the effect in units of what could be mistaken for it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tests.validation.hidden import fly, sensors
from tests.validation.hidden.batch import Flight
from tests.validation.hidden.cases import Case
from tests.validation.hidden.commands import Commands
from tests.validation.hidden.plant import TOLERANCE, Plant, stack, stated, take
from tests.validation.hidden.rotation import Array, exponential, multiply

Readings = dict[str, Array]
Change = Callable[[Plant], None]

# keys of the plant behind each tolerance; relative ones scale, the others add
BEHIND: dict[str, list[str]] = {
    "mass": ["mass"],
    "inertia": ["inertia"],
    "thrust_coefficient": ["act_common"],
    "thrust_coefficient_each": ["act_gain"],
    "torque_coefficient": ["act_torque"],
    "centre_of_gravity": ["com"],
    "displaced_volume": ["volume"],
    "drag_coefficient": ["air_linear", "air_quadratic", "water_quadratic"],
    "angular_drag_coefficient": ["angular_linear", "angular_quadratic"],
    "added_mass": ["added"],
    "command_delay": ["act_delay"],
    "water_thrust_ratio": ["water_ratio"],
    "joint_friction": ["rub"],
    "link_mass": ["link_mass"],
    "joint_kp": ["servo_stiff"],
    "joint_kd": ["servo_damp"],
    "accelerometer_bias": ["imu_bias"],
    "accelerometer_scale": ["imu_scale"],
    "gyroscope_bias": ["gyro_bias"],
    "sensor_misalignment": ["imu_turn"],
    "sensor_delay": ["imu_delay"],
}
WHOLE = {"torque_coefficient"}
WINDOWS = {"aam": 8, "crossing": 10, "drop": 12}
BEGIN = {"position": 0.005, "orientation": 0.01, "velocity": 0.02, "angular_velocity": 0.02}


def _nudge(key: str, index: int | None, size: float, relative: bool) -> Change:
    def change(plant: Plant) -> None:
        value = np.array(plant[key], dtype=float)
        where: Any = ... if index is None else index
        value[where] += size * (value[where] if relative else 1.0)
        plant[key] = value

    return change


def tolerance_changes(case: Case) -> list[Change]:
    """One-sigma changes of the plant, one for each independent uncertain number."""
    plant, out = case.without, []
    for name in stated(case.vehicle):
        size, meaning = TOLERANCE[name]
        for key in BEHIND.get(name, []):
            value = np.atleast_1d(plant[key])
            relative = meaning.startswith("relative")
            if relative and name != "accelerometer_scale":
                live = np.flatnonzero(value)
            else:
                relative, live = False, np.arange(value.size)
            if name in WHOLE or np.ndim(plant[key]) == 0:
                out.append(_nudge(key, None, size, relative))
            else:
                out.extend(_nudge(key, int(i), size, relative) for i in live)
    out.extend(_together(case))
    return out


def _together(case: Case) -> list[Change]:
    """Tolerances that move two arrays at once, and the powers of the drag laws."""
    out: list[Change] = []
    names = stated(case.vehicle)
    for name in ("rotor_time_constant", "thruster_time_constant"):
        if name in names:
            size = TOLERANCE[name][0]
            out.append(
                _both(_nudge("lag_up", None, size, False), _nudge("lag_down", None, size, False))
            )
    if "centre_of_buoyancy" in names:
        size = TOLERANCE["centre_of_buoyancy"][0]
        out.extend(
            _both(_nudge("cob_shift", i, size, False), _nudge("centroid_whole", i, size, False))
            for i in range(3)
        )
    powers = {"air_power": "air_quadratic", "water_power": "water_quadratic"}
    powers["spin_power"] = "angular_quadratic"
    out.extend(_nudge(p, None, 0.05, False) for p, k in powers.items() if case.without[k].any())
    return out


def _both(one: Change, two: Change) -> Change:
    def change(plant: Plant) -> None:
        one(plant)
        two(plant)

    return change


def _changed(plant: Plant, change: Change) -> Plant:
    out = dict(plant)
    change(out)
    return out


class Windows:
    """Windows of one case, replayed many times from the true states."""

    def __init__(self, flight: Flight, index: int) -> None:
        self.flight, self.case = flight, flight.cases[index]
        member, first, rows = flight.layout()
        mine = np.flatnonzero(flight.owner[member] == index)
        self.prior = self.case.spec.kind == "drop_imu_only"
        if self.prior:
            # nothing but the release is known of the pose: whole drops instead of windows
            rows = flight.track.rows.shape[0] - flight.skip
            members = np.flatnonzero(flight.owner == index)
            self.member, self.first = members, np.full(members.shape, flight.skip, dtype=np.intp)
            self.weight = 1.0
        else:
            wanted = min(WINDOWS.get(flight.kind, 12), mine.size)
            some = mine[np.linspace(0, mine.size - 1, wanted).round().astype(int)]
            self.member, self.first = member[some], first[some]
            self.weight = mine.size / wanted
        self.rows = rows
        self.per_row = max(flight.per_row // 2, 4)
        fine = flight.track.fine[self.first * flight.per_row, :, self.member].T
        state = flight.track.rows[self.first, :, self.member].T
        self._start = (state, fine[4:7], fine[7:10])

    def readings(self, plants: list[Plant], nudge: Array | None, sent: Commands) -> list[Readings]:
        """Whitenable readings of every window under each plant, or under one plant with nudges.

        Args:
            plants: Parameter sets; one when `nudge` is given.
            nudge: Changes of the initial state, (changes, freedoms), or None.
            sent: Commands of the flight.
        """
        count, w = (len(plants) if nudge is None else nudge.shape[0]), self.member.size
        which = np.repeat(np.arange(len(plants)), w) if nudge is None else np.zeros(count * w, int)
        body = self.flight.make(take(stack(plants), which))
        state, velocity, spin = (np.tile(a, (1, count)) for a in self._start)
        first = np.tile(self.first, count)
        if nudge is not None:
            push = np.repeat(nudge, w, axis=0).T
            state = state.copy()
            state[:3] += push[:3]
            state[3:7] = multiply(state[3:7], exponential(push[3:6]))
            velocity, spin = velocity + push[6:9], spin + push[9:12]
            joints = self.flight.joints()
            if joints is not None:
                state[joints.start : joints.start + 6] += push[12:18]
        state = body.with_motion(state, velocity, spin, first * self.flight.step)
        track = fly.windows(
            body,
            state,
            sent,
            log=np.tile(self.member, count),
            first=first,
            rows=self.rows,
            inner=self.flight.step / self.per_row,
            per_row=self.per_row,
        )
        values = sensors.exact(track, body.plant, self.flight.joints())
        return [{k: v[..., i * w : (i + 1) * w] for k, v in values.items()} for i in range(count)]

    def whitened(self, one: Any, two: Any) -> Array:
        """Differences in units of the noise, (numbers, windows), thinned to each sensor's rate."""
        kind, parts = self.case.spec.kind, []
        skip = 2 if self.flight.kind == "drop" else 4
        for name, value in sensors.differences(one, two, sensors.CHANNELS[kind]).items():
            every = round(1.0 / self.flight.step) // sensors.CHANNELS[kind][name][1]
            parts.append(value[skip : self.rows : every].reshape(-1, value.shape[2]))
        return np.concatenate(parts)


def _freedoms(flight: Flight, prior: bool) -> Array:
    """Changes of the initial state, one freedom each, (freedoms, freedoms)."""
    size = np.repeat(list(BEGIN.values()), 3)
    if flight.joints() is not None:
        size = np.concatenate((size, np.full(3, 0.01), np.full(3, 0.05)))
    return np.diag(size)


class Gains:
    """Projector of one case: what is left of a difference after states and tolerances."""

    def __init__(self, flight: Flight, index: int) -> None:
        self.windows = Windows(flight, index)
        self.case = flight.cases[index]
        self._sent = flight.sent.obeyed()
        self._base_plant = self.case.without
        self.base = self._run([self._base_plant])[0]
        nudges = _freedoms(flight, self.windows.prior)
        moved = self.windows.readings([self._base_plant], nudges, self._sent)
        starts = np.stack([self.windows.whitened(m, self.base) for m in moved], axis=-1)
        changes = tolerance_changes(self.case)
        plants = [_changed(self._base_plant, c) for c in changes]
        runs = self._run(plants)
        self._start = np.moveaxis(starts, 1, 0)  # (windows, numbers, freedoms)
        self._tolerance = self._project(
            np.stack([self.windows.whitened(r, self.base) for r in runs], axis=-1).swapaxes(0, 1)
        )

    def _run(self, plants: list[Plant], sent: Commands | None = None) -> list[Any]:
        return self.windows.readings(plants, None, self._sent if sent is None else sent)

    def _project(self, columns: Array) -> Array:
        """Columns (windows, numbers, k) without what initial states explain."""
        starts = self._start
        if self.windows.prior:
            # a prior of one sigma: an extra row for each freedom
            n = starts.shape[2]
            eye = np.broadcast_to(np.eye(n), (starts.shape[0], n, n))
            starts = np.concatenate((starts, eye), axis=1)
            zero = np.zeros((columns.shape[0], n, columns.shape[2]))
            columns = np.concatenate((columns, zero), axis=1)
        q, _ = np.linalg.qr(starts)
        left = columns - q @ (q.swapaxes(1, 2) @ columns)
        return left.reshape(-1, columns.shape[2])

    def difference(self, plant: Plant, sent: Commands | None = None) -> Array:
        """Projected difference (numbers, 1) that another plant makes."""
        run = self._run([plant], sent)[0]
        return self._project(self.windows.whitened(run, self.base).T[..., None])

    def of(self, difference: Array, free: list[Array] | None = None) -> float:
        """Chi-square of a projected difference that tolerances (and free columns) leave."""
        return self._fit(difference, free or [np.zeros_like(difference)])[0]

    def left(
        self, plant: Plant, sent: Commands, twin: list[tuple[float, Callable[[float], Change]]]
    ) -> float:
        """Chi-square left when a twin may be fitted too; a few Gauss-Newton steps."""
        amount = np.zeros(len(twin))
        goal, best = self._run([plant], sent)[0], np.inf
        for _ in range(4):
            here = self._with_twin(twin, amount)
            near = [
                self._with_twin(twin, amount + np.eye(len(twin))[i] * size)
                for i, (size, _) in enumerate(twin)
            ]
            runs = self._run([here, *near])
            r = self._project(self.windows.whitened(goal, runs[0]).T[..., None])
            free = [self._project(self.windows.whitened(x, runs[0]).T[..., None]) for x in runs[1:]]
            value, step = self._fit(r, free)
            best = min(best, value)
            amount = amount + step * np.array([size for size, _ in twin])
        return best

    def _with_twin(
        self, twin: list[tuple[float, Callable[[float], Change]]], amount: Array
    ) -> Plant:
        plant = dict(self._base_plant)
        for (_, by), x in zip(twin, amount, strict=True):
            by(float(x))(plant)
        return plant

    def _fit(self, difference: Array, free: list[Array]) -> tuple[float, Array]:
        """Chi-square left by tolerances and free columns, and the columns' amounts."""
        root = np.sqrt(self.windows.weight)
        r = root * difference[:, 0]
        extra = root * np.concatenate(free, axis=1)
        long = np.maximum(np.linalg.norm(extra, axis=0), 1e-9)
        b = np.concatenate((root * self._tolerance, extra / long), axis=1)
        prior = np.diag(np.r_[np.ones(self._tolerance.shape[1]), np.full(len(long), 1e-10)])
        found = np.linalg.solve(prior + b.T @ b, b.T @ r)
        return max(float(r @ r - found @ (b.T @ r)), 0.0), found[-len(long) :] / long


def measure(flight: Flight, index: int) -> dict[str, Any]:
    """Gains of one case, as its level needs them."""
    case = flight.cases[index]
    gains = Gains(flight, index)
    whole = gains.difference(case.with_it, flight.sent)
    out: dict[str, Any] = {"gain_after_tolerances": gains.of(whole)}
    if len(case.hidden) == 2:
        alone = [gains.difference(_changed(case.without, h.set_in)) for h in case.hidden]
        out["gain_of_each"] = [
            gains.of(alone[0], [alone[1]]),
            gains.of(alone[1], [alone[0]]),
        ]
    if case.spec.twin is not None:
        twin = case.spec.twin
        out["gain_left_after_twin"] = {
            twin: gains.left(case.with_it, flight.sent, _twin(twin, case))
        }
    return out


def _twin(name: str, case: Case) -> list[tuple[float, Callable[[float], Change]]]:
    """Directions that span a twin's parameters: a typical step and the change by an amount."""
    wet = case.vehicle.water
    numbers = {
        "thrust_coefficient": ("act_common", 0.03),
        "rotor_drag": ("rotor_drag", 0.006),
        "payload": ("payload_mass", 0.03 * case.vehicle.mass),
        "buoyancy": ("volume", 0.01 * case.vehicle.volume),
    }
    vectors = {
        "accelerometer_bias": (("imu_bias",), 0.1),
        "linear_drag": (("hidden_linear",), 2.0 if wet else 0.1),
        "quadratic_drag": (("hidden_quadratic",), 4.0 if wet else 0.05),
        "centre_of_buoyancy": (("cob_shift", "centroid_whole"), 0.003),
    }
    if name in numbers:
        key, size = numbers[name]
        return [(size, lambda x: _nudge(key, None, x, False))]
    keys, size = vectors[name]

    def along(axis: int) -> Callable[[float], Change]:
        def by(x: float) -> Change:
            parts = [_nudge(k, axis, x, False) for k in keys]
            return parts[0] if len(parts) == 1 else _both(*parts)

        return by

    return [(size, along(i)) for i in range(3)]
