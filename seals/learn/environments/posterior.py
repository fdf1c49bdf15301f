"""Effect parameters that vary between environments: by tolerances, or as a diagnosis says."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.effects.effect import Effect, EffectOptions
from seals.errors import ConfigError, suggestion
from seals.plugin_options import options_of
from seals.registry import get, names
from seals.schema import Parameter, parameters_of, read, vars_of
from seals.sysid.candidates.reported_values import NORMAL90
from seals.sysid.validation.answer import Finding, FoundEffect, read_answer

KEY = "varied_from"
_ROUNDED = 1e-6
"""What rounding may take from a correlation [1]."""
_PLACES = ("rotor", "joint")
"""What an answer says of an effect beside its parameters: at which of several it sits."""
_MEDIA = ("air", "water")


class Estimate(NamedTuple):
    """Parameter estimated by a diagnosis, with its uncertainty.

    Args:
        mean: in the parameter's unit.
        sd: one standard deviation of the posterior.
    """

    mean: float
    sd: float


class _Fitted(NamedTuple):
    """Value of the data sheet as an answer tells it."""

    value: float
    sd: float


class _Interval(NamedTuple):
    """Parameter of an effect as an answer tells it."""

    value: float
    low90: float
    high90: float


class Posterior(NamedTuple):
    """Joint normal distribution of the parameters that a diagnosis estimated.

    Args:
        estimates: by ``"effect.parameter"``, k of them.
        correlation: in their order [1], shape (k, k).
    """

    estimates: Mapping[str, Estimate]
    correlation: Floats

    def standard(self, normal: Floats) -> Floats:
        """Return correlated from independent unit normal draws, shape (k, N)."""
        sizes, axes = np.linalg.eigh(self.correlation)
        # rounding may leave a size just below zero
        found: Floats = (axes * np.sqrt(np.maximum(sizes, 0.0))) @ axes.T @ normal
        return found


def posterior_of(
    where: str | Path,
    effects: Mapping[str, Any],
    model: Mapping[str, Any] | None = None,
    *,
    root: str = "root",
) -> Posterior:
    """Return the parameters of an environment's effects that a diagnosis has estimated.

    An answer tells changes of the model that its log states, as ``seals add`` takes them: they are
    added to what is configured. A model made of that answer holds those of the effects already.

    Args:
        where: folder that ``seals diagnose`` wrote, or its file.
        effects: of the environment by name.
        model: content of the model that the environment has taken over, or None.
        root: name of the robot's root link.

    Returns:
        Estimates of the missing effects, and of the values of the data sheet that were fitted
        beside them, where the environment has such an effect; uncorrelated where the file holds no
        covariance.

    Raises:
        ConfigError: it is no diagnosis, names no effect, names one that the environment does not
            have, or the model is made of another one.
    """
    finding = read_answer(where, key=KEY)
    if model is not None:
        # refuse a model that was not made from this diagnosis: its values mean something else
        made = str((model.get("provenance") or {}).get("diagnosis_sha256"))
        if made != hashlib.sha256(finding.file.read_bytes()).hexdigest():
            raise ConfigError(
                f"{KEY}={finding.file.parent}: model={model.get('name')} was made from another "
                "diagnosis.\n"
                "Make one from this diagnosis: seals add diagnosis=FOLDER name=NAME, or leave "
                "model= out."
            )
    found = {key: (name, one) for name, key, one in _data_sheet_estimates(finding, effects)}
    for k, entry in enumerate(finding.effects):
        own = _effect_estimates(finding, entry, effects, root, added=model is not None)
        found |= {key: (f"effects.{k}.{field}", one) for field, key, one in own}
    correlation = _correlation(finding, [name for name, _ in found.values()])
    return Posterior({key: one for key, (_, one) in found.items()}, correlation)


def _correlation(finding: Finding, names: Sequence[str]) -> Floats:
    """Return the correlations of some parameters by their names in the covariance."""
    found = np.eye(len(names))
    known = list(finding.answer.covariance.parameters)
    here = [k for k, name in enumerate(names) if name in known]
    if not here:
        return found
    at = [known.index(names[k]) for k in here]
    matrix = np.array(finding.answer.covariance.matrix, dtype=float)[np.ix_(at, at)]
    # null stands for what the log did not determine
    matrix = np.where(np.isnan(matrix), 0.0, matrix)
    size = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    scale = np.where(size > 0.0, size, 1.0)
    found[np.ix_(here, here)] = part = matrix / np.outer(scale, scale)
    found[np.diag_indices(len(names))] = 1.0
    if not np.allclose(part, part.T, atol=_ROUNDED) or np.linalg.eigvalsh(found)[0] < -_ROUNDED:
        raise ConfigError(
            f"{finding.file}: covariance.matrix is not symmetric, or not positive.\n"
            "Diagnose the log again."
        )
    return found


def _effect_estimates(
    finding: Finding,
    entry: FoundEffect,
    effects: Mapping[str, Any],
    root: str,
    *,
    added: bool,
) -> Iterator[tuple[str, str, Estimate]]:
    """Yield the estimates of one missing effect; ``added`` if the environment has them."""
    kind, parameters = entry.name, entry.parameters
    places = {k: parameters[k].value for k in _PLACES if k in parameters}
    alike = _matching_effects(kind, effects, medium=entry.medium or "", **places)
    if added:
        alike = [name for name in alike if effects[name].correction] or alike
    if not alike:
        words = "".join(f" of {name} {int(value)}" for name, value in places.items())
        raise ConfigError(
            f"{KEY}={finding.file.parent}: it found {kind}{words}, and the environment "
            f"has no such effect.\nAdd it: '+effect@effects.{kind}={kind}', or +model=NAME that "
            f"seals add made.  {suggestion(kind, effects, label='Effects')}"
        )
    place = entry.link or root
    elsewhere = (
        place not in (root, "root", *(n for a in alike for n in effects[a].links)) and not added
    )
    if len(alike) > 1 or elsewhere:
        where = f"it found {kind} on link {entry.link}" if elsewhere else f"it found {kind}"
        raise ConfigError(
            f"{KEY}={finding.file.parent}: {where}, and the matching effect of the environment "
            f"is ambiguous: {', '.join(alike)}.\n"
            "Use the model that seals add writes from it: +model=NAME"
        )
    for field, given in parameters.items():
        if field in _PLACES:
            continue
        known = read(_Interval, vars_of(given), where=f"{finding.file}: {kind}.{field}")
        sd = abs(known.high90 - known.low90) / (2.0 * NORMAL90)
        own = _field(effects[alike[0]], field, finding.file)
        base = float(getattr(effects[alike[0]], own))
        yield field, f"{alike[0]}.{own}", Estimate(base if added else base + known.value, sd)


def _data_sheet_estimates(
    finding: Finding, effects: Mapping[str, Any]
) -> Iterator[tuple[str, str, Estimate]]:
    """Yield the corrected data sheet values of effects that the environment has exactly once.

    Others are of sensors, or of the body itself, whose parameters the environment does not vary.
    """
    for key, fitted in finding.answer.nominal.items():
        instance, _, field = key.partition(".")
        kind, places = _kind(instance)
        alike = _matching_effects(kind, effects, **places) if kind in names("effect") else []
        alike = [name for name in alike if not effects[name].correction]
        if len(alike) != 1 or field not in parameters_of(effects[alike[0]]):
            continue
        told = {k: v for k, v in fitted.items() if v is not None}
        known = read(_Fitted, told, where=f"{finding.file}: {key}", extra=True)
        base = float(getattr(effects[alike[0]], field))
        yield f"nominal.{key}", f"{alike[0]}.{field}", Estimate(base + known.value, known.sd)


def _kind(instance: str) -> tuple[str, dict[str, Any]]:
    """Return the effect of a factor of the data sheet, and its location.

    Example:
        >>> _kind("quadratic_drag_water_change"), _kind("weak_rotor_2")
        (('quadratic_drag', {'medium': 'water'}), ('weak_rotor', {'rotor': 2}))
    """
    name = instance.removesuffix("_change")
    stem, _, last = name.rpartition("_")
    if last in _MEDIA:
        return stem, {"medium": last}
    if last.isdigit():
        return stem, {"rotor" if "rotor" in stem else "joint": int(last)}
    return name, {}


def _matching_effects(
    kind: str, effects: Mapping[str, Any], *, medium: str = "", **places: Any
) -> list[str]:
    """Return the effects of a kind, optionally of a medium and a location.

    Of several those on the link that a diagnosis means: the one that the plug-in itself names.
    """
    plain: type[Effect] = get("effect", kind).load() if kind in names("effect") else Effect
    found = []
    for name, effect in effects.items():
        own = options_of(effect, EffectOptions).medium
        wet = not medium or own is None or own.value in (medium, "any")
        here = all(getattr(effect, k, None) == int(v) for k, v in places.items())
        if type(effect) is plain and wet and here:
            found.append(name)
    usual = [n for n in found if list(effects[n].links) == list(plain().links)]
    return usual if len(found) > 1 and usual else found


def _field(effect: Any, field: str, file: Path) -> str:
    """Return the name of a parameter in its effect: the given one, or ``NAME_change``."""
    for name in (field, f"{field}_change"):
        if name in parameters_of(effect):
            return name
    raise ConfigError(
        f"{file}: '{field}' is not a parameter of {type(effect).__name__}.\nDiagnose the log again."
    )


def drawn_parameters(
    effects: Mapping[str, Any],
    count: int,
    *,
    share: float,
    rng: np.random.Generator,
    known: Posterior | None = None,
) -> dict[str, Floats]:
    """Draw parameters of N environments, normally distributed about those configured.

    Whoever learns in all of them at once learns what works for any robot that the model may mean.

    Args:
        effects: of the run by name.
        count: N.
        share: of the tolerances that is one standard deviation; 0 for no difference.
        rng: decides the draws, effect by effect.
        known: what is known better than by tolerances; these are drawn jointly, about their means
            with their own deviations and correlations, whatever the share.

    Returns:
        ``"effect.parameter"`` to values, shape (N,), as twins take them.

    References:
        Tobin et al. 2017, arXiv 1703.06907 (randomised worlds); here they are as wide as the
        tolerances of the model, and no wider.
    """
    estimates = {} if known is None else known.estimates
    found, about = {}, {}
    for name, effect in effects.items():
        for field, declared in parameters_of(effect).items():
            key, value = f"{name}.{field}", getattr(effect, field)
            if key in estimates:
                mean, size = estimates[key]
            else:
                mean, size = value, share * _deviation(declared, value)
                if size == 0.0:
                    continue
            about[key] = mean, size, declared.bounds
            found[key] = rng.standard_normal(count)
    if known is not None and estimates:
        joint = known.standard(np.array([found[key] for key in estimates]))
        found |= dict(zip(estimates, joint, strict=True))
    scaled = {key: (mean + size * found[key], ends) for key, (mean, size, ends) in about.items()}
    return {key: np.clip(values, *ends) for key, (values, ends) in scaled.items()}


def _deviation(known: Parameter, value: Any) -> float:
    """Return the standard deviation of a parameter in its unit, 0 if unknown.

    Args:
        known: what is declared of it.
        value: configured; what is no number does not vary.
    """
    if not known.fit or isinstance(value, bool) or not isinstance(value, int | float):
        return 0.0
    return known.tolerance * (abs(float(value)) if known.relative else 1.0)
