"""Misfit of a linearised model as a function of the times at which an effect begins and ends."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.sysid.candidates.activity import ACTIVE, log_rows
from seals.sysid.candidates.parameters import Candidate
from seals.sysid.predictors.linear_screen import CandidateEquations
from seals.sysid.predictors.linearise import Columns
from seals.sysid.predictors.normal_equations import Fit
from seals.sysid.predictors.whitened import Whitened
from seals.sysid.predictors.windows_fit import Fitter

_FREE = 1e-6
"""Prior precision of a strength in units of the present one: free."""


@dataclass(frozen=True, kw_only=True)
class Blocks:
    """Inner products of an effect's responses; leading axes count alternatives.

    Args:
        cross: with the responses of all other parameters, shape (..., f, c).
        own: with themselves, shape (..., c, c).
        right: with the misfit without the effect, shape (..., c).
    """

    cross: Floats
    own: Floats
    right: Floats

    def each(self, change: Callable[..., Floats], *others: Blocks) -> Blocks:
        """Return the result of a function of each of the three arrays, of others beside them."""
        parts = zip(*((b.cross, b.own, b.right) for b in (self, *others)), strict=True)
        cross, own, right = (change(*part) for part in parts)
        return Blocks(cross=cross, own=own, right=right)

    def __add__(self, other: Blocks) -> Blocks:
        """Return the sum, as products of separate windows add."""
        return self.each(np.add, other)

    def __getitem__(self, at: Any) -> Blocks:
        """Return some of the choices."""
        return self.each(lambda x: x[at])

    def less(self, other: Blocks) -> Blocks:
        """Return the difference."""
        return self.each(np.subtract, other)

    def over(self, axis: int = 0) -> Blocks:
        """Return the sum over one leading axis."""
        return self.each(lambda x: x.sum(axis=axis))

    def before(self) -> Blocks:
        """Return the exclusive cumulative sums along the first axis."""
        return self.each(lambda x: np.cumsum(x, axis=0) - x)

    def in_line(self) -> Blocks:
        """Return the choices of two leading axes in one."""
        return self.each(lambda x: x.reshape(x.shape[0] * x.shape[1], *x.shape[2:]))


@dataclass(frozen=True, kw_only=True)
class ActivityEquations:
    """Normal equations of an effect that begins or ends inside windows; W windows, R offsets.

    The response of a window to an effect that acts in some of its rows is linear in these rows. The
    first column of the effect is its response at its present values, where it has any.

    Args:
        fitter: of the linearisation.
        offsets: rows, and parts of a row, after the start of a window from which, or up to which,
            the effect acts, ascending, the first of them 0, shape (R,).
        on: acting from each offset on, shape (W, R) in front.
        off: acting up to each offset, shape (W, R) in front.
        normal: of all other parameters over all windows, priors included, shape (f, f).
        gradient: of all other parameters without the effect, priors included, shape (f,).
        precision: prior precision of the effect's parameters, shape (k,).
        at: present values of the effect's parameters, shape (k,).
        values: of all other parameters.
    """

    fitter: Fitter
    offsets: Floats
    on: Blocks
    off: Blocks
    normal: Floats
    gradient: Floats
    precision: Floats
    at: Floats
    values: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def _inverse_factor(self) -> Floats:
        scale = 1.0 / np.sqrt(np.maximum(np.diag(self.normal), 1e-300))
        scaled = self.normal * scale[:, None] * scale[None, :] + 1e-12 * np.eye(len(scale))
        inverse: Floats = np.linalg.inv(np.linalg.cholesky(scaled)) * scale
        return inverse

    @cached_property
    def absent(self) -> float:
        """Decrease of the cost by the other parameters alone."""
        return float(np.sum((self._inverse_factor @ self.gradient) ** 2))

    def fall(self, blocks: Blocks) -> tuple[Floats, Floats]:
        """Predict the decrease of the cost by the effect, and its parameter values.

        Args:
            blocks: sums over the windows, shape (N,) in front.

        Returns:
            Falls, shape (N,), and values of the effect's parameters, shape (N, k).
        """
        present = self.at.any()
        first = 1 if present else 0
        moved = blocks.cross[:, :, first:]
        gradient = np.broadcast_to(self.gradient, blocks.cross.shape[:2])
        own_gradient = blocks.right[:, first:] - self.precision * self.at
        own = blocks.own[:, first:, first:] + np.diag(self.precision)
        fixed = np.full(len(own), float(np.sum(self.precision * self.at**2)))
        if present:
            gradient = gradient - blocks.cross[:, :, 0]
            own_gradient = own_gradient - blocks.own[:, 1:, 0]
            fixed += blocks.own[:, 0, 0] - 2.0 * blocks.right[:, 0]
        across = np.matmul(self._inverse_factor, moved)
        taken = gradient @ self._inverse_factor.T
        rest = own - np.matmul(across.transpose(0, 2, 1), across)
        slope = own_gradient - np.einsum("nfk,nf->nk", across, taken)
        size = 1.0 / np.sqrt(np.maximum(np.einsum("nkk->nk", own), 1e-300))
        scaled = rest * size[:, :, None] * size[:, None, :] + 1e-9 * np.eye(rest.shape[1])
        step = np.linalg.solve(scaled, (slope * size)[:, :, None])[:, :, 0] * size
        gain = np.sum(taken**2, axis=1) + np.sum(step * slope, axis=1) - fixed - self.absent
        return gain, self.at + step

    def windows_of_logs(self) -> list[NDArray[np.int64]]:
        """Indices of the windows of each log, in order."""
        first = self.fitter.windows.rows[:, 0]
        spans = log_rows(self.fitter.plant.samples)
        return [np.flatnonzero((first >= a) & (first < b)) for a, b in spans]

    def tail(self, windows: NDArray[np.int64]) -> Blocks:
        """Products of an effect that begins at each window and offset, in one leading axis."""
        whole = self.on[windows, 0]
        after = whole.over()[None].less(whole.before()).less(whole)
        return (self.on[windows] + after[:, None]).in_line()

    def head(self, windows: NDArray[np.int64]) -> Blocks:
        """Products of an effect that ends at each window and offset, in one leading axis."""
        return (self.off[windows] + self.on[windows, 0].before()[:, None]).in_line()


def coarse_equations(
    fitter: Fitter, table: CandidateEquations, candidate: Candidate
) -> ActivityEquations:
    """Return the equations of a candidate that begins and ends between windows."""
    own = [table.keys.index(k) for k in candidate.throughout.all_keys]
    used = (*fitter.tolerances, *table.free)
    rest = [i for i, k in enumerate(table.keys) if k in used]
    keys = [table.keys[i] for i in rest]
    on = Blocks(
        cross=table.normal[:, rest][:, :, own][:, None],
        own=table.normal[:, own][:, :, own][:, None],
        right=table.right[:, own][:, None],
    )
    prior = fitter.precision(keys, table.free)
    past = np.array([table.values[k] - table.centre.get(k, 0.0) for k in keys])
    return ActivityEquations(
        fitter=fitter,
        offsets=np.zeros(1),
        on=on,
        off=on.less(on),
        normal=table.normal[:, rest][:, :, rest].sum(axis=0) + np.diag(prior),
        gradient=table.right[:, rest].sum(axis=0) - prior * past,
        precision=_own_precision(fitter, candidate),
        at=np.zeros(len(own)),
        values={k: table.values[k] for k in keys},
    )


def activity_equations(
    fitter: Fitter,
    fit: Fit,
    candidate: Candidate,
    offsets: Sequence[float],
    *,
    strength: bool = False,
) -> ActivityEquations:
    """Return the equations of an effect that begins or ends at rows inside windows.

    Args:
        fitter: of the fit.
        fit: with the effect, throughout or for a time, or without it.
        candidate: the effect.
        offsets: rows after the start of a window, ascending, the first of them 0.
        strength: whether the effect, present in the fit, is moved in strength alone: one column.
    """
    keys, held = candidate.throughout.all_keys, {*candidate.all_keys}
    values = {k: v for k, v in fit.values.items() if k not in held or k in fitter.tolerances}
    at = np.array([fit.values.get(k, 0.0) for k in candidate.all_keys])
    values |= dict.fromkeys(held & set(values), 0.0)
    free = tuple(k for k in fit.free if k not in held)
    rest = [*fitter.tolerances, *(k for k in free if k not in fitter.tolerances)]
    with_it = dict(values)
    for key, value in zip(keys, at, strict=True):
        with_it[key] = with_it.get(key, 0.0) + float(value)
    misfit = fitter.misfit(values)
    others = fitter.fixed
    if len(rest) > len(fitter.tolerances):
        others = others.beside(fitter.whitened(rest[len(fitter.tolerances) :], values))
    chosen = () if strength else keys
    found = fitter.columns_at(chosen, with_it)
    if not at.any():
        responses = found
    else:
        before, after = fitter.prediction(values), fitter.prediction(with_it)
        responses = Columns(
            keys=("", *chosen),
            push=np.concatenate([(after.defect - before.defect)[:, :, None], found.push], axis=2),
            reading=np.concatenate(
                [(after.reading - before.reading)[:, :, None], found.reading], axis=2
            ),
        )
    on, off = _masked(fitter, responses, offsets)
    blocks = [_blocks(columns, others, misfit, len(offsets)) for columns in (on, off)]
    prior = fitter.precision(rest, free)
    centre = dict(zip(fit.keys, fit.centre, strict=True))
    past = np.array([values[k] - float(centre.get(k, 0.0)) for k in rest])
    return ActivityEquations(
        fitter=fitter,
        offsets=np.asarray(offsets, dtype=float),
        on=blocks[0],
        off=blocks[1],
        normal=others.product(others).sum(axis=0) + np.diag(prior),
        gradient=others.product(misfit)[:, :, 0].sum(axis=0) - prior * past,
        precision=np.full(1, _FREE) if strength else _own_precision(fitter, candidate),
        at=np.zeros(1) if strength else at,
        values={k: values[k] for k in rest},
    )


def _own_precision(fitter: Fitter, candidate: Candidate) -> Floats:
    keys = [k + ACTIVE for k in candidate.throughout.all_keys]
    return fitter.precision(keys, keys)


def _masked(
    fitter: Fitter, columns: Columns, offsets: Sequence[float]
) -> tuple[Whitened, Whitened]:
    """Whitened responses with the effect active from each offset on, and up to it."""
    windows = fitter.windows
    inside = np.full((fitter.plant.samples.rows, 1, 1), -np.inf)
    inside[windows.rows, 0, 0] = np.arange(windows.length)
    # inside a row the rest of its step is pushed; the reading at the row is over
    pushed = [columns.push * np.clip(inside + 1.0 - r, 0.0, 1.0) for r in offsets]
    read = [columns.reading * (inside >= r) for r in offsets]
    many = Columns(
        keys=columns.keys * len(offsets),
        push=np.concatenate(pushed, axis=2),
        reading=np.concatenate(read, axis=2),
    )
    on = windows.whiten(windows.responses(many))
    size = len(columns.keys)
    whole = on.each(lambda x: np.tile(x[:, :, :size], len(offsets)))
    return on, whole.less(on)


def _blocks(columns: Whitened, others: Whitened, misfit: Whitened, offsets: int) -> Blocks:
    """Products of the responses by window and offset."""
    count = columns.outputs.shape[0]
    cross, right = others.product(columns), columns.product(misfit)[:, :, 0]
    size = right.shape[1] // offsets
    parts = [
        columns.each(lambda x, at=at: x[:, :, at : at + size])
        for at in range(0, offsets * size, size)
    ]
    own = np.stack([part.product(part) for part in parts], axis=1)
    split = cross.reshape(count, cross.shape[1], offsets, size)
    return Blocks(
        cross=split.transpose(0, 2, 1, 3), own=own, right=right.reshape(count, offsets, size)
    )
