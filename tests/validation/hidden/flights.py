"""Command line: several flights of one vehicle with the same hidden effect, truth kept apart."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import yaml

from tests.validation.hidden import equivalents, gain, generate, references, writing
from tests.validation.hidden.batch import Flight
from tests.validation.hidden.cases import SECONDS, Case, Spec, build

NAMES = "abcdefgh"


def cases(spec: Spec, count: int) -> list[Case]:
    """One vehicle, one hidden effect, a motion and a draw of the noise for every flight."""
    made = [build(spec) for _ in range(count)]
    for k, case in enumerate(made):
        case.rng = np.random.default_rng((*spec.seed, 77, k))
        if k:
            motion = np.random.default_rng((*spec.seed, 78, k))
            case.wanted = references.draw(spec.body, spec.pattern, motion, SECONDS[spec.body])
    return made


def produce(spec: Spec, out: Path, truth: Path, *, count: int, seed: int) -> None:
    """Fly and write all flights; the truth of the first, and only it, goes into a file apart."""
    made = cases(spec, count)
    flight = Flight(made, seed)
    equivalents.settle(flight)
    flight.excess()
    made[0].found["gains"] = gain.measure(flight, 0)
    good, _ = generate.judge(made[0])
    if not good:
        raise SystemExit(f"seed {seed} gives no case of level {spec.level}: take another")
    readings = flight.readings()
    for k in range(count):
        folder = out / f"flight_{NAMES[k]}"
        writing.write(folder, flight, k, readings)
        (folder / "truth.yaml").unlink()
    effects = writing.truth(made[0])
    truth.write_text(yaml.safe_dump(effects, sort_keys=False), encoding="utf-8")


def main(argv: list[str] | None = None) -> int:
    """Parse the arguments and fly."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--truth", type=Path, required=True, help="file for what is hidden")
    parser.add_argument("--level", choices=list(generate.LEVELS), default="clear")
    parser.add_argument("--vehicle", choices=["quad", "auv", "aam", "crossing"], default="quad")
    parser.add_argument("--count", type=int, choices=range(1, len(NAMES) + 1), default=2)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args(argv)
    spec = generate.plan(1, args.seed, level=args.level, vehicle=args.vehicle, effect=None)[0]
    produce(spec, args.out, args.truth, count=args.count, seed=args.seed)
    print(f"{args.count} flights in {args.out}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
