"""``seals validate``: runs a validation set and writes its report."""

from __future__ import annotations

import importlib
from collections.abc import Callable

from seals.errors import ConfigError, suggestion

SETS = {"water": "seals.experiments.water_validation"}
"""Package of each validation set; its ``main`` takes the further words."""


def validate(arguments: list[str]) -> int:
    """Run the named set and return its exit code.

    Raises:
        ConfigError: there is no such set.
    """
    name = arguments[0] if arguments else ""
    if name not in SETS:
        raise ConfigError(
            f"there is no validation set '{name}'.\n{suggestion(name, SETS, label='Sets')}"
        )
    main: Callable[[list[str]], int] = importlib.import_module(SETS[name]).main
    return main(arguments[1:])
