"""Dynamics along a trajectory whose memory can be released."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

from seals.sysid.data.trajectory import Trajectory
from seals.sysid.predictors.linearise import Dynamics, dynamics_along
from seals.sysid.predictors.plant import Plant
from seals.sysid.predictors.trajectory_cache import TrajectoryCache


class ReleasableDynamics:
    """Dynamics along a trajectory that are computed where they are used, and again once released.

    Args:
        plant: extended model.
        trajectory: about which it is linear.
        at: values of the linearisation by parameter key.
        cache: the plant along the trajectory.
    """

    def __init__(
        self,
        plant: Plant,
        trajectory: Trajectory,
        at: Mapping[str, float],
        cache: TrajectoryCache,
    ) -> None:
        self.plant, self.trajectory, self.at, self.cache = plant, trajectory, at, cache

    @cached_property
    def found(self) -> Dynamics:
        """The dynamics."""
        return dynamics_along(self.plant, self.trajectory, self.at, cache=self.cache)

    def release(self) -> None:
        """Release the memory of the dynamics and of the evaluations along the trajectory."""
        self.__dict__.pop("found", None)
        self.cache.release()


def dynamics_of(given: Dynamics | ReleasableDynamics) -> Dynamics:
    """Return dynamics, computed where they are not at hand."""
    return given if isinstance(given, Dynamics) else given.found
