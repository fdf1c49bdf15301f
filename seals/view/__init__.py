"""Display of a run: stage, link poses over time, water and forces."""

from seals.view.replay import Replay, open_replay
from seals.view.stage import Stage, build_stage

__all__ = ["Replay", "Stage", "build_stage", "open_replay"]
