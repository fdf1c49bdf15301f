"""Display of a run: stage, link poses over time, water and forces."""

from seals.view.replay import Replay as Replay
from seals.view.replay import open_replay as open_replay
from seals.view.stage import Stage as Stage
from seals.view.stage import build_stage as build_stage
