"""One case: the robot, what its folder states, the true plant, the logs and what is hidden when."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from tests.validation.hidden import plant as plants
from tests.validation.hidden.catalogue import Hidden
from tests.validation.hidden.plant import Plant
from tests.validation.hidden.references import Wanted, at, joints, typical_speed
from tests.validation.hidden.rotation import Array
from tests.validation.hidden.vehicles import six
from tests.validation.hidden.wild import effects, manoeuvres, robots, sea
from tests.validation.hidden.wild.robots import Rng, Robot

Span = tuple[float | None, float | None]
MAKERS: dict[str, Any] = {
    "hexa": robots.multirotor,
    "octo": robots.multirotor,
    "grip": robots.manipulator,
    "dual": robots.manipulator,
    "rov6": sea.rov,
    "rov8": sea.rov,
    "torpedo": sea.torpedo,
    "boat": sea.boat,
    "buoy": sea.drifter,
    "spar": sea.drifter,
    "float": sea.drifter,
    "projectile": sea.projectile,
}
# shape of the true laws: the stated vehicle with the hidden effect shares it
SHAPE = ("hidden_power", "hidden_first", "sag_power", "rotor_drag_power", "tether_hardening")
SHAPE += ("slam_shape", "stribeck")
DRAGS = {
    "water_drag": "water_quadratic",
    "air_drag": "air_linear",
    "air_drag_fast": "air_quadratic",
}


@dataclass(frozen=True)
class Spec:
    """What a case is asked to be."""

    family: str
    level: str
    effects: tuple[str, ...]
    step: float
    seed: tuple[int, ...]
    size: float = 1.0
    name: str = ""


@dataclass
class Log:
    """One log: its name, its motion, its origin of time and its own phase of the waves."""

    name: str
    wanted: Wanted
    starts: list[dict[str, Array]]
    origin: float
    phase: float


@dataclass
class Case:
    """A case ready to run, and later what the run found."""

    spec: Spec
    robot: Robot
    stated: Robot
    plant: Plant
    nominal: Plant
    sheet: Plant
    hidden: list[Hidden]
    active: list[dict[str, Span]]
    logs: list[Log]
    seconds: float
    rng: Rng
    truth: dict[str, Any] = field(default_factory=dict)
    found: dict[str, Any] = field(default_factory=dict)

    def at(
        self,
        plant: Plant,
        log: Log,
        t: float | None,
        leave: int | None = None,
        *,
        bare: bool = False,
    ) -> Plant:
        """A plant with the waves of a log and the effects that act at t, or all, or none.

        Time runs from the first row of the log.
        """
        out = dict(plant)
        wave = out["wave"].copy()
        if self.robot.waves is not None:
            wave[:3] = [self.robot.waves[k] for k in ("amplitude", "period", "direction")]
        # in deep water the second order has no orbital motion
        wave[3:] = log.phase, 0.0
        out["wave"] = wave
        for i, (effect, spans) in enumerate(zip(self.hidden, self.active, strict=True)):
            if not bare and i != leave and (t is None or acts(spans.get(log.name), t)):
                effect.set_in(out)
        return out


def acts(span: Span | None, t: float) -> bool:
    """Whether an effect with a span acts at a time."""
    if span is None:
        return False
    start, end = span
    return (start is None or t >= start - 1e-9) and (end is None or t < end - 1e-9)


def build(spec: Spec) -> Case:
    """Draw a case; the same spec gives the same case."""
    rng = np.random.default_rng(spec.seed)
    robot: Robot = MAKERS[spec.family](rng, spec.family)
    wavy = "waves" in spec.effects
    if wavy:
        robot = replace(robot, waves=None)
    seconds = manoeuvres.SECONDS.get(spec.family, 18.0)
    height = manoeuvres.middle(robot, wavy)
    count = int(rng.choice([1, 2, 3], p=[0.15, 0.6, 0.25])) if spec.level != "onset" else 2
    logs = [_log(n, robot, rng, seconds, height) for n in "abc"[:count] + "h"]
    stated, true = robot, plants.draw(robot.vehicle, rng)
    _typical(true, robot, logs, seconds)
    truth: dict[str, Any] = {}
    if spec.level == "calibrate":
        stated, truth = _asked(robot, true, rng)
    elif spec.level == "data_sheet":
        stated, truth = _sheet(robot, true, spec.effects[0])
    nominal, sheet = _nominal(robot, true), _nominal(stated, true)
    hidden = [
        effects.outsider(n, robot, rng, spec.size, height)
        if spec.level == "outside"
        else effects.hide(n, robot, rng, spec.size, logs[0].wanted)
        for n in (() if spec.level in {"calibrate", "data_sheet"} else spec.effects)
    ]
    spans = _spans(spec, hidden, [log.name for log in logs], seconds, rng)
    return Case(
        spec, robot, stated, true, nominal, sheet, hidden, spans, logs, seconds, rng, truth=truth
    )


def _nominal(robot: Robot, true: Plant) -> Plant:
    """The plant that a robot's numbers say, with the shape of the true laws."""
    out = plants.draw(robot.vehicle, np.random.default_rng(0), exact=True)
    for key in ("speed", "spin_speed", *(k for k in SHAPE if k in true)):
        out[key] = true[key]
    return out


