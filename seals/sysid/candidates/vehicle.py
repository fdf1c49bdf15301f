"""Candidate effects of a vehicle, from the declarations of all installed effects."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.effects.discrepancy import SurfaceForce
from seals.effects.effect import Effect
from seals.effects.identification import Addition, Freed, Identification, Stage, Subject
from seals.errors import UnknownPlugin
from seals.sysid.candidates.parameters import CandidateSet, Collector, Waves
from seals.sysid.data.installed import loaded
from seals.sysid.data.known_sea import own_key, sea_laws
from seals.sysid.data.vehicle import Vehicle

_SURFACE = 0.04
"""1-sigma of the hydrostatic force while the hull pierces the surface, as a share."""


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
