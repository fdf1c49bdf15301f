"""Candidate effects of a diagnosis, from the declarations of all installed effects.

Those of one log are the additions that every effect offers for its vehicle, as changes of the
stated model; those of runs that are compared are whole effects in a medium, as `Comparison` says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.compare.settings import CompareSettings, PredictionMethod
from seals.config.plugin_lookup import plugin_name
from seals.effects.binding import has_hook
from seals.effects.derived import strengths_of, unit_scale
from seals.effects.discrepancy import SurfaceForce
from seals.effects.effect import Effect, MediumKind
from seals.effects.identification import (
    Addition,
    Comparison,
    Freed,
    Identification,
    Stage,
    Subject,
)
from seals.errors import UnknownPlugin, refuse_unlisted
from seals.robot.model import RobotModel
from seals.schema import parameters_of
from seals.sysid.candidates.parameters import Candidate, CandidateSet, Collector, Parameter, Waves
from seals.sysid.data.installed import loaded
from seals.sysid.data.known_sea import own_key, sea_laws
from seals.sysid.data.vehicle import Vehicle

_SURFACE = 0.04
"""1-sigma of the hydrostatic force while the hull pierces the surface, as a share."""


_FAST = 5.0
"""Typical speed where no channel tells it [m/s]."""


def candidate_set_of(
    vehicle: Vehicle,
    *,
    speeds: Floats,
    logs: int = 1,
    shortfall: float = 0.1,
    open_loop: bool = False,
) -> CandidateSet:
    """Collect the tolerances and candidate effects of a vehicle from all installed effects.

    Args:
        vehicle: stated model.
        speeds: typical speeds along the body axes [m/s], shape (3,).
        logs: number of logs that are fitted together.
        shortfall: typical missing share of the battery's full voltage [1].
        open_loop: whether the rotors' speeds were computed from signals to the motors.
    """
    subject = replace(vehicle, speeds=speeds, shortfall=shortfall, open_loop=open_loop)
    found: list[tuple[str, Identification, Addition]] = []
    for name, law in installed().items():
        known = law.identification
        if known.in_arm is None:
            known = replace(known, in_arm=callable(getattr(law, "joint_loads", None)))
        found += [(name, known, a) for a in law.additions(name, subject)]
    found += [("", Identification(), a) for a in _structure(subject)]
    made, waves = Collector(vehicle.effects), dict[str, Waves]()
    for law in wave_laws():
        if vehicle.sea is not None:
            # waves that are known leave no room for others; what goes with them may be a little off
            inside = (replace(a, effect=None) for a in law.additions(subject))
            found += [
                (law.candidate, law.identification, a)
                for a in inside
                if a.instance in vehicle.effects
            ]
            continue
        additions = [_of_each_log(law, a, logs) for a in law.additions(subject)]
        beside = tuple(a.instance for a in additions if a.effect is not None)
        waves |= {a.instance: Waves(law=law, beside=beside) for a in additions if a.effect is None}
        found += [(law.candidate, law.identification, a) for a in additions]
    for name, known, addition in sorted(found, key=lambda f: f[2].order):
        made.take(name, known, addition)
    return made.candidate_set(waves)


def _of_each_log(law: Any, addition: Addition, logs: int) -> Addition:
    """Return the candidates with separate parameters for each log where these may differ."""
    if addition.effect is not None or logs < 2:
        return addition
    own = {
        own_key(name, k): addition.parameters[name] for name in law.per_log for k in range(1, logs)
    }
    return replace(
        addition,
        parameters={**addition.parameters, **own},
        nuisance=(*addition.nuisance, *own),
    )


def wave_laws() -> list[Any]:
    """Return the classes of the waves that may be missing, see `seals.environment.waves`."""
    return list(sea_laws().values())


def installed() -> dict[str, type[Effect]]:
    """Return the classes of all installed effects by name; a broken one is left out with a warning.

    One that lacks an optional dependency cannot act in any model and is left out.
    """
    laws = loaded("effect").items()
    return {n: law for n, law in laws if isinstance(law, type) and issubclass(law, Effect)}


def formula_effect() -> str:
    """Return the name of the installed effect that evaluates a fitted formula.

    Raises:
        UnknownPlugin: none is installed.
    """
    found = (name for name, law in installed().items() if law.identification.formula)
    name = next(found, None)
    if name is None:
        raise UnknownPlugin("no installed effect accepts a formula.\nInstall one: see seals doctor")
    return name


def _structure(subject: Subject) -> list[Addition]:
    """Tolerances of the vehicle itself, beside those of effects."""
    found = []
    spread = subject.spread("torque_coefficient")
    if len(subject.lag) and subject.rotors and spread:
        found.append(
            Addition(
                instance="rotors",
                effect=None,
                parameters={"torque_change": Freed(tolerance=spread, scale=0.1)},
                named=(),
                order=(Stage.actuators, 0, 2),
            )
        )
    if subject.has_water:
        found.append(
            Addition(
                instance="surface",
                effect=SurfaceForce(),
                parameters={"share": Freed(tolerance=_SURFACE, scale=0.1)},
                named=(),
                order=(Stage.water, 0, 3),
            )
        )
    gains = [(n, subject.servo[n]) for n in ("kp", "kd")] if subject.servo else []
    # gains that differ from joint to joint are taken as stated
    if gains and all(np.ptp(gain) == 0.0 for _, gain in gains):
        parameters = {
            n: Freed(tolerance=subject.spread(f"joint_{n}") * float(gain[0]), scale=float(gain[0]))
            for n, gain in gains
        }
        found.append(
            Addition(
                instance="servos",
                effect=None,
                parameters=parameters,
                named=(),
                order=(Stage.joints, 0, 0),
            )
        )
    return found


def candidates_of_runs(settings: CompareSettings, robot: RobotModel) -> CandidateSet:
    """Collect the candidate effects of a configured model, for runs that are compared.

    Raises:
        ConfigError: ``rivals`` or ``naming`` name something that is not there.
    """
    nominal = _nominal(settings)
    sizes = _Sizes(settings, robot)
    made = Collector({n: settings.effects[n] for n in nominal})
    made.parameters = _stated(settings, nominal)
    both = settings.environment.water_level is not None
    taken: set[tuple[Any, ...]] = set()
    for instance, effect in _offered(settings, robot, nominal).items():
        name = _name_of(effect)
        law = (name, getattr(effect, "medium", None), tuple(effect.links))
        if law in taken:
            continue
        taken.add(law)
        made.effects[instance] = replace(effect, correction=True)
        for candidate in _split(name, instance, effect, both=both):
            if candidate.keys:
                made.parameters |= {k: sizes.parameter(effect, k) for k in candidate.keys}
                made.candidates.append(candidate)
    made.candidates = _chosen(made.candidates, settings.rivals)
    return replace(made.candidate_set({}), nominal=tuple(nominal))


def _name_of(effect: Effect) -> str:
    """Return the name of an effect among the candidates.

    Example:
        >>> from seals.registry import get
        >>> _name_of(get("effect", "lift").load()())
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


