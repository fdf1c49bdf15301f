"""Diagnosis of a flight by healthy flights, and its output for `diagnosis.json`."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from seals.errors import LogError
from seals.logs.log import Log
from seals.sysid.data.robot_description import RobotDescription, stated_robot
from seals.sysid.data.vehicle import Vehicle, read_vehicle
from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.decision.verdict import Verdict
from seals.sysid.healthy_flights.balance import (
    DriveLayout,
    balance_of,
    has_inertial,
    layout_of,
)
from seals.sysid.healthy_flights.comparison import COMMON, Changed, Reference

_SAME_MASS = 0.1
"""Share by which stated masses of one vehicle differ at most: a battery, or a load."""


@dataclass(frozen=True, kw_only=True)
class HealthyDiagnosis:
    """Answer about a flight beside healthy ones.

    Args:
        reference: the healthy flights.
        changed: what the flight shows.
        left_out: what each healthy flight shows beside the other sessions, by its name.
        seconds: that it took.
        source: path and checksum of the log, ``healthy`` the same of the healthy ones.
    """

    reference: Reference
    changed: Changed
    left_out: Mapping[str, Changed]
    seconds: float = 0.0
    source: Mapping[str, Any] = field(default_factory=dict)

    @property
    def odd(self) -> list[str]:
        """Healthy flights that the others would call changed."""
        return [n for n, one in self.left_out.items() if set(one.names) - set(COMMON)]

    @property
    def verdict(self) -> Verdict:
        """Of the comparison; it cannot tell where no change of any size would be seen."""
        blind = all(math.isnan(size) for size in self.reference.smallest.values())
        silent = self.changed.verdict is Verdict.nothing_missing
        return Verdict.cannot_tell if blind and silent else self.changed.verdict

    def confidence(self, name: str) -> float:
        """Return the probability of an explanation among all, each as probable as no change."""
        scores = {**self.changed.scores, "": 0.0}
        most = max(scores.values())
        odds = {n: math.exp(0.5 * (s - most)) for n, s in scores.items()}
        return odds[name] / sum(odds.values())

    def effects(self) -> list[dict[str, Any]]:
        """Effects of the answer in the form of ``diagnosis.json``, best first."""
        out = []
        for name in self.changed.names:
            effect, _, drives = name.partition("@")
            out.append(
                {
                    "name": effect,
                    "drives": [int(k) for k in drives.split("+") if k],
                    "confidence": self.confidence(name),
                    "parameters": self.reference.parameters(name, self.changed),
                }
            )
        return out

    def reasons(self) -> list[str]:
        """What the answer rests on, in words."""
        sessions = self.reference.scatter.sessions
        out = []
        if self.verdict is Verdict.none_of_these:
            out.append(
                "no effect at a drive, no load and no shift of the centre of gravity explains the "
                "difference from the healthy flights"
            )
        if self.verdict is Verdict.cannot_tell:
            out.append("the drives are nearly idle: changes of the drives would not be detected")
        if sessions < 2:
            out.append(
                "one healthy session shows no scatter between sessions: that of other vehicles is "
                "assumed; fly more sessions"
            )
        for name in self.odd:
            out.append(f"the healthy flight {name} differs from the others like a changed one")
        return out

    def to_dict(self) -> dict[str, Any]:
        """Return the answer in the form of ``diagnosis.json``."""
        reference, changed = self.reference, self.changed
        scatter, modes = reference.scatter, reference.modes.names
        return {
            "verdict": self.verdict.value,
            "effects": self.effects(),
            "ambiguous_with": [list(changed.names)] if len(changed.names) > 1 else [],
            "next_experiment": None,
            "held_out_error": None,
            "reasons": self.reasons(),
            "tried": [
                {"name": n.partition("@")[0], "label": n, "score": s}
                for n, s in sorted(changed.scores.items(), key=lambda item: -item[1])
            ],
            "healthy": {
                "sessions": scatter.sessions,
                "thrusts": scatter.mean.tolist(),
                "lost_share": changed.lost_shares.tolist(),
                "modes": {
                    mode: {"change": float(d), "scatter": float(v) ** 0.5, "degrees": float(f)}
                    for mode, d, v, f in zip(
                        modes, changed.change, scatter.variance, scatter.degrees, strict=True
                    )
                },
                "required": reference.least,
                "unexplained": changed.unexplained,
                "smallest": reference.smallest,
                "left_out": {
                    n: {"evidence": one.evidence, "explanations": list(one.names)}
                    for n, one in self.left_out.items()
                },
            },
            "log": dict(self.source),
            "seconds": self.seconds,
        }


@dataclass(frozen=True, kw_only=True)
class HealthyFlights:
    """Healthy flights of one vehicle, read.

    Args:
        vehicle: that flew them.
        stated: what their logs say of it: name, mass [kg] and number of drives.
        reference: their balances.
        inertial: whether accelerometers tell how much the drives carry.
        left_out: what each healthy flight shows beside the other sessions, by its name.
    """

    vehicle: Vehicle
    stated: Mapping[str, Any]
    reference: Reference
    inertial: bool
    left_out: Mapping[str, Changed]

    @classmethod
    def of(
        cls,
        logs: Sequence[Log],
        robot: RobotDescription | None,
        *,
        sessions: Sequence[int] = (),
        inertial: bool = True,
    ) -> HealthyFlights:
        """Return the healthy flights of logs.

        Args:
            logs: one at least.
            robot: that flew them; None for the vehicle that they state.
            sessions: number of the session of each; left out, each is one of its own.
            inertial: whether the logs to compare have accelerometers.

        Raises:
            LogError: a log shows no flight, has no commands, or is of another vehicle.
        """
        knows = [log for log in logs if _stated(log)]
        if robot is None and not knows:
            raise LogError(
                f"log '{logs[0].name}' does not state its vehicle (meta.yaml: vehicle).\n"
                "Give it: robot=NAME, or a robot's folder"
            )
        vehicle = _vehicle((knows or list(logs))[0], robot)
        layout, stated = layout_of(vehicle, logs[0]), dict[str, Any]()
        inertial = inertial and all(has_inertial(log) for log in logs)
        flights = []
        for log, session in zip(logs, sessions or range(len(logs)), strict=True):
            _refuse_other(log, robot, stated, layout)
            stated = {**_stated(log), **stated}
            flights.append(balance_of(log, vehicle, layout, session=session, inertial=inertial))
        reference, left_out = Reference(layout, tuple(flights)), {}
        for flight in flights:
            others = reference.without(flight.session)
            if others is not None and others.scatter.sessions > 1:
                left_out[flight.name] = others.compared(flight, DecisionPolicy())
        return cls(
            vehicle=vehicle, stated=stated, reference=reference, inertial=inertial,
            left_out=left_out,
        )  # fmt: skip

    def diagnose(self, log: Log, robot: RobotDescription | None) -> HealthyDiagnosis:
        """Return what changed between the healthy flights and another one.

        Raises:
            LogError: the log shows no flight, has no commands, or is of another vehicle.
        """
        began, layout = time.perf_counter(), self.reference.layout
        _refuse_other(log, robot, self.stated, layout)
        flight = balance_of(log, self.vehicle, layout, inertial=self.inertial)
        return HealthyDiagnosis(
            reference=self.reference,
            changed=self.reference.compared(flight, DecisionPolicy()),
            left_out=self.left_out,
            seconds=time.perf_counter() - began,
        )


def _refuse_other(
    log: Log, robot: RobotDescription | None, stated: Mapping[str, Any], layout: DriveLayout
) -> None:
    """Refuse a log that states another vehicle than the healthy flights.

    What a log itself says counts also where the robot is given; a log that says nothing passes.

    Args:
        log: to look at.
        robot: that was given; None for the vehicle that the logs state.
        stated: what the healthy logs say: name, mass [kg] and number of drives.
        layout: drives of their vehicle.

    Raises:
        LogError: it does.
    """
    own = _stated(log)
    differ = [
        key for key in own
        if key in stated and not _alike(own[key], stated[key], _SAME_MASS if key == "mass" else 0.0)
    ]  # fmt: skip
    if differ:
        words = [", ".join(f"{key} {one[key]}" for key in differ) for one in (own, stated)]
        raise LogError(
            f"log '{log.name}' is of another vehicle ({words[0]}) than the healthy flights "
            f"({words[1]}).\nGive flights of one vehicle, or correct vehicle in meta.yaml."
        )
    if robot is None and own:
        wrench = layout_of(_vehicle(log, None), log).wrench
        if wrench.shape != layout.wrench.shape or not np.allclose(wrench, layout.wrench):
            raise LogError(
                f"log '{log.name}' states different drives than the healthy flights: number, "
                "positions, axes or torques differ.\nGive flights of one vehicle, or its folder: "
                "robot=NAME"
            )


def _stated(log: Log) -> dict[str, Any]:
    """Return what a log says of its vehicle: name, mass [kg], number of drives, where it does."""
    vehicle = stated_robot(log.meta)
    out = {key: vehicle[key] for key in ("name", "mass") if vehicle.get(key) is not None}
    drives = [vehicle[key] for key in ("rotors", "thrusters") if isinstance(vehicle.get(key), list)]
    return {**out, "drives": sum(map(len, drives))} if any(drives) else out


def _alike(one: Any, other: Any, share: float) -> bool:
    """Return whether two statements agree, numbers within a share."""
    if all(isinstance(value, int | float) for value in (one, other)):
        return math.isclose(one, other, rel_tol=share)
    return bool(one == other)


def _vehicle(log: Log, robot: RobotDescription | None) -> Vehicle:
    """Return the vehicle of a log, in air on Earth where it states no surroundings."""
    return read_vehicle({"environment": {}, **log.meta}, robot)
