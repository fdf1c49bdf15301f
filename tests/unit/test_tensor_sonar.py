"""A sonar by PyTorch is that of NumPy to rounding, ray by ray and bin by bin."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seals.arrays import Floats
from seals.environment.settings import EnvironmentSettings
from seals.errors import ConfigError
from seals.frames import matrix_of, quaternion_of_rpy
from seals.plugins.sensors.sonar import SensorSonar
from seals.sensors import casting
from seals.sensors.protocol import SensorInput
from seals.sensors.rays import Shape
from seals.sensors.surroundings import Surroundings

torch = pytest.importorskip("torch")
NONE = np.zeros((0, 3, 3))
CORNERS = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) * 0.6
TETRAHEDRON = CORNERS[[[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]]
SIZES: dict[str, tuple[float, ...]] = {
    "box": (0.5, 0.9, 0.4),
    "cylinder": (0.3, 1.2),
    "capsule": (0.2, 1.0),
    "sphere": (0.45,),
    "mesh": (),
}


def turned(rng: np.random.Generator) -> Floats:
    """A random rotation."""
    q = rng.normal(size=(1, 4))
    return matrix_of(q / np.linalg.norm(q))[0]


def solids(kinds: tuple[str, ...], rng: np.random.Generator) -> list[Shape]:
    """Solids of some kinds at random places, mixed, and a bottom."""
    found = [Shape("plane", (), np.array([0.0, 0.0, -3.0]), np.eye(3), NONE)]
    for _ in range(3):
        for kind in kinds:
            corners = TETRAHEDRON if kind == "mesh" else NONE
            place = rng.normal(size=3) * 3.0
            found.append(Shape(kind, SIZES[kind], place, turned(rng), corners))
    return found


@pytest.mark.parametrize("kind", [*SIZES, "all"])
def test_hits_are_those_of_numpy(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Distance, normal and shape of ten thousand rays, axes of the world among them."""
    from seals.sensors.tensor_echoes import scene_of, tensor_cast

    monkeypatch.setattr(casting, "_embree", lambda corners: None)
    casting._trees.clear()
    rng = np.random.default_rng(list(SIZES).index(kind) if kind in SIZES else 9)
    shapes = solids(tuple(SIZES) if kind == "all" else (kind,), rng)
    rays = rng.normal(size=(10_000, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    rays[:6] = [*np.eye(3), *-np.eye(3)]
    origin = np.array([0.1, 0.2, -0.3])
    expected = casting.cast(shapes, origin, rays, 12.0)
    scene = scene_of(shapes)
    corners = [torch.from_numpy(x.copy()) for x in scene.corners]
    given = (torch.from_numpy(x) for x in (origin, rays))
    table = torch.from_numpy(scene.table)
    way, normal, row = tensor_cast(table, scene.counts, corners, *given, farthest=12.0)
    met = np.isfinite(expected.distance)
    assert 1000 < met.sum() < 9900
    np.testing.assert_allclose(way.numpy(), expected.distance, rtol=1e-9)
    np.testing.assert_allclose(normal.numpy()[met], expected.normal[met], atol=1e-6)
    assert np.array(scene.order)[row.numpy()[met]].tolist() == expected.shape[met].tolist()


def felt(around: Surroundings, rpy: tuple[float, float, float]) -> SensorInput:
    """The sonar a metre under water, turned."""
    axes, zero = matrix_of(quaternion_of_rpy(np.array([rpy])))[0], np.zeros(3)
    here = np.array([0.0, 0.0, -1.0])
    return SensorInput(0.0, 0.01, here, axes, zero, zero, zero, zero, around=around)


@pytest.mark.parametrize("rpy", [(0.0, 0.0, 0.0), (0.1, 0.4, 0.5), (0.0, -0.6, 0.0)])
@pytest.mark.parametrize("empty", [False, True])
def test_echoes_are_those_of_numpy(rpy: tuple[float, float, float], empty: bool) -> None:
    """Level, looking level, at the bottom, and at the surface; in open water, too."""
    around = Surroundings(EnvironmentSettings(water_level=0.0, salinity=[[0.0, 35.0]]))
    if not empty:
        rng = np.random.default_rng(3)
        around.ground = solids(("box", "sphere"), rng)[:1]
        around.ground_names = ("tank_bottom",)
        around.bodies = lambda: solids(tuple(SIZES), np.random.default_rng(4))[1:]
    values: dict[str, Any] = {"beams": 64, "bins": 128, "rays": 16, "farthest": 8.0}
    plain = SensorSonar(**values, speckle=False)
    fast = SensorSonar(**values, speckle=False, device="cpu")
    here, none = felt(around, rpy), np.random.default_rng(0)
    expected, got = plain.echo(here), fast.echo(here)
    assert expected.max() > 0.0 or empty
    # beams are summed in single precision by both
    np.testing.assert_allclose(got, expected, rtol=1e-4, atol=1e-6 * expected.max() + 1e-30)
    np.testing.assert_allclose(fast.ping(here, none), plain.ping(here, none), atol=1e-3)


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no CUDA card")
def test_recorded_kernels_follow_a_scene_that_moves() -> None:
    """First and replayed pings, a moved body, and a scene with another number of shapes."""
    around = Surroundings(EnvironmentSettings(water_level=0.0, salinity=[[0.0, 35.0]]))
    around.ground, around.ground_names = solids((), np.random.default_rng(3)), ("tank_bottom",)
    values: dict[str, Any] = {"beams": 64, "bins": 128, "rays": 16, "farthest": 8.0}
    plain, fast = SensorSonar(**values), SensorSonar(**values, device="cuda")
    here = felt(around, (0.1, 0.2, 0.3))
    for seed, many in ((4, None), (5, None), (6, None), (7, -2), (8, -2)):
        shapes = solids(tuple(SIZES), np.random.default_rng(seed))[1:many]
        around.bodies = lambda shapes=shapes: shapes  # type: ignore[misc]
        expected = plain.echo(here)
        np.testing.assert_allclose(
            fast.echo(here), expected, rtol=1e-4, atol=1e-6 * expected.max() + 1e-30
        )


def test_speckle_follows_the_random_state() -> None:
    """The same state gives the same ping, another one another; its mean is one."""
    around = Surroundings(EnvironmentSettings(water_level=0.0))
    sonar = SensorSonar(beams=64, bins=256, rays=4, device="cpu")
    here = felt(around, (0.0, 0.0, 0.0))
    first, same, other = (sonar.ping(here, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert np.array_equal(first, same)
    assert not np.array_equal(first, other)
    mean = SensorSonar(beams=64, bins=256, rays=4, device="cpu", speckle=False)
    quiet = 10.0 ** (0.1 * (first - mean.ping(here, np.random.default_rng(1))))
    # standard exponential variates, 16,384 of them: mean and deviation are one
    assert quiet.mean() == pytest.approx(1.0, abs=0.04)
    assert quiet.std() == pytest.approx(1.0, abs=0.06)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"device": "gpu"}, "Allowed: numpy, cpu, cuda"),
        ({"device": "cpu", "multipath": True}, "with multipath"),
    ],
)
def test_devices_are_refused_in_words(values: dict[str, Any], words: str) -> None:
    """An unknown device, and echoes by way of the surface."""
    with pytest.raises(ConfigError, match=words):
        SensorSonar(**values)


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a CUDA card")
def test_a_card_that_is_not_there_is_refused() -> None:
    """At the first ping."""
    around = Surroundings(EnvironmentSettings(water_level=0.0))
    sonar = SensorSonar(beams=4, bins=8, rays=2, device="cuda")
    with pytest.raises(ConfigError, match="no CUDA device"):
        sonar.ping(felt(around, (0.0, 0.0, 0.0)), np.random.default_rng(0))
