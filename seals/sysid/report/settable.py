"""Estimators in the conventions of scikit-learn: settings by name, results after a fit."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from seals.errors import NotFitted, refuse_unlisted
from seals.logs import Log, read_native, refuse_if_bad
from seals.logs.shipped import find_log

Own = TypeVar("Own", bound="Settable")


class Settable:
    """Base of estimators: the arguments of the constructor are the settings.

    ``fit`` sets the attributes that a class annotates with a name that ends in ``_``.
    """

    def __repr__(self) -> str:
        """Show the settings."""
        given = ", ".join(f"{k}={v!r}" for k, v in self.get_params().items())
        return f"{type(self).__name__}({given})"

    def __getattr__(self, name: str) -> Any:
        # reached only when the attribute is not there
        learned = any(name in inspect.get_annotations(c) for c in type(self).__mro__)
        if learned and name.endswith("_"):
            raise NotFitted(f"{name} is not known: no log was fitted.\nCall fit(log) first.")
        raise AttributeError(f"{type(self).__name__} has no attribute '{name}'")

    @classmethod
    def _settings(cls) -> list[str]:
        return [name for name in inspect.signature(cls.__init__).parameters if name != "self"]

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Return the settings by name.

        Args:
            deep: of no consequence: no setting has settings of its own.
        """
        return {name: getattr(self, name) for name in self._settings()}

    def set_params(self: Own, **settings: Any) -> Own:
        """Change settings and return the estimator itself.

        Raises:
            ConfigError: there is no such setting.
        """
        for name, value in settings.items():
            refuse_unlisted(
                name, self._settings(), f"'{name}' is not a setting of {type(self).__name__}"
            )
            setattr(self, name, value)
        return self


def read_usable(log: Log | str | Path, *, robot: str | Path | None = None) -> Log:
    """Return a log, from its folder or the short name of one that ships.

    Args:
        log: the log.
        robot: name or folder of its robot, whose data sheet says what the log does not.

    Raises:
        ConfigError: there is no such log.
        LogError: it cannot be used.
    """
    read = log if isinstance(log, Log) else read_native(find_log(log))
    refuse_if_bad(read)
    if robot is None:
        return read
    from seals.config.source import find_robot
    from seals.run.equipment_metadata import datasheet_of

    sheet = datasheet_of(find_robot(str(robot)).settings.folder)
    return replace(read, meta={**sheet, **read.meta})


def bar(shown: bool, label: str, total: int) -> AbstractContextManager[Callable[[int], None]]:
    """Return a progress bar, or a silent substitute."""
    from seals.run.progress import progress

    return progress(label, total) if shown else nullcontext(lambda done: None)
