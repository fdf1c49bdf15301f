"""Mutation test of the effects: every law is broken, and its tests must fail.

    python benchmarks/mutations.py [EFFECT ...] [--contract] [--jobs N] [--seconds S]

A law guarded by nothing is found: the command ends with 1 when a mutant survives. A mutant is first
compared with the law at random instants; one that changes nothing there is no mutant. Then the unit
tests that name the effect run with the broken law (`benchmarks.mutate`) until the first fails;
where none does, or with ``--contract``, the effect's contract check runs, too. With ``--jobs``,
each of N effects at a time has a copy of the checkout and of the installed package.
"""

from __future__ import annotations

import argparse
import itertools
import json
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
# at the end: the installed package comes before the checkout
sys.path.append(str(ROOT))
from benchmarks.copies import Place, side_by_side  # noqa: E402
from benchmarks.mutate import CONTROL, Mutant, broken, mutants_of  # noqa: E402
from seals import registry  # noqa: E402
from seals.effects.binding import bind_effects  # noqa: E402
from seals.testing import check_effect  # noqa: E402
from seals.testing.calling import call_hook  # noqa: E402
from seals.testing.effect import material_effect  # noqa: E402
from seals.testing.instants import leaves, random_instant  # noqa: E402

KINDS = ("effect", "actuator")
VALUES: dict[str, dict[str, Any]] = {
    "servos": {"kp": 0.2, "kd": 0.004},
    "joint_backlash": {"kp": 5.0},
    "thrust_in_water": {"ratio": 0.8},
}
"""Fields at which a law shows that chooses nothing itself."""
_ASK_NOTHING = (
    "test_effects_libraries.py",
    "test_effects_confounders.py",
    "test_effects_two_hooks.py",
)
"""Test files that name effects without asking for their laws."""
_ROWS = 9
_CHILD = """
import json, pathlib, sys
sys.path.append({root!r})
from benchmarks.mutate import Mutant, first_failures
found = first_failures({mutants!r}, {words!r})
pathlib.Path({found!r}).write_text(json.dumps(found))
"""


class Outcome(NamedTuple):
    """Result of one mutant.

    Args:
        mutant: the broken law.
        changes: whether it differs from the law at random instants.
        test: first unit test that fails; empty for none.
        contract: first words of the contract's refusal; empty for none; None when not asked.
    """

    mutant: Mutant
    changes: bool
    test: str = ""
    contract: str | None = None

    @property
    def kept(self) -> bool:
        """Whether the result is good: mutant caught, control passed, or nothing to catch."""
        caught = bool(self.test or self.contract)
        return not caught if self.mutant.mutation == CONTROL else caught or not self.changes

    def line(self) -> str:
        """One line of the table."""
        m = self.mutant
        found = self.test or ("" if self.contract is None else self.contract)
        if m.mutation == CONTROL:
            word = f"CONTROL FAILS: {found}" if found else "passes"
        elif not self.changes:
            word = "changes nothing"
        else:
            word = found or "SURVIVED"
            if self.test and self.contract:
                word += f"; contract: {self.contract}"
        return f"{m.name:22s} {m.hook:12s} {m.mutation:9s} {word}"


def examined(mutants: Sequence[Mutant], *, contract: bool = False) -> Iterator[Outcome]:
    """Break the laws of one plug-in, one after the other, and run its tests.

    Args:
        mutants: of one plug-in, the control first.
        contract: whether the contract is asked even where a unit test failed.
    """
    real = [m for m in mutants if m.mutation == CONTROL or differs(m)]
    failed = first_failures(real)
    for mutant in mutants:
        control = mutant.mutation == CONTROL
        if mutant not in real:
            yield Outcome(mutant, changes=False)
            continue
        test = failed[str(mutant)]
        refusal = refused(mutant) if contract or not (test or control) else None
        yield Outcome(mutant, changes=not control, test=test, contract=refusal)


def differs(mutant: Mutant) -> bool:
    """Whether the broken law differs from the law at any of some random instants."""
    cls = registry.get(mutant.kind, mutant.name).load()
    effect = material_effect(cls, VALUES.get(mutant.name) or _few_drives(mutant))
    bound = bind_effects({"it": effect}, ["base"])
    params = bound.with_values({}, np.zeros(1), _ROWS).bound[0].params
    memory = np.full((_ROWS, effect.memory_size), 0.1) if effect.memory_size else None

    def outputs() -> list[Any]:
        rng = np.random.default_rng(1)
        return [
            leaves(call_hook(effect, mutant.hook, random_instant(rng, _ROWS), memory, params)[0])
            for _ in range(5)
        ]

    right = outputs()
    with broken(mutant):
        wrong = outputs()
    pairs = zip(itertools.chain(*right), itertools.chain(*wrong), strict=True)
    return any(a is not None and not np.allclose(a, b, rtol=1e-9, atol=1e-12) for a, b in pairs)


def _few_drives(mutant: Mutant) -> dict[str, Any]:
    if mutant.kind != "actuator":
        return {}
    return {"position": [[0.1, 0.2, 0.0], [0.2, -0.1, 0.0]]}


