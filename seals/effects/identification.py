"""Declarations of effects for system identification: plausible sizes, variants, confounders.

Every installed effect is a candidate of a diagnosis. One that has a law and parameters declared
with `seals.schema.param` needs no more: `seals.effects.derived` derives the rest. One that knows
better states an `Identification`, or overrides `seals.effects.Effect.additions`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.frames import AXES
from seals.motion import MediumKind

if TYPE_CHECKING:
    from seals.arrays import Floats
    from seals.effects.effect import Effect
    from seals.environment.settings import EnvironmentSettings
    from seals.hydrostatics import Hull
    from seals.robot.model import RobotModel


class Stage(IntEnum):
    """Part of the vehicle in which an effect acts; candidates are tried stage by stage."""

    body = 0
    actuators = 1
    flow = 2
    water = 3
    joints = 4
    surroundings = 5
    sensors = 6
    installed = 7


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Declaration of an effect for comparisons of several runs.

    Args:
        order: stage and rank: effects are tried in this order.
        media: in which it is tried; empty for the class's own medium, or for an effect without one.
        scales: plausible size by the stem of a parameter; 0.05 where nothing is stated.
        laws: stems of its laws where it has several, told apart, and their names.
        held: parameters, by stem, that a few runs do not tell.
        rigid: a property of the body, which what is bolted down does not feel: its last link does.
        whole: switched off by the robot's whole displaced volume, and never tried beside itself.
    """

    order: tuple[int, int] = (Stage.installed, 0)
    media: tuple[str, ...] = ()
    scales: Mapping[str, Callable[[Subject], float]] = field(default_factory=dict)
    laws: Mapping[str, str] = field(default_factory=dict)
    held: tuple[str, ...] = ()
    rigid: bool = False
    whole: bool = False


@dataclass(frozen=True, kw_only=True)
class Identification:
    """Declarations of an effect that a diagnosis uses.

    Args:
        scales: plausible change of a parameter, by its name or the stem of ``stem_x ... stem_z``,
            in the parameter's unit: the prior width of a missing effect. Left out, it is derived
            from the unit, see `seals.effects.derived.plausible_scale`. Name here a parameter whose
            bounds exclude zero (a shape rather than a strength) to have it fitted too.
        searched: whether the diagnosis of one log tries the effect. False for laws that every model
            holds anyway and for those that only several runs compared can tell.
        starts: starting values of the fit, one row of parameters each; none for zero alone.
        resists: whether it is a drag, which an error in the law of another drag may imitate.
        answers: whether it changes the response to commands, as feedback against gusts does.
        needs_motion: rank among the effects that only a log with enough motion can show; `seals
            plan` serves the first one first. None for all others.
        in_arm: it acts inside an arm; None where the hook ``joint_loads`` decides.
        always_fitted: whether the linear screen may not rule it out, because its response about
            zero is not typical of it.
        confounders: names of effects that a log may be unable to tell from it; either of two may
            name the other. They are compared first where an effect is one of several.
        data_sheet: two sides of one proportion of a vehicle, such as thrust and mass, share a
            name here: a data sheet that is wrong about one looks like an effect of the other. The
            effect whose unnamed addition is the vehicle's own value stands for the data sheet.
        may_begin: it may begin midway through a log: a gust, a part that breaks, sliding ballast.
        may_end: it may end midway through a log: a gust, a payload that is dropped, a fouled blade
            that comes clear.
        guessed: it is not linear about zero and needs a pose and starting values from the residual
            force, see `seals.effects.Effect.guesses`.
        placed: its force depends on the place in the world.
        centre: parameter, a vector of the world, that is the point toward which it acts.
        approximate: whether its law is of first order and leaves part of the residual.
        adds_only: parameters whose natural spread can only add, such as latencies.
        family: common name of laws that differ only by the power of the speed; where a fit needs
            two of them, neither is the law.
        power: of the speed, of a law of a family.
        measurement: a measurement on the ground that would identify it, as a sentence.
        words: plain names of its parameters by their name or stem; ``{}`` stands for the variant.
        gusty: it is a flow that comes with gusts: one whose force is no larger than theirs is none
            that blows steadily.
        formula: its parameters are the terms of a formula: a force that no effect explains becomes
            an instance of it.
        compared: how comparisons of several runs try it; None where they do not.

    Example:
        >>> Identification(scales={"stiffness": 5.0}).searched
        True
    """

    scales: Mapping[str, float] = field(default_factory=dict)
    searched: bool = True
    starts: tuple[tuple[float, ...], ...] = ()
    resists: bool = False
    answers: bool = False
    needs_motion: int | None = None
    in_arm: bool | None = None
    always_fitted: bool = False
    confounders: tuple[str, ...] = ()
    data_sheet: str = ""
    may_begin: bool = False
    may_end: bool = False
    guessed: bool = False
    placed: bool = False
    centre: str = ""
    approximate: bool = False
    adds_only: tuple[str, ...] = ()
    family: str = ""
    power: int = 0
    measurement: str = ""
    words: Mapping[str, str] = field(default_factory=dict)
    gusty: bool = False
    formula: bool = False
    compared: Comparison | None = field(default_factory=Comparison)


