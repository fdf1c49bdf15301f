"""Mutation test of input checks (guards): each is removed, and its tests must fail.

    python -m benchmarks.guards [GUARD ...]

The command ends with 1 when the tests of a guard pass without it. The guards are those of
``docs/security.md``.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.guard import BOUNDS, CLASSES, FILES, Guard
from benchmarks.guards_described import DESCRIPTIONS
from benchmarks.guards_page import PAGE
from benchmarks.guards_reading import ROBOTS_AND_TABLES
from benchmarks.guards_runs import RUN_FOLDERS
from benchmarks.guards_states import STORED_STATES

ROOT = Path(__file__).parents[1]
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
    **PAGE,
    **RUN_FOLDERS,
    **STORED_STATES,
    **DESCRIPTIONS,
    "old checkpoints of trainings": Guard(
        "seals.learn.training.checkpoint",
        "if (folder / OLD).exists():",
        "if False:",
        RUNNING,
        "without_running",
        "torch",
    ),
    "form of a training": Guard(
        "seals.learn.training.application",
        "        conform(stored(state), stored(training.state()))\n",
        "",
        FORGED,
        "forged",
        "torchrl",
    ),
    "faults of a training": Guard(
        "seals.learn.training.application",
        "    except Exception as cause:  # parts restore",
        "    except ZeroDivisionError as cause:  # parts restore",
        FORGED,
        "forged",
        "torchrl",
    ),
    "size of a memory": Guard(
        "seals.learn.replay.memory",
        "if not 0 <= protected <= size <= protected + self.capacity or not 0 <= cursor <= size:",
        "if False:",
        FORGED,
        "forged",
        "torchrl",
    ),
    "links in a policy": Guard(
        "seals.learn.policy", " or path.is_symlink()", "", BOUNDS, "policy", "torchrl"
    ),
    "form of a card": Guard(
        "seals.learn.metadata",
        'or metadata.get("format") != form',
        "",
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
        "seals.cli.of_system", "if told_short(error):", "if False:", DISK, "other_wants or absent"
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
    "files of demonstrations": Guard(
        "seals.learn.demonstrations.folder",
        "if path.is_symlink() or name not in promised:",
        "if False:",
        DEMOS,
        "strange_folders",
        "tensordict",
    ),
    "class of demonstrations": Guard(
        "seals.learn.demonstrations.folder",
        'or meta.pop("_type", None) != _PLAIN',
        'or not meta.pop("_type", None)',
        DEMOS,
        "strange_folders",
        "tensordict",
    ),
    "links in HDF5": Guard(
        "seals.learn.demonstrations.exchange",
        "child = group.get(name) if isinstance(group.get(name, getlink=True), h5py.HardLink)",
        "child = group.get(name) if True",
        DEMOS,
        "soft_link",
        "h5py",
    ),
    "files behind HDF5": Guard(
        "seals.learn.demonstrations.exchange",
        "if child.is_virtual or child.external:",
        "if False:",
        DEMOS,
        "strange_hdf5",
        "h5py",
    ),
    "filters of HDF5": Guard(
        "seals.learn.demonstrations.exchange",
        "if codes - set(_FILTERS):",
        "if False:",
        DEMOS,
        "strange_hdf5",
        "h5py",
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
        '    refuse_dangerous(\n        note["words"],',
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
        "seals.config.node_checks", "if key in SPECIAL:", "if False:", FILES, "target_must_be"
    ),
    "targets inside": Guard(
        "seals.config.node_checks",
        "        if not OmegaConf.is_missing(node, key):\n",
        "        if False:\n",
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


def unguarded(name: str) -> tuple[int, str]:
    """Run the tests of a guard without it, in a child process.

    Returns:
        The exit code of pytest, 1 when a test noticed; and its words.
    """
    guard = GUARDS[name]
    words = [
        *("-p", "benchmarks.unguard", "-q", "-x", "-m", "", "-p", "no:cacheprovider"),
        *(guard.tests, "-k", guard.words),
    ]
    done = subprocess.run(
        [sys.executable, "-c", _CHILD.format(root=str(ROOT)), *words],
        cwd=ROOT,
        env={**os.environ, "SEALS_UNGUARD": name},
        capture_output=True,
        text=True,
        timeout=_PATIENCE,
        check=False,
    )
    return done.returncode, done.stdout + done.stderr


def held(code: int, said: str) -> bool:
    """Return whether a test failed without any other error."""
    failed, wrong = (re.search(rf"\b\d+ {what}\b", said) for what in ("failed", "errors?"))
    return code == 1 and failed is not None and wrong is None


def main(names: Sequence[str]) -> int:
    """Remove the named guards, or all, one after the other."""
    unknown = [name for name in names if name not in GUARDS]
    if unknown:
        print(f"there is no guard '{unknown[0]}'; there are: {', '.join(GUARDS)}", file=sys.stderr)
        return 2
    missed = 0
    for name in names or GUARDS:
        code, said = unguarded(name)
        good = held(code, said)
        missed += not good
        print(f"{name:32} {'noticed' if good else f'NOT NOTICED (pytest {code})'}", flush=True)
        if not good:
            print("\n".join(said.splitlines()[-12:]), flush=True)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
