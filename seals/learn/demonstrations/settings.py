"""Typed settings of ``seals record``."""

from __future__ import annotations

from dataclasses import dataclass

from seals.field_roles import roles
from seals.learn.settings import LearnSettings


@roles(data="name keep who device", read="policy labels after", write="hdf5 minari out")
@dataclass(kw_only=True)
class RecordSettings(LearnSettings):
    """Settings of a recording: an environment, and the policy to record.

    Args:
        policy: a folder that training wrote, ``scripted``, or a script of keys (YAML or CSV).
        episodes: number of episodes to keep.
        first: seed of the first start; the others follow. Below those that judge a policy.
        noise: standard deviation of noise added to the actions, for demonstrations that
            also show how to come back [1].
        labels: policy whose actions are recorded in place of those performed, for behaviour
            cloning: with ``labels=scripted`` the expert says at every step of ``policy`` what it
            would do there.
        after: folder of demonstrations of the same world, which come first in what is written.
        keep: episodes to keep: ``successes`` or ``all``.
        who: source of the decisions: ``scripted`` or ``human``, also where the policy
            is a script of keys.
        most: episodes to try at most, as a multiple of those to keep.
        device: where networks and twins compute: ``cpu`` or ``cuda``.
        hdf5: file for the exchange with other programs, beside the folder.
        minari: id of a Minari data set to write as well (needs the package
            minari), as ``seals/reach/scripted-v0``.
        out: folder of the demonstrations, or None for one in the run's folder.
    """

    name: str = "record"
    policy: str = "scripted"
    episodes: int = 10
    first: int = 0
    noise: float = 0.0
    labels: str | None = None
    after: str | None = None
    keep: str = "successes"
    who: str = "scripted"
    most: int = 10
    device: str = "cpu"
    hdf5: str | None = None
    minari: str | None = None
    out: str | None = None