def _stated(settings: CompareSettings, nominal: Sequence[str]) -> dict[str, Parameter]:
    """Parameters of the stated model, those with a tolerance first."""
    keys = {
        f"{n}.{p}": _parameter(effect, f"{n}.{p}", nominal=float(getattr(effect, p)))
        for n, effect in ((n, settings.effects[n]) for n in nominal)
        for p in parameters_of(effect)
    }
    own: dict[str, Parameter] = {}
    for full, spread in settings.naming.tolerances.items():
        key = str(full).removeprefix("effects.")
        refuse_unlisted(
            key, keys, f"naming.tolerances: '{full}' is not a parameter of the stated model"
        )
        own[key] = replace(keys[key], tolerance=float(spread), scale=float(spread))
    return own | {k: p for k, p in keys.items() if k not in own}


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
    held = {(_name_of(settings.effects[n]), _medium(settings.effects[n])) for n in nominal}
    for name, law, options in _installed(settings, robot):
        medium = options.get("medium")
        configured = any(
            _name_of(e) == name and _medium(e) in (medium, MediumKind.any) for e in out.values()
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


_DRIVEN = ("actuation", "command", "drive_loads", "timing")
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

    def parameter(self, effect: Effect, key: str) -> Parameter:
        """Return one parameter of a candidate: nominal value, start, scale and bounds."""
        law, name = type(effect), key.partition(".")[2]
        rules = law.identification.compared
        off = -self.subject.volume if rules is not None and rules.whole else 0.0
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
