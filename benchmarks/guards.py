"""Would the tests notice a guard that is gone? Every guard is taken out, and its tests are run.

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
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
FILES, CLASSES = "tests/unit/test_guards.py", "tests/unit/test_guards_classes.py"
BROKEN, RECORDINGS = "tests/unit/test_logs_broken.py", "tests/unit/test_logs_recordings.py"
DEMOS, POLICY = "tests/unit/test_learn_demonstrations.py", "tests/unit/test_learn_policy.py"
ROBOT, ULOG = "tests/unit/test_robot_broken.py", "tests/unit/test_logs_ulog.py"
FOUND, VIEW = "tests/unit/test_fuzz_findings.py", "tests/unit/test_view_session.py"
SWEEP, RUNS = "tests/unit/test_sweep.py", "tests/unit/test_runs_verb.py"
BOUNDS, RUNNING = "tests/unit/test_guards_bounds.py", "tests/unit/test_learn_training.py"


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


class Guard(NamedTuple):
    """One guard and the tests that hold it.

    Args:
        module: that it stands in.
        text: of the guard, once in its module.
        without: what stands there when it is gone.
        tests: file of the tests.
        words: what their names contain, as for ``pytest -k``.
        needs: package without which the tests are left out; empty for none.
    """

    module: str
    text: str
    without: str
    tests: str
    words: str
    needs: str = ""


_XML = 'if re.search(r"<!\\s*(DOCTYPE|ENTITY)", text, re.IGNORECASE):'
_YAML = "seals.untrusted_io"
GUARDS: dict[str, Guard] = {
    "entities of a URDF": Guard("seals.robot.urdf", _XML, "if False:", FILES, "entities_of_a_urdf"),
    "zero bytes of a URDF": Guard(
        "seals.robot.urdf", 'if "\\0" in text:', "if False:", FILES, "entities_of_a_urdf"
    ),
    "entities of a URDF taken over": Guard(
        "seals.scaffold.takeover", _XML, "if False:", BOUNDS, "taken_over"
    ),
    "entities of a mesh": Guard(
        "seals.hydrostatics.formats", "if _ENTITY.search(raw) or", "if", FILES, "entities_of_a_mesh"
    ),
    "zero bytes of a mesh": Guard(
        "seals.hydrostatics.formats", ' or b"\\0" in raw', "", FILES, "entities_of_a_mesh"
    ),
    "entities of a manifest": Guard(
        "seals.scaffold.resources", 'if "<!" in text', 'if "<?!" in text', FILES, "manifest"
    ),
    "macros": Guard(
        "seals.robot.macros", "_INSIDE.match(name)", "False", CLASSES, "macro", "xacro"
    ),
    "formats of meshes": Guard(
        "seals.hydrostatics.formats", "not in FORMATS", "is None", FILES, "plain_meshes"
    ),
    "meshes inside": Guard(
        "seals.robot.meshes",
        "if not target.is_relative_to(_root(folder)):",
        "if False:",
        ROBOT,
        "outside",
    ),
    "hulls inside": Guard(
        "seals.robot.build", ".resolve().is_relative_to(folder)", "", ROBOT, "hull_mesh_outside"
    ),
    "size of meshes": Guard(
        "seals.robot.meshes", "if max(size, declared) > MOST_BYTES:", "if False:", ROBOT, "huge"
    ),
    "work on broken meshes": Guard(
        "seals.hydrostatics.meshes",
        "MOST_WORK // len(even)",
        "4 * MOST_WORK // len(even)",
        FOUND,
        "thin_broken",
    ),
    "URDF inside": Guard(
        "seals.robot.robot_file",
        "if not (folder / urdf).resolve().is_relative_to(folder.resolve()):",
        "if False:",
        CLASSES,
        "stays_in_itself",
    ),
    "references of a robot": Guard(
        "seals.robot.robot_file",
        "    refuse_references(raw, where=str(path))\n",
        "",
        CLASSES,
        "stays_in_itself",
    ),
    "references of a model": Guard(
        "seals.config.overlay",
        "    refuse_references(raw, where=str(path))\n",
        "",
        CLASSES,
        "looks_nothing_up",
    ),
    "names of parts": Guard(
        "seals.robot.robot_file",
        "not _NAME.fullmatch(str(name))",
        "False",
        CLASSES,
        "stays_in_itself",
    ),
    "safe YAML": Guard(
        _YAML,
        'loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)',
        "loader = yaml.UnsafeLoader",
        FILES,
        "yaml",
    ),
    "depth of YAML": Guard(_YAML, "if depth > _DEEPEST or", "if", BOUNDS, "measured_first"),
    "aliases of YAML": Guard(_YAML, "        _unfold(content)\n", "", FILES, "yaml_that_unfolds"),
    "size of YAML": Guard(
        _YAML, "_MOST_META_BYTES = 1 << 20", "_MOST_META_BYTES = 1 << 40", BROKEN, "meta"
    ),
    "ordinary files": Guard(_YAML, "if not file.is_file():", "if False:", BROKEN, "pipe"),
    "size of files": Guard(_YAML, "if size > most:", "if False:", BOUNDS, "size_of_a_file"),
    "packed files": Guard(_YAML, "if unpacker.unconsumed_tail:", "if False:", BROKEN, "gzip_bomb"),
    "values of a table": Guard(
        "seals.logs.table", "if rows * max(width, 1) > MOST_VALUES:", "if False:", BOUNDS, "table"
    ),
    "declared chunks": Guard(
        "seals.plugins.readers.mcap_file",
        "if size > _MOST_RECORD:",
        "if False:",
        BOUNDS,
        "not_unpacked",
        "mcap",
    ),
    "declared records": Guard(
        "seals.plugins.readers.mcap_file",
        "record_size_limit=_MOST_RECORD",
        "record_size_limit=None",
        BOUNDS,
        "not_read",
        "mcap",
    ),
    "packed streams": Guard(
        "seals.plugins.readers.mcap_file",
        "max_length=size + 1",
        "max_length=-1",
        BOUNDS,
        "stream",
        "lz4",
    ),
    "views of a database": Guard(
        "seals.plugins.readers.rosbag2_file",
        '.startswith("TABLE CREATE TABLE")',
        '.startswith("")',
        RECORDINGS,
        "data_only",
        "rosbags",
    ),
    "computed columns": Guard(
        "seals.plugins.readers.rosbag2_file",
        "if row[6] == 0",
        "",
        RECORDINGS,
        "data_only",
        "rosbags",
    ),
    "read-only database": Guard(
        "seals.plugins.readers.rosbag2_file", "?mode=ro&immutable=1", "", BOUNDS, "read_only"
    ),
    "files of a bag": Guard(
        "seals.plugins.readers.rosbag2_file",
        " or not file.resolve().is_relative_to(place.resolve())",
        "",
        RECORDINGS,
        "lie_in_its_folder",
        "rosbags",
    ),
    "fields of a ULog": Guard(
        "seals.plugins.readers.ulog_file",
        "if len(layout) > _MOST_FIELDS:",
        "if False:",
        BOUNDS,
        "fields",
    ),
    "depth of a ULog": Guard(
        "seals.plugins.readers.ulog_file", " or depth > _DEEPEST", "", ULOG, "itself"
    ),
    "objects in an array": Guard(
        "seals.logs.arrays", 'if dtype.kind not in "fiu":', "if False:", BROKEN, "pickled_array"
    ),
    "declared arrays": Guard(
        "seals.logs.arrays", "if declared != held or", "if", BROKEN, "declares_too_much"
    ),
    "names in a pickle": Guard(
        "seals.run.unpickling", "isinstance(found, type) and", "", FILES, "stranger_runs_nothing"
    ),
    "imports in a pickle": Guard(
        "seals.run.unpickling", " and found.__module__ == module", "", BOUNDS, "module_imports"
    ),
    "homes in a pickle": Guard(
        "seals.run.unpickling",
        'module.partition(".")[0] in _homes()',
        "True",
        BOUNDS,
        "classes_of_the_system",
    ),
    "bytes of a pickle": Guard(
        "seals.run.unpickling",
        "if not isinstance(content, bytes | bytearray):",
        "if False:",
        FOUND,
        "bytes_out_of_a_number",
    ),
    "checkpoint of a training": Guard(
        "seals.learn.training.checkpoint",
        "weights_only=True",
        "weights_only=False",
        RUNNING,
        "without_running",
        "torch",
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
        "seals.config.targets", "if key in SPECIAL:", "if False:", FILES, "target_must_be"
    ),
    "targets inside": Guard(
        "seals.config.targets",
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
    "host of the page": Guard(
        "seals.view.settings", 'host: str = "127.0.0.1"', 'host: str = "0.0.0.0"', FILES, "the_page"
    ),
    "sharing the page": Guard(
        "seals.plugins.viewers.browser.server",
        "Private(host=host",
        "viser.ViserServer(host=host",
        VIEW,
        "this_machine_alone",
        "viser",
    ),
    "range of the page": Guard(
        "seals.view.session",
        "if not (math.isfinite(value) and low <= value <= high):",
        "if False:",
        VIEW,
        "cannot_leave_the_range",
    ),
    "keys of the page": Guard(
        "seals.view.session", "if key not in known:", "if False:", VIEW, "leave_the_range"
    ),
}
"""Every guard by name."""


def unguarded(name: str) -> tuple[int, str]:
    """Run the tests of a guard without it, in a process of its own.

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
    """Return whether a test failed, and nothing else went wrong."""
    failed, wrong = (re.search(rf"\b\d+ {what}\b", said) for what in ("failed", "errors?"))
    return code == 1 and failed is not None and wrong is None


def main(names: Sequence[str]) -> int:
    """Take out the guards named, or all, one after the other."""
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
