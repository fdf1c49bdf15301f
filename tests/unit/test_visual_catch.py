"""The detector of the crab: what its maps mean, that it learns, and what a start shows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.errors import ConfigError
from seals.experiments.visual_catch import main
from seals.experiments.visual_catch.accuracy import accuracy
from seals.experiments.visual_catch.pictures import ABSENT, PRESENT, Pictures, load_pictures
from seals.experiments.visual_catch.training import Course, loss_of, train
from seals.plugins.tasks.sighting.detector import (
    UNEVEN,
    DetectorNetwork,
    inputs_of,
    load_detector,
    network_of,
    peaks_of,
    pixels_of,
    save_detector,
    shot_of,
)
from seals.rendering.camera import OPTICAL, Lens
from seals.rendering.camera_view import CameraView, Shot
from seals.rendering.optics.waters import WATERS
from seals.rendering.picture import Picture

torch = pytest.importorskip("torch")
SIZE = 48


def scene(count: int, seed: int) -> Pictures:
    """Return pictures of a red disc 2 cm above a floor 0.8 to 1.2 m away, on half of them."""
    rng = np.random.default_rng(seed)
    rows, columns = np.mgrid[0:SIZE, 0:SIZE] + 0.5
    floor = rng.uniform(0.8, 1.2, count)
    place = np.stack([*rng.uniform(8.0, 40.0, (2, count)), floor - 0.02], axis=1)
    label = np.where(np.arange(count) % 2 == 0, PRESENT, ABSENT).astype(np.int8)
    disc = (columns - place[:, 0, None, None]) ** 2 + (rows - place[:, 1, None, None]) ** 2 < 25.0
    disc &= (label == PRESENT)[:, None, None]
    grey = rng.integers(90, 110, (count, SIZE, SIZE, 3))
    colour = np.where(disc[..., None], [200, 60, 40], grey).astype(np.uint8)
    depth = 1e3 * (floor[:, None, None] - 0.03 * disc)
    return Pictures(
        colour,
        depth.astype(np.uint16),
        label,
        place,
        np.arange(count, dtype=np.int8) % len(WATERS),
        np.full(count, 40.0),
    )


@pytest.mark.slow
def test_a_detector_learns_where_a_disc_is(tmp_path: Path) -> None:
    """It is found in fresh pictures, to a fraction of a cell, and saved and loaded as it was."""
    course = Course(updates=150, batch=32, seed=1)
    words = train(scene(400, 0), tmp_path / "disc", course)
    assert "found" in words
    rows = accuracy(scene(100, 1), str(tmp_path / "disc"))
    whole = rows[0]
    assert (whole["present"], whole["absent"]) == (50, 50)
    assert whole["found"] >= 48
    assert whole["false"] <= 2
    # a pixel is 25 mm there
    assert whole["median_mm"] < 25.0
    assert sum(row["present"] for row in rows[1 : 1 + len(WATERS)]) == 50


def test_maps_are_read_as_places() -> None:
    """The surest cell, its place within it, and the mean depth in it give column, row, depth."""
    depth = torch.full((1, 16, 16), 2.0)
    depth[0, 8:12, 4:8] = torch.inf
    seen = inputs_of(torch.zeros(1, 16, 16, 3, dtype=torch.uint8), depth)
    maps = torch.zeros(1, 4, 4, 4) - 5.0
    maps[0, :, 2, 1] = torch.tensor([3.0, 0.25, -0.5, 0.1])
    peak = peaks_of(maps, seen)[0]
    # beyond what it reads, depth is 4 m
    torch.testing.assert_close(peak, torch.tensor([0.952574, 7.0, 8.0, 4.1]), rtol=1e-5, atol=1e-5)


def test_the_loss_is_least_at_the_truth() -> None:
    """Sure and exact maps cost next to nothing, moved or doubting ones more."""
    seen = inputs_of(torch.zeros(1, 16, 16, 3, dtype=torch.uint8), torch.full((1, 16, 16), 1.0))
    label, place = torch.tensor([PRESENT]), torch.tensor([[6.0, 10.0, 0.98]])
    middle = torch.arange(4) + 0.5
    best = torch.zeros(1, 4, 4, 4)
    best[0, 0], best[0, 0, 2, 1] = -12.0, 12.0
    best[0, 1], best[0, 2] = 1.5 - middle[None, :], 2.5 - middle[:, None]
    best[0, 3] = -0.02
    least = float(loss_of(best, seen, label, place))
    assert least < 1e-3
    for channel, change in ((0, -3.0), (1, 0.2), (2, 0.2), (3, 0.02)):
        moved = best.clone()
        moved[0, channel, 2, 1] += change * (8.0 if channel == 0 else 1.0)
        assert float(loss_of(moved, seen, label, place)) > least + 1e-3
    assert float(loss_of(best, seen, torch.tensor([ABSENT]), place)) > 1.0


UNREAD: Any = None
"""State of the robot, which a network does not read."""


class Peak(torch.nn.Module):
    """A network that always says the same."""

    def forward(self, seen: torch.Tensor) -> torch.Tensor:
        """Return maps with one peak, at column 30 and row 10 of each picture."""
        maps = torch.full((len(seen), 4, SIZE // 4, SIZE // 4), -9.0)
        maps[:, :, 2, 7] = torch.tensor([9.0, 0.0, 0.0, 0.0])
        return maps


def down_on(ground: float, lens: Lens) -> CameraView:
    """Return a camera at (1, 2, 0) that looks straight down on level ground at a depth."""
    size = lens.height, lens.width
    picture = Picture(np.zeros((*size, 3)), np.full(size, ground), np.ones(size, dtype=int))
    axes = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    camera = CameraView(None)
    shot = Shot(0, 0.1, picture, lens, ("rgb", "depth"), np.array([1.0, 2.0, 0.0]), axes)
    camera.keep(shot)
    return camera


def test_a_place_in_a_picture_is_one_in_the_world() -> None:
    """The line of sight ends as high above the ground as the animal stands."""
    metadata = {"pixel": 1.0, "threshold": 0.5}
    lens, stance = Lens(width=SIZE, height=SIZE), 0.03
    detector = DetectorNetwork(Peak(), metadata, stance)
    camera = down_on(2.0, lens)
    (found,) = detector.find([camera], UNREAD)
    x, y = (30.0 - 24.0) / lens.fx, (10.0 - 24.0) / lens.fy
    place = np.array([1.0 - 1.97 * y, 2.0 - 1.97 * x, -1.97])
    np.testing.assert_allclose(found.place, place, atol=1e-6)
    across, ray = (1.97 / lens.fx) ** 2, np.array([y, x, 1.0])
    wanted = np.diag([across, across, 0.0]) + UNEVEN**2 * np.outer(ray, ray)
    np.testing.assert_allclose(found.noise, wanted, atol=1e-12)
    # the label's projection is the inverse
    shot = shot_of(camera)
    seen = shot.axes.T @ (found.place - shot.position)
    np.testing.assert_allclose(lens.project(seen), [30.0, 10.0], atol=1e-5)
    # a hand above the middle of the window changes nothing
    shot.picture.depth[8:14, 26:36] = 1.9
    (again,) = detector.find([camera], UNREAD)
    np.testing.assert_allclose(again.place, place, atol=1e-6)


def test_places_that_cannot_be_on_the_ground_are_not_taken() -> None:
    """Lines of sight along the ground, nothing met, and what the network puts elsewhere."""
    detector = DetectorNetwork(Peak(), {"pixel": 1.0, "threshold": 0.5}, 0.03)
    lens = Lens(width=SIZE, height=SIZE)
    level, far, high = down_on(2.0, lens), down_on(np.inf, lens), down_on(2.0, lens)
    level.keep(shot_of(level)._replace(axes=OPTICAL))
    shot_of(high).picture.depth[8:12, 28:32] = 1.5
    for camera in (level, far, high):
        assert detector.find([camera], UNREAD) == []
    black = down_on(0.0, lens)
    assert detector.find([black], UNREAD) == []


def test_a_start_shows_no_animal_and_its_flight_is_labelled(tmp_path: Path) -> None:
    """In full worlds the crab is out of sight at first; what record writes says so."""
    pytest.importorskip("mujoco")
    from seals.config.compose import compose
    from seals.learn.environments import batched_of
    from seals.learn.starts import held_out_seeds

    words = ["env=catch_seen", "backend=mujoco", "task.duration=0.4"]
    environment = batched_of(compose(words, root="evaluate"), count=1)
    try:
        world = environment.simulator.worlds[0]  # type: ignore[attr-defined]
        for seed in held_out_seeds(2):
            environment.reset([seed])
            environment.step(environment.scripted_policy())
            cameras = world.actor.sensor_suite.cameras
            assert [*cameras] == ["front", "belly"]
            assert [pixels_of("crab", camera) for camera in cameras.values()] == [0, 0]
            assert environment.perceived.facts["seen"] == 0.0
            assert np.all(environment.perceived.target == environment.now.position)
    finally:
        environment.close()


def test_words_that_make_no_sense_are_refused(tmp_path: Path) -> None:
    """Unknown steps, no pictures, and a detector that reads none."""
    with pytest.raises(ConfigError, match="no step 'trian'"):
        main(["trian", "--out", str(tmp_path)])
    with pytest.raises(ConfigError, match="--pictures is not given"):
        main(["train", "--out", str(tmp_path)])
    with pytest.raises(ConfigError, match="holds no pictures"):
        load_pictures(tmp_path)
    with pytest.raises(ConfigError, match="reads no pictures"):
        accuracy(scene(4, 0), "parts")
    (tmp_path / "card.json").write_text('{"format": "seals-detector", "version": 1}')
    with pytest.raises(ConfigError, match=r"detector\.safetensors"):
        load_detector(str(tmp_path), animal="crab", stance=0.0)


@pytest.mark.parametrize(
    ("name", "value"),
    [("pixel", float("nan")), ("pixel", 1e30), ("pixel", -1.0), ("threshold", 2.0)],
)
def test_a_detector_with_senseless_metadata_is_refused(name: str, value: float) -> None:
    """Its noise would be no covariance, and the flight would end in a traceback."""
    metadata = {"pixel": 1.0, "threshold": 0.5, name: value}
    with pytest.raises(ConfigError, match=f"detector: {name}=.* is not allowed"):
        DetectorNetwork(Peak(), metadata, 0.03)


def test_weights_that_are_not_finite_are_refused(tmp_path: Path) -> None:
    """They would put the animal nowhere."""
    network = network_of()
    with torch.no_grad():
        network[0].weight.fill_(float("inf"))
    folder = save_detector(tmp_path / "odd", network, {"pixel": 1.0, "threshold": 0.5})
    with pytest.raises(ConfigError, match="not finite"):
        load_detector(str(folder), animal="crab", stance=0.0)
