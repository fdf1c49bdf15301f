"""Model overlay: YAML file of effects and changes that a diagnosis added to a robot.

``models/my_model.yaml`` becomes the Hydra option ``model=my_model``, as a robot's folder becomes
``robot=NAME``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, NamedTuple

from seals.effects.effect import Effect, EffectOptions, MediumKind
from seals.environment.waves import Waves
from seals.errors import ConfigError, refuse_unlisted
from seals.plugin_options import options_of
from seals.robot.robot_file import taken_name
from seals.schema import check_value, parameters_of, read
from seals.untrusted_io import read_file, refuse_references

FOLDER = "models"
"""Folder in which models are looked for by name."""
KEYS = (
    "summary",
    "effects",
    "changes",
    "wave",
    "intervals",
    "nominal",
    "speeds",
    "provenance",
    "withdrawn",
)
"""What a model's file may say."""
WAVE = "waves"
"""Name of the waves among the parts of a model."""


class Fitted(NamedTuple):
    """Stated property with its fitted value.

    Args:
        value: change that was fitted beside the effects.
        sd: its 1-sigma.
        alone: change that a fit without the effects would choose; None for the same.
    """

    value: float
    sd: float = 0.0
    alone: float | None = None

    @property
    def calibrated(self) -> float:
        """Change that calibration alone can do."""
        return self.value if self.alone is None else self.alone


@dataclass(frozen=True, kw_only=True)
class Change:
    """Change of an effect that the underlying model has already.

    Args:
        name: of this change.
        effect: plug-in of the effect that changes.
        medium: in which it acts; None for any.
        links: on which it acts; None for any.
        values: change of each parameter, in the parameter's unit.
    """

    name: str
    effect: str
    medium: MediumKind | None = None
    links: tuple[str, ...] | None = None
    values: Mapping[str, float]

    def applied(self, own: Mapping[str, Effect]) -> dict[str, Effect]:
        """Return the effects of a model with this change made.

        Raises:
            ConfigError: no effect, or more than one, fits; or a value is out of bounds.
        """
        found = [name for name, effect in own.items() if self._fits(effect)]
        where = f"changes.{self.name}"
        if len(found) != 1:
            many = f"{len(found)} effects" if found else "no effect"
            place = f" in {self.medium.name}" if self.medium else ""
            raise ConfigError(
                f"{where}: the model has {many} of the kind '{self.effect}'{place}.\n"
                "A change needs exactly one; give medium or links, or add the effect to the model."
            )
        effect = own[found[0]]
        declared = parameters_of(effect)
        total: dict[str, Any] = {}
        for name, change in self.values.items():
            what = f"{where}: '{name}' is not a parameter of {self.effect}"
            refuse_unlisted(name, declared, what)
            total[name] = float(getattr(effect, name)) + change
            check_value(f"{where}: {found[0]}.{name}", total[name], declared[name])
        return {**own, found[0]: replace(effect, **total)}

    def _fits(self, effect: Effect) -> bool:
        from seals.registry import get

        if type(effect) is not get("effect", self.effect).load() or effect.correction:
            return False
        medium = options_of(effect, EffectOptions).medium
        if self.medium is not None and medium not in (None, self.medium):
            return False
        return self.links is None or tuple(effect.links) == self.links


