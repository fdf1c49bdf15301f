"""Candidate effects of an experiment: installed ones that can act on its robot in its medium."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from seals.compare.settings import CompareSettings, PredictionMethod
from seals.config.plugin_lookup import plugin_name
from seals.effects.binding import has_hook
from seals.effects.derived import strengths_of, unit_scale
from seals.effects.effect import Effect, MediumKind
from seals.effects.identification import Comparison, Stage, Subject
from seals.errors import refuse_unlisted
from seals.robot.model import RobotModel
from seals.schema import parameters_of
from seals.sysid.candidates.parameters import Candidate, CandidateSet, Parameter
from seals.sysid.candidates.vehicle import installed

_FAST = 5.0
"""Typical speed where no channel tells it [m/s]."""


def candidate_set_of(settings: CompareSettings, robot: RobotModel) -> CandidateSet:
    """Collect the candidate effects of a configured model.

    Raises:
        ConfigError: ``rivals`` or ``naming`` name something that is not there.
    """
    nominal = _nominal(settings)
    sizes = _Sizes(settings, robot)
    effects: dict[str, Effect] = {n: settings.effects[n] for n in nominal}
    keys = {
        f"{n}.{p}": _parameter(
            settings.effects[n], f"{n}.{p}", nominal=float(getattr(settings.effects[n], p))
        )
        for n in nominal
        for p in parameters_of(settings.effects[n])
    }
    tolerances = _tolerances(settings, keys)
    found: list[Candidate] = []
    taken: set[tuple[Any, ...]] = set()
    for instance, effect in _offered(settings, robot, nominal).items():
        name = name_of(effect)
        law = (name, getattr(effect, "medium", None), tuple(effect.links))
        if law in taken:
            continue
        taken.add(law)
        effects[instance] = replace(effect, correction=True)
        both = settings.environment.water_level is not None
        for candidate in _split(name, instance, effect, both=both):
            free = tuple(k for k in candidate.keys if k not in tolerances)
            for key in free:
                keys[key] = sizes.parameter(effect, key, instance in nominal)
            if free:
                found.append(replace(candidate, keys=free))
    own = {k: keys.pop(k) for k in tolerances}
    return CandidateSet(
        effects=effects,
        nominal=tuple(nominal),
        parameters=own | keys,
        candidates=tuple(_chosen(found, settings.rivals)),
    )


def name_of(effect: Effect) -> str:
    """Return the name of an effect among the candidates.

    Example:
        >>> from seals.registry import get
        >>> name_of(get("effect", "lift").load()())
        'lift'
    """
    law = type(effect)
    names = (plugin_name(kind, law) for kind in ("effect", "actuator"))
    return next((name for name in names if name != law.__name__), law.__name__)


def _nominal(settings: CompareSettings) -> list[str]:
    first = next(iter(settings.ladder.values()), None)
    chosen = settings.naming.nominal or ([str(e) for e in first] if first is not None else None)
    names = list(settings.effects) if chosen is None else [str(n) for n in chosen]
    for name in names:
        refuse_unlisted(name, settings.effects, f"naming.nominal: there is no effect '{name}'")
    drives = [n for n, a in settings.actuators.items() if has_hook(a, "drives")]
    return [*names, *(n for n in drives if n in settings.effects and n not in names)]


def _tolerances(settings: CompareSettings, keys: dict[str, Parameter]) -> tuple[str, ...]:
    out = []
    for full, spread in settings.naming.tolerances.items():
        key = str(full).removeprefix("effects.")
        refuse_unlisted(
            key, keys, f"naming.tolerances: '{full}' is not a parameter of the stated model"
        )
        keys[key] = replace(keys[key], tolerance=float(spread), scale=float(spread))
        out.append(key)
    return tuple(out)


def _parameter(effect: Effect, key: str, *, nominal: float) -> Parameter:
    meta = parameters_of(effect)[key.partition(".")[2]]
    return Parameter(key=key, nominal=nominal, start=nominal, bounds=meta.bounds, unit=meta.unit)


def _offered(
    settings: CompareSettings, robot: RobotModel, nominal: Sequence[str]
) -> dict[str, Effect]:
    """Return configured effects outside the stated model first, then other installed ones."""
    out = {
        n: e
        for n, e in settings.effects.items()
        if n not in nominal and "weight" not in e.accounts_for
    }
    held = {(name_of(settings.effects[n]), _medium(settings.effects[n])) for n in nominal}
    for name, law, options in _installed(settings, robot):
        medium = options.get("medium")
        configured = any(
            name_of(e) == name and _medium(e) in (medium, MediumKind.any) for e in out.values()
        )
        rules = law.identification.compared
        if configured or ((name, medium) in held and rules is not None and rules.whole):
            continue
        instance = f"more_{name}" + (f"_{medium.value}" if medium else "")
        own = {n: settings.effects[n] for n in nominal}
        out[instance] = law(**{**law.options_on(robot, own, medium), **options})
    return out


def _installed(
    settings: CompareSettings, robot: RobotModel
) -> list[tuple[str, type[Effect], dict[str, Any]]]:
    """Installed effects that could act on the robot, with options, in the order of their trial."""
    wet = settings.environment.water_level is not None
    drives = any(has_hook(e, "drives") for e in settings.effects.values())
    # what is bolted down does not feel its own inertia: the last link moves
    last = {"links": [robot.links[-1]]} if robot.tree.fixed_base else {}
    found: list[tuple[tuple[int, int, int], str, type[Effect], dict[str, Any]]] = []
    for name, law in installed().items():
        rules = law.identification.compared
        driven = any(callable(getattr(law, h, None)) for h in _DRIVEN)
        jointed = callable(getattr(law, "joint_loads", None))
        if rules is None or (driven and not drives) or (jointed and not robot.tree.joints):
            continue
        if rules.order[0] == Stage.installed and not strengths_of(law):
            continue
        own = getattr(law, "medium", None)
        media = [MediumKind(m) for m in rules.media] or ([own] if own is not None else [])
        for medium in media:
            if wet or medium is not MediumKind.water:
                group = 2 if medium is MediumKind.air else 1
                found.append(((group, *rules.order), name, law, {"medium": medium}))
        if not media:
            group = 0 if rules.order[0] == Stage.body else 3
            options = dict(last) if rules.rigid else {}
            found.append(((group, *rules.order), name, law, options))
    return [(name, law, options) for _, name, law, options in sorted(found, key=lambda f: f[0])]


_DRIVEN = ("actuation", "drive_loads", "timing")
"""Hooks that act on drives."""


def _medium(effect: Effect) -> MediumKind | None:
    return getattr(effect, "medium", None)


def _split(name: str, instance: str, effect: Effect, *, both: bool) -> list[Candidate]:
    rules = type(effect).identification.compared or Comparison()
    fitted = [
        p
        for p, meta in parameters_of(effect).items()
        if meta.fit and not any(p.startswith(stem) for stem in rules.held)
    ]
    if rules.order[0] == Stage.installed and type(effect).identification.compared is not None:
        # zero does not switch a shape off
        fitted = [p for p in fitted if p in strengths_of(type(effect))]
    groups = {s: [p for p in fitted if p.startswith(s)] for s in rules.laws} or {"": fitted}
    # where there are air and water, the one that is not meant as a rule is said
    air = ["in air"] if both and _medium(effect) is MediumKind.air else []
    return [
        Candidate(
            name=name,
            law=", ".join(filter(None, [rules.laws.get(law, law), *air])),
            keys=tuple(f"{instance}.{p}" for p in parameters),
        )
        for law, parameters in groups.items()
    ]


def _chosen(found: list[Candidate], wanted: Sequence[str]) -> list[Candidate]:
    for name in wanted:
        known = sorted({x for c in found for x in (c.name, c.instance, c.label)})
        refuse_unlisted(name, known, f"rivals: no effect named '{name}' could act here")
    keep = set(wanted)

    def called(c: Candidate) -> set[str]:
        """Names by which a candidate may be chosen; the plain name means the law in water."""
        return {c.label, c.instance} | (set() if "in air" in c.law else {c.name})

    return [c for c in found if not keep or keep & called(c)]


class _Sizes:
    """Plausible sizes of missing effects, from the robot's own mass, size and speed."""

    def __init__(self, settings: CompareSettings, robot: RobotModel) -> None:
        self.kick = 0.0 if settings.compare.course is PredictionMethod.simulated else 1.0
        self.subject = Subject(
            robot=robot,
            effects=settings.effects,
            environment=settings.environment,
            speeds=np.full(3, _FAST),
        )

    def parameter(self, effect: Effect, key: str, nominal: bool) -> Parameter:
        """Return one parameter of a candidate: nominal value, start, scale and bounds."""
        law, name = type(effect), key.partition(".")[2]
        rules = law.identification.compared
        off = float(getattr(effect, name)) if nominal else 0.0
        if rules is not None and rules.whole:
            off = -self.subject.volume
        scale = self._scale(law, name)
        # some laws have a corner at zero: a glide without any lift holds its axis, a lag far
        # shorter than a step or a damping far from resonance changes nothing
        start = off + self.kick * scale
        return replace(_parameter(effect, key, nominal=off), scale=scale, start=start)

    def _scale(self, law: type[Effect], parameter: str) -> float:
        """Plausible size: as stated, 0.05 by default, or from the unit for an effect of others."""
        rules = law.identification.compared or Comparison(order=(Stage.surroundings, 0))
        for stem, scale in rules.scales.items():
            if parameter.startswith(stem):
                return scale(self.subject)
        if rules.order[0] != Stage.installed:
            return 0.05
        meta, own = parameters_of(law)[parameter], self.subject
        return unit_scale(meta, mass=own.mass, length=own.reach, gravity=own.environment.gravity)
