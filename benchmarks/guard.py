"""One check of untrusted input (guard), and the tests that cover it."""

from __future__ import annotations

from typing import NamedTuple

FILES, CLASSES = "tests/unit/test_guards.py", "tests/unit/test_guards_classes.py"
FOUND, BOUNDS = "tests/unit/test_fuzz_findings.py", "tests/unit/test_guards_bounds.py"


class Guard(NamedTuple):
    """One check of untrusted input (guard), and the tests that cover it.

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
