"""Every numeric key of every installed experiment at 0, -1, 1e300 and nan.

    python benchmarks/fuzz_numbers.py [EXPERIMENT ...] [--steps 3] [--every | --once]

Each value is set alone, in a forked process of bounded time and memory: it must be refused in
words, or the run must be built and take some steps. Any other end is printed; the command then ends
with 1. A key of a class that an earlier experiment had is tried with one value, and only built:
`--every` runs it with all, `--once` leaves it out.
"""

from __future__ import annotations

import argparse
import os
import resource
import signal
import sys
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# at the end: the installed package comes before the checkout
sys.path.append(str(Path(__file__).parents[1]))

VALUES = (0.0, -1.0, 1e300, float("nan"))
LONGEST = 30
"""Seconds of the processor that one value may take."""
STUCK = 300.0
"""Seconds of the clock after which a value that takes no processor hangs: others work here, too."""
MOST_MEMORY = 6 << 30
"""Address space of one value, libraries and all [byte]."""
REFUSED, RAN, BUILT, NUMBERS = "refused", "ran", "built", "refused as numbers"
WORDS = (RAN, REFUSED, NUMBERS, BUILT)
"""Allowed ends by the exit code of the forked process."""


class Enough:
    """Recorder that ends a run after some steps, as an interruption does."""

    def __init__(self, steps: int) -> None:
        self.left = steps

    def start(self, world: Any, folder: Path | None) -> None:
        """Begin."""

    def record(self, moment: Any) -> None:
        """Count a step.

        Raises:
            KeyboardInterrupt: it was the last one.
        """
        self.left -= 1
        if self.left <= 0:
            raise KeyboardInterrupt

    def close(self) -> None:
        """End."""


def numeric_keys(node: Any, key: str = "", target: str = "") -> Iterator[tuple[str, str]]:
    """Yield every numeric key, and what it is by the class that owns it.

    Args:
        node: plain mapping, list or value of a configuration.
        key: of the node, with dots.
        target: class that owns the node.
    """
    if isinstance(node, dict):
        owner = str(node.get("_target_", target))
        for name, inner in node.items():
            if name != "hydra":
                yield from numeric_keys(inner, f"{key}.{name}" if key else str(name), owner)
    elif isinstance(node, list):
        for k, inner in enumerate(node):
            yield from numeric_keys(inner, f"{key}.{k}", target)
    elif isinstance(node, int | float) and not isinstance(node, bool):
        yield key, f"{target}:{key if not target else key.rpartition('.')[2]}:{type(node).__name__}"


def attempt(config: Any, key: str, value: float, steps: int) -> str:
    """Set a key and build the run; return how it ended, one of `WORDS`.

    Args:
        config: composed.
        key: of the number, with dots.
        value: to set.
        steps: of the run; with 0 it is only built.

    Raises:
        Exception: whatever is no refusal.
    """
    from omegaconf import OmegaConf
    from omegaconf.errors import OmegaConfBaseException

    from seals.errors import SealsError
    from seals.run.build import build_run
    from seals.run.simulation import simulate
    from seals.sound_numbers import numeric_fault

    try:
        whole = isinstance(OmegaConf.select(config, key), int) and value == value  # noqa: PLR0124
        OmegaConf.update(config, key, int(value) if whole else value)
        settings = build_run(config)
        if steps == 0:
            return BUILT
        record = simulate(settings, recorders=[Enough(steps)])  # type: ignore[list-item]
        if record.error is not None and not isinstance(record.error, KeyboardInterrupt):
            raise record.error
    except (SealsError, OmegaConfBaseException):
        return REFUSED
    except Exception as error:
        if numeric_fault(error) is None:
            raise
        return NUMBERS
    return RAN


def apart(config: Any, key: str, value: float, steps: int, told: Path) -> str:
    """Return how `attempt` ended in a forked process; words of a defect where it was none.

    Args:
        config: see `attempt`.
        key: see `attempt`.
        value: see `attempt`.
        steps: see `attempt`.
        told: file for what the process prints.
    """
    child = os.fork()
    if child == 0:
        code = 99
        try:
            stream = os.open(told, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(stream, 1)
            os.dup2(stream, 2)
            warnings.simplefilter("ignore")
            resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
            resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST))
            code = WORDS.index(attempt(config, key, value, steps))
        except BaseException:
            traceback.print_exc()
            sys.stderr.flush()
        finally:
            os._exit(code)
    end = time.monotonic() + STUCK
    while time.monotonic() < end:
        done, state = os.waitpid(child, os.WNOHANG)
        if done:
            code = os.waitstatus_to_exitcode(state)
            if 0 <= code < len(WORDS):
                return WORDS[code]
            lines = told.read_text(encoding="utf-8", errors="replace").splitlines()
            return " | ".join([f"exit code {code}", *lines[-3:]])
        time.sleep(0.005)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return f"no end within {STUCK:.0f} s"


def main(words: Sequence[str] | None = None) -> int:
    """Try the named experiments, or all."""
    import tempfile

    from omegaconf import OmegaConf

    from seals.config.compose import compose
    from seals.config.roots import experiments

    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("experiment", nargs="*", metavar="EXPERIMENT")
    parser.add_argument("--steps", type=int, default=3, help="of each run")
    parser.add_argument("--every", action="store_true", help="run keys that were run before")
    parser.add_argument("--once", action="store_true", help="leave out what was run before")
    given = parser.parse_args(words)
    roots, count, known, faults = experiments(), Counter[str](), set[str](), list[str]()
    with tempfile.TemporaryDirectory() as folder:
        for name in given.experiment or roots:
            begin, here = time.perf_counter(), Counter[str]()
            config = compose([f"experiment={name}"], root=roots[name])
            keys = list(numeric_keys(OmegaConf.to_container(config, resolve=True)))
            count["keys"] += len(keys)
            # what is imported once is there for every forked process
            attempt(config.copy(), "time.step", config.time.step, 1)
            for k, (key, what) in enumerate(keys):
                again = what in known and not given.every
                if again and given.once:
                    here["left out"] += 4
                    continue
                for value in (VALUES[k % 4],) if again else VALUES:
                    steps = 0 if again else given.steps
                    end = apart(config, key, value, steps, Path(folder) / "told")
                    here[end if end in WORDS else "DEFECT"] += 1
                    if end not in WORDS:
                        faults.append(f"{name} {key}={value:g}: {end}")
                        print(faults[-1], flush=True)
                known.add(what)
            count.update(here)
            told = ", ".join(f"{number} {word}" for word, number in here.items())
            print(
                f"{name}: {len(keys)} keys, {told}; {time.perf_counter() - begin:.0f} s", flush=True
            )
    print(", ".join(f"{number} {word}" for word, number in count.items()))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