@dataclass(frozen=True, kw_only=True)
class Overlay:
    """Effects and values that a diagnosis added to a model.

    Args:
        name: of the model.
        file: that it was read from.
        summary: one line about it.
        effects: to add, by instance name.
        changes: of effects that the model below holds, by name.
        waves: of the water surface; None when the model does not speak of them.
        intervals: 90 % interval of each parameter, by part and parameter.
        nominal: fitted changes of the stated properties of the log's vehicle.
        speeds: typical speeds of the log that was fitted [m/s]; exponents of drag refer to them.
        provenance: log, verdict, confidence, date, version.
        withdrawn: why the model is not to be used; empty when it may be.
    """

    name: str
    file: str = ""
    summary: str = ""
    effects: Mapping[str, Effect] = field(default_factory=dict)
    changes: Mapping[str, Change] = field(default_factory=dict)
    waves: Waves | None = None
    intervals: Mapping[str, Any] = field(default_factory=dict)
    nominal: Mapping[str, Fitted] = field(default_factory=dict)
    speeds: tuple[float, ...] = ()
    provenance: Mapping[str, Any] = field(default_factory=dict)
    withdrawn: str = ""

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of all entries, in the order of the file."""
        return (*self.effects, *self.changes, *([] if self.waves is None else [WAVE]))

    def only(self, parts: Sequence[str]) -> Overlay:
        """Return the overlay reduced to some of its entries."""
        return replace(
            self,
            effects={n: e for n, e in self.effects.items() if n in parts},
            changes={n: c for n, c in self.changes.items() if n in parts},
            waves=self.waves if WAVE in parts else None,
        )

    def applied(self, own: Mapping[str, Effect]) -> dict[str, Effect]:
        """Return the effects of a model with those of the overlay; waves are left to the caller.

        Args:
            own: effects of the model by instance name.

        Raises:
            ConfigError: a change does not fit the model, or its result is out of bounds.
        """
        found = dict(own)
        for change in self.changes.values():
            found = change.applied(found)
        for name, effect in self.effects.items():
            found[free_name(name, found)] = effect
        return found

    def refuse_withdrawn(self, *, force: bool) -> None:
        """Refuse an overlay that was withdrawn.

        Raises:
            ConfigError: it was, and nobody insists.
        """
        if self.withdrawn and not force:
            raise ConfigError(
                f"model '{self.name}' was withdrawn: {self.withdrawn}.\n"
                "Diagnose again, or use it anyway with force=true"
            )


def free_name(name: str, taken: Mapping[str, Any]) -> str:
    """Return a name that is not taken yet.

    Example:
        >>> free_name("drag", {"drag": 1}), free_name("wind", {})
        ('drag_2', 'wind')
    """
    number, free = 2, name
    while free in taken:
        free, number = f"{name}_{number}", number + 1
    return free


def find_overlay(name: str) -> Path | None:
    """Return the file of ``model=NAME``: a path, or a name in the folder of models."""
    places = (Path(name), Path(f"{name}.yaml"), Path(FOLDER) / f"{name}.yaml", Path(FOLDER) / name)
    return next((p for p in places if p.suffix == ".yaml" and p.is_file()), None)


def overlay_names() -> list[str]:
    """Return the names of the overlays in the folder of models."""
    return sorted(path.stem for path in Path(FOLDER).glob("*.yaml"))


def load_overlay(path: Path) -> dict[str, Any]:
    """Return the checked content of an overlay file, with its name and path.

    Raises:
        ConfigError: it cannot be read, or holds keys that no model has.
    """
    raw = read_file(dict[str, Any] | None, path) or {}
    refuse_references(raw, where=str(path))
    for key in raw:
        refuse_unlisted(key, KEYS, f"{path}: '{key}' is not a key of a model")
    return {"name": path.stem, "file": str(path.resolve()), **raw}


def read_overlay(raw: Mapping[str, Any]) -> Overlay:
    """Read an overlay file and check every name and value.

    Raises:
        ConfigError: a name is unknown, or a value is not allowed; the message says where.
    """
    where = f"{raw.get('file') or 'model'}:"
    content: dict[str, Any] = {"name": "model", **raw}
    # by default a correction of one of its kind
    content["effects"] = {
        name: _plugin("effect", entry, f"{where} effects.{name}", correction=True)
        for name, entry in _section(raw.get("effects"), f"{where} effects").items()
    }
    content["changes"] = {
        name: _change(name, entry, f"{where} changes.{name}")
        for name, entry in _section(raw.get("changes"), f"{where} changes").items()
    }
    wave = content.pop("wave", None)
    content["waves"] = None if wave is None else _plugin("wave", wave, f"{where} wave")
    provenance = _section(raw.get("provenance"), f"{where} provenance")
    _section(provenance.get("confidence"), f"{where} provenance.confidence")
    return read(Overlay, content, where=where)


def _plugin(kind: str, raw: Any, where: str, **values: Any) -> Any:
    from seals.config.build import build_from_values
    from seals.config.derive import schema_of
    from seals.registry import get

    values |= read(dict[str, Any], raw, where=where)
    plugin = taken_name(kind, values, where)
    known = [f.name for f in fields(schema_of(get(kind, plugin))) if not f.name.startswith("_")]
    for key in values:
        refuse_unlisted(str(key), known, f"{where}: '{key}' is not a parameter of {plugin}")
    return build_from_values(kind, plugin, values, {}, where=where)


def _change(name: str, raw: Any, where: str) -> Change:
    from seals.registry import get

    values = read(dict[str, Any], raw, where=where)
    plugin = taken_name("effect", values, where)
    get("effect", plugin)
    told: dict[str, Any] = {"name": name, "effect": plugin}
    told |= {key: values.pop(key, None) for key in ("medium", "links")}
    told["values"] = read(dict[str, float], values, where=where)
    return read(Change, told, where=where)


def _section(raw: Any, where: str) -> dict[str, Any]:
    found: dict[str, Any] | None = read(dict[str, Any] | None, raw, where=where)
    return found or {}
