"""The task of catching what cameras see: starts, detector, filter, and what a policy is told."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from seals.errors import ConfigError
from seals.learn.task import Instant
from seals.plugins.tasks.catch_seen import TaskCatchSeen
from seals.plugins.tasks.sighting.detector import Sighting, load_detector, shot_of
from seals.plugins.tasks.sighting.watcher import PATIENCE, Watcher, begun, corrected, predicted
from seals.rendering.camera import OPTICAL, Lens
from seals.rendering.camera_view import CameraView, Shot
from seals.rendering.picture import Picture

SMALL = 1e-4 * np.eye(3)


class Told:
    """Detector that says what it was made with."""

    def __init__(self, *places: Sequence[float]) -> None:
        self.places = [np.array(p, dtype=float) for p in places]
        self.pictures: list[Picture] = []

    def find(self, cameras: Sequence[CameraView], now: Instant) -> list[Sighting]:
        """Return all places."""
        self.pictures += [shot_of(camera).picture for camera in cameras]
        return [Sighting(p, SMALL) for p in self.places]


def instant(
    time: float = 0.1,
    *,
    tool: Sequence[float] = (0.0, 0.0, -0.5),
    touch: Sequence[float] = (0.0, 0.0, 0.0),
) -> Instant:
    """Return the state of a robot at rest whose true target is far away."""
    zero = np.zeros((1, 3))
    return Instant(
        time=np.array([[time]]),
        position=zero,
        rotation=np.eye(3)[None],
        velocity=zero,
        angular_velocity=zero,
        tool=np.array([tool]),
        target=np.array([[9.0, 9.0, 9.0]]),
        target_velocity=zero,
        submersion=np.zeros((1, 1)),
        action=np.zeros((1, 4)),
        start=np.ones((1, 1)),
        facts={"touch": np.array([touch])},
    )


def camera(number: int = 0, size: int = 16) -> CameraView:
    """Return a camera with a grey picture."""
    picture = Picture(
        np.full((size, size, 3), 0.5), np.full((size, size), 1.0), np.ones((size, size), dtype=int)
    )
    found = CameraView(None)
    lens = Lens(width=size, height=size)
    found.keep(Shot(number, 0.1, picture, lens, ("rgb", "depth"), np.zeros(3), OPTICAL))
    return found


def test_animals_begin_behind_the_robot() -> None:
    """Every start has the animal behind; one that cannot be is refused."""
    drawn = TaskCatchSeen(behind=0.7).draw(np.random.default_rng(3), 50)
    assert np.all(drawn.position[:, 0] - drawn.goal[:, 0] >= 0.7)
    assert np.ptp(drawn.goal[:, 1]) > 0.8
    with pytest.raises(ConfigError, match=r"task\.behind=1\.5"):
        TaskCatchSeen(behind=1.5).draw(np.random.default_rng(3), 1)


def test_the_filter_finds_a_steady_velocity_and_refuses_what_is_far() -> None:
    """A steady walk is found without bias, and another place is not taken for it."""
    rng = np.random.default_rng(0)
    way, velocity = np.array([0.1, -0.2, 0.0]), np.array([0.08, -0.03, 0.0])
    track = begun(way, SMALL)
    errors = []
    for k in range(1, 400):
        place = way + 0.1 * k * velocity + 0.01 * rng.standard_normal(3)
        track = corrected(predicted(track, 0.1), place, SMALL)
        assert track is not None
        errors.append(track.mean - np.concatenate((way + 0.1 * k * velocity, velocity)))
    late = np.array(errors[50:])
    # unbiased, better than one measurement of 10 mm an axis, and as sure as it says at most
    assert np.all(np.abs(late.mean(axis=0)) < [0.002] * 3 + [0.012] * 3)
    spread = late.std(axis=0)
    assert np.all(spread[:3] < 0.0095)
    assert np.all(spread <= 1.1 * np.sqrt(np.diag(track.covariance)))
    assert corrected(track, track.place + 0.5, SMALL) is None
    # the closed form of one correction without motion: the mean of two equal measurements
    twice = corrected(begun(way, SMALL), way + 0.01, SMALL)
    np.testing.assert_allclose(twice.place, way + 0.005, atol=1e-12)


def test_a_policy_is_told_what_is_seen_and_nothing_else() -> None:
    """The true target reaches no policy."""
    watcher = Watcher(Told(), firm=0.3)
    told = watcher.perceive(instant(), {"belly": camera()})
    assert told.facts["seen"] == 0.0
    assert np.all(told.target == told.position)
    assert np.all(TaskCatchSeen().seen(told) == 0.0)
    watcher.detector = Told((1.0, 2.0, -1.0))
    told = watcher.perceive(instant(0.2), {"belly": camera(1)})
    np.testing.assert_allclose(told.target, [[1.0, 2.0, -1.0]])
    assert told.facts["seen"] == 1.0


def test_a_picture_counts_once_and_a_lost_animal_is_forgotten() -> None:
    """Old pictures say nothing new, and patience ends."""
    found = Told((1.0, 2.0, -1.0))
    watcher = Watcher(found, firm=0.3)
    watcher.perceive(instant(0.1), {"belly": camera()})
    watcher.perceive(instant(0.2), {"belly": camera()})
    assert len(found.pictures) == 1
    assert watcher.perceive(instant(PATIENCE), {}).facts["seen"] == 1.0
    assert watcher.perceive(instant(PATIENCE + 0.2), {}).facts["seen"] == 0.0
    watcher.perceive(instant(1.5), {"belly": camera(1)})
    watcher.begin()
    assert watcher.perceive(instant(0.1), {}).facts["seen"] == 0.0


def test_what_two_fingers_feel_goes_with_the_hand_unseen() -> None:
    """An animal in the hand is known by touch."""
    watcher = Watcher(Told((0.0, 0.0, -0.5)), firm=0.3)
    watcher.perceive(instant(0.1), {"belly": camera()})
    firm = (1.0, 1.0, 0.0)
    for k in range(1, 30):
        place = (0.0, 0.0, -0.5 + 0.03 * k)
        told = watcher.perceive(instant(0.1 + 0.1 * k, tool=place, touch=firm), {})
    np.testing.assert_allclose(told.target, [[0.0, 0.0, -0.5 + 0.03 * 29]], atol=1e-9)
    np.testing.assert_allclose(told.target_velocity, [[0.0, 0.0, 0.3]], atol=1e-9)
    one = Watcher(Told((0.0, 0.0, -0.5)), firm=0.3)
    one.perceive(instant(0.1), {"belly": camera()})
    told = one.perceive(instant(0.3, tool=(0.0, 0.0, 0.5), touch=(1.0, 0.0, 0.0)), {})
    np.testing.assert_allclose(told.target, [[0.0, 0.0, -0.5]], atol=1e-9)


def test_black_pictures_show_nothing() -> None:
    """The control leaves no light, depth or part."""
    found = Told()
    Watcher(found, firm=0.3, black=True).perceive(instant(), {"belly": camera()})
    (picture,) = found.pictures
    assert not np.any(picture.colour)
    assert not np.any(picture.depth)
    assert not np.any(picture.parts)


def test_an_unknown_detector_is_refused() -> None:
    """The refusal names what there is."""
    with pytest.raises(ConfigError, match=r"task\.detector=partz.*\n.*parts"):
        load_detector("partz", animal="crab", stance=0.0)
