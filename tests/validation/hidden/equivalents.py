"""The parameter of the catalogue's law that fits the true force of a log best."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.validation.hidden import forces
from tests.validation.hidden.arm import friction
from tests.validation.hidden.batch import Flight
from tests.validation.hidden.body import IMPULSE
from tests.validation.hidden.forces import Motion
from tests.validation.hidden.plant import Plant
from tests.validation.hidden.rotation import Array
from tests.validation.hidden.vehicles import six

Pair = tuple[Array, Array]  # true force and the law's force with a parameter of one


def _drag(plant: Plant, m: Motion, square: bool) -> Pair:
    in_water = plant["hidden_in_water"] > 0.5
    weight = np.where(in_water, m.wet, 1.0 - m.wet)
    v = np.where(in_water, m.through_water, m.through_air)
    return forces.spread_drag(plant, m)[0], -weight * (np.abs(v) * v if square else v)


def _spin(plant: Plant, m: Motion) -> Pair:
    weight = np.where(plant["spin_in_water"] > 0.5, m.wet, 1.0)
    none = dict(plant)
    none["hidden_spin"] = np.zeros_like(plant["hidden_spin"])
    return forces.angular(plant, m) - forces.angular(none, m), -weight * m.spin


def _rotor_drag(plant: Plant, m: Motion, thrust: Array) -> Pair:
    one = dict(plant)
    one["rotor_drag"] = np.ones_like(plant["rotor_drag"])
    one["rotor_drag_power"] = np.ones_like(plant["rotor_drag"])
    return forces.rotor_drag(plant, m, thrust)[0], forces.rotor_drag(one, m, thrust)[0]


def _tether(plant: Plant, m: Motion) -> Pair:
    one = dict(plant)
    one["tether_gain"] = np.ones_like(plant["tether_gain"])
    one["tether_hardening"] = np.zeros_like(plant["tether_gain"])
    return forces.tether(plant, m), forces.tether(one, m)


def _sag(plant: Plant, volts: Array, thrust: Array) -> Pair:
    short = np.maximum(1.0 - volts / plant["full_voltage"], 0.0)
    factor = forces.sag_factor(plant, volts)
    full = thrust.sum(0) / factor
    return (full * (factor - 1.0))[None], (-full * short)[None]


def _ground(plant: Plant, m: Motion, thrust: Array, level: float) -> Pair:
    """The law in the form T k x = T - T_free, linear in k, at the true thrust T."""
    factor = forces.ground_factor(plant, m, level)
    return thrust * (1.0 - 1.0 / factor), thrust * forces.ground_ratio(plant, m, level) ** 2


def _pairs(flight: Flight, names: set[str], row: int) -> dict[str, Pair]:
    """True and unit forces of the named effects at one row, (axes, members) each."""
    body: Any = flight.body
    plant, state = flight.with_it, flight.track.rows[row]
    t = np.full(body.size, row * flight.step)
    m = body.motion(state, t)[0]
    out: dict[str, Pair] = {}
    if "linear_drag" in names:
        out["linear_drag"] = _drag(plant, m, square=False)
    if "quadratic_drag" in names:
        out["quadratic_drag"] = _drag(plant, m, square=True)
    if "angular_drag" in names:
        out["angular_drag"] = _spin(plant, m)
    if "tether" in names:
        out["tether"] = _tether(plant, m)
    if names & {"rotor_drag", "battery_sag", "ground_effect"}:
        thrust = body.thrusts(state, m)[0]
        if "rotor_drag" in names:
            out["rotor_drag"] = _rotor_drag(plant, m, thrust)
        if "battery_sag" in names:
            out["battery_sag"] = _sag(plant, flight.track.volts[row], thrust)
        if "ground_effect" in names:
            out["ground_effect"] = _ground(plant, m, thrust, flight.body.ground or 0.0)
    return out


BY_AXIS = {"linear_drag", "quadratic_drag", "angular_drag"}
PARAMETER = {
    "tether": "stiffness",
    "rotor_drag": "coefficient",
    "battery_sag": "sensitivity",
    "ground_effect": "coefficient",
}
FITTED = BY_AXIS | set(PARAMETER)


def settle(flight: Flight, *, stride: int = 2) -> None:
    """Replace the drawn parameters of every hidden effect by their equivalents."""
    names = {h.name for c in flight.cases for h in c.hidden} & FITTED
    sums: dict[str, list[Array]] = {}
    if names:
        for row in range(flight.skip, flight.track.rows.shape[0], stride):
            for name, (true, unit) in _pairs(flight, names, row).items():
                held = sums.setdefault(name, [np.zeros_like(true), np.zeros_like(true)])
                held[0] += true * unit
                held[1] += unit * unit
    for i, case in enumerate(flight.cases):
        mine = flight.owner == i
        for effect in case.hidden:
            if effect.name == "slamming":
                _settle_slam(flight, mine, effect.values)
            if effect.name == "joint_friction":
                _settle_friction(flight, mine, effect.values)
            if effect.name not in sums:
                continue
            top, bottom = (s[:, mine].sum(1) for s in sums[effect.name])
            if effect.name in BY_AXIS:
                fit = six(top / np.maximum(bottom, 1e-12))
                for axis, value in zip("xyz", fit, strict=True):
                    _replace(effect.values, f"coefficient_{axis}", float(value))
            else:
                _replace(
                    effect.values, PARAMETER[effect.name], six(top.sum() / max(bottom.sum(), 1e-12))
                )


def _settle_slam(flight: Flight, mine: Array, values: dict[str, float]) -> None:
    true, law = flight.track.rows[-1][IMPULSE][:, mine].sum(1)
    if law > 0.0:
        values["coefficient"] = six(values["coefficient"] * true / law)


def _settle_friction(flight: Flight, mine: Array, values: dict[str, float]) -> None:
    """Coulomb and viscous parts together, from the true torque at the inner rows' joint rates."""
    joint = int(values["joint"]) - 1
    member = int(np.flatnonzero(mine)[0])
    speed = flight.track.rows[flight.skip :, flight.body.rate_rows.start + joint, member]
    one = {k: flight.with_it[k][..., member] for k in ("stribeck",)}
    true = friction(one, speed, np.array(values["coulomb"]), np.array(values["viscous"]))
    laws = np.stack((-np.sign(speed), -speed), axis=1)
    dry, wet = np.linalg.lstsq(laws, true, rcond=None)[0]
    values["coulomb"], values["viscous"] = six(dry), six(wet)


def _replace(values: dict[str, float], name: str, value: float) -> None:
    """Take a fitted value, unless the log hardly fits it (an axis that never moves)."""
    drawn = values[name]
    if abs(value - drawn) <= 0.35 * abs(drawn):
        values[name] = value


def taut_share(flight: Flight, case: int) -> float:
    """Share of the rows of a case in which its tether is taut."""
    plant = flight.with_it
    place = flight.track.rows[flight.skip :, :3]
    away = place - plant["tether_anchor"]
    taut = np.sqrt((away**2).sum(1)) > plant["tether_length"]
    return float(taut[:, flight.owner == case].mean())
