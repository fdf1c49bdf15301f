"""Ends an experiment as ``seals`` ends: a refusal in two lines and an exit code."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence

from seals.cli.main import two_lines
from seals.errors import SealsError


def ended(main: Callable[[Sequence[str] | None], int]) -> int:
    """Return the exit code of an experiment; what was refused is printed instead of raised.

    Args:
        main: of the experiment; takes its arguments, None for those of the command line.
    """
    try:
        return main(None)
    except SealsError as refusal:
        print(two_lines(refusal), file=sys.stderr)
        return refusal.exit_code
    except KeyboardInterrupt:
        print("Interrupted.", file=sys.stderr)
        return 130