@dataclass(frozen=True, kw_only=True)
class Property:
    """Number of a vehicle's stated model, and how a parameter changes it.

    Args:
        name: ``mass``, ``inertia_xx``, or the field of a hull or of an actuator.
        value: as the model states it.
        unit: of the value.
        section: of ``robot.yaml``, ``hulls`` or ``actuators``; empty for the whole vehicle.
        slope: change of the number with the parameter; the number itself for a relative change.
    """

    name: str
    value: float
    unit: str
    section: str = ""
    slope: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Freed:
    """Free parameter of a fit; all values are changes against the stated model.

    Args:
        tolerance: 1-sigma of the change that the vehicle's data admit; 0 where they are exact.
        scale: size of a plausible missing effect.
        bounds: of the change.
        least: size below which the law does not hold or nobody would call it a fault; an effect
            that stays below it is not named.
        changes: number of the stated model of which the tolerance is the accuracy; None where that
            is a field of an effect of the same law.
        nudge: step of the difference quotient by it; 0 for a share of its size.
    """

    tolerance: float = 0.0
    scale: float = 1.0
    bounds: tuple[float, float] = (-math.inf, math.inf)
    least: float = 0.0
    changes: Property | None = None
    nudge: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Addition:
    """Candidate: a variant in which an effect may be missing on a vehicle.

    Args:
        instance: name of the effect's instance in the extended model.
        effect: with all changes zero; None where the parameters are those of an instance that the
            stated model holds.
        parameters: that a fit may move.
        named: those that make up the candidate, in the order of the report; None for all, empty for
            a tolerance of the stated model that is not a candidate.
        reported: their names in the report; None for the same.
        nuisance: parameters that the candidate frees but does not report.
        variant: tells variants apart, for example ``{"rotor": 2}``.
        law: which form of the effect's law, where it offers several; empty for its usual one.
        starts: starting values of the named and nuisance parameters, one row each.
        order: stage, index of the medium or joint, and rank: candidates are tried in this order.
    """

    instance: str
    effect: Effect | None
    parameters: Mapping[str, Freed]
    named: tuple[str, ...] | None = None
    reported: tuple[str, ...] | None = None
    nuisance: tuple[str, ...] = ()
    variant: Mapping[str, float] = field(default_factory=dict)
    law: str = ""
    starts: Sequence[Sequence[float]] = ()
    order: tuple[int, int, int] = (Stage.installed, 0, 0)


