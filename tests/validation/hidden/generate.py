"""Command line: cases with a hidden effect, by level and vehicle, into one folder each."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.validation.hidden import equivalents, gain, levels, onsets, writing
from tests.validation.hidden.batch import Flight
from tests.validation.hidden.cases import Case, Spec, build
from tests.validation.hidden.vehicles import six

KINDS = {"quad": 30, "auv": 20, "aam": 8, "drop": 10, "drop_imu_only": 3, "crossing": 5}
LEVELS = {
    "null": 14,
    "clear": 29,
    "weak": 9,
    "pairs": 7,
    "out_of_library": 8,
    "sensor_only": 6,
    "confounded": 6,
    "poor_excitation": 6,
    "onset": 0,
}
TRIES = 6
# excess of the loudest channel that a level asks for
EXCESS = {
    "clear": (5.0, np.inf),
    "onset": (5.0, np.inf),
    "pairs": (5.0, np.inf),
    "weak": (0.1, np.inf),
    "poor_excitation": (0.0, 0.05),
    "out_of_library": (5.0, np.inf),
    "sensor_only": (1.0, np.inf),
    "confounded": (2.0, np.inf),
}
# least and most gain beyond the tolerances, and the one to aim at after a miss
GAIN = {
    "clear": (220.0, np.inf, 400.0),
    "onset": (400.0, np.inf, 700.0),
    "pairs": (180.0, np.inf, 400.0),
    "weak": (55.0, 150.0, 95.0),
    "sensor_only": (150.0, np.inf, 260.0),
    "out_of_library": (250.0, np.inf, 500.0),
    "confounded": (45.0, np.inf, 90.0),
    "poor_excitation": (0.0, 8.0, 4.0),
}
TWIN_LEFT = 12.0


def _choice(rng: np.random.Generator, weights: dict[str, int]) -> str:
    names = list(weights)
    share = np.array([weights[n] for n in names], dtype=float)
    return str(rng.choice(names, p=share / share.sum()))


def plan(
    count: int, seed: int, *, level: str | None, vehicle: str | None, effect: str | None
) -> list[Spec]:
    """Specs of a set: levels and vehicles drawn in their proportions unless given."""
    rng = np.random.default_rng([seed, 911])
    out: list[Spec] = []
    for i in range(count):
        # of a few draws the one whose effect was asked for least, so that all get their turn
        some = [_spec(rng, (seed, i), level, vehicle, effect) for _ in range(6)]
        first = some[0]
        alike = [s for s in some if (s.kind, s.level) == (first.kind, first.level)]
        out.append(min(alike, key=lambda s: sum(o.effects == s.effects for o in out)))
    return out


def _spec(
    rng: np.random.Generator,
    seed: tuple[int, ...],
    level: str | None,
    vehicle: str | None,
    effect: str | None,
) -> Spec:
    for _ in range(2000):
        wish = level or _choice(rng, LEVELS)
        kind = vehicle or _choice(rng, KINDS)
        own = (*seed, list(LEVELS).index(wish), list(KINDS).index(kind))
        made = _possible(rng, own, wish, kind, effect)
        if made is not None:
            return made
    raise SystemExit(f"no case for level {level}, vehicle {vehicle}, effect {effect}")


def _possible(
    rng: np.random.Generator, seed: tuple[int, ...], level: str, kind: str, effect: str | None
) -> Spec | None:
    """One draw of a spec, or None where the vehicle cannot hold the level or the effect."""
    tables: dict[str, list[Any]] = {
        "confounded": levels.CONFOUNDED,
        "poor_excitation": levels.UNSEEN,
    }
    table = tables.get(level)
    if table is not None:
        fits = [r for r in table if r[0] == kind and effect in {None, r[2]}]
        if not fits:
            return None
        row: Any = fits[rng.integers(len(fits))]
        return Spec(kind, level, row[1], [row[2]], seed, row[3] if len(row) > 3 else None)
    usual = "drop" if kind.startswith("drop") else "sines"
    if level == "null":
        # always a rich motion: a null log that shows nothing would be "cannot tell"
        other = {"quad": "low", "auv": "shallow"}.get(kind)
        rare = other is not None and rng.random() < 0.1
        return Spec(kind, level, str(other) if rare else usual, [], seed)
    pool = {
        "out_of_library": levels.OUTSIDE,
        "onset": onsets.NAMES,
        "sensor_only": dict.fromkeys(KINDS, levels.SENSOR),
    }
    names = pool.get(level, levels.LIBRARY).get(kind, [])
    if not names or (effect is not None and effect not in names):
        return None
    if level == "pairs":
        return _pair(rng, kind, names, effect, seed, usual)
    name = effect or str(names[rng.integers(len(names))])
    return Spec(kind, level, levels.PATTERN.get(name, usual), [name], seed)


def _pair(
    rng: np.random.Generator,
    kind: str,
    names: list[str],
    effect: str | None,
    seed: tuple[int, ...],
    usual: str,
) -> Spec | None:
    if kind == "drop_imu_only" or (effect is not None and effect not in names):
        return None
    one = effect or str(names[rng.integers(len(names))])
    two = str(names[rng.integers(len(names))])
    if one == two or {one, two} in levels.TOO_CLOSE:
        return None
    patterns = {levels.PATTERN.get(n, usual) for n in (one, two)} - {usual}
    pattern = patterns.pop() if patterns else usual
    return Spec(kind, "pairs", pattern, [one, two], seed)


def judge(case: Case) -> tuple[bool, float]:
    """Whether the case is what its level says, and by what its size should change if not."""
    excess, gains = case.found.get("excess", {}), case.found.get("gains", {})
    loudest = max(excess.values(), default=0.0)
    case.found["detectability"] = {
        "excess": {_short(k): six(v) for k, v in excess.items()},
        "excess_max": six(loudest),
        **_rounded(gains),
    }
    level = case.spec.level
    if level == "null":
        case.found["detectability"] = {"excess_max": 0.0}
        return True, 1.0
    low, high = EXCESS[level]
    if not low <= loudest <= high:
        return False, 1.4 if loudest < low else 0.7
    if not gains:
        return True, 1.0
    low, high, aim = GAIN[level]
    worth = min(gains.get("gain_of_each", [gains["gain_after_tolerances"]]))
    if not low <= worth <= high:
        return False, float(np.clip(np.sqrt(aim / max(worth, 1e-3)), 0.4, 2.5))
    left = max(gains.get("gain_left_after_twin", {"": 0.0}).values())
    if left > TWIN_LEFT:
        return False, float(np.clip(np.sqrt(0.6 * TWIN_LEFT / left), 0.5, 0.9))
    return True, 1.0


def _rounded(gains: dict[str, Any]) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for key, value in gains.items():
        if isinstance(value, dict):
            out[key] = {k: six(v) for k, v in value.items()}
        else:
            out[key] = six(value)
    return out


def _short(channel: str) -> str:
    names = {"angular_velocity": "gyro", "specific_force": "acc", "joint_position": "joint"}
    return names.get(channel, channel)


def produce(specs: list[Spec], out: Path, seed: int, *, gains: bool = True) -> int:
    """Fly and write all specs; a case that misses its level is changed, and in the end left out."""
    names = {spec.seed: f"g{i + 1:03d}" for i, spec in enumerate(specs)}
    label = {spec.seed: spec.seed for spec in specs}
    waiting, written = specs, 0
    for attempt in range(TRIES):
        again: list[Spec] = []
        for kind in sorted({s.body for s in waiting}):
            group = [build(s) for s in waiting if s.body == kind]
            flight = Flight(group, seed * 10 + attempt)
            equivalents.settle(flight)
            flight.excess()
            readings = flight.readings()
            for i, case in enumerate(group):
                if gains and case.spec.level != "null":
                    case.found["gains"] = gain.measure(flight, i)
                good, change = judge(case)
                case.found["accepted"] = good
                home = label[case.spec.seed]
                _extra(flight, i)
                if good:
                    writing.write(out / names[home], flight, i, readings)
                    written += 1
                elif attempt < TRIES - 1:
                    # the same case in another size first; another draw when that does not help
                    fresh = (*home, attempt + 1) if attempt > 1 else case.spec.seed
                    label[fresh] = home
                    again.append(replace(case.spec, seed=fresh, size=case.spec.size * change))
        waiting = again
        if not waiting:
            break
    return written


def _extra(flight: Flight, index: int) -> None:
    """Facts that only the run knows."""
    for effect in flight.cases[index].hidden:
        if effect.name == "tether":
            effect.facts["taut_share"] = equivalents.taut_share(flight, index)


def main(argv: list[str] | None = None) -> int:
    """Parse the arguments and generate."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--level", choices=list(LEVELS))
    parser.add_argument("--vehicle", choices=list(KINDS))
    parser.add_argument("--effect")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--no-gain", action="store_true", help="skip the slow part of the labels")
    args = parser.parse_args(argv)
    specs = plan(args.count, args.seed, level=args.level, vehicle=args.vehicle, effect=args.effect)
    done = produce(specs, args.out, args.seed, gains=not args.no_gain)
    print(f"{done} of {args.count} cases in {args.out}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
