"""Binding of effects to links: parameter arrays, rows of links, check for double counting."""

from __future__ import annotations

import copy
import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from seals.arrays import Array, Floats, as_like, columns, namespace
from seals.effects.effect import Effect, EffectOptions, MediumKind
from seals.effects.hooks import ARGUMENTS, arguments_of
from seals.errors import ConfigError, suggestion
from seals.plugin_options import options_of
from seals.schema import parameters_of, vector_groups


@dataclass(frozen=True, kw_only=True)
class BoundEffect:
    """Effect bound to its links.

    Args:
        name: instance name in the configuration.
        effect: the plug-in object.
        links: indices of its links, increasing.
        kind: medium in which it acts; None for an effect that knows no medium, such as gravity.
        params: parameter arrays, shape (1 or N, k), see `seals.effects.effect.Parameters`.
    """

    name: str
    effect: Effect
    links: tuple[int, ...]
    kind: MediumKind | None
    params: Mapping[str, Array]

    @property
    def hooks(self) -> Any:
        """The effect, typed with all its optional hooks."""
        return self.effect


class EffectSet:
    """The effects of a scene in the order of the configuration, sorted by hook.

    Args:
        bound: effects on their links.

    Attributes:
        held: places of the joints of a robot that moves as one body [rad or m], which its effects
            are given in place of the state's; None for joints that move.
    """

    bound: tuple[BoundEffect, ...]
    flows: tuple[BoundEffect, ...]
    inertias: tuple[BoundEffect, ...]
    loads: tuple[BoundEffect, ...]
    joint_loads: tuple[BoundEffect, ...]
    joint_drives: tuple[BoundEffect, ...]
    joint_resistances: tuple[BoundEffect, ...]
    joint_others: tuple[BoundEffect, ...]
    actuators: tuple[BoundEffect, ...]
    actuations: tuple[BoundEffect, ...]
    drive_loads: tuple[BoundEffect, ...]
    batteries: tuple[BoundEffect, ...]
    inertia_changes: tuple[BoundEffect, ...]
    measures: tuple[BoundEffect, ...]
    timings: tuple[BoundEffect, ...]
    commands: tuple[BoundEffect, ...]
    names: tuple[str, ...]
    index: dict[str, int]

    def __init__(self, bound: Sequence[BoundEffect]) -> None:
        self.bound = tuple(bound)
        self._as_bound = True
        self.held: tuple[float, ...] | None = None
        self.flows = self.having("flow")
        self.inertias = self.having("inertia")
        self.loads = self.having("loads")
        self.joint_loads = self.having("joint_loads")
        self.joint_drives = self.having("joint_drive")
        self.joint_resistances = self.having("joint_resistance")
        driven = {b.name for b in self.joint_drives}
        self.joint_others = tuple(b for b in self.joint_loads if b.name not in driven)
        self.actuators = self.having("drives")
        self.actuations = self.having("actuation")
        self.drive_loads = self.having("drive_loads")
        self.batteries = self.having("battery_update")
        self.inertia_changes = self.having("inertia_change")
        self.measures = self.having("measure")
        self.timings = self.having("timing")
        self.commands = tuple(b for b in self.having("command") if changes_commands(b.effect))
        self.names = tuple(b.name for b in bound)
        self.index = {b.name: k for k, b in enumerate(bound)}

    def having(self, hook: str) -> tuple[BoundEffect, ...]:
        """Return the effects that define a hook."""
        found = [b for b in self.bound if _defines(cast(Any, type(b.effect)), hook)]
        return tuple(found)

    @property
    def wrenching(self) -> tuple[str, ...]:
        """Names of all effects that make wrenches, in the order of the configuration."""
        makers = (*self.inertia_changes, *self.loads, *self.actuators, *self.drive_loads)
        made = {b.name for b in makers}
        return tuple(name for name in self.names if name in made)

    def zero_memory(self, batch: int = 1) -> dict[str, Floats]:
        """Return zeroed memory of every effect, shape (links x batch, memory size)."""
        return {
            b.name: np.zeros((len(b.links) * batch, b.effect.memory_size))
            for b in self.bound
            if b.effect.memory_size
        }

    def with_values(self, values: Mapping[str, Array], like: Array, batch: int) -> EffectSet:
        """Return the set with parameters replaced, in the array library of ``like``.

        Args:
            values: ``"effect.parameter"`` to a scalar or an array of shape (batch,).
            like: array whose library, type and device to use.
            batch: number of bodies; arrays repeat for every link.

        Raises:
            ConfigError: an effect or parameter is not part of the set.
        """
        chosen: dict[str, dict[str, Array]] = {b.name: {} for b in self.bound}
        for key, value in values.items():
            name, _, parameter = key.partition(".")
            if name not in chosen or parameter not in parameters_of(
                self.bound[self.index[name]].effect
            ):
                keys = [f"{b.name}.{p}" for b in self.bound for p in parameters_of(b.effect)]
                raise ConfigError(
                    f"'{key}' is not a parameter of this model.\n{suggestion(key, keys)}"
                )
            chosen[name][parameter] = value
        plain = self._as_bound and type(like) is np.ndarray and like.dtype == np.float64
        # the set with other parameters, sorted as this one
        bound = [
            b
            if plain and not chosen[b.name]
            else replace(b, params=_params(b.effect, chosen[b.name], like, len(b.links), batch))
            for b in self.bound
        ]
        other = copy.copy(self)
        other.bound, other._as_bound = tuple(bound), False
        for kind in _KINDS:
            own = getattr(self, kind)
            setattr(other, kind, tuple(other.bound[self.index[b.name]] for b in own))
        return other


