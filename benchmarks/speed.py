"""Speed of ten cases beside the bare engine in the same run: ``python benchmarks/speed.py``.

Every case runs in a process of its own, its blocks in turn with blocks of the engine's own step of
the same scene. What counts are ratios, for the pace of a machine moves: the share of the engine's
pace (of a robot that stands or walks: of one step of its own, through the same states), the slow
steps beside the usual one, and a start, machine code made anew, in steps of the engine.
``build/speed.json`` keeps the last table; what fell since is said, and ends with 1.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

KEPT = Path("build/speed.json")
CASES = (
    *("chain in air", "chain crossing", "aam in air", "aam crossing", "crab on the bottom"),
    *("aam in air, pybullet", "crab on the bottom, pybullet"),
    *("gymnasium Hover", "gymnasium Reach", "gymnasium Hover, 64"),
)
TOLERANCE = {"share": 0.8, "slow": 1.5, "memory": 1.2, "start": 1.5}
"""Factor against the last table beyond which a number has fallen: `share` down, others up. Blocks
of one case in turn differ by a tenth on a quiet machine, 95th percentiles by a third."""
PERIOD = 10
"""Steps of the engine in a control step of an environment."""
MANY = 64
CONTROLS = 50
"""Control steps of a block."""
STEP = 0.004
"""Step of all cases [s]."""


class Row(NamedTuple):
    """Measurements of one case.

    Args:
        pace: steps a second of processor time; of environments control steps of all of them.
        engine: the same of the bare engine and one robot, in control steps of as many steps of it.
        share: of the engine's pace [1], median of blocks in turn.
        slow: 95th percentile of a step beside the median [1].
        real: simulated time by processor time [1].
        memory: largest of the process [MB].
        start: processor time from the settings to the first block, without a cache [s].
        begin: the same in thousands of the engine's steps.
        code: part of the start that goes into laws: following, writing and compiling them [s].
    """

    pace: float
    engine: float
    share: float
    slow: float
    real: float
    memory: float
    start: float
    begin: float
    code: float = 0.0


class Measured(NamedTuple):
    """What is measured: one step, the world whose engine is the measure, and their relation.

    Args:
        step: makes one.
        world: of the engine.
        steps: of a block.
        each: steps of the engine in one of these.
        again: begins anew before a block.
        robots: that a step moves.
    """

    step: Callable[[], None]
    world: Any
    steps: int
    each: int
    again: Callable[[], None]
    robots: int = 1


def built(case: str, folder: Path) -> Measured:
    """Return a case that is ready to be measured."""
    kind, _, engine = case.partition(", ")
    if kind.startswith("gymnasium"):
        return _environment(kind.split()[1], MANY if engine == str(MANY) else 1)
    return _world(kind, engine or "mujoco", folder)


def _world(kind: str, engine: str, folder: Path) -> Measured:
    import world as worlds

    from seals import registry
    from seals.run import build_world, initial_configuration

    height = 0.0 if kind.endswith("crossing") else 5.0
    if kind.startswith("crab"):
        settings = worlds.crab_settings()
    elif kind.startswith("chain"):
        settings = worlds.chain_settings(folder, added_mass=True, height=height)
    else:
        settings = worlds.aam_settings(added_mass=True, height=height)
    settings.backend = registry.get("backend", engine).load()(compiled="true")
    made = build_world(settings)
    start = {"robot": initial_configuration(settings, made.actors["robot"].robot)}

    def again() -> None:
        made.reset(start)
        made.advance(worlds.WALKING if kind.startswith("crab") else 1)

    return Measured(lambda: made.advance(1), made, worlds.BLOCK, 1, again)


def _environment(name: str, count: int) -> Measured:
    import gymnasium
    import numpy as np
    import torch

    import seals.envs  # noqa: F401  it registers the tasks

    torch.set_num_threads(1)
    task = f"SEALS/{name}-v0"
    rng = np.random.default_rng(0)
    if count == 1:
        one: Any = gymnasium.make(task, disable_env_checker=True).unwrapped
        world = one._batched.simulator.worlds[0].world

        def step() -> None:
            *_, terminated, truncated, _ = one.step(rng.uniform(-1.0, 1.0, one.action_space.shape))
            if terminated or truncated:
                one.reset(seed=1)

        return Measured(step, world, CONTROLS, PERIOD, lambda: one.reset(seed=0) and None)
    many: Any = gymnasium.make_vec(task, count)
    world = _world("aam in air", "mujoco", Path()).world
    shape = many.action_space.shape
    return Measured(
        lambda: many.step(rng.uniform(-1.0, 1.0, shape).astype(np.float32)) and None,
        *(world, CONTROLS, PERIOD),
        lambda: many.reset(seed=0) and None,
        robots=count,
    )


def measured(case: str, repeats: int) -> Row:
    """Measure a case in this process."""
    import world as worlds

    begin, code = time.process_time(), _timed_compiler()
    with tempfile.TemporaryDirectory() as folder:
        found = built(case, Path(folder))
        _block(found)
        start, coded = time.process_time() - begin, code[0]
        _block(found)
        pairs = [(_block(found), worlds.bare(found.world) / found.each) for _ in range(repeats)]
        found.again()
        spans = [_span(found.step) for _ in range(4 * found.steps)]
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    pace, engine = (statistics.median(column) for column in zip(*pairs, strict=True))
    slow = statistics.quantiles(spans, n=20)[-1] / statistics.median(spans)
    share = statistics.median(a / b for a, b in pairs)
    real, begun = pace * found.each * STEP, start * engine * found.each / 1000.0
    return Row(pace, engine, share, slow, real, memory, start, begun, coded)


def _timed_compiler() -> list[float]:
    """Return processor time spent on machine code of laws from now on [s], kept up to date."""
    from seals.scalar_compiler import kernel, rows

    spent, inside = [0.0], [False]

    def timed(work: Callable[..., Any]) -> Callable[..., Any]:
        def done(*given: Any) -> Any:
            if inside[0]:
                return work(*given)
            inside[0], begin = True, time.process_time()
            try:
                return work(*given)
            finally:
                inside[0] = False
                spent[0] += time.process_time() - begin

        return done

    for module in (kernel, rows):
        for name in ("followed", "text_of", "_machine_code"):
            if hasattr(module, name):
                setattr(module, name, timed(getattr(module, name)))
    return spent


def _block(found: Measured) -> float:
    """Return the steps a second of a block."""
    found.again()
    begin = time.process_time()
    if found.each == 1:
        found.world.advance(found.steps)
    else:
        for _ in range(found.steps):
            found.step()
    return found.robots * found.steps / (time.process_time() - begin)


def _span(step: Callable[[], None]) -> float:
    begin = time.process_time()
    step()
    return time.process_time() - begin


def alone(case: str, repeats: int) -> Row:
    """Measure a case in a process of its own, without a cache of machine code."""
    with tempfile.TemporaryDirectory() as cache:
        done = subprocess.run(
            [sys.executable, __file__, "--one", case, "--repeats", str(repeats)],
            env={**os.environ, "XDG_CACHE_HOME": cache},
            capture_output=True,
            text=True,
            check=False,
        )
    if done.returncode:
        raise SystemExit(f"{case}: {done.stderr.strip()[-2000:]}")
    return Row(**json.loads(done.stdout.splitlines()[-1]))


def table(rows: Mapping[str, Row]) -> str:
    """Return the table.

    Example:
        >>> print(table({"a": Row(50.0, 100.0, 0.5, 1.2, 0.2, 90.0, 1.5, 0.15, 0.9)}))
        | case | steps/s | bare engine | share | 95 % of steps | real time | memory | start | laws |
        |---|---|---|---|---|---|---|---|---|
        | a | 50 | 100 | 0.500 | 1.2 medians | 0.2 | 90 MB | 1.5 s, 0.15 k steps | 0.9 s |
    """
    heads = ("case", "steps/s", "bare engine", "share", "95 % of steps", "real time", "memory")
    lines = ["| " + " | ".join((*heads, "start", "laws")) + " |", "|---" * 9 + "|"]
    for case, row in rows.items():
        words = (
            *(case, f"{row.pace:,.0f}", f"{row.engine:,.0f}", f"{row.share:.3f}"),
            *(f"{row.slow:.3g} medians", f"{row.real:.3g}", f"{row.memory:.0f} MB"),
            *(f"{row.start:.3g} s, {row.begin:.3g} k steps", f"{row.code:.3g} s"),
        )
        lines.append("| " + " | ".join(words) + " |")
    return "\n".join(lines)


def fallen(rows: Mapping[str, Row], last: Mapping[str, Sequence[float]]) -> list[str]:
    """Return what is worse than in the last table, by ratios.

    Example:
        >>> now = Row(50.0, 100.0, 0.5, 1.2, 0.2, 90.0, 1.5, 0.15, 0.9)
        >>> fallen({"a": now}, {"a": now._replace(share=0.8)})
        ['a: share of the engine 0.5, was 0.8']
        >>> fallen({"a": now}, {"a": now._replace(share=0.6), "b": now})
        []
    """
    found = []
    for case, row in rows.items():
        if case not in last:
            continue
        before = Row(*last[case])
        if row.share < TOLERANCE["share"] * before.share:
            found.append(f"{case}: share of the engine {row.share:.3g}, was {before.share:.3g}")
        for key, words, now, then in (
            ("slow", "95 % of steps in medians", row.slow, before.slow),
            ("memory", "memory in MB", row.memory, before.memory),
            ("start", "start in thousands of the engine's steps", row.begin, before.begin),
        ):
            if now > TOLERANCE[key] * then:
                found.append(f"{case}: {words} {now:.3g}, was {then:.3g}")
    return found


def main() -> int:
    """Measure, print the table and what fell, and keep the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5, help="blocks of each case")
    parser.add_argument("--case", nargs="+", choices=CASES, default=list(CASES))
    parser.add_argument("--kept", type=Path, default=KEPT, help="the last table")
    parser.add_argument("--one", choices=CASES, help="measure in this process, print numbers")
    given = parser.parse_args()
    if given.one:
        print(json.dumps(measured(given.one, given.repeats)._asdict()))
        return 0
    import machine

    print(machine.describe())
    rows: dict[str, Row] = {}
    for case in given.case:
        if "pybullet" in case and not _there("pybullet"):
            print(f"{case}: PyBullet is not installed")
            continue
        rows[case] = alone(case, given.repeats)
        # a long table is seen to grow
        print(table(rows).splitlines()[-1] if len(rows) > 1 else table(rows), flush=True)
    last = json.loads(given.kept.read_text("utf-8")) if given.kept.is_file() else {}
    worse = fallen(rows, last)
    for line in worse:
        print(line)
    given.kept.parent.mkdir(parents=True, exist_ok=True)
    whole = {**last, **{case: list(row) for case, row in rows.items()}}
    given.kept.write_text(json.dumps(whole, indent=1), encoding="utf-8")
    return 1 if worse else 0


def _there(package: str) -> bool:
    import importlib.util

    return importlib.util.find_spec(package) is not None


if __name__ == "__main__":
    import machine

    machine.one_thread()
    sys.exit(main())
