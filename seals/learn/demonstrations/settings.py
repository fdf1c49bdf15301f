"""Typed settings of ``seals record``."""

from __future__ import annotations

from dataclasses import dataclass

from seals.field_roles import roles
from seals.learn.learner import MOST
from seals.learn.settings import LearnSettings
from seals.schema import count, setting


@roles(data="name keep who device", read="policy labels after", write="hdf5 minari out")
@dataclass(kw_only=True)
class RecordSettings(LearnSettings):
    """Settings of a recording: an environment, and the policy to record.

    Args:
        policy: folder of a trained policy, ``scripted``, or a script of keys (YAML or CSV).
        episodes: number of episodes to keep.
        first: seed of the first start; the others follow. Below the seeds of evaluations.
        noise: standard deviation of noise added to the actions, for demonstrations that
            also show recoveries [1].
        labels: policy whose actions are recorded instead of the executed ones, for behaviour
            cloning: with ``labels=scripted`` the action of the expert is recorded at every step of
            ``policy``.
        after: folder of demonstrations of the same world, which are written first.
        keep: episodes to keep: ``successes`` or ``all``.
        who: source of the decisions: ``scripted`` or ``human``, also where the policy
            is a script of keys.
        most: maximum number of episodes to try, as a multiple of those to keep.
        device: device of networks and twins: ``cpu`` or ``cuda``.
        hdf5: HDF5 file for other programs, in addition to the folder.
        minari: id of a Minari data set to write as well (needs the package
            minari), as ``seals/reach/scripted-v0``.
        out: folder of the demonstrations, or None for a folder in the run's folder.
    """

    name: str = "record"
    policy: str = "scripted"
    episodes: int = count(10, bounds=(1, MOST))
    first: int = 0
    noise: float = setting(0.0, "1", bounds=(0.0, 1.0), source="chosen")
    labels: str | None = None
    after: str | None = None
    keep: str = "successes"
    who: str = "scripted"
    most: int = count(10, bounds=(1, MOST))
    device: str = "cpu"
    hdf5: str | None = None
    minari: str | None = None
    out: str | None = None
