"""A run folder as something to look at: places over time, water, forces, pictures."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from seals.cli.main import main
from seals.errors import ConfigError
from seals.logs.atomic import write_table
from seals.plugins.waves.airy import WaveAiry
from seals.view import Replay, open_replay
from seals.view.forces import Forces
from seals.view.session import Shots
from seals.view.water import Water

G = 9.81
MASS = 0.3
"""Of the pebble [kg], as its URDF says."""
TRIANGLE = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 {height}
1 0 {height}
0 1 {height}
3 0 1 2
"""


@pytest.fixture
def fallen(pebble: Path, tmp_path: Path) -> Replay:
    """A pebble that fell for 0.2 s from 2 m in the void."""
    folder = tmp_path / "fallen"
    words = [f"robot={pebble}", "initial.position=[1,2,2]", "time.duration=0.2"]
    assert main(["run", *words, f"hydra.run.dir={folder}"]) == 0
    return open_replay(folder)


def test_a_fall_is_seen_where_it_was(fallen: Replay) -> None:
    """Between the rows, too: z = z0 - g t^2 / 2, whose chord over 4 ms is 2e-5 m off at most."""
    times = [0.0, 0.05, 0.0813, 0.2, 9.0]
    place = np.asarray(fallen.poses(times).position)
    assert place.shape == (5, 1, 3)
    expected = [2.0 - 0.5 * G * min(t, 0.2) ** 2 for t in times]
    assert place[:, 0, 2] == pytest.approx(expected, abs=2.1e-5)
    assert place[:, 0, :2] == pytest.approx(np.tile([1.0, 2.0], (5, 1)))
    assert fallen.end == pytest.approx(0.2)
    assert fallen.stage.scene.frames == ("robot/base",)


def test_links_turn_with_their_joints(tmp_path: Path) -> None:
    """At 0.5 rad about y the arm of the pendulum leans toward -x below its pivot."""
    folder = tmp_path / "swing"
    words = ["robot=pendulum", "initial.joint_position=[0.5]", "time.duration=0.01"]
    assert main(["run", *words, f"hydra.run.dir={folder}"]) == 0
    replay = open_replay(folder)
    turn = np.asarray(replay.poses([0.0]).rotation)[0, replay.stage.frame("robot", "arm")]
    below = turn @ np.array([0.0, 0.0, -1.0])
    assert below == pytest.approx([-math.sin(0.5), 0.0, -math.cos(0.5)], abs=1e-12)


def test_the_weight_is_an_arrow_down(fallen: Replay) -> None:
    """In the void gravity alone pushes: m g, from where the pebble is."""
    forces = Forces(fallen.stage, fallen.folder)
    poses = fallen.poses([0.1])
    arrows = forces.at(0.1, poses)
    assert forces.effects == ("gravity",)
    assert arrows["gravity"].vectors == pytest.approx(np.array([[0.0, 0.0, -MASS * G]]))
    assert arrows["gravity"].origins == pytest.approx(np.asarray(poses.position[0]))
    assert forces.usual == pytest.approx(MASS * G)
    assert Forces(fallen.stage, None).at(0.1, poses) == {}


def test_forces_stand_in_world_axes(fallen: Replay, tmp_path: Path) -> None:
    """The ledger is in link axes: a push along the x of a link that looks north goes north."""
    columns = {"t": np.array([0.0, 0.1]), "push.base.force_x": np.array([1.0, 2.0])}
    write_table(tmp_path / "ledger.parquet", columns)
    forces = Forces(fallen.stage, tmp_path)
    poses = fallen.poses([0.0])
    north = np.array([[[[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]]])
    turned = poses._replace(rotation=north)
    assert forces.at(0.05, turned)["push"].vectors == pytest.approx(np.array([[0.0, 1.0, 0.0]]))
    assert forces.at(5.0, turned)["push"].vectors == pytest.approx(np.array([[0.0, 2.0, 0.0]]))


def sea(folder: Path | None = None, level: float | None = -0.5) -> Water:
    """Water of 0.1 m amplitude and 2 s period."""
    around = SimpleNamespace(water_level=level)
    waves = WaveAiry(amplitude=0.1, period=2.0)
    return Water(SimpleNamespace(environment=around, wave=waves), folder)  # type: ignore[arg-type]


def test_the_surface_is_that_of_the_waves() -> None:
    """Height = level + a cos(k x - w t), k = w^2 / g, at every corner of the patch."""
    patch = sea().patch(0.3, np.array([1.0, 0.0]), 5.0, 16)
    assert patch is not None
    omega = math.pi
    x, _, z = patch.vertices.T
    expected = -0.5 + 0.1 * np.cos(omega**2 / G * x - omega * 0.3)
    assert z == pytest.approx(expected, abs=1e-4)  # the wave's own g is 9.80665
    a, b, c = (patch.vertices[patch.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    assert np.all(normals[:, 2] > 0.0)
    assert 0.5 * float(normals[:, 2].sum()) == pytest.approx(100.0)
    assert sea().moves


def test_no_water_has_no_surface() -> None:
    """A run without water shows none, and says so when asked."""
    assert sea(level=None).patch(0.0, np.zeros(2), 1.0, 4) is None
    with pytest.raises(ConfigError, match="no water"):
        sea(level=None).heights(0.0, np.zeros(1), np.zeros(1))


def test_meshes_of_the_surface_go_by_their_time(tmp_path: Path) -> None:
    """The last mesh written before a time is shown; before the first, the first."""
    (tmp_path / "surface").mkdir()
    for time, height in ((0.05, 1), (0.1, 2)):
        file = tmp_path / "surface" / f"t_{time:08.4f}.ply"
        file.write_text(TRIANGLE.format(height=height))
    water = sea(tmp_path)
    heights = []
    for time in (0.0, 0.05, 0.0999, 0.1, 7.0):
        mesh = water.mesh(time)
        assert mesh is not None
        heights.append(float(mesh.vertices[0, 2]))
    assert heights == [1.0, 1.0, 1.0, 2.0, 2.0]
    assert sea().mesh(0.0) is None


def test_pictures_go_by_their_time(tmp_path: Path) -> None:
    """The last picture taken up to a time; none before the first, none that is lost."""
    home = tmp_path / "pictures" / "front"
    home.mkdir(parents=True)
    write_table(home / "index.parquet", {"number": [0.0, 1.0, 2.0], "t": [0.1, 0.2, 0.3]})
    for k in (0, 1):
        (home / f"{k:06d}.png").write_bytes(b"")
    shots = Shots(tmp_path)
    assert shots.cameras == ("front",)
    names = [shots.last("front", t) for t in (0.0, 0.1, 0.25, 9.0)]
    assert [n and n.name for n in names] == [None, "000000.png", "000001.png", "000001.png"]
    assert Shots(None).cameras == ()


def test_a_folder_without_a_log_is_refused(fallen: Replay) -> None:
    """What was cut off says how to go on."""
    (fallen.folder / "log.parquet").unlink()
    with pytest.raises(ConfigError, match="resume="):
        open_replay(fallen.folder)
