"""Photoreal frames: water's light by closed forms, variants that do not run, what is missing."""

from __future__ import annotations

import math
import subprocess
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from seals import child_process
from seals.errors import ConfigError, MissingExtra, PhysicsError
from seals.plugins.viewers.mitsuba import RendererMitsuba
from seals.plugins.viewers.mitsuba import renderer as denoising
from seals.plugins.viewers.mitsuba import variant as variants
from seals.plugins.viewers.mitsuba.building import (
    backward_share,
    mean_cosine,
    medium_of,
    sand,
    sky_map,
)
from seals.plugins.viewers.mitsuba.renderer import faded, wet_share
from seals.plugins.viewers.mitsuba.variant import Variant, mitsuba
from seals.rendering import Cameras, Lens, Light, Poses, Scene, Shape
from seals.rendering.optics import Optics, SurfaceAiry, SurfaceStill, water_of
from seals.schema import read
from seals.view.films import Frame, Viewpoint, WaterBody
from seals.view.films.settings import Quality

DRY = Scene((), ("nothing",), ())
FRESNEL = ((1.333 - 1.0) / (1.333 + 1.0)) ** 2
"""Share that water mirrors of light that falls straight on it."""


def still_water() -> WaterBody:
    """A level sea of two triangles."""
    corners = 500.0 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=float)
    return WaterBody(corners, np.array([[0, 1, 2], [0, 2, 3]]), False, SurfaceStill())


def straight(height: float, way: float) -> Viewpoint:
    """A camera over the origin that looks straight up or down."""
    return Viewpoint.looking(np.array([0.0, 0.0, height]), np.array([0.0, 0.0, height + way]))


def seen(optics: Optics, view: Viewpoint, *, samples: int = 64) -> Any:
    """Mean colour of a small picture of still water."""
    pytest.importorskip("mitsuba")
    renderer = RendererMitsuba(samples=samples, denoise=False)
    renderer.arrange(DRY, optics, Quality.draft)
    lens = Lens(width=16, height=16, fov=0.05, far=2000.0)
    try:
        image = renderer.photograph(Frame(0.0, Poses.nowhere(), view, lens, still_water(), 0.01))
    finally:
        renderer.close()
    return image.reshape(-1, 3).mean(axis=0)


def test_water_mirrors_as_fresnel_says() -> None:
    """Straight down on water that swallows all, two hundredths of the sky are seen."""
    optics = Optics(water_type="oceanic_1", absorption=[20.0] * 3, scattering=[0.0] * 3)
    sky = np.array(optics.sky_zenith)
    np.testing.assert_allclose(
        seen(optics, straight(3.0, -1.0), samples=1024), FRESNEL * sky, rtol=0.1
    )


def test_light_fades_by_beer_and_lambert() -> None:
    """Straight up through still water the sky is n^2 (1 - F) brighter, and exp(-a d) darker."""
    absorption = [0.5, 0.2, 0.05]
    optics = Optics(water_type="oceanic_1", absorption=absorption, scattering=[0.0] * 3)
    near, far = (seen(optics, straight(-d, 1.0), samples=1024) for d in (1.0, 3.0))
    np.testing.assert_allclose(far / near, np.exp(-2.0 * np.array(absorption)), rtol=0.04)
    clear = np.array(optics.sky_zenith) * 1.333**2 * (1.0 - FRESNEL)
    np.testing.assert_allclose(near, clear * np.exp(-np.array(absorption)), rtol=0.04)


def test_under_the_critical_angle_water_mirrors_all() -> None:
    """Seen from below at 60 degrees from the vertical, black water shows no sky."""
    optics = Optics(water_type="oceanic_1", absorption=[2.0] * 3, scattering=[0.0] * 3)
    way = np.array([math.sin(1.05), 0.0, math.cos(1.05)])
    origin = np.array([0.0, 0.0, -0.5])
    assert seen(optics, Viewpoint.looking(origin, origin + way)).max() < 1e-4


@pytest.mark.parametrize("g", [0.1, 0.5, 0.8])
def test_backward_share_is_that_of_the_phase_function(g: float) -> None:
    """The closed form agrees with the integral over the back hemisphere."""
    mu = (np.arange(20000) + 0.5) / 20000 - 1.0
    phase = 0.5 * (1.0 - g * g) / (1.0 + g * g - 2.0 * g * mu) ** 1.5
    np.testing.assert_allclose(backward_share(g), phase.mean(), rtol=1e-6)
    np.testing.assert_allclose(mean_cosine(float(phase.mean())), g, rtol=1e-6)


def test_the_medium_is_jerlovs() -> None:
    """Extinction is a + (1 - f) b of the water type, what is not scattered of it a."""
    water, optics = water_of("coastal_3"), Optics(water_type="coastal_3", forward_share=0.6)
    medium = medium_of(optics)
    assert water is not None
    assert medium is not None
    a, b = np.array(water.absorption), np.array(water.scattering)
    extinction = medium["scale"] * np.array(medium["sigma_t"]["value"])
    np.testing.assert_allclose(extinction, a + 0.4 * b)
    np.testing.assert_allclose(extinction * (1.0 - np.array(medium["albedo"]["value"])), a)
    assert 0.0 < medium["phase"]["g"] < 1.0
    assert medium_of(Optics()) is None


