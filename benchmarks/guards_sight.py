"""Guards of detectors, of pictures that they learn from, and of folders that they replace."""

from __future__ import annotations

from benchmarks.guard import Guard

WORDS, SEEN = "tests/unit/test_visual_catch_refusals.py", "tests/unit/test_visual_catch.py"
_PICTURES = "seals.experiments.visual_catch.pictures"
_COMMAND = "seals.experiments.command"

SIGHT: dict[str, Guard] = {
    "folders of others": Guard(
        "seals.learn.metadata",
        "        read_metadata(folder, form=form, key=key)\n    except",
        "        pass\n    except",
        WORDS,
        "only_a_detector",
        "torchrl",
    ),
    "what a detector replaces": Guard(
        "seals.plugins.tasks.sighting.detector",
        '    refuse_other(folder, form=FORM, key="task.detector")\n',
        "",
        WORDS,
        "only_a_detector",
        "torchrl",
    ),
    "form of pictures": Guard(_PICTURES, "        found.check()\n", "", WORDS, "are_none"),
    "size of pictures": Guard(
        _PICTURES, "if unpacked > _MOST_BYTES:", "if False:", WORDS, "that_swell"
    ),
    "damaged pictures": Guard(
        _PICTURES,
        "MemoryError, SealsError, *_DAMAGED)",
        "MemoryError)",
        WORDS,
        "that_are_damaged",
    ),
    "flights that judge": Guard(
        _PICTURES, "    if strange:\n", "    if False:\n", WORDS, "flown_again"
    ),
    "numbers of an experiment": Guard(
        _COMMAND, " or not low <= int(text) <= high:", ":", WORDS, "senseless_words"
    ),
    "times of an experiment": Guard(
        _COMMAND, "if not 0.0 < value < math.inf:", "if False:", WORDS, "senseless_words"
    ),
    "rights of an experiment": Guard(
        _COMMAND, "if not os.access(there, os.W_OK):", "if False:", WORDS, "of_the_system"
    ),
    "numbers of a detector": Guard(
        "seals.plugins.tasks.sighting.detector",
        "pixel: Annotated[float, Within(1e-3, 100.0)]",
        "pixel: Any",
        SEEN,
        "senseless_metadata",
        "torchrl",
    ),
    "weights of a detector": Guard(
        "seals.plugins.tasks.sighting.detector",
        "if not all(bool(x.isfinite().all()) for x in tensors.values()):",
        "if False:",
        SEEN,
        "not_finite",
        "torchrl",
    ),
}
"""By name."""
