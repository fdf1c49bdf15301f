"""Command line: robots of a user's own with something hidden, one folder each.

python -m tests.validation.hidden.wild --out DIR --seed S --count 12 [--level L] [--family F]

A case that is there already is not made again.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.validation.hidden import equivalents
from tests.validation.hidden.wild import effects, records
from tests.validation.hidden.wild.cases import MAKERS, Case, Spec, build
from tests.validation.hidden.wild.crew import Crew

LEVELS = {
    "null": 20,
    "clear": 40,
    "onset": 25,
    "pairs": 12,
    "data_sheet": 8,
    "outside": 10,
    "calibrate": 12,
}
# time between the rows [s]: one of a family, so that its cases fly together
PERIOD = {"octo": 0.016, "grip": 0.012, "rov8": 0.012, "torpedo": 0.016, "spar": 0.012}
PERIOD = {f: PERIOD.get(f, 0.01) for f in MAKERS}
TRIES = 5
# least misfit in floors that a level asks of every effect; the one to aim at, and too loud
LEAST, AIM, MOST = 6.0, 18.0, 300.0


def plan(
    count: int, seed: int, level: str | None, family: str | None, effect: str | None
) -> list[Spec]:
    """Specs in the proportions of the levels, families and effects in turn."""
    rng = np.random.default_rng([seed, 4711])
    share = np.array(list(LEVELS.values())) / sum(LEVELS.values())
    wanted = [level] * count if level else list(np.repeat(list(LEVELS), _split(count, share)))
    turns: dict[str, int] = defaultdict(int)
    out: list[Spec] = []
    for i, wish in enumerate(wanted):
        families = [f for f in MAKERS if family in {None, f} and _fits(f, wish, effect)]
        if not families:
            raise SystemExit(f"no case of level {wish}, family {family}, effect {effect}")
        kind = families[turns[wish] % len(families)]
        turns[wish] += 1
        step = PERIOD[kind]
        seeds = (seed, i, list(LEVELS).index(wish))
        names = (effect,) if effect else _names(kind, wish, rng, out)
        out.append(Spec(kind, wish, names, step, seeds, name=f"w{i + 1:03d}"))
    return out


def _split(count: int, share: np.ndarray) -> np.ndarray:
    """Whole numbers that sum to count, near their shares."""
    exact = share * count
    out = np.floor(exact).astype(int)
    for i in np.argsort(out - exact)[: count - out.sum()]:
        out[i] += 1
    return out


def _fits(family: str, level: str, effect: str | None) -> bool:
    if level == "data_sheet":
        return family in {"hexa", "octo"}
    if level == "calibrate":
        return family != "projectile"
    pool = {"onset": effects.STEPS, "outside": effects.OUTSIDE}.get(level, effects.LIBRARY)
    if level == "pairs" and family in {"spar", "float", "projectile", "buoy"}:
        return False
    return family in pool and (effect is None or effect in pool[family])


def _names(
    family: str, level: str, rng: np.random.Generator, before: list[Spec]
) -> tuple[str, ...]:
    if level in {"null", "calibrate"}:
        return ()
    if level == "data_sheet":
        return (str(rng.choice(["sheet_mass", "sheet_thrust"])),)
    if level == "pairs":
        return tuple(effects.pair(family, rng))
    pool = {"onset": effects.STEPS, "outside": effects.OUTSIDE}.get(level, effects.LIBRARY)
    some = [str(n) for n in rng.permutation(pool[family])]
    used = [(s.family == family, s.effects) for s in before if s.level == level]
    # first what the family had least, then what all had least
    turn = {n: (used.count((True, (n,))), used.count((False, (n,)))) for n in some}
    return (min(some, key=turn.__getitem__),)


def judge(case: Case) -> tuple[bool, float]:
    """Whether the case is as loud as its level says, and by what its size should change if not."""
    if case.spec.level in {"null", "calibrate", "data_sheet"}:
        return True, 1.0
    loud = case.found["each"]
    if min(loud) < LEAST:
        return False, float(np.clip(np.sqrt(AIM / max(min(loud) - 1.0, 0.3)), 1.2, 3.0))
    if min(loud) > MOST:
        return False, 0.5
    return True, 1.0


def produce(specs: list[Spec], out: Path, seed: int) -> int:
    """Fly and write all specs; a case that is too quiet is made louder, and in the end left out."""
    waiting, written = specs, 0
    for attempt in range(TRIES):
        groups: dict[tuple[str, float], list[Spec]] = defaultdict(list)
        for spec in waiting:
            groups[(spec.family, spec.step)].append(spec)
        waiting = []
        for group in groups.values():
            crew = Crew([build(s) for s in group], seed * 10 + attempt)
            equivalents.settle(crew)  # type: ignore[arg-type]
            readings = crew.measure()
            crew.misfits(readings)
            for i, case in enumerate(crew.cases):
                good, change = judge(case)
                line = f"{case.spec.name} {case.spec.level} {case.spec.family}"
                loud = " ".join(f"{x:.3g}" for x in case.found["each"])
                print(line, *case.spec.effects, loud, "" if good else "again", flush=True)
                if good:
                    records.write(out / case.spec.name, crew, i, readings)
                    written += 1
                elif attempt < TRIES - 1:
                    # in another size first; another draw when that does not help
                    fresh = (*case.spec.seed, attempt) if attempt > 1 else case.spec.seed
                    size = min(case.spec.size * change, 4.0)
                    waiting.append(replace(case.spec, seed=fresh, size=size))
        if not waiting:
            break
    return written


def main(argv: list[str] | None = None) -> int:
    """Parse the arguments and generate."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=12)
    parser.add_argument("--level", choices=list(LEVELS))
    parser.add_argument("--family", choices=list(MAKERS))
    parser.add_argument("--effect")
    parser.add_argument("--only", nargs="*", help="of the planned cases, those of these families")
    args = parser.parse_args(argv)
    specs = plan(args.count, args.seed, args.level, args.family, args.effect)
    specs = [s for s in specs if args.only is None or s.family in args.only]
    specs = [s for s in specs if not (args.out / s.name).exists()]
    done = produce(specs, args.out, args.seed)
    print(f"{done} of {len(specs)} cases in {args.out}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