@pytest.mark.parametrize("radius", [0.05, 0.3])
def test_the_sun_gives_its_share_of_the_daylight(radius: float) -> None:
    """Its irradiance on level ground is pi times its share, however wide the disc."""
    optics = Optics(sky_zenith=[0.0] * 3, sky_horizon=[0.0] * 3, sun_share=0.7, sun_zenith=0.6)
    light = sky_map(optics, radius)[..., 1].astype(float)
    rows, columns = light.shape
    theta = (np.arange(rows) + 0.5) * np.pi / rows
    solid = (np.sin(theta) * np.maximum(np.cos(theta), 0.0))[:, None]
    total = (light * solid).sum() * (np.pi / rows) * (2.0 * np.pi / columns)
    np.testing.assert_allclose(total, 0.7 * np.pi, rtol=1e-6)
    # it stands where the optics say
    row, column = np.unravel_index(np.argmax(light), light.shape)
    assert abs(theta[row] - 0.6) < radius + 0.02
    east_of_north = (column + 0.5) * 2.0 * np.pi / columns
    away = (0.5 * np.pi - east_of_north - optics.sun_azimuth + np.pi) % (2.0 * np.pi) - np.pi
    assert abs(away) < 2.0 * radius + 0.05


def test_the_port_is_wet_below_the_waterline() -> None:
    """A level camera at the surface has its lower half in the water, a lifted one less."""
    lens = Lens(width=30, height=20, fov=0.9)
    level = Viewpoint.looking(np.zeros(3), np.array([1.0, 0.0, 0.0]))
    share = wet_share(Frame(0.0, Poses.nowhere(), level, lens, still_water(), 0.2))
    np.testing.assert_array_equal(share[:10], 0.0)
    np.testing.assert_array_equal(share[10:], 1.0)
    # 0.05 m higher and a port at 0.2 m: the line stands fx / 4 rows below the middle
    lifted = Viewpoint(np.array([0.0, 0.0, 0.05]), level.axes)
    share = wet_share(Frame(0.0, Poses.nowhere(), lifted, lens, still_water(), 0.2))
    assert abs((1.0 - share[:, 0]).sum() - (10.0 + 0.25 * lens.fy)) < 0.4
    assert wet_share(Frame(0.0, Poses.nowhere(), level, lens, None, 0.2)).max() == 0.0


def test_sand_keeps_its_light() -> None:
    """Under still water the floor is its colour; caustics move light about and lose none."""
    optics = Optics(water_type="coastal_1")
    plain = sand((0.6, 0.5, 0.4), (0.0, 0.0), 0.0, (optics, None, 0.0))
    still = sand((0.6, 0.5, 0.4), (0.0, 0.0), 2.0, (optics, SurfaceStill(), 0.0))
    inner = slice(100, 400)
    np.testing.assert_allclose(still[inner, inner], plain[inner, inner], atol=0.02)
    assert plain.min() >= 0.0
    assert plain.max() < 1.0
    # one colour at the edges, which the wide floor goes on with
    for edge in (plain[0], plain[:, -1], still[-1], still[:, 0]):
        assert np.ptp(edge, axis=0).max() < 0.01


def test_caustics_lie_in_the_tank_alone() -> None:
    """Outside of the place that the water fills the floor is as on dry land."""
    optics = Optics(water_type="coastal_1")
    given = (
        (0.6, 0.5, 0.4),
        (1.0, -1.0),
        1.0,
        (optics, SurfaceAiry([0.03], [[6.0, 2.0]], [7.7], [0.0]), 0.3),
    )
    dry = sand(*given[:2], 0.0, (optics, None, 0.0))
    tank, sea = sand(*given, ((0.0, -2.0), (2.0, -0.5))), sand(*given)
    # rows are north of -5 m, columns east of -3 m, 64 to the metre
    inside = np.zeros(dry.shape[:2], dtype=bool)
    inside[192:288, 192:320] = True
    np.testing.assert_allclose(tank[~inside], dry[~inside], atol=1e-6)
    np.testing.assert_allclose(tank[inside], sea[inside], atol=1e-6)
    assert np.abs(sea - dry)[inside].max() > 0.05


