"""Parameters that identification may estimate: of the stated model and of candidate effects."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.effects.effect import Effect, Timed
from seals.effects.identification import Addition, Identification, Property
from seals.schema import parameters_of
from seals.sysid.candidates.activity import ACTIVE, Activity
from seals.sysid.decision.policy import DecisionPolicy, SearchBudget


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """Parameter of a model that identification may estimate.

    In the extended model of a vehicle its value is the change against the stated model; in a model
    of an experiment, the value itself.

    Args:
        key: ``instance.parameter`` in the model; with the ending `ACTIVE` what is added to that
            value at the times at which an effect acts.
        tolerance: 1-sigma uncertainty of the nominal value; 0 when it is exact.
        scale: size of a plausible missing effect, the prior width of a candidate.
        bounds: least and largest value.
        least: size below which it makes no effect that is named.
        adds: whether the tolerance can only add, as that of a latency.
        nominal: value in the stated model.
        start: value from which a fit of a candidate starts.
        unit: SI unit of the value; empty where its effect states it.
        changes: number of the stated model that the parameter changes; None for a field of an
            effect.
        stated_nudge: step of the difference quotient by it; 0 for a share of its size.
    """

    key: str
    tolerance: float = 0.0
    scale: float = 1.0
    bounds: tuple[float, float] = (-np.inf, np.inf)
    least: float = 0.0
    adds: bool = False
    nominal: float = 0.0
    start: float = 0.0
    unit: str = ""
    changes: Property | None = None
    stated_nudge: float = 0.0

    @property
    def instance(self) -> str:
        """Name of the effect's instance."""
        return self.key.partition(".")[0]

    @property
    def parameter(self) -> str:
        """Name of the parameter."""
        return self.key.partition(".")[2].removesuffix(ACTIVE)

    @property
    def nudge(self) -> float:
        """Step of the finite difference by this parameter."""
        size = self.tolerance if self.tolerance > 0.0 else 0.1 * self.scale
        return self.stated_nudge or 0.02 * size


def prior_widths(
    parameters: Mapping[str, Parameter], keys: Sequence[str], free: Collection[str], wide: float
) -> Floats:
    """Return the prior 1-sigma of parameters, shape (p,): plausible for free ones, else tolerances.

    Args:
        parameters: by key.
        keys: of the parameters.
        free: those that a fit frees.
        wide: factor on the plausible sizes.
    """
    widths = [
        wide * max(p.scale, p.tolerance) if k in free else p.tolerance
        for k, p in ((k, parameters[k]) for k in keys)
    ]
    return np.asarray(widths, dtype=float)


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """Effect that the search may add, in one variant.

    Args:
        name: of the effect in the catalogue.
        keys: parameters that are estimated, in the order of the report; all of one instance.
        reported: name of each key's parameter in the report; empty for their own names.
        variant: what tells variants apart, for example ``{"rotor": 2}``.
        law: which of its laws, where it has several; empty otherwise.
        nuisance: keys that are estimated but not reported.
        starts: starting values for the keys, one row each; empty for one start at zero.
        identification: traits that the effect declares.
        activity: when it acts; None for throughout. Its keys then end in `ACTIVE`.
    """

    name: str
    keys: tuple[str, ...]
    reported: tuple[str, ...] = ()
    variant: Mapping[str, float] = field(default_factory=dict, hash=False)
    law: str = ""
    nuisance: tuple[str, ...] = ()
    starts: tuple[tuple[float, ...], ...] = ()
    identification: Identification = field(default_factory=Identification, hash=False)
    activity: Activity | None = None

    @property
    def label(self) -> str:
        """Name with law or variant.

        Example:
            >>> Candidate(name="weak_rotor", keys=("r.loss",), variant={"rotor": 2}).label
            'weak_rotor (rotor 2)'
        """
        parts = [*filter(None, [self.law]), *(f"{k} {v:g}" for k, v in self.variant.items())]
        parts += ["for a time"] if self.activity is not None else []
        return self.name + (f" ({', '.join(parts)})" if parts else "")

    @property
    def instance(self) -> str:
        """Instance of the effect in the model."""
        return self.keys[0].partition(".")[0]

    @property
    def in_arm(self) -> bool:
        """True where the effect acts inside an arm."""
        return bool(self.identification.in_arm)

    def acting(self, activity: Activity) -> Candidate:
        """Return the effect as one that acts in some time spans only."""
        return replace(
            self.throughout,
            activity=activity,
            keys=tuple(k + ACTIVE for k in self.throughout.keys),
            nuisance=tuple(k + ACTIVE for k in self.throughout.nuisance),
        )

    @property
    def throughout(self) -> Candidate:
        """The effect as one that acts at all times.

        Example:
            >>> Candidate(name="wind", keys=("wind.x",)).acting(Activity(spans=())).throughout.keys
            ('wind.x',)
        """
        return replace(
            self,
            activity=None,
            keys=tuple(k.removesuffix(ACTIVE) for k in self.keys),
            nuisance=tuple(k.removesuffix(ACTIVE) for k in self.nuisance),
        )

    @property
    def may_change(self) -> bool:
        """True where the effect may begin or end in the middle of a log."""
        return self.identification.may_begin or self.identification.may_end

    def resembles(self, other: Candidate) -> bool:
        """Return true if either of two effects declares the other as a confounder."""
        return (
            other.name in self.identification.confounders
            or self.name in other.identification.confounders
        )

    @property
    def all_keys(self) -> tuple[str, ...]:
        """Reported keys, then nuisance keys."""
        return (*self.keys, *self.nuisance)


