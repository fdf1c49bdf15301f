"""Trajectory of a vehicle without a measured pose: simulated from its stated start."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.batch import TwinState
from seals.errors import LogError
from seals.frames import normalised
from seals.sysid.data.samples import Samples
from seals.sysid.data.trajectory import Trajectory
from seals.sysid.data.vehicle import Vehicle
from seals.sysid.predictors.extended_model import ExtendedModel, nonzero


def simulated_trajectory(
    samples: Samples,
    vehicle: Vehicle,
    *,
    parts: int,
    plant: ExtendedModel | None = None,
    values: Mapping[str, float] | None = None,
) -> Trajectory:
    """Simulate every run from its stated start.

    Args:
        samples: the log.
        vehicle: stated model with a start state for every run.
        parts: integration steps per row.
        plant: extended model; left out, the nominal one.
        values: changes of its parameters.

    Raises:
        LogError: the starts are not stated.
    """
    if len(vehicle.initial_state) < len(samples.runs):
        raise LogError(
            "the log has neither a measured pose nor a start state for every run.\n"
            "Give position and orientation, or initial_state in meta.yaml."
        )
    if plant is None:
        from seals.sysid.candidates.parameters import CandidateSet

        bare = CandidateSet(effects=dict(vehicle.effects), parameters={}, candidates=())
        plant = ExtendedModel(vehicle, bare, samples, parts=parts)
    used = nonzero(values or {})
    lengths = [last - first for first, last in samples.runs]
    firsts = np.array([first for first, _ in samples.runs])
    state = start_states(vehicle.initial_state[: len(lengths)])
    twin, drive = plant.twin(used, len(lengths)), plant.drive(used)
    seen = [state]
    for k in range(max(lengths) - 1):
        rows = np.minimum(firsts + k, samples.rows - 1)
        state, _ = plant.advance(twin, state, rows, drive)
        seen.append(state)
    return Trajectory.joined(seen, lengths)


def start_states(entries: Sequence[Mapping[str, Any]]) -> TwinState:
    """Return the stated starts of runs, as in ``initial_state`` of the metadata."""
    names = ("position", "orientation", "velocity", "angular_velocity")
    rows = (np.array([entry[name] for entry in entries], dtype=float) for name in names)
    position, turn, velocity, spin = rows
    joints = np.zeros((len(position), 0))
    quaternion = normalised(np.roll(turn, -1, axis=1))
    return TwinState(position, quaternion, velocity, spin, joints, joints)


def start_sigma(vehicle: Vehicle) -> Floats:
    """1-sigma of the stated start states, shape (12,)."""
    sigma = vehicle.initial_state[0]["sigma"]
    names = ("position", "orientation", "velocity", "angular_velocity")
    spread: Floats = np.repeat([float(sigma[n]) for n in names], 3)
    return spread
