"""Successes of policies on held-out starts, in full worlds: ``python benchmarks/judged.py``.

As ``seals evaluate`` counts them, with the starts dealt to processes: a hundred catches take a
quarter of an hour on one core. One line for each policy in each environment; ``--out`` keeps
who succeeded from which start, and after how many steps.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import sys
from pathlib import Path
from typing import Any

WORDS = "words of the configuration, as for seals evaluate: backend=mujoco task.ends=true ..."


def episodes(job: tuple[str, list[str], list[int]]) -> list[tuple[int, bool, int]]:
    """Return seed, success and length of the episodes of one process."""
    import torch

    from seals.config.compose import compose
    from seals.learn.environments import batched_of
    from seals.learn.evaluation.policies import policy_of
    from seals.learn.training.scoring import score

    policy, words, seeds = job
    torch.set_num_threads(1)
    environment = batched_of(compose(words, root="evaluate"), count=1)
    try:
        found = score(environment, policy_of(policy, environment, device="cpu"), seeds)
    finally:
        environment.close()
    columns = found.seed, found.success, found.length
    return [(int(s), bool(w), int(n)) for s, w, n in zip(*columns, strict=True)]


def judged(policy: str, words: list[str], *, count: int, pool: Any, parts: int) -> dict[str, Any]:
    """Return the successes of one policy from the first held-out starts."""
    from seals.learn.starts import held_out_seeds
    from seals.learn.statistics.interval import wilson

    seeds = held_out_seeds(count)
    jobs = [(policy, words, seeds[k::parts]) for k in range(parts) if seeds[k::parts]]
    rows = sorted(row for part in pool.map(episodes, jobs) for row in part)
    won = sum(success for _, success, _ in rows)
    bounds = wilson(won, count)
    lengths = sorted(length for _, success, length in rows if success)
    return {
        "policy": policy,
        "words": words,
        "episodes": count,
        "won": won,
        "low": bounds.low,
        "high": bounds.high,
        "median_steps": lengths[len(lengths) // 2] if lengths else None,
        "rows": rows,
    }


def main(given: list[str] | None = None) -> int:
    """Judge, and print one line a case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("words", nargs="*", help=WORDS)
    parser.add_argument("--env", action="append", default=[])
    parser.add_argument("--policy", action="append", default=[])
    parser.add_argument("--episodes", type=int, default=100)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--out", type=Path)
    chosen = parser.parse_args(given)
    found = []
    context = multiprocessing.get_context("spawn")
    with context.Pool(chosen.processes) as pool:
        for policy in chosen.policy or ["scripted"]:
            for env in chosen.env or ["catch", "catch_fleeing"]:
                words = [f"env={env}", *chosen.words]
                case = judged(
                    policy, words, count=chosen.episodes, pool=pool, parts=chosen.processes
                )
                found.append(case)
                print(
                    f"{env}, {policy}: {case['won']} of {case['episodes']} "
                    f"({case['low']:.0%} to {case['high']:.0%}), "
                    f"median {case['median_steps']} steps",
                    flush=True,
                )
                if chosen.out is not None:
                    chosen.out.write_text(json.dumps(found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
