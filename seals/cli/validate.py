"""``seals validate``: runs a validation set and writes its report."""

from __future__ import annotations

import importlib
from collections.abc import Callable

from seals.errors import refuse_unlisted

SETS = {"water": "seals.experiments.water_validation"}
"""Package of each validation set; its ``main`` takes the further words."""


def validate(arguments: list[str]) -> int:
    """Run the named set and return its exit code.

    Raises:
        ConfigError: there is no such set.
    """
    name = arguments[0] if arguments else ""
    what = f"there is no validation set '{name}'" if name else "no validation set is given"
    refuse_unlisted(name, SETS, what, label="Write: seals validate SET; sets")
    main: Callable[[list[str]], int] = importlib.import_module(SETS[name]).main
    flags = {"full=true": ["--full"], "full=false": []}
    # written as elsewhere, KEY=VALUE, or as the parser of the set has them
    keyed = [word for word in arguments[1:] if "=" in word and word[0] != "-"]
    plain = [word for word in arguments[1:] if word not in keyed]
    for word in keyed:
        if word.startswith("full="):
            refuse_unlisted(word, flags, f"{word} is not allowed", label="Allowed")
    return main([*plain, *(flag for w in keyed for flag in flags.get(w, [f"--{w}"]))])
