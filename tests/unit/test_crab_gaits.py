"""Gaits of the crab: films of them, and targets under other circumstances."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seals.errors import ConfigError
from seals.experiments.crab_gaits import main
from seals.experiments.crab_gaits.cases import CASES
from seals.experiments.crab_gaits.filming import FILMED, film
from seals.experiments.crab_gaits.reaching import TASKS
from seals.experiments.crab_gaits.walks import standing
from seals.frames import quaternion_of_rpy

pytest.importorskip("pybullet")


@pytest.mark.thorough
def test_a_film_shows_the_animal_all_the_way(tmp_path: Path) -> None:
    """The camera goes along: the crab is in the picture at the start and a second later."""
    image = pytest.importorskip("PIL.Image")
    words = ["--film", "fast", "film=false", "fps=1", "end=1.0", "width=96", "height=60"]
    assert main(["--out", str(tmp_path), *words]) == 0
    frames = sorted(tmp_path.glob("fast/render/*/frame_*.png"))
    assert len(frames) == 2
    for frame in frames:
        red, _, blue = np.asarray(image.open(frame).convert("RGB"), dtype=float).transpose(2, 0, 1)
        # nothing else is of the crab's red
        assert (red > 2.0 * blue).mean() > 0.02
    written = frames[0].stat().st_mtime_ns
    assert main(["--out", str(tmp_path), *words]) == 0
    assert frames[0].stat().st_mtime_ns == written


def test_an_unknown_gait_is_refused(tmp_path: Path) -> None:
    """The nearest name is told."""
    with pytest.raises(ConfigError, match="Did you mean 'tripod'"):
        film(tmp_path, ["tripd"], [])
    assert "learned" in FILMED


def test_a_target_is_reached_on_other_ground(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Circumstances are laid under a target; the table is one of its own."""
    words = ["--reach", "crab", "--seeds", "1", "--only", "land_friction_12"]
    assert main(["--out", str(tmp_path), *words]) == 0
    assert "crab, land_friction_12: 1 of 1 succeeded" in capsys.readouterr().out
    assert (tmp_path / "reach_crab_land_friction_12.csv").is_file()
    assert set(TASKS) >= {"crab", "crab_learned"}


def test_who_stands_on_a_slope_is_square_to_it() -> None:
    """The body's z axis is the normal of the slope, however the body is turned about it."""
    slope = CASES["land_slope_10"].slope
    for yaw in (-2.0, 0.0, 0.4, 3.0):
        rpy = np.array([[float(word) for word in standing(yaw, slope).strip("[]").split(",")]])
        x, y, z, w = quaternion_of_rpy(rpy)[0]
        up = [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]
        np.testing.assert_allclose(up, [-np.sin(slope), 0.0, np.cos(slope)], atol=1e-5)