@dataclass(frozen=True, kw_only=True)
class Waves:
    """Wave model as a candidate; waves belong to the water and not to an effect.

    Args:
        law: class of the waves.
        beside: instances that act in these waves alone, such as their moment on a hull.
    """

    law: Any
    beside: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class CandidateSet:
    """Nominal model with all parameters and candidate effects.

    Args:
        effects: instances of the extended model by name, all changes zero.
        parameters: by key.
        candidates: effects that may be missing.
        nominal: instances of the stated model, where it is a choice of a recipe.
        unobservable: effects that could act but change no reading.
        waves: that may be missing, by the instance of their parameters.
        data_sheet: errors of the vehicle's own values that look like an effect; never searched.
        policy: thresholds of the decisions.
        budget: limits of the search.
    """

    effects: Mapping[str, Effect]
    parameters: Mapping[str, Parameter]
    candidates: tuple[Candidate, ...]
    nominal: tuple[str, ...] = ()
    unobservable: tuple[Candidate, ...] = ()
    waves: Mapping[str, Waves] = field(default_factory=dict)
    data_sheet: tuple[Candidate, ...] = ()
    policy: DecisionPolicy = field(default_factory=DecisionPolicy)
    budget: SearchBudget = field(default_factory=SearchBudget)

    @cached_property
    def sensor_delay(self) -> str:
        """Key of the delay of the inertial sensors; empty without one."""
        for name, effect in self.effects.items():
            if not isinstance(effect, Timed):
                continue
            for parameter in parameters_of(effect):
                one = {p: np.full((1, 1), float(p == parameter)) for p in parameters_of(effect)}
                if np.any(effect.timing(one).sensor_delay):
                    return f"{name}.{parameter}"
        return ""

    def without(self, unobservable: Iterable[Candidate]) -> CandidateSet:
        """Return the set with some candidates moved to those that change no reading."""
        out = tuple(unobservable)
        kept = tuple(c for c in self.candidates if c not in out)
        return replace(self, candidates=kept, unobservable=(*self.unobservable, *out))

    def allowed(self, key: str, value: float) -> float:
        """Return a value, or the bound of the parameter that it passes."""
        low, high = self.parameters[key].bounds
        return float(min(max(value, low), high))

    def nominal_of(self, key: str) -> float:
        """Return the value in the extended model to which the change ``key`` is added."""
        effect = self.effects.get(self.parameters[key].instance)
        return float(getattr(effect, self.parameters[key].parameter, 0.0))

    @property
    def tolerances(self) -> tuple[str, ...]:
        """Keys of all parameters with a tolerance: nuisance parameters of every model."""
        return tuple(k for k, f in self.parameters.items() if f.tolerance > 0.0)


class Collector:
    """Builder of a candidate set, one effect at a time."""

    def __init__(self, effects: Mapping[str, Effect]) -> None:
        self.effects: dict[str, Effect] = dict(effects)
        self._nominal = frozenset(effects)
        self.parameters: dict[str, Parameter] = {}
        self.candidates: list[Candidate] = []
        self.data_sheet: list[Candidate] = []

    def take(self, name: str, known: Identification, addition: Addition) -> None:
        """Add the instance, the parameters and the candidate of one addition.

        Args:
            name: of the effect.
            known: its traits.
            addition: one way in which it may be missing.
        """
        effect = addition.effect
        if effect is not None:
            if addition.instance in self._nominal:
                # beside one of the stated model
                addition = replace(addition, instance=f"{addition.instance}_change")
            effect.correction = True
            self.effects[addition.instance] = effect
        for parameter, known_size in addition.parameters.items():
            key = f"{addition.instance}.{parameter}"
            self.parameters[key] = Parameter(
                key=key,
                tolerance=known_size.tolerance,
                scale=known_size.scale,
                bounds=known_size.bounds,
                least=known_size.least,
                adds=parameter in known.adds_only,
                changes=known_size.changes,
                stated_nudge=known_size.nudge,
            )
        named = tuple(addition.parameters) if addition.named is None else addition.named
        if addition.named is None:
            named = tuple(p for p in named if p not in addition.nuisance)
        if known.data_sheet and addition.named == ():
            self.data_sheet.append(
                Candidate(
                    name=name,
                    keys=tuple(f"{addition.instance}.{p}" for p in addition.parameters),
                    reported=tuple(addition.parameters),
                    law="data sheet",
                    identification=known,
                )
            )
        if named:
            self.candidates.append(
                Candidate(
                    name=name,
                    keys=tuple(f"{addition.instance}.{p}" for p in named),
                    reported=named if addition.reported is None else addition.reported,
                    variant=dict(addition.variant),
                    law=addition.law,
                    nuisance=tuple(f"{addition.instance}.{p}" for p in addition.nuisance),
                    starts=tuple(tuple(s) for s in addition.starts),
                    identification=known,
                )
            )

    def candidate_set(self, waves: Mapping[str, Waves]) -> CandidateSet:
        """Return the candidate set.

        Args:
            waves: that may be missing, by instance.
        """
        temporary = {k: None for c in self.candidates if c.may_change for k in c.all_keys}
        # what acts for a time comes on top of a tolerance, which holds throughout
        active = {
            k + ACTIVE: replace(self.parameters[k], key=k + ACTIVE, tolerance=0.0)
            for k in temporary
        }
        return CandidateSet(
            effects=self.effects,
            parameters=self.parameters | active,
            candidates=tuple(self.candidates),
            waves=waves,
            data_sheet=tuple(self.data_sheet[:1]),
        )
