"""Model of whole runs, linearised about its own trajectory, and its Gauss-Newton iteration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.least_squares import BlockIterate, BlockPace, Proposal, minimise
from seals.sysid.data.trajectory import Trajectory
from seals.sysid.predictors.normal_equations import Fit, newton_step
from seals.sysid.predictors.problem import stated_starts, transient_rows
from seals.sysid.predictors.substep_integrator import SubstepFitter, SubstepIntegrator
from seals.sysid.predictors.surface_model_error import SurfaceModelError
from seals.sysid.predictors.windows import WHOLE, Windows

_KNOT = 0.05
"""Spacing of the knots of the disturbance [s]."""
_REACH = np.repeat([0.06, 0.1, 0.4, 1.0], 3)
"""Longest step of a trajectory: position [m], turn [rad], velocity [m/s], spin [rad/s]."""


@dataclass(frozen=True, kw_only=True)
class UnmodelledDisturbance:
    """Unmodelled disturbance: gusts and the model error at the water surface.

    Args:
        gusts: factor on their stated level.
        surface_error: errors at the surface, the same for every model; None without a surface.
        length: of the windows, longer than a run for whole runs [s].
    """

    gusts: float
    surface_error: SurfaceModelError | None
    length: float = WHOLE


@dataclass(frozen=True, kw_only=True)
class LinearisedModel:
    """Model linearised about a trajectory of its own and parameter values.

    Args:
        fitter: of that linearisation.
        fit: its equations at those values.
        disturbance: under which it is judged.
        done: whether further steps gain nothing.
    """

    fitter: SubstepFitter
    fit: Fit
    disturbance: UnmodelledDisturbance
    done: bool = False

    @property
    def level(self) -> float:
        """Twice the negative log evidence, up to a constant, without the Occam factor."""
        return self.fit.cost + self.fitter.windows.volume


def linearise_about(
    integrator: SubstepIntegrator,
    trajectory: Trajectory,
    free: Sequence[str],
    at: Mapping[str, float],
    disturbance: UnmodelledDisturbance,
) -> LinearisedModel:
    """Linearise a model about a trajectory and values."""
    substeps = integrator.substeps(trajectory, at)
    rows, fine = integrator.dynamics(substeps, at)
    plant, surface_error = integrator.plant, disturbance.surface_error
    windows = Windows(
        plant.samples,
        plant.vehicle,
        trajectory,
        rows,
        length=disturbance.length,
        gusts=disturbance.gusts,
        surface_error=surface_error,
        knot=max(_KNOT, 1.5 * plant.samples.step),
        stated=stated_starts(plant, trajectory) if disturbance.length == WHOLE else None,
        skip=transient_rows(plant),
    )
    fitter = SubstepFitter(integrator, trajectory, windows, fine=fine, rows=rows, at=at)
    return LinearisedModel(fitter=fitter, fit=fitter.start(free), disturbance=disturbance)


def converged(now: LinearisedModel, *, rounds: int) -> LinearisedModel:
    """Iterate Gauss-Newton steps of parameters, start states and gusts to convergence.

    Args:
        now: model to start from.
        rounds: steps at most.

    Returns:
        The best model on the way; ``done`` where the iteration converged there.
    """
    task = _RunTask(
        now=now,
        best=now,
        done=now.done,
        cost=now.fit.cost,
        pace=np.ones(now.fitter.windows.count),
        misfit=now.fit.misfit,
    )
    task.remember()
    minimise(_Descent(), [task], BlockPace(), steps=rounds)
    return replace(task.best, done=task.done and not task.stuck)


class _Step(NamedTuple):
    """Model after a step, with the largest move in units of the reach."""

    cost: float
    model: LinearisedModel
    moved: float


@dataclass(kw_only=True)
class _RunTask(BlockIterate):
    """Whole-run model during its fit; a block is a run."""

    now: LinearisedModel
    best: LinearisedModel
    stuck: bool = False

    def remember(self) -> None:
        """Store the present model as the best one."""
        self.best, self.best_cost, self.best_misfit = self.now, self.cost, self.misfit

    def recall(self) -> None:
        """Return to the best model."""
        self.now, self.cost, self.misfit = self.best, self.best_cost, self.best_misfit


class _Descent:
    """Gauss-Newton problem of models that are linearised about their own trajectories."""

    def linearise(self, tasks: Sequence[_RunTask]) -> None:
        """Do nothing: a model is linearised at the point it moved to."""

    def evaluate(
        self, tasks: Sequence[_RunTask], proposals: Sequence[Sequence[Proposal]]
    ) -> list[list[_Step]]:
        """Take a step; a task whose step is not finite ends."""
        out: list[list[_Step]] = []
        for task in tasks:
            step = _stepped(task.now, task.pace)
            task.stuck = task.done = step is None
            out.append([] if step is None else [step])
        return out

    def keep(self, task: _RunTask, outcome: _Step) -> None:
        """Move to the model after a step."""
        task.now, task.moved, task.misfit = outcome.model, outcome.moved, outcome.model.fit.misfit


def _stepped(now: LinearisedModel, pace: Floats) -> _Step | None:
    """Take a step with one step length per run; return the largest move in units of the reach.

    None where the step is not finite: the equations, or the trajectory that it leads to.
    """
    fitter = now.fitter
    step, _ = newton_step(now.fit)
    if not np.isfinite(step).all():
        return None
    values = fitter.moved(now.fit, step, float(pace.mean()))
    windows = fitter.windows
    # a trial from a trajectory far off may run away, and is refused below
    with np.errstate(over="ignore", invalid="ignore"):
        prediction = fitter.prediction(values)
    error = windows.states(windows.residual(prediction), prediction)
    if not np.isfinite(error).all():
        return None
    largest = 0.0
    for run, share in zip(windows.rows, pace, strict=True):
        size = float((np.abs(error[run, :12]) / _REACH).max())
        largest = max(largest, size)
        # a measured pose holds a trajectory by itself
        far = 1.0 / max(size, 1e-9) if now.disturbance.length == WHOLE else 1.0
        error[run] *= min(share, far)
    trajectory = fitter.trajectory.moved(error)
    try:
        moved = linearise_about(
            fitter.integrator, trajectory, now.fit.free, values, now.disturbance
        )
    except np.linalg.LinAlgError:
        # a trajectory so far off that its windows have no equations left
        return None
    return _Step(moved.fit.cost, moved, largest)