def refused(mutant: Mutant) -> str:
    """First line of the contract error of the broken law; empty when it passes."""
    cls = registry.get(mutant.kind, mutant.name).load()
    values = VALUES.get(mutant.name) if mutant.kind == "actuator" else None
    with broken(mutant):
        try:
            check_effect(cls, values=values, steps=(0.004,), duration=1.0)
        except Exception as refusal:  # a wrong law may end in any error: all of them tell
            return f"{type(refusal).__name__}: {str(refusal).splitlines()[0]}"
    return ""


def first_failures(mutants: Sequence[Mutant]) -> dict[str, str]:
    """First unit test that fails under every mutant of one plug-in; empty when all pass."""
    files = guards(mutants[0])
    if not files:
        return {str(m): "" for m in mutants}
    words = ["-x", "-qq", "--no-header", "--tb=no", "-p", "no:cacheprovider"]
    words += ["--rootdir", str(ROOT), "-c", str(ROOT / "pyproject.toml"), *map(str, files)]
    with tempfile.TemporaryDirectory() as folder:
        found = Path(folder) / "found.json"
        child = _CHILD.format(root=str(ROOT), mutants=mutants, words=words, found=str(found))
        # not from the checkout's root: the installed package is meant, wherever it lies
        done = subprocess.run(
            [sys.executable, "-c", child], cwd=folder, capture_output=True, text=True, check=False
        )
        if done.returncode or not found.exists():
            raise RuntimeError(f"the tests of {mutants[0].name} did not run.\n{done.stderr}")
        named: dict[str, str] = json.loads(found.read_text(encoding="utf-8"))
    return {key: node.rpartition("/")[2] for key, node in named.items()}


def guards(mutant: Mutant) -> list[Path]:
    """Unit tests that name an effect, by its class or in quotes."""
    cls = registry.get(mutant.kind, mutant.name).load()
    named = re.compile(rf"\b{cls.__name__}\b|\"{mutant.name}\"")
    files = sorted((ROOT / "tests" / "unit").glob("test_effects_*.py"))
    return [
        path
        for path in files
        if path.name not in _ASK_NOTHING and named.search(path.read_text(encoding="utf-8"))
    ]


def plugins_of(names: Sequence[str]) -> list[tuple[str, str]]:
    """Kind and name of the named plug-ins, or of all installed effects and actuators."""
    installed = [(kind, name) for kind in KINDS for name in registry.names(kind)]
    for name in names:
        if name not in [known for _, known in installed]:
            # the registry's own refusal names the nearest
            registry.get("effect", name)
    return [(kind, name) for kind, name in installed if not names or name in names]


def reported(name: str, *, contract: bool) -> Counter[str]:
    """Break the laws of one plug-in, print a line for each, and return how many came to what."""
    count: Counter[str] = Counter()
    for kind, found in plugins_of([name]):
        for outcome in examined(mutants_of(kind, found), contract=contract):
            print(outcome.line(), flush=True)
            control = outcome.mutant.mutation == CONTROL
            if control:
                count["controls that fail"] += not outcome.kept
            elif outcome.changes:
                count["caught" if outcome.kept else "survived"] += 1
            else:
                count["change nothing"] += 1
    return count


def _elsewhere(name: str, place: Place, *, contract: bool) -> Counter[str]:
    """Do the same in a process of its own, in a copy: a law is broken for its whole process."""
    line = [sys.executable, str(place.root / "benchmarks" / "mutations.py"), name, "--counts"]
    done = subprocess.run(
        [*line, *["--contract"] * contract],
        env=place.environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    told, _, counts = done.stdout.rstrip().rpartition("\n")
    if done.returncode or not counts.startswith("{"):
        print(f"{name:22s} DID NOT RUN: {done.stderr[-900:]}", flush=True)
        return Counter({"did not run": 1})
    print(told, flush=True)
    return Counter(json.loads(counts))


def main(words: list[str] | None = None) -> int:
    """Break every law and print the tests that failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("effects", nargs="*")
    parser.add_argument("--contract", action="store_true", help="always ask the contract, too")
    parser.add_argument("--jobs", type=int, default=1, help="effects at a time")
    parser.add_argument("--seconds", type=float, default=1e9, help="after which no effect begins")
    parser.add_argument("--counts", action="store_true", help=argparse.SUPPRESS)
    chosen = parser.parse_args(words)
    begin, total = time.perf_counter(), Counter[str]()
    names = list(dict.fromkeys(name for _, name in plugins_of(chosen.effects)))

    def work(name: str, place: Place) -> Counter[str]:
        if place.own is None:
            return reported(name, contract=chosen.contract)
        return _elsewhere(name, place, contract=chosen.contract)

    for name, count in side_by_side(work, names, chosen.jobs, chosen.seconds):
        if count is None:
            print(f"{name:22s} no time", flush=True)
        total += Counter({"no time": 1}) if count is None else count
    if chosen.counts:
        print(json.dumps(total))
        return 0
    told = ", ".join(f"{number} {word}" for word, number in total.items())
    mutants = sum(total[word] for word in ("caught", "survived"))
    seconds = time.perf_counter() - begin
    print(f"{mutants} mutants of {len(names)} plug-ins: {told}; {seconds:.0f} s")
    return 1 if set(total) - {"caught", "change nothing"} else 0


if __name__ == "__main__":
    sys.exit(main())
