"""Snapshots belong to their scene: one of a closed scene does not touch the next."""

import gc

from seals.environment.settings import EnvironmentSettings
from seals.plugins.backends.pybullet import BackendPybullet


def test_a_snapshot_of_a_closed_scene_removes_no_state_of_the_next() -> None:
    """The engine gives the numbers of a closed scene to the next one."""
    backend = BackendPybullet()
    backend.open(EnvironmentSettings(), 0.004)
    old = backend.snapshot()
    backend.close()
    backend.open(EnvironmentSettings(), 0.004)
    new = backend.snapshot()
    assert old[0].number == new[0].number
    del old
    gc.collect()
    backend.restore(new)
    backend.close()