def test_cameras_see_depth_and_parts() -> None:
    """A ball of 0.5 m at 3 m over ground: depth to its front, the ground behind, by closed form."""
    pytest.importorskip("mitsuba")
    ball = Shape("sphere", (0.5,), np.array([3.0, 0.0, 0.0]), np.eye(3), (0.8, 0.2, 0.2), 1)
    ground = Shape("plane", (), np.array([0.0, 0.0, -1.0]), np.eye(3), (0.5, 0.5, 0.5), 2)
    renderer = RendererMitsuba()
    renderer.open(Scene((ball, ground), ("nothing", "ball", "ground"), ()), Light())
    lens = Lens(width=41, height=41, fov=1.2)
    view = Viewpoint.looking(np.zeros(3), np.array([1.0, 0.0, 0.0]))
    picture = renderer.render(Poses.nowhere(), Cameras.single(*view), lens, normals=True).of(0, 0)
    renderer.close()
    assert picture.parts[20, 20] == 1
    np.testing.assert_allclose(picture.depth[20, 20], 2.5, atol=0.01)
    below = (38 + 0.5 - lens.cy) / lens.fy
    assert picture.parts[38, 2] == 2
    np.testing.assert_allclose(picture.depth[38, 2], 1.0 / below, rtol=1e-3)
    assert picture.parts[2, 2] == 0
    assert np.isinf(picture.depth[2, 2])
    assert picture.normals is not None
    np.testing.assert_allclose(picture.normals[38, 2], [0.0, 0.0, 1.0], atol=1e-5)
    red, green, _ = picture.colour[20, 20]
    assert red > 2.0 * green


def test_missing_mitsuba_is_said(absent: Callable[..., None]) -> None:
    """The extra is named, and a renderer that needs it not."""
    absent("mitsuba")
    with pytest.raises(MissingExtra, match=r"aam-seals\[render\].*renderer=tiny"):
        RendererMitsuba().arrange(DRY, Optics(), Quality.draft)


def test_a_variant_that_aborts_is_said_in_words(monkeypatch: pytest.MonkeyPatch) -> None:
    """An old LLVM ends the child, not this process; auto then takes one that always runs."""
    pytest.importorskip("mitsuba")

    def aborted(*_: Any, **__: Any) -> Any:
        return subprocess.CompletedProcess((), -6, "", "LLVM ERROR: Cannot select: fminimum\n")

    variants.trial.cache_clear()
    monkeypatch.setattr(child_process.subprocess, "run", aborted)
    with pytest.raises(PhysicsError, match=r"signal 6.*fminimum") as refusal:
        mitsuba(Variant.llvm_ad_rgb)
    assert "scalar_rgb" in str(refusal.value)
    assert mitsuba(Variant.auto).variant() == "scalar_rgb"
    variants.trial.cache_clear()


def test_a_trial_that_hangs_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    """A child that takes too long counts as one that does not run."""

    def slow(*_: Any, **__: Any) -> Any:
        raise subprocess.TimeoutExpired("python", 120.0)

    variants.trial.cache_clear()
    monkeypatch.setattr(child_process.subprocess, "run", slow)
    assert "longer than" in variants.trial("cuda_ad_rgb")
    variants.trial.cache_clear()


def test_a_real_trial_tells_without_ending_this_process() -> None:
    """The scalar variant draws; whatever the others say, it is words."""
    pytest.importorskip("mitsuba")
    variants.trial.cache_clear()
    assert variants.trial("scalar_rgb") == ""
    assert isinstance(variants.trial("cuda_ad_rgb"), str)
    assert "\n" not in variants.trial("no_such_variant")
    assert variants.trial("no_such_variant")


def test_without_a_denoiser_single_dots_go(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bright dot takes the median about it; an edge stays as it is."""
    monkeypatch.setattr(denoising, "denoiser", lambda: None)
    image = np.full((9, 9, 3), 0.2, dtype=np.float32)
    image[:, 5:] = 1.0
    image[3, 2] = 60.0
    found = denoising.cleaned(image, image, image)
    wanted = image.copy()
    wanted[3, 2] = 0.2
    np.testing.assert_allclose(found, wanted)


def test_a_denoiser_takes_the_grain_out() -> None:
    """Noise on an even grey falls to a fifth; its mean stays."""
    if denoising.denoiser() is None:
        pytest.skip("pyoidn is not installed: pip install 'aam-seals[render]'")
    rng = np.random.default_rng(3)
    image = rng.gamma(4.0, 0.1, (64, 64, 3)).astype(np.float32)
    flat = np.full_like(image, 0.5)
    found = denoising.cleaned(image, flat, flat)
    assert found.std() < 0.2 * image.std()
    np.testing.assert_allclose(found.mean(), image.mean(), rtol=0.03)


def test_nothing_arranged_is_said() -> None:
    """A photograph without a scene is refused; counts that mean nothing as well."""
    view = Viewpoint(np.zeros(3), np.eye(3))
    frame = Frame(0.0, Poses.nowhere(), view, Lens(), None, 0.1)
    with pytest.raises(PhysicsError, match="no scene"):
        RendererMitsuba().photograph(frame)
    with pytest.raises(ConfigError, match=r"viewer\.samples=-1 is not allowed"):
        read(RendererMitsuba, {"samples": -1}, where="viewer")


def test_guides_of_the_denoiser_fade_with_the_way_through_water() -> None:
    """What water hides, and what nothing is behind, guides nothing; in air everything does."""
    distance = np.array([0.0, 1.0, 4.0])
    assert faded(distance, 0.5) == pytest.approx([0.0, np.exp(-0.5), np.exp(-2.0)])
    assert faded(distance, 0.0).tolist() == [1.0, 1.0, 1.0]