def _log(name: str, robot: Robot, rng: Rng, seconds: float, height: float) -> Log:
    driven = robot.family in manoeuvres.SHAPES
    wanted = manoeuvres.draw(robot, rng, seconds, height) if driven else {}
    segments = 0 if driven else 1
    if robot.family == "projectile":
        segments = int(rng.integers(3, 5))
    starts = [manoeuvres.release(robot, rng) for _ in range(segments)]
    return Log(name, wanted, starts, round(float(rng.uniform(2.0, 60.0)), 2), rng.uniform(0, 6.28))


def _typical(true: Plant, robot: Robot, logs: list[Log], seconds: float) -> None:
    if logs[0].wanted:
        batch = {k: np.stack([g.wanted[k] for g in logs], axis=-1) for k in logs[0].wanted}
        true["speed"] = typical_speed(batch, seconds).mean(1)
    else:
        fall = 2.5 if robot.family == "projectile" else 0.2
        true["speed"] = np.array([0.2, 0.2, fall])


def _spans(
    spec: Spec, hidden: list[Hidden], logs: list[str], seconds: float, rng: Rng
) -> list[dict[str, Span]]:
    """When each effect acts, by log, from the log's first row."""
    out: list[dict[str, Span]] = [dict.fromkeys(logs, (None, None)) for _ in hidden]
    late = spec.level == "onset" or (spec.level == "pairs" and rng.random() < 0.4)
    if not late or spec.family == "projectile":
        return out
    which = next((i for i, h in enumerate(hidden) if h.name in effects.STEPS[spec.family]), None)
    if which is None:
        return out
    kinds = ["start", "end", "window"]
    if hidden[which].name == "payload":
        kinds = ["end", "end", "start"]
    kind = str(rng.choice(kinds))
    for i, name in enumerate(n for n in logs if n != "h"):
        # the first log always holds the step; another may hold another one, or none
        word = kind if i == 0 else str(rng.choice([kind, kind, "all", "never"]))
        span = _span(word, seconds, rng)
        if span is None:
            del out[which][name]
        else:
            out[which][name] = span
    return out


def _span(word: str, seconds: float, rng: Rng) -> Span | None:
    def moment(low: float, high: float) -> float:
        return round(float(rng.uniform(low, high)) * seconds / 0.002) * 0.002

    if word == "never":
        return None
    if word == "start":
        return moment(0.25, 0.7), None
    if word == "end":
        return None, moment(0.3, 0.75)
    if word == "window":
        return moment(0.2, 0.4), moment(0.6, 0.8)
    return None, None


def _changed(robot: Robot, **fields: Any) -> Robot:
    return replace(robot, vehicle=replace(deepcopy(robot.vehicle), **fields))


def whole_mass(robot: Robot, true: Plant) -> float:
    """True mass of the whole vehicle."""
    links = true["link_mass"].sum() if robot.tree is not None else 0.0
    return float(true["mass"] + links)


