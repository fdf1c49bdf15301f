"""Height maps against a plane and a known slope: contacts, rays, ground height; wrong files."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from seals.environment.ground import ground_height
from seals.errors import ConfigError
from seals.run import build_world
from seals.run.build import run_settings
from seals.run.settings import RunSettings
from seals.sensors.surroundings import Surroundings

SLOPE = 0.2
RISE = math.tan(SLOPE)
ENGINES = ["pybullet", "mujoco"]


def slope_map(folder: Path, *, nodes: tuple[int, int] = (33, 65)) -> list[str]:
    """Write a plane that rises eastward over 8 by 4 m, as a table; return its overrides."""
    rows, columns = nodes
    east = RISE * np.linspace(-4.0, 4.0, columns)
    np.savetxt(folder / "slope.csv", np.tile(east, (rows, 1)), delimiter=",", fmt="%.17g")
    terrain = "environment.terrain"
    return [f"{terrain}.file={folder / 'slope.csv'}", f"{terrain}.size=[8,4]"]


def rest(run: RunSettings, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity of the robot after some time."""
    world = build_world(run)
    for _ in range(round(seconds / run.time.step)):
        world.step()
    state = world.actors["robot"].body.read()
    world.close()
    return state.position, state.velocity


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("place", [(0.0, 0.0), (1.37, -0.81), (-2.9, 1.6)])
@pytest.mark.parametrize("nodes", [(33, 65), (2, 2)])
def test_a_cube_rests_on_a_slope_of_the_map(
    engine: str, nodes: tuple[int, int], place: tuple[float, float], tmp_path: Path
) -> None:
    """Half an edge along the normal above the plane, and it stays there with friction enough."""
    options = [*slope_map(tmp_path, nodes=nodes), f"backend={engine}", "environment.friction=3"]
    run = run_settings(["robot=cube", *options])
    run.initial.position = [*place, RISE * place[0] + 0.05]
    run.initial.rpy = [0.0, -SLOPE, 0.0]
    at, speed = rest(run, 0.6)
    # the engines' own sinking in and collision margins: half a millimetre, as on a slab
    assert at[2] - RISE * at[0] == pytest.approx(0.025 / math.cos(SLOPE), abs=1.5e-3)
    assert np.abs(speed).max() < 5e-3


@pytest.mark.parametrize("engine", ENGINES)
def test_a_level_map_is_a_plane(engine: str, tmp_path: Path) -> None:
    """A picture of one grey is level: white at `high`, moved by the position."""
    Image.fromarray(np.full((9, 17), 255, dtype=np.uint8)).save(tmp_path / "flat.png")
    run = run_settings([
        "robot=cube", f"backend={engine}", f"environment.terrain.file={tmp_path / 'flat.png'}",
        "environment.terrain.low=-3", "environment.terrain.high=0.5",
        "environment.terrain.position=[2,1,-1]", "initial.position=[2.3,0.6,-0.45]",
    ])  # fmt: skip
    at, _ = rest(run, 0.6)
    assert at[2] == pytest.approx(-0.5 + 0.025, abs=1.5e-3)


@pytest.mark.parametrize("engine", ENGINES)
def test_north_is_the_first_row(engine: str, tmp_path: Path) -> None:
    """A step upward in the north-west corner carries a cube there, and nowhere else."""
    grid = np.zeros((21, 41))
    grid[:8, :12] = 1.0
    np.savetxt(tmp_path / "step.csv", grid, delimiter=",")
    options = [
        f"environment.terrain.file={tmp_path / 'step.csv'}",
        "environment.terrain.size=[8,4]",
    ]
    for x, y, height in ((-3.2, 1.6, 1.0), (3.2, 1.6, 0.0), (-3.2, -1.6, 0.0)):
        run = run_settings(["robot=cube", f"backend={engine}", *options])
        run.initial.position = [x, y, height + 0.06]
        assert ground_height(run.environment, x, y) == height
        at, _ = rest(run, 0.6)
        assert at[2] == pytest.approx(height + 0.025, abs=1.5e-3)


