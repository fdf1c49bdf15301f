"""Typed settings of one comparison of a model with measurements."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Any, ClassVar

from seals.field_roles import roles
from seals.run.settings import RunSettings
from seals.schema import param


@roles(data="nominal tolerances judge floor")
@dataclass(kw_only=True)
class NamingSettings:
    """Settings of a diagnosis from several runs: stated model, tolerances, validation.

    Args:
        nominal: instances of effects in the stated model; empty for the first variant of
            ``ladder``, or all effects without one.
        tolerances: full keys of stated parameters and how uncertain they are, one standard
            deviation in their unit; they are fitted in every model.
        judge: channels that are not fitted but used for the evaluation.
        floor: by channel, the error that systematic faults of the measurement leave in any model.
        step: integration step of the twin [s] instead of that of the comparison; 0 for the same.
        stride: keep every n-th row instead of the comparison's choice; 0 for the same.
        folds: maximum number of parts of the training runs; each is held out in turn.
        most: maximum number of effects that are named together.
    """

    nominal: list[str] = field(default_factory=list)
    tolerances: dict[str, float] = field(default_factory=dict)
    judge: list[str] = field(default_factory=list)
    floor: dict[str, Any] = field(default_factory=dict)
    step: float = param(0.0, "s", bounds=(0.0, 0.1), tolerance=0.0, source="chosen", fit=False)
    stride: int = 0
    folds: int = 6
    most: int = 3


_CHOSEN = "chosen"


class StartMode(Enum):
    """Source of the state at the start of a comparison."""

    auto = "auto"
    """``drop`` for logs without pose, else ``pose``."""
    pose = "pose"
    """The first samples of position, attitude, velocity and joints; refined on the data."""
    drop = "drop"
    """A release from rest found in the accelerometer: the speed at entry is that of the fall."""


class PredictionMethod(Enum):
    """Method by which a model predicts the sensors' readings."""

    simulated = "simulated"
    """The motion is integrated from the start of every run."""
    glide = "glide"
    """A steady glide at the measured pitch: forces balance at every sample."""
    thrust = "thrust"
    """What an accelerometer feels of the rotors' measured commands."""
    heave = "heave"
    """Steady heave in a regular wave: its amplitude against that of the wave."""


@dataclass(kw_only=True)
class CompareOptions:
    """Options of a comparison.

    Args:
        course: how sensor readings are computed from the model.
        start: where the initial state comes from.
        step: integration step of the batch dynamics [s]; 0 chooses from the sampling.
        stride: keep every n-th row.
        before: time kept before the water entry of a drop [s].
        after: time kept after the water entry of a drop [s].
        margin: time removed before the end of a drop [s].
        idle_speed: speed of a rotor at no pulse width, for the course ``thrust`` [rad/s].
        offset: search for a clock offset up to this size [s]; 0 for none.
        iterations: maximum number of Gauss-Newton steps.
    """

    course: PredictionMethod = PredictionMethod.simulated
    start: StartMode = StartMode.auto
    step: float = param(0.0, "s", bounds=(0.0, 0.1), tolerance=0.0, source=_CHOSEN, fit=False)
    stride: int = 1
    before: float = param(0.0, "s", bounds=(0.0, 1.0), tolerance=0.0, source=_CHOSEN, fit=False)
    after: float = param(0.08, "s", bounds=(0.001, 10.0), tolerance=0.0, source=_CHOSEN, fit=False)
    margin: float = param(0.015, "s", bounds=(0.0, 1.0), tolerance=0.0, source=_CHOSEN, fit=False)
    offset: float = param(0.0, "s", bounds=(0.0, 1.0), tolerance=0.0, source=_CHOSEN, fit=False)
    idle_speed: float = param(
        0.0, "rad/s", bounds=(0.0, 1e5), tolerance=0.0, source=_CHOSEN, fit=False
    )
    iterations: int = 12


@roles(data="name only reader fit train held_out per_log ladder rivals", read="log", write="out")
@dataclass(kw_only=True)
class CompareSettings(RunSettings):
    """Settings of a comparison: a run as the model, and the measurement.

    Args:
        log: folder, file or name of the measurement, a list of these, or None for all data of
            the reader.
        only: names (shell patterns) of the logs to use; empty for all.
        reader: plug-in that reads the measurement.
        fit: full keys of the parameters to fit, for instance ``effects.hull_drag.coefficient_z``;
            ``axes`` of one stem may be tied:
            ``effects.drag.coefficient_x+coefficient_y+coefficient_z``.
        train: names (shell patterns) of the logs or segments that are fitted; empty for all.
        held_out: names (shell patterns) of the logs or segments on which the fit is evaluated.
        per_log: fit every log by itself instead of all together.
        ladder: variants by name, each the list of effects that act; empty for one variant with all
            effects.
        rivals: effects that may be missing, for ``seals diagnose``: names of effects or of
            instances in the configuration; empty for all that could act.
        naming: stated model and criterion, for ``seals diagnose``.
        compare: settings of the comparison.
        out: folder of the results, or None for the run's folder.
    """

    name: str = "compare"
    log: Any = None
    only: list[str] = field(default_factory=list)
    reader: Any = None
    fit: list[str] = field(default_factory=list)
    train: list[Any] = field(default_factory=list)
    held_out: list[Any] = field(default_factory=list)
    per_log: bool = False
    ladder: dict[str, Any] = field(default_factory=dict)
    rivals: list[str] = field(default_factory=list)
    naming: NamingSettings = field(default_factory=NamingSettings)
    compare: CompareOptions = field(default_factory=CompareOptions)
    out: str | None = None

    several: ClassVar[bool] = False
