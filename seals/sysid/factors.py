"""The parameters a diagnosis may move: tolerances of the nominal model, and candidate effects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from seals.effects.effect import Effect
from seals.effects.identification import Addition, Identification
from seals.sysid.decision.policy import DecisionPolicy, SearchBudget


@dataclass(frozen=True, kw_only=True)
class Factor:
    """One parameter of the extended model; its value is the change against the nominal model.

    Args:
        key: ``instance.parameter`` in the extended model.
        tolerance: 1-sigma of the change that the datasheet admits; 0 when the nominal value is
            exact.
        scale: size of a plausible missing effect, the prior width of a candidate.
        bounds: of the change.
        adds: whether the tolerance can only add, as that of a latency.
    """

    key: str
    tolerance: float = 0.0
    scale: float = 1.0
    bounds: tuple[float, float] = (-np.inf, np.inf)
    adds: bool = False

    @property
    def instance(self) -> str:
        """Name of the effect's instance."""
        return self.key.partition(".")[0]

    @property
    def parameter(self) -> str:
        """Name of the parameter."""
        return self.key.partition(".")[2]

    @property
    def nudge(self) -> float:
        """Step of a difference quotient."""
        size = self.tolerance if self.tolerance > 0.0 else 0.1 * self.scale
        return 0.02 * size


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """One effect that may be missing, in one variant.

    Args:
        name: of the effect in the catalogue.
        variant: what tells variants apart, for example ``{"rotor": 2}``.
        keys: factors that are freed, in the order of the reported parameters.
        reported: name of each key's parameter in the report.
        free: keys that are freed but not reported.
        starts: starting values for the keys, one row each; empty for one start at zero.
        identification: traits that the effect declares.
    """

    name: str
    keys: tuple[str, ...]
    reported: tuple[str, ...]
    variant: Mapping[str, float] = field(default_factory=dict)
    free: tuple[str, ...] = ()
    starts: tuple[tuple[float, ...], ...] = ()
    identification: Identification = field(default_factory=Identification)

    @property
    def label(self) -> str:
        """Name with variant."""
        parts = [f"{k} {v:g}" for k, v in self.variant.items()]
        return self.name + (f" ({', '.join(parts)})" if parts else "")

    @property
    def in_arm(self) -> bool:
        """Whether the effect acts inside an arm."""
        return bool(self.identification.in_arm)

    @property
    def all_keys(self) -> tuple[str, ...]:
        """Reported and other freed keys."""
        return (*self.keys, *self.free)


@dataclass(frozen=True, kw_only=True)
class Library:
    """Everything a diagnosis of one vehicle may move.

    Args:
        effects: instances of the extended model by name, all changes zero.
        factors: parameters by key.
        candidates: effects that may be missing.
        policy: thresholds of the decisions.
        budget: limits of the search.
    """

    effects: Mapping[str, Effect]
    factors: Mapping[str, Factor]
    candidates: tuple[Candidate, ...]
    policy: DecisionPolicy = field(default_factory=DecisionPolicy)
    budget: SearchBudget = field(default_factory=SearchBudget)

    @property
    def tolerances(self) -> tuple[str, ...]:
        """Keys of all factors with a tolerance."""
        return tuple(k for k, f in self.factors.items() if f.tolerance > 0.0)


class Collector:
    """Collects instances, factors and candidates one effect at a time."""

    def __init__(self, effects: Mapping[str, Effect]) -> None:
        """Start from the nominal model."""
        self.effects: dict[str, Effect] = dict(effects)
        self.factors: dict[str, Factor] = {}
        self.candidates: list[Candidate] = []

    def take(self, name: str, known: Identification, addition: Addition) -> None:
        """Add the instance, the factors and the candidate of one addition.

        Args:
            name: of the effect.
            known: its traits.
            addition: one way in which it may be missing.
        """
        if addition.effect is not None:
            addition.effect.correction = True
            self.effects[addition.instance] = addition.effect
        for parameter, freed in addition.parameters.items():
            key = f"{addition.instance}.{parameter}"
            self.factors[key] = Factor(
                key=key,
                tolerance=freed.tolerance,
                scale=freed.scale,
                bounds=freed.bounds,
                adds=parameter in known.adds_only,
            )
        named = tuple(addition.parameters) if addition.named is None else addition.named
        if addition.named is None:
            named = tuple(p for p in named if p not in addition.nuisance)
        if named:
            self.candidates.append(
                Candidate(
                    name=name,
                    keys=tuple(f"{addition.instance}.{p}" for p in named),
                    reported=named if addition.reported is None else addition.reported,
                    variant=dict(addition.variant),
                    free=tuple(f"{addition.instance}.{p}" for p in addition.nuisance),
                    starts=tuple(tuple(s) for s in addition.starts),
                    identification=known,
                )
            )

    def library(self) -> Library:
        """Return what was collected."""
        return Library(
            effects=self.effects, factors=self.factors, candidates=tuple(self.candidates)
        )