def test_rays_and_heights_are_those_of_the_plane(tmp_path: Path) -> None:
    """Rays downward, aslant and upward from below; 4,000 heights; nothing beside the map."""
    run = run_settings(["robot=cube", *slope_map(tmp_path, nodes=(9, 17))])
    around = Surroundings(run.environment)
    draw = np.random.default_rng(0)
    for _ in range(40):
        x, y = draw.uniform((-3.0, -1.5), (3.0, 1.5))
        origin = np.array([x, y, RISE * x + draw.uniform(0.1, 2.0)])
        ways = draw.normal(size=(5, 3)) * [0.3, 0.3, 1.0]
        ways[:, 2] = -np.abs(ways[:, 2]) - 1.0
        ways /= np.linalg.norm(ways, axis=1)[:, None]
        found = around.ground_ahead(origin, ways)
        normal = np.array([-RISE, 0.0, 1.0])
        expected = -(origin @ normal) / (ways @ normal)
        ends = origin + expected[:, None] * ways
        inside = (np.abs(ends[:, 0]) < 4.0) & (np.abs(ends[:, 1]) < 2.0)
        np.testing.assert_allclose(found[inside], expected[inside], rtol=1e-9)
        assert np.isinf(found[~inside]).all()
    for x, y in draw.uniform((-4.0, -2.0), (4.0, 2.0), (4000, 2)):
        assert ground_height(run.environment, x, y) == pytest.approx(RISE * x, abs=1e-12)
    assert ground_height(run.environment, 4.1, 0.0) is None


def test_an_altimeter_measures_the_bottom(tmp_path: Path) -> None:
    """A range finder that looks down reads the height above the map."""
    options = ["+sensor@sensors.down=range_finder", "sensors.down.rpy=[0,1.5707963,0]",
               "sensors.down.noise=0", "sensors.down.noise_share=0", "sensors.down.resolution=0",
               "water=fossen", "environment.terrain.position=[0,0,-5]",
               "initial.position=[1,0.5,-3]", "time.duration=0.1"]  # fmt: skip
    from seals.run.simulation import simulate

    log = simulate(run_settings(["robot=rov", *slope_map(tmp_path), *options])).log
    found = log.channel("range")
    found = found[np.isfinite(found)]
    assert found[0] == pytest.approx(2.0 - RISE * 1.0, abs=1e-3)


def test_sixteen_bits_keep_their_levels(tmp_path: Path) -> None:
    """65,536 levels over 100 m: 1.5 mm."""
    grey = np.array([[0, 20000], [20001, 65535]], dtype=np.uint16)
    Image.fromarray(grey).save(tmp_path / "deep.png")
    run = run_settings(["robot=cube", f"environment.terrain.file={tmp_path / 'deep.png'}",
                        "environment.terrain.low=-100", "environment.terrain.high=0"])  # fmt: skip
    corners = [ground_height(run.environment, x, y) for x, y in ((-10, 10), (10, 10), (-10, -10))]
    np.testing.assert_allclose(corners, -100.0 + 100.0 * np.array([0, 20000, 20001]) / 65535)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("1,2\n3,nan\n", "not finite"),
        ("1,2\n3\n", "cannot be used"),
        ("a,b\nc,d\n", "cannot be used"),
        ("1,2\n", "1 by 2 nodes"),
        ("\n".join([",".join(["0"] * 1100)] * 1000), "1,048,576 nodes"),
    ],
)
def test_what_is_no_map_is_refused_in_two_lines(content: str, words: str, tmp_path: Path) -> None:
    """Holes, ragged rows, text, one row alone, and too many nodes."""
    (tmp_path / "map.csv").write_text(content, encoding="utf-8")
    with pytest.raises(ConfigError, match=words) as told:
        run_settings(["robot=cube", f"environment.terrain.file={tmp_path / 'map.csv'}"])
    assert len(str(told.value).splitlines()) == 2
    with pytest.raises(ConfigError, match="cannot be used"):
        run_settings(["robot=cube", "environment.terrain.file=nowhere.png"])