_KINDS = (
    "flows",
    "inertias",
    "loads",
    "joint_loads",
    "joint_drives",
    "joint_resistances",
    "joint_others",
    "actuators",
    "actuations",
    "drive_loads",
    "batteries",
    "inertia_changes",
    "measures",
    "timings",
    "commands",
)


def has_hook(effect: object, hook: str) -> bool:
    """Return true if an effect's class defines a hook; a battery has a ``state`` as well."""
    law: Any = type(effect)
    return _defines(law, hook)


def changes_commands(effect: Effect) -> bool:
    """Return true if an effect with its options changes commands on their way to the drives.

    A hook ``command`` that returns what it was given, whatever its parameters, does not.
    """
    if not has_hook(effect, "command"):
        return False
    law: Any = effect
    params = _params(effect, dict.fromkeys(parameters_of(effect), 1.0), np.zeros(1), 1, 1)
    return bool(np.any(law.command(_PROBE, np.zeros(4), params) != _PROBE))


_PROBE = np.array([[-2.0, -0.5, 0.5, 2.0]])
"""Commands about parameters of one."""


@functools.cache
def _defines(law: type, hook: str) -> bool:
    """Return true if a class defines a hook: asked for every effect of every model of a fit."""
    names = ("battery_update", "state") if hook == "battery_update" else (hook,)
    return all(callable(getattr(law, name, None)) for name in names)


def bind_effects(
    effects: Mapping[str, Effect],
    links: Sequence[str],
    others: Mapping[str, Sequence[str]] | None = None,
) -> EffectSet:
    """Bind effects to the links of a robot.

    Args:
        effects: plug-in objects by instance name.
        links: link names of the scene; the first is the root.
        others: further owners of phenomena, see `refuse_double_counting`.

    Raises:
        ConfigError: a link is unknown, or two effects own one phenomenon on one link.
    """
    bound = []
    for name, effect in effects.items():
        chosen = _link_indices(name, effect.links, links)
        kind = options_of(effect, EffectOptions).medium
        params = _params(effect, {}, np.zeros(1), len(chosen), 1)
        # refuse hooks with arguments that the simulation does not pass
        for hook in ARGUMENTS:
            if has_hook(effect, hook):
                try:
                    arguments_of(effect, hook)
                except ConfigError as cause:
                    raise ConfigError(f"effects.{name}: {cause}") from cause
        bound.append(BoundEffect(name=name, effect=effect, links=chosen, kind=kind, params=params))
    refuse_double_counting(bound, links, others)
    return EffectSet(bound)


def refuse_double_counting(
    bound: Sequence[BoundEffect],
    links: Sequence[str],
    others: Mapping[str, Sequence[str]] | None = None,
) -> None:
    """Refuse two owners of one phenomenon in one medium on one link.

    Args:
        bound: effects on their links.
        links: link names.
        others: further owners (for example particle water) and the phenomena they account for on
            all links.

    Raises:
        ConfigError: names both owners, the phenomenon and the link.
    """
    owner: dict[tuple[str, MediumKind, int], str] = {}
    for name, phenomena in (others or {}).items():
        for phenomenon in phenomena:
            owner.update({(phenomenon, MediumKind.water, k): name for k in range(len(links))})
    for b in bound:
        if b.effect.correction:
            continue
        for phenomenon in b.effect.accounts_for:
            for k in b.links:
                own = b.kind or MediumKind.any
                kinds = list(MediumKind) if own is MediumKind.any else [own, MediumKind.any]
                clash = next(
                    (
                        owner[phenomenon, kind, k]
                        for kind in kinds
                        if (phenomenon, kind, k) in owner
                    ),
                    None,
                )
                if clash is not None:
                    raise ConfigError(
                        f"'{clash}' and '{b.name}' both account for {phenomenon} "
                        f"on link '{links[k]}'.\n"
                        f"Remove one of them, or give effects.{b.name}.correction=true "
                        "if it is intended as an addition."
                    )
                owner[phenomenon, own, k] = b.name