def _asked(robot: Robot, true: Plant, rng: Rng) -> tuple[Robot, dict[str, Any]]:
    """A folder with wrong numbers, and the names, true and stated values of what is asked."""
    v = robot.vehicle
    entry: dict[str, Any] = {}
    fields: dict[str, Any] = {}
    # exact laws: the asked coefficients are then exact numbers
    for key in ("air_power", "water_power", "spin_power"):
        true[key] = np.array(2.0)

    def ask(name: str, value: float, factor: float, unit: str) -> float:
        entry[name] = {"value": six(value), "unit": unit, "stated": six(value * factor)}
        return float(entry[name]["stated"])

    def factor(size: float) -> float:
        return float(np.exp(rng.choice([-1.0, 1.0]) * rng.uniform(0.4, 1.0) * np.log(1.0 + size)))

    drag = "water_drag" if v.water else "air_drag"
    key = DRAGS[drag]
    axes = rng.permutation([0, 1, 2])[:2] if v.count else np.array([2])
    value = getattr(v, key).copy()
    unit = "N s^2/m^2" if v.water else "N s/m"
    for i in sorted(int(a) for a in axes):
        value[i] = ask(f"effects.{drag}.coefficient_{'xyz'[i]}", true[key][i], factor(0.5), unit)
    fields[key] = value
    if not v.water and robot.tree is None:
        which = str(rng.choice(["mass", "thrust", "lag"]))
        if which == "mass":
            fields["mass"] = ask("mass", float(true["mass"]), factor(0.25), "kg")
        elif which == "thrust":
            gain = float(true["act_common"] * true["act_gain"].mean())
            name = "actuators.rotors.thrust_coefficient"
            fields["thrust"] = ask(name, gain, factor(0.25), "N/(rad/s)^2")
    elif v.count and v.water:
        if rng.random() < 0.5 and v.driven != (0, 1, 4):
            name = "hulls.body.displaced_volume"
            fields["volume"] = ask(name, float(true["volume"]), factor(0.05), "m^3")
        else:
            added = v.added.copy()
            added[1] = ask("effects.added_mass.mass_y", float(true["added"][1]), factor(0.5), "kg")
            fields["added"] = added
    elif v.water:
        added = v.added.copy()
        added[2] = ask("effects.added_mass.mass_z", float(true["added"][2]), factor(0.5), "kg")
        fields["added"] = added
    return _changed(robot, **fields), {"calibration": entry}


def _sheet(robot: Robot, true: Plant, which: str) -> tuple[Robot, dict[str, Any]]:
    """A folder that lies about the mass or the thrust."""
    v = robot.vehicle
    accept = ["payload", "thrust_coefficient"]
    allow = [*accept, "centre_of_gravity", "inertia"]
    if which == "sheet_mass":
        stated = _changed(robot, mass=six(v.mass / 1.2), inertia=six(v.inertia / 1.2))
        sheet = {"mass": six(float(true["mass"]))}
        change, unit = {"mass": six(true["mass"] - stated.vehicle.mass)}, "kg"
    else:
        stated = _changed(robot, thrust=six(v.thrust * 1.17))
        gain = float(true["act_common"] * true["act_gain"].mean())
        sheet = {"actuators.rotors.thrust_coefficient": six(gain)}
        change, unit = {"relative_change": six(1.0 / 1.17 - 1.0)}, "1"
        allow.append("battery_sag")
    effect = {
        "name": which,
        "parameters": {k: {"value": x, "unit": unit} for k, x in change.items()},
        "scored_groups": [list(change)],
    }
    return stated, {
        "effects": [effect],
        "sheet": sheet,
        "accept": accept,
        "allow": allow,
        "single_name_ok": False,
    }


def joint_start(log: Log, t: float) -> Array:
    """Joint angles that a log begins with."""
    batch = {k: a[..., None] for k, a in log.wanted.items()}
    return joints(batch, t)[:, 0]


def begin(log: Log, t: float) -> tuple[Array, Array]:
    """Reference and its rate at a time, (4,) each."""
    batch = {k: a[..., None] for k, a in log.wanted.items()}
    place, speed, _ = at(batch, t)
    return place[:, 0], speed[:, 0]