@dataclass(frozen=True, kw_only=True)
class Subject:
    """Vehicle whose model is identified, from which effects derive their candidates.

    Args:
        robot: links, masses, hulls.
        effects: of the stated model by instance.
        environment: air, water, ground.
        lag: first-order time constants of the drives [s], shape (n,).
        commands: channel of the drives' commands; empty for none.
        servo: gains of the joint servos, shape (J,) each; empty without an arm.
        full_voltage: of the battery [V]; None when not known.
        sigma: white noise of each measured channel, 1-sigma, in the channel's unit.
        tolerance: 1-sigma uncertainty of each stated property, by name.
        simulated_step: step of the simulation that made the log [s], whose laws are those of this
            version; None for another log.
        speeds: typical speeds along the body axes [m/s], shape (3,); zero before a log is followed.
        shortfall: typical missing share of the battery's full voltage [1].
        open_loop: whether the rotors' speeds were computed from signals to the motors.
    """

    robot: RobotModel
    effects: Mapping[str, Effect]
    environment: EnvironmentSettings
    lag: Floats = field(default_factory=lambda: np.zeros(0))
    commands: str = ""
    servo: Mapping[str, Floats] = field(default_factory=dict)
    full_voltage: float | None = None
    sigma: Mapping[str, float] = field(default_factory=dict)
    tolerance: Mapping[str, float] = field(default_factory=dict)
    simulated_step: float | None = None
    speeds: Floats = field(default_factory=lambda: np.zeros(3))
    shortfall: float = 0.1
    open_loop: bool = False

    @property
    def rotors(self) -> bool:
        """Whether rotors are commanded."""
        return self.commands == "rotor_speed_cmd"

    @property
    def media(self) -> tuple[MediumKind, ...]:
        """Media in which the vehicle moves, water first."""
        if self.has_water and self.rotors:
            return (MediumKind.water, MediumKind.air)
        dry = self.environment.water_level is None
        return (MediumKind.air if dry else MediumKind.water,)

    @property
    def mass(self) -> float:
        """Mass of the whole vehicle [kg]."""
        return float(self.robot.mass.sum())

    @property
    def weight(self) -> float:
        """Weight of the whole vehicle [N]."""
        return self.mass * self.environment.gravity

    @property
    def hull(self) -> Hull | None:
        """Hull of the base."""
        return self.robot.hulls[0]

    @property
    def has_water(self) -> bool:
        """Return true if there is water and the base has a hull."""
        return self.environment.water_level is not None and self.hull is not None

    @property
    def volume(self) -> float:
        """Volume of all hulls [m^3]."""
        return sum(h.volume for h in self.robot.hulls if h is not None)

    @property
    def reach(self) -> float:
        """Reach of the largest hull [m]; 0.15 m without one."""
        return max((h.reach for h in self.robot.hulls if h is not None), default=0.15)

    @property
    def speed(self) -> float:
        """Largest of the typical speeds [m/s]."""
        return float(self.speeds.max())

    @property
    def length(self) -> float:
        """Size of the vehicle [m]: of its hull, or the radius of gyration of its base."""
        if self.hull is not None:
            return float(self.hull.volume ** (1.0 / 3.0))
        turning = float(np.trace(self.robot.inertia[0])) / 3.0
        return max(math.sqrt(turning / max(float(self.robot.mass[0]), 1e-9)), 0.05)

    def spread(self, name: str) -> float:
        """Return the stated tolerance of a property, 0 where none is stated."""
        return float(self.tolerance.get(name, 0.0))

    def nominal(self, name: str, stem: str, medium: MediumKind) -> Floats:
        """Return three parameters of a stated effect in a medium, shape (3,).

        An instance of the stated model is called after its effect and medium, such as
        ``linear_drag_water``; one that acts in any medium counts in each. Zeros without one.

        Args:
            name: under which the effect is installed.
            stem: of the parameters ``stem_x``, ``stem_y`` and ``stem_z``.
            medium: in which it acts.
        """
        total: Floats = np.zeros(3)
        for kind in (medium, MediumKind.any):
            effect = self.effects.get(f"{name}_{kind.value}")
            if effect is not None:
                total = total + [float(vars(effect).get(f"{stem}_{a}", 0.0)) for a in AXES]
        return total


@dataclass(frozen=True, kw_only=True)
class Residual:
    """Residual force of a model over the time of a log, K points.

    Args:
        position: of the base, world axes [m], shape (K, 3).
        force: that is left over, world axes [N], shape (K, 3).
        time: of each point, on the time of its log [s], shape (K,).
        subject: the vehicle.
        log: index of the log of each point, shape (K,); zeros for one log.
    """

    position: Floats
    force: Floats
    time: Floats
    subject: Subject
    log: Any = 0


def addition_along_axes(
    law: type[Effect],
    name: str,
    stem: str,
    sizes: tuple[Any, Any],
    order: tuple[int, int, int],
    **more: Any,
) -> list[Addition]:
    """Return the one candidate of an effect whose parameters are those of three axes.

    Args:
        law: the effect.
        name: of its instance.
        stem: of its parameters.
        sizes: their tolerance and scale, see `along_axes`.
        order: see `Addition`.
        more: further fields of the `Addition`.
    """
    parameters = along_axes(stem, *sizes)
    return [Addition(instance=name, effect=law(), parameters=parameters, order=order, **more)]


def along_axes(
    stem: str, tolerance: Any, scale: Any, *, low: Floats | None = None
) -> dict[str, Freed]:
    """Return the three parameters ``stem_x``, ``stem_y`` and ``stem_z``.

    Args:
        stem: of their names.
        tolerance: one number or three.
        scale: one number or three.
        low: lower bounds of the changes, shape (3,).

    Example:
        >>> along_axes("bias", 0.0, 0.3)["bias_y"].scale
        0.3
    """
    sizes = np.broadcast_to(np.asarray(scale, dtype=float), 3)
    spread = np.broadcast_to(np.asarray(tolerance, dtype=float), 3)
    least = np.full(3, -math.inf) if low is None else low
    return {
        f"{stem}_{a}": Freed(
            tolerance=float(spread[i]), scale=float(sizes[i]), bounds=(float(least[i]), math.inf)
        )
        for i, a in enumerate(AXES)
    }
