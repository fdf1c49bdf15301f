"""Estimators in the conventions of scikit-learn: settings by name, results after a fit."""

from __future__ import annotations

import inspect
from typing import Any, ClassVar, TypeVar

from seals.errors import ConfigError, NotFitted, suggestion

Own = TypeVar("Own", bound="Settable")


class Settable:
    """Base of estimators: the arguments of the constructor are the settings."""

    _learned: ClassVar[tuple[str, ...]] = ()
    """Attributes that ``fit`` sets."""

    def __repr__(self) -> str:
        """Show the settings."""
        given = ", ".join(f"{k}={v!r}" for k, v in self.get_params().items())
        return f"{type(self).__name__}({given})"

    def __getattr__(self, name: str) -> Any:
        # reached only when the attribute is not there
        if name in self._learned:
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
            if name not in self._settings():
                raise ConfigError(
                    f"'{name}' is not a setting of {type(self).__name__}.\n"
                    f"{suggestion(name, self._settings())}"
                )
            setattr(self, name, value)
        return self
