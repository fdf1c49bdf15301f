"""Pytest plug-in that removes one guard from the code, as SEALS_UNGUARD states.

    SEALS_UNGUARD="size of a state" pytest -p benchmarks.unguard tests/unit/test_state_file.py

Nothing on disk is touched: the text of one module is changed as it is imported.
"""

from __future__ import annotations

import importlib.abc
import importlib.machinery
import importlib.util
import os
import sys
from collections.abc import Sequence
from types import CodeType, ModuleType

from benchmarks.guards import GUARDS, Guard

VARIABLE = "SEALS_UNGUARD"


class Unguarded(importlib.machinery.SourceFileLoader):
    """Loader of a module with a piece of its source replaced, bypassing compiled copies."""

    def __init__(self, name: str, path: str, guard: Guard) -> None:
        super().__init__(name, path)
        self.guard = guard

    def get_code(self, fullname: str) -> CodeType:
        """Compile the changed text.

        Raises:
            RuntimeError: the guard is not there, or more than once.
        """
        path = self.get_filename(fullname)
        text = self.get_data(path).decode("utf-8")
        if text.count(self.guard.text) != 1:
            raise RuntimeError(
                f"{fullname} holds {self.guard.text!r} {text.count(self.guard.text)}x"
            )
        return self.source_to_code(text.replace(self.guard.text, self.guard.without), path)


class Finder(importlib.abc.MetaPathFinder):
    """Import finder that applies the loader to one module."""

    def __init__(self, guard: Guard) -> None:
        self.guard = guard

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Find the module as the others do, and change who loads it."""
        if name != self.guard.module:
            return None
        for finder in sys.meta_path:
            spec = None if finder is self else finder.find_spec(name, path, target)
            if spec is not None and spec.origin is not None:
                spec.loader = Unguarded(name, spec.origin, self.guard)
                return spec
        return None


def pytest_configure() -> None:
    """Remove the guard before any module is imported."""
    name = os.environ.get(VARIABLE, "")
    if not name:
        return
    guard = GUARDS[name]
    if guard.module in sys.modules:
        raise RuntimeError(f"{guard.module} is imported already")
    sys.meta_path.insert(0, Finder(guard))