def _link_indices(name: str, wanted: Sequence[str], links: Sequence[str]) -> tuple[int, ...]:
    """Indices of named links, ``root`` and ``*`` understood."""
    if "*" in wanted:
        return tuple(range(len(links)))
    found = set()
    for link in wanted:
        if link not in (*links, "root"):
            raise ConfigError(
                f"effects.{name}.links: there is no link '{link}'.\n"
                f"{suggestion(link, [*links, 'root', '*'])}"
            )
        found.add(0 if link == "root" else list(links).index(link))
    return tuple(sorted(found))


def _params(
    effect: Effect, values: Mapping[str, Any], like: Array, links: int, batch: int
) -> dict[str, Array]:
    """Parameter arrays of one effect.

    Their shape is (1, k) when constant, (links x batch, k) when one value is batched.
    """
    names = parameters_of(effect)
    if type(like) is np.ndarray and all(isinstance(v, int | float) for v in values.values()):
        return _numbers(effect, names, values, like)
    single = {n: _row(values.get(n, getattr(effect, n)), like, links, batch) for n in names}
    out = {key: as_like(value, like) for key, value in effect.constants().items()}
    groups = vector_groups(names)
    for stem, members in groups.items():
        rows = max(single[m].shape[0] for m in members)
        out[stem] = columns(*(single[m] * as_like(np.ones(rows), like) for m in members))
    grouped = {m for members in groups.values() for m in members}
    out.update({n: single[n][:, None] for n in names if n not in grouped})
    return out


def _numbers(
    effect: Effect, names: Mapping[str, Any], values: Mapping[str, Any], like: Floats
) -> dict[str, Array]:
    """Parameter arrays of one effect on NumPy where all values are numbers, shape (1, k)."""
    single = {n: float(values.get(n, getattr(effect, n))) for n in names}
    groups = vector_groups(names)
    out = {key: as_like(value, like) for key, value in effect.constants().items()}
    stems = {stem: [single[m] for m in members] for stem, members in groups.items()}
    grouped = {m for members in groups.values() for m in members}
    stems |= {n: [value] for n, value in single.items() if n not in grouped}
    return out | {stem: np.array([row], dtype=like.dtype) for stem, row in stems.items()}


def _row(value: Any, like: Array, links: int, batch: int) -> Array:
    """Return a parameter as a vector of shape (1,) or (links x batch,)."""
    if isinstance(value, int | float):
        return as_like([float(value)], like)
    array = as_like(value, like)
    if array.ndim != 1 or array.shape[0] not in (1, batch):
        raise ConfigError(
            f"a batched parameter has shape {tuple(array.shape)}.\nAllowed: ({batch},) or a number."
        )
    if links == 1 or array.shape[0] == 1:
        return array
    return namespace(array).concat([array] * links, axis=0)


def rows_of(links: tuple[int, ...], count: int, batch: int) -> Any:
    """Rows of some links in link-by-link order.

    None stands for all; contiguous links make a slice, and so do evenly spaced ones of one robot,
    such as one link of every leg; others make an index array.
    """
    if len(links) == count:
        return None
    if links == tuple(range(links[0], links[0] + len(links))):
        return slice(links[0] * batch, (links[-1] + 1) * batch)
    apart = links[1] - links[0]
    if batch == 1 and apart > 0 and links == tuple(range(links[0], links[-1] + 1, apart)):
        return slice(links[0], links[-1] + 1, apart)
    return np.concatenate([np.arange(k * batch, (k + 1) * batch) for k in links])


def spread(velocity: Array, rows: Any, like: Array) -> Array:
    """Return a flow on some rows as a flow on all rows of ``like``, zero elsewhere."""
    xp = namespace(like)
    index = np.arange(like.shape[0])
    inside = np.zeros((like.shape[0], 1))
    inside[index[rows]] = 1.0
    if velocity.shape[0] == 1:
        return velocity * xp.asarray(inside, dtype=like.dtype)
    source = np.zeros(like.shape[0], dtype=np.int64)
    source[index[rows]] = np.arange(velocity.shape[0])
    return xp.take(velocity, xp.asarray(source), axis=0) * xp.asarray(inside, dtype=like.dtype)
