"""Mutation test of input checks (guards): each is removed, and its tests must fail.

    python benchmarks/guards.py [GUARD ...] [--jobs N] [--seconds S]

The command ends with 1 when the tests of a guard pass without it. The guards are those of
``docs/security.md``. With ``--jobs``, each of N guards at a time has a copy of the checkout and of
the installed package.
"""

from __future__ import annotations

import argparse
import importlib.util
import re
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

# at the end: the installed package comes before the checkout
sys.path.append(str(Path(__file__).resolve().parents[1]))
from benchmarks.copies import Place, side_by_side
from benchmarks.guard import BOUNDS, CLASSES, FILES, Guard
from benchmarks.guards_described import DESCRIPTIONS
from benchmarks.guards_imports import IMPORTS
from benchmarks.guards_meshes import BULK
from benchmarks.guards_page import PAGE
from benchmarks.guards_peers import NETWORK
from benchmarks.guards_reading import ROBOTS_AND_TABLES
from benchmarks.guards_roles import ROLES_AND_READERS
from benchmarks.guards_runs import RUN_FOLDERS
from benchmarks.guards_sight import SIGHT
from benchmarks.guards_states import STORED_STATES
from benchmarks.guards_vehicles import VEHICLES

DEMOS, POLICY = "tests/unit/test_learn_demonstrations.py", "tests/unit/test_learn_policy.py"
SWEEP, RUNS = "tests/unit/test_sweep.py", "tests/unit/test_runs_verb.py"
DISK = "tests/unit/test_disk_full.py"
RUNNING, FORGED = "tests/unit/test_learn_training.py", "tests/unit/test_learn_forged.py"


_PATIENCE = 600.0
"""Time after which tests without their guard hang, which is no way to notice [s]."""
_CHILD = """
import resource, sys
# what a guard held back shall fail, not fill the machine
resource.setrlimit(resource.RLIMIT_AS, (1 << 33, 1 << 33))
# the installed package comes before the checkout
sys.path[:] = [*filter(None, sys.path), {root!r}]
import pytest
sys.exit(pytest.main(sys.argv[1:]))
"""


GUARDS: dict[str, Guard] = {
    **ROBOTS_AND_TABLES,
    **IMPORTS,
    **PAGE,
    **NETWORK,
    **RUN_FOLDERS,
    **STORED_STATES,
    **DESCRIPTIONS,
    **SIGHT,
    **ROLES_AND_READERS,
    **VEHICLES,
    **BULK,
    "form of a training": Guard(
        "seals.learn.training.loop",
        "    conform(stored(state), stored(fresh), tables=GROWN)\n",
        "",
        FORGED,
        "forged",
        "torchrl",
    ),
    "faults of a training": Guard(
        "seals.learn.training.loop",
        "    except Exception as cause:  # parts restore",
        "    except ZeroDivisionError as cause:  # parts restore",
        FORGED,
        "forged",
        "torchrl",
    ),
    "size of a memory": Guard(
        "seals.learn.replay",
        "if not 0 <= protected <= size <= protected + self.capacity or not 0 <= cursor <= size:",
        "if False:",
        FORGED,
        "forged",
        "torchrl",
    ),
    "links in a policy": Guard(
        "seals.learn.tensor_file", " or path.is_symlink()", "", BOUNDS, "policy", "torchrl"
    ),
    "form of a card": Guard(
        "seals.learn.metadata",
        'if metadata.get("format") != form:',
        "if False:",
        POLICY,
        "strange_policies",
        "torchrl",
    ),
    "memory of a card": Guard(
        "seals.learn.policy",
        'with torch.device("meta"):',
        "if True:",
        POLICY,
        "strange_policies",
        "torchrl",
    ),
    "any description of a network": Guard(
        "seals.learn.networks",
        "except _UNFIT as cause:",
        "except KeyError as cause:",
        POLICY,
        "strange_policies",
        "torchrl",
    ),
    "want of memory": Guard(
        "seals.cli.of_system", "if _told_short(error):", "if False:", DISK, "other_wants or absent"
    ),
    "no room for words": Guard(
        "seals.cli.of_system",
        "except (MemoryError, ImportError):",
        "except KeyboardInterrupt:",
        DISK,
        "no_room_for_words",
    ),
    "failing disk": Guard(
        "seals.cli.of_system",
        "if error.errno in (errno.EIO, None):",
        "if False:",
        DISK,
        "other_wants",
    ),
    "size of a card": Guard(
        "seals.learn.metadata",
        "if path.stat().st_size > _MOST_BYTES:",
        "if False:",
        DEMOS,
        "strange_folders",
        "tensordict",
    ),
    "links in place of arrays": Guard(
        "seals.learn.tensor_file",
        " or path.is_symlink()",
        "",
        DEMOS,
        "strange_folders",
        "tensordict",
    ),
    "size of arrays": Guard(
        "seals.learn.tensor_file",
        "if path.stat().st_size > most:",
        "if False:",
        DEMOS,
        "strange_folders",
        "tensordict",
    ),
    "arrays of demonstrations": Guard(
        "seals.learn.demonstrations.folder",
        "if given != wanted:",
        "if False:",
        DEMOS,
        "strange_folders",
        "tensordict",
    ),
    "words of a file": Guard(
        "seals.config.overrides",
        'if _DANGER.search(word) or not ("=" in word or word.startswith("~")):',
        "if False:",
        FILES,
        "words",
    ),
    "words of a card": Guard(
        "seals.cli.evaluate",
        "    refuse_dangerous(\n        given,",
        "    dict(",
        FILES,
        "policy_card",
    ),
    "words of a sweep": Guard(
        "seals.cli.sweep",
        "    refuse_dangerous(\n        begun_words,",
        "    dict(",
        SWEEP,
        "strangers_sweep",
    ),
    "measures of a run": Guard(
        "seals.sweep.metrics",
        'return bool(name) and not set(name) & set("/\\\\\\0") and name != ".."',
        "return True",
        RUNS,
        "stays_inside",
    ),
    "target of a plug-in": Guard(
        "seals.config.checks",
        "if made and key in SPECIAL:",
        "if False:",
        FILES,
        "target_must_be",
    ),
    "targets inside": Guard(
        "seals.config.checks",
        "        waiting += reversed(below)\n",
        "",
        CLASSES,
        "class_deep_inside or special_keys or behind_a_reference",
    ),
    "folder of configuration": Guard(
        "seals.config.strangers",
        "        refuse_commands(folder)\n",
        "        pass\n",
        CLASSES,
        "set",
    ),
    "section hydra": Guard(
        "seals.config.strangers", "if _HYDRA.search(str(key)):", "if False:", CLASSES, "sets_values"
    ),
    "packages of configuration": Guard(
        "seals.config.strangers", "if _HYDRA.search(package):", "if False:", CLASSES, "sets_values"
    ),
    "choices of configuration": Guard(
        "seals.config.strangers", "if _HYDRA.search(word):", "if False:", CLASSES, "sets_values"
    ),
    "folders of configuration": Guard(
        "seals.config.strangers",
        "if any(_HYDRA.search(part)",
        "if any(False",
        CLASSES,
        "sets_values",
    ),
    "classes of configuration": Guard(
        "seals.config.strangers",
        "if key in SPECIAL and not (key == TARGET and is_plugin(str(value[key]))):",
        "if False:",
        CLASSES,
        "sets_values",
    ),
    "ways out of configuration": Guard(
        "seals.config.strangers", 'if ".." in word:', "if False:", CLASSES, "sets_values"
    ),
    "links out of configuration": Guard(
        "seals.config.strangers", "if path.is_symlink() and", "if False and", CLASSES, "links"
    ),
    "search path": Guard(
        "seals.config.strangers", ".startswith(_SEARCH)", ".startswith('?')", CLASSES, "every_way"
    ),
}
"""Every guard by name."""


