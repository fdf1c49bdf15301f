"""``python -m seals.testing KIND NAME ...``: checks installed plug-ins and prints the results."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import Any

from seals import registry
from seals.errors import SealsError, refuse_unlisted
from seals.testing import (
    check_backend,
    check_controller,
    check_effect,
    check_fluid,
    check_guide,
    check_learner,
    check_reader,
    check_robot,
    check_sensor,
    check_task,
    check_waves,
)

CHECKS: dict[str, Callable[[str], Any]] = {
    # an actuator keeps the contract of effects
    "actuator": lambda name: check_effect(registry.get("actuator", name).load()),
    "backend": check_backend,
    "effect": check_effect,
    "fluid": check_fluid,
    "learner": check_learner,
    "reader": check_reader,
    "robot": check_robot,
    "sensor": check_sensor,
    "guide": check_guide,
    "controller": check_controller,
    "task": check_task,
    "wave": check_waves,
}
"""The check of each kind of plug-in."""


def main(arguments: Sequence[str]) -> int:
    """Check the named plug-ins, or all of a kind; return 0 when all fulfil their contract.

    Args:
        arguments: a kind, then names.
    """
    try:
        kind = arguments[0] if arguments else ""
        refuse_unlisted(kind, CHECKS, f"there is no check of kind '{kind}'", label="Kinds")
        for name in arguments[1:] or registry.names(kind):
            print(CHECKS[kind](name).table(), flush=True)
    except SealsError as refusal:
        print(f"{type(refusal).__name__}: {refusal}", file=sys.stderr)
        return refusal.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
