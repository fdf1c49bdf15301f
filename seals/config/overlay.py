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
from seals.schema import check_value, parameters_of
from seals.untrusted_io import read_plain_yaml, refuse_references

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
    """Nominal property with its fitted value.

    Args:
        value: change that was fitted beside the effects.
        sd: its 1-sigma.
        alone: change that a fit without the effects would choose: what calibration alone can do.
    """

    value: float
    sd: float
    alone: float


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
    medium: str | None
    links: tuple[str, ...] | None
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
            place = f" in {self.medium}" if self.medium else ""
            raise ConfigError(
                f"{where}: the model has {many} of the kind '{self.effect}'{place}.\n"
                "A change needs exactly one; say medium or links, or add the effect to the model."
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
        if self.medium is not None and medium is not None and medium.value != self.medium:
            return False
        return self.links is None or tuple(effect.links) == self.links


@dataclass(frozen=True, kw_only=True)
class Overlay:
    """Effects and values that a diagnosis added to a model.

    Args:
        name: of the model.
        file: that it was read from.
        effects: to add, by instance name.
        changes: of effects that the model below holds, by name.
        waves: of the water surface; None when the model does not speak of them.
        intervals: 90 % interval of each parameter, by part and parameter.
        nominal: fitted changes of the nominal properties of the log's vehicle.
        speeds: typical speeds of the log that was fitted [m/s]; exponents of drag refer to them.
        provenance: log, verdict, confidence, date, version.
        withdrawn: why the model is not to be used; empty when it may be.
    """

    name: str
    file: str = ""
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
                "Diagnose again, or use it all the same with force=true"
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
    import yaml

    try:
        raw = read_plain_yaml(path)
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as cause:
        text = " ".join(str(cause).split())
        raise ConfigError(f"{path} cannot be read: {text}.\nIt must be YAML text in UTF-8.") from (
            cause
        )
    raw = _mapping(raw, str(path))
    refuse_references(raw, where=str(path))
    for key in raw:
        refuse_unlisted(str(key), KEYS, f"{path}: '{key}' is not a key of a model")
    return {"name": path.stem, "file": str(path.resolve()), **raw}


def read_overlay(raw: Mapping[str, Any]) -> Overlay:
    """Read an overlay file and check every name and value.

    Raises:
        ConfigError: a name is unknown, or a value is not allowed; the message says where.
    """
    name, where = str(raw.get("name", "model")), str(raw.get("file") or "model")
    effects = _mapping(raw.get("effects"), f"{where}: effects")
    changes = _mapping(raw.get("changes"), f"{where}: changes")
    wave = raw.get("wave")
    nominal = _mapping(raw.get("nominal"), f"{where}: nominal")
    return Overlay(
        name=name,
        file=str(raw.get("file") or ""),
        effects={
            # by default a correction of one of its kind
            str(n): _plugin("effect", v, f"{where}: effects.{n}", correction=True)
            for n, v in effects.items()
        },
        changes={str(n): _change(str(n), v, f"{where}: changes.{n}") for n, v in changes.items()},
        waves=None if wave is None else _plugin("wave", wave, f"{where}: wave"),
        intervals=_mapping(raw.get("intervals"), f"{where}: intervals"),
        nominal={str(k): _fitted(v, f"{where}: nominal.{k}") for k, v in nominal.items()},
        speeds=_speeds(raw.get("speeds"), f"{where}: speeds"),
        provenance=_mapping(raw.get("provenance"), f"{where}: provenance"),
        withdrawn=str(raw.get("withdrawn") or ""),
    )


def _plugin(kind: str, raw: Any, where: str, **values: Any) -> Any:
    from seals.config.build import build_from_values
    from seals.config.derive import schema_of
    from seals.registry import get

    values |= _mapping(raw, where)
    plugin = _plugin_name(kind, values, where)
    known = [f.name for f in fields(schema_of(get(kind, plugin))) if not f.name.startswith("_")]
    for key in values:
        refuse_unlisted(str(key), known, f"{where}: '{key}' is not a parameter of {plugin}")
    return build_from_values(kind, plugin, values, {}, where=where)


def _plugin_name(kind: str, values: dict[str, Any], where: str) -> str:
    plugin = values.pop(kind, None)
    if not isinstance(plugin, str):
        raise ConfigError(
            f"{where} does not say which {kind} it is.\n"
            f"Add the line '{kind}: NAME'; the names are shown by: seals list {kind}"
        )
    return plugin


def _change(name: str, raw: Any, where: str) -> Change:
    from seals.registry import get

    values = dict(_mapping(raw, where))
    plugin = _plugin_name("effect", values, where)
    get("effect", plugin)
    medium, links = values.pop("medium", None), values.pop("links", None)
    if not isinstance(links, list | None):
        raise ConfigError(f"{where}.links={links} is not allowed.\nAllowed: a list of links")
    if medium is not None:
        what = f"{where}.medium={medium} is not allowed"
        refuse_unlisted(str(medium), MediumKind.__members__, what)
    return Change(
        name=name,
        effect=plugin,
        medium=medium,
        links=None if links is None else tuple(str(x) for x in links),
        values={str(k): _number(v, f"{where}.{k}") for k, v in values.items()},
    )


def _fitted(raw: Any, where: str) -> Fitted:
    """A fitted value, its 1-sigma, and the value without the effects."""
    entry = _mapping(raw, where) if not isinstance(raw, int | float) else {"value": raw}
    for key in entry:
        refuse_unlisted(str(key), Fitted._fields, f"{where}: '{key}' is not known here")
    value = _number(entry.get("value"), where)
    alone = _number(entry.get("alone", value), f"{where}.alone")
    return Fitted(value, _number(entry.get("sd", 0.0), f"{where}.sd"), alone)


def _speeds(raw: Any, where: str) -> tuple[float, ...]:
    if not isinstance(raw, Sequence | None) or isinstance(raw, str):
        raise ConfigError(f"{where}={raw} is not allowed.\nAllowed: a list of numbers [m/s]")
    return tuple(_number(x, where) for x in raw or ())


def _number(raw: Any, where: str) -> float:
    import math

    if isinstance(raw, bool) or not isinstance(raw, int | float) or not math.isfinite(raw):
        raise ConfigError(f"{where}={raw} is not allowed.\nAllowed: a finite number.")
    return float(raw)


def _mapping(raw: Any, where: str) -> dict[str, Any]:
    if raw is None:
        return {}
    if not isinstance(raw, Mapping):
        raise ConfigError(
            f"{where} is a {type(raw).__name__}.\nAllowed: a mapping of names to values."
        )
    return dict(raw)