def unguarded(name: str, place: Place | None = None) -> tuple[int, str]:
    """Run the tests of a guard without it, in a child process.

    Args:
        name: of the guard.
        place: checkout to run in; by default this one.

    Returns:
        The exit code of pytest, 1 when a test noticed; and its words.
    """
    guard, place = GUARDS[name], place or Place()
    words = [
        *("-p", "benchmarks.unguard", "-q", "-x", "-m", "", "-p", "no:cacheprovider"),
        *(guard.tests, "-k", guard.words),
    ]
    try:
        done = subprocess.run(
            [sys.executable, "-c", _CHILD.format(root=str(place.root)), *words],
            cwd=place.root,
            env={**place.environment(), "SEALS_UNGUARD": name},
            capture_output=True,
            text=True,
            timeout=_PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return -1, f"no end within {_PATIENCE:.0f} s"
    return done.returncode, done.stdout + done.stderr


def held(code: int, said: str) -> bool:
    """Return whether a test failed without any other error."""
    failed, wrong = (re.search(rf"\b\d+ {what}\b", said) for what in ("failed", "errors?"))
    return code == 1 and failed is not None and wrong is None


def _lacking(name: str) -> str:
    """Return the package without which the tests of a guard are left out; empty for none."""
    needed = GUARDS[name].needs
    return needed if needed and importlib.util.find_spec(needed) is None else ""


def _word(code: int, said: str) -> str:
    if code == 0 and re.search(r"\b\d+ skipped\b", said) and not re.search(r"\b\d+ passed", said):
        return "left out, with its tests"  # which say why, and need what is not installed
    return "noticed" if held(code, said) else "NOT NOTICED"


def main(words: Sequence[str] | None = None) -> int:
    """Remove the named guards, or all."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("guard", nargs="*", metavar="GUARD")
    parser.add_argument("--jobs", type=int, default=1, help="guards at a time")
    parser.add_argument("--seconds", type=float, default=1e9, help="after which no guard begins")
    given = parser.parse_args(words)
    unknown = [name for name in given.guard if name not in GUARDS]
    if unknown:
        parser.error(f"there is no guard '{unknown[0]}'; there are: {', '.join(GUARDS)}")
    begin, every, count = time.perf_counter(), given.guard or list(GUARDS), Counter[str]()
    able = [name for name in every if not _lacking(name)]
    for name in every:
        if name not in able:
            count["left out"] += 1
            print(f"{name:32} left out: {_lacking(name)} is not installed", flush=True)
    for name, found in side_by_side(unguarded, able, given.jobs, given.seconds):
        code, said = found or (0, "")
        word = "no time" if found is None else _word(code, said)
        count[word] += 1
        print(f"{name:32} {word}{f' (pytest {code})' if word == 'NOT NOTICED' else ''}", flush=True)
        if word == "NOT NOTICED":
            print("\n".join(said.splitlines()[-12:]), flush=True)
    told = ", ".join(f"{number} {word}" for word, number in count.items())
    print(f"{len(every)} guards: {told}; {time.perf_counter() - begin:.0f} s")
    return 1 if count["NOT NOTICED"] or count["no time"] else 0


if __name__ == "__main__":
    sys.exit(main())
