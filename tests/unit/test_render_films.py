"""Films of runs: frames that go on after a kill, cameras, refusals in words."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from PIL import Image

from seals.api import load_log
from seals.cli.main import main
from seals.errors import ConfigError, MissingExtra
from seals.rendering import Lens
from seals.rendering.optics.surface import SurfaceAiry
from seals.view.films.application import prepare
from seals.view.films.files import Frames, times_of, write_film
from seals.view.films.settings import RenderSettings
from seals.view.films.viewpoint import Viewpoint, Way, apparent, camera_of, in_picture

DROP = [
    "experiment=drop_test",
    "initial.position=[0,0,0.3]",
    "time.duration=0.4",
    "time.step=0.004",
]
SMALL = ["width=64", "height=40", "fps=10", "film=false"]


@pytest.fixture(scope="module")
def drop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a short drop into still water."""
    folder = tmp_path_factory.mktemp("runs") / "drop"
    assert main(["run", *DROP, f"hydra.run.dir={folder}"]) == 0
    return folder


def render(run: Path, *words: str) -> int:
    """Render a run with small frames."""
    return main(["render", f"run={run}", *SMALL, f"hydra.run.dir={run.parent / 'job'}", *words])


def test_a_run_becomes_frames_that_show_the_robot(drop: Path, tmp_path: Path) -> None:
    """Five frames of the wanted size; the ball in the middle differs from the same view later."""
    assert render(drop, f"out={tmp_path}", "camera=[0,-1,0.3]", "look_at=[0,0,0.3]") == 0
    frames = sorted(tmp_path.glob("frame_*.png"))
    assert [f.name for f in frames] == [f"frame_{k:05d}.png" for k in range(5)]
    first, last = (np.asarray(Image.open(f), dtype=float) for f in (frames[0], frames[-1]))
    assert first.shape == (40, 64, 3)
    # a ball of 0.1 m at 1 m under 0.9 rad is 6.6 pixels wide: there at first, gone at the end
    assert np.abs(first - last)[18:22, 30:34].mean() > 20.0
    assert np.abs(first - last)[:5, :5].max() == 0.0
    assert not (drop.parent / "job").exists()


def test_a_render_that_was_cut_off_keeps_whole_frames_only(drop: Path, tmp_path: Path) -> None:
    """Frames that are there stay untouched; a missing and a cut-off one are drawn again."""
    assert render(drop, f"out={tmp_path}") == 0
    whole = {p.name: p.read_bytes() for p in tmp_path.glob("frame_*.png")}
    (tmp_path / "frame_00001.png").unlink()
    (tmp_path / "frame_00003.png").write_bytes(whole["frame_00003.png"][:-20])
    before = {p.name: p.stat().st_mtime_ns for p in tmp_path.glob("frame_*.png")}
    assert render(drop, f"out={tmp_path}") == 0
    after = {p.name: p.stat().st_mtime_ns for p in tmp_path.glob("frame_*.png")}
    assert {n for n in after if after[n] != before.get(n)} == {"frame_00001.png", "frame_00003.png"}
    assert {p.name: p.read_bytes() for p in tmp_path.glob("frame_*.png")} == whole


def test_a_kill_in_a_frame_leaves_the_others_and_no_half_one(
    drop: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """When the third frame breaks, two stand, and nothing else that looks like a frame."""
    from seals.view.films.frame import Drawn

    real, calls = Drawn.photograph, []

    def cut(self: Any, frame: Any) -> Any:
        calls.append(frame.time)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return real(self, frame)

    monkeypatch.setattr(Drawn, "photograph", cut)
    assert render(drop, f"out={tmp_path}") == 130
    names = sorted(p.name for p in tmp_path.iterdir())
    assert names == ["frame_00000.png", "frame_00001.png", "render.json"]
    assert render(drop, f"out={tmp_path}") == 0
    # the two that stood are not asked for again
    assert [round(t, 3) for t in calls[3:]] == [0.2, 0.3, 0.4]


def test_frames_of_two_films_are_not_mixed(
    drop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Another camera into the same folder is refused by name, unless it may replace."""
    assert render(drop, f"out={tmp_path}") == 0
    first = (tmp_path / "frame_00000.png").read_bytes()
    assert render(drop, f"out={tmp_path}", "camera=side") == 2
    said = capsys.readouterr().err
    assert "camera" in said
    assert "replace=true" in said
    assert (tmp_path / "frame_00000.png").read_bytes() == first
    assert render(drop, f"out={tmp_path}", "camera=side", "replace=true") == 0
    assert (tmp_path / "frame_00000.png").read_bytes() != first


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["run=nowhere"], "no such folder"),
        (["run=null"], "run is not given"),
        (["camera=sidee"], "Did you mean 'side'"),
        (["camera=[1,2]"], "is not a finite position"),
        (["camera=[0,0,0]", "look_at=[0,0,0]"], "Give two different positions"),
        (["start=9"], "after the end"),
        (["water_type=coastal_4"], "water_type=coastal_4 is not known"),
        (["quality=best"], "draft"),
        (["renderer=tinny"], "tiny"),
        (["renderer=browser"], "renders no frames"),
        (["fps=0"], "fps"),
        (["width=100000"], "pixels"),
    ],
)
def test_refusals_name_what_is_wrong(
    drop: Path, words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each is two lines with exit code 2, and no folder is made."""
    assert render(drop, *words) == 2
    err = capsys.readouterr().err
    assert said in err
    assert "Traceback" not in err
    assert len(err.strip().splitlines()) == 2
    assert not (drop / "render").exists()


def test_a_dry_run_has_no_camera_under_water(drop: Path, tmp_path: Path) -> None:
    """Presets that need water say so, and name those that do not."""
    way = Way(np.zeros(3), 1.0, None)
    for camera in ("split", "under_water"):
        with pytest.raises(ConfigError, match="the run has no water"):
            camera_of(RenderSettings(camera=camera), way)
    for camera in ("side", "three_quarter"):
        assert camera_of(RenderSettings(camera=camera), way)(np.zeros(3)).axes[2, 2] < 0.0


def test_presets_hold_the_whole_way(drop: Path) -> None:
    """Every point of the ball about robot and way is in the picture, from all presets."""
    way = Way(np.array([1.0, 2.0, -0.3]), 1.5, 0.0)
    rng = np.random.default_rng(1)
    on_ball = rng.normal(size=(400, 3))
    on_ball = way.middle + way.radius * on_ball / np.linalg.norm(on_ball, axis=1, keepdims=True)
    for camera in ("side", "three_quarter"):
        origin, axes = camera_of(RenderSettings(camera=camera), way)(np.zeros(3))
        seen = (on_ball - origin) @ axes
        wide = np.tan(0.5 * 0.9)
        assert np.abs(seen[:, 0] / seen[:, 2]).max() < wide
        assert np.abs(seen[:, 1] / seen[:, 2]).max() < wide * 300 / 480


def test_the_camera_follows_when_told(drop: Path) -> None:
    """It goes along with the robot, but under water it keeps its depth."""
    way = Way(np.zeros(3), 1.0, 0.0)
    still = camera_of(RenderSettings(camera="side"), way)
    along = camera_of(RenderSettings(camera="side", follow=True), way._replace(level=None))
    there = np.array([2.0, 0.0, 1.0])
    np.testing.assert_allclose(still(there).origin, still(np.zeros(3)).origin)
    np.testing.assert_allclose(along(there).origin - along(np.zeros(3)).origin, there)
    split = camera_of(RenderSettings(camera="split", follow=True), way)
    assert split(there).origin[2] == 0.0


@pytest.mark.parametrize("camera", ["side", "three_quarter", "split"])
@pytest.mark.parametrize("height", [-0.6, -0.2, 0.0, 0.3, 0.6])
def test_a_preset_keeps_robot_and_waterline_in_the_picture(camera: str, height: float) -> None:
    """On a way of 9 m the camera goes along: robot and the water beside it are in the picture."""
    way = Way(np.zeros(3), 4.5, 0.0, reach=0.6)
    at = np.array([4.0, 0.0, height])
    view = camera_of(RenderSettings(camera=camera), way)(at)
    lens = Lens(width=480, height=300, fov=0.9, near=0.02, far=100.0)
    for corner in 0.5 * np.vstack([np.eye(3), -np.eye(3)]):
        # seen through air alone: where the eye is does not matter here
        assert in_picture(view, lens, (at + corner)[None], None)
    assert in_picture(view, lens, np.array([[4.0, 0.0, 0.0]]), None)
    # near enough: the robot fills a sixth of the picture's height or more
    far = float(np.linalg.norm(view.origin - at))
    assert 2 * 0.6 / far > 2 * np.tan(0.45) * 300 / 480 / 6


def test_a_camera_half_in_the_water_rides_on_the_waves(
    drop: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its height is that of the surface where it is, at the time of the frame."""
    wave = SurfaceAiry([0.2], [[0.4, 0.1]], [2.0], [0.4])
    for camera, rides in (("split", True), ("side", False)):
        shooting = prepare(RenderSettings(run=str(drop), camera=camera))
        body = shooting.water.at(0.0)
        assert body is not None
        monkeypatch.setattr(shooting.water, "at", Mock(return_value=body._replace(surface=wave)))
        x, y, z = shooting.frame_at(3, port=0.1).view.origin
        height = float(wave.height(np.array([x]), np.array([y]), shooting.times[3])[0])
        assert (float(z) == pytest.approx(height)) is rides
        assert abs(height) > 0.01


def test_an_eye_under_water_sees_the_air_in_a_cone() -> None:
    """Snell's law: a ball far off over the water stands at 48.6 degrees from the vertical."""
    eye = np.array([0.0, 0.0, -1.0])
    place = apparent(eye, np.array([[1000.0, 0.0, 5.0], [0.0, 0.0, 5.0]]), 0.0)
    lean = np.degrees(np.arctan2(place[:, 0], place[:, 2] + 1.0))
    np.testing.assert_allclose(lean, [np.degrees(np.arcsin(1 / 1.333)), 0.0], atol=0.1)
    # on the way back it is the same path
    back = apparent(np.array([3.0, 0.0, 2.0]), eye[None], 0.0)[0] - [3.0, 0.0, 2.0]
    there = apparent(eye, np.array([[3.0, 0.0, 2.0]]), 0.0)[0] - eye
    sines = [np.hypot(*ray[:2]) / np.linalg.norm(ray) for ray in (back, there)]
    np.testing.assert_allclose(sines[0], 1.333 * sines[1], rtol=1e-6)


def test_a_camera_that_misses_the_robot_says_so(
    drop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The picture is drawn, and the console names the frames without the robot and a camera."""
    assert render(drop, f"out={tmp_path}", "camera=[0,-3,1]", "look_at=[0,-9,1]") == 0
    said = capsys.readouterr().out
    assert "camera: the robot is in the picture in 0 of 5 sampled frames" in said
    assert "camera=side shows it in 100 %" in said
    assert render(drop, f"out={tmp_path}", "camera=side", "replace=true") == 0
    assert "camera:" not in capsys.readouterr().out


@pytest.mark.thorough
def test_frames_of_one_colour_are_said(
    drop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """From far above the robot is a dot; the frame is counted, and another place is offered."""
    one = [f"run={drop}", "start=0.1", "end=0.1", "film=false"]
    assert main(["render", *one, "camera=[0,0,400]", "look_at=[0,0,0]", f"out={tmp_path}"]) == 0
    said = capsys.readouterr().out
    assert "camera: 1 of 1 frames show nothing but one colour, the first at 0.10 s" in said
    assert "camera=three_quarter looks from near by" in said
    assert main(["render", *one, f"out={tmp_path / 'near'}"]) == 0
    assert "one colour" not in capsys.readouterr().out


def test_a_slow_renderer_begins_with_a_preview(
    drop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Four frames of TinyRenderer stand in a picture of 640 x 400 before the first is drawn."""
    pytest.importorskip("mitsuba")
    words = ["renderer=mitsuba", "renderer.samples=1", "width=32", "height=20"]
    assert render(drop, f"out={tmp_path}", *words) == 0
    assert "preview: " in capsys.readouterr().out
    shown = np.asarray(Image.open(tmp_path / "preview.png"))
    assert shown.shape == (400, 640, 3)
    assert shown.std() > 5.0


def test_looking_is_upright() -> None:
    """The target is ahead, the horizon level, the axes right-handed."""
    view = Viewpoint.looking(np.array([1.0, 2.0, 3.0]), np.array([4.0, -2.0, 1.0]))
    ahead = np.array([3.0, -4.0, -2.0]) / np.sqrt(29.0)
    np.testing.assert_allclose(view.axes[:, 2], ahead)
    assert abs(view.axes[2, 0]) < 1e-12
    assert view.axes[2, 1] < 0.0
    np.testing.assert_allclose(np.linalg.det(view.axes), 1.0)


@pytest.mark.parametrize(
    ("speed", "count", "last"), [(1.0, 11, 0.4), (0.5, 21, 0.4), (3.0, 4, 0.36)]
)
def test_slow_motion_takes_more_frames(speed: float, count: int, last: float) -> None:
    """Frames stand at speed / fps."""
    times = times_of(0.0, 0.4, fps=25.0, speed=speed)
    assert (len(times), round(float(times[-1]), 9)) == (count, last)


def test_water_that_has_no_type_gets_one(drop: Path) -> None:
    """A film shows water; the run's own type rules, the film's over it."""
    assert prepare(RenderSettings(run=str(drop))).optics.water_type == "coastal_1"
    own = RenderSettings(run=str(drop), water_type="oceanic_2")
    assert prepare(own).optics.water_type == "oceanic_2"


def test_the_film_has_all_frames(drop: Path, tmp_path: Path) -> None:
    """A decoder reads as many frames as there are pictures, of their size and brightness."""
    av = pytest.importorskip("av")
    paths = []
    for k in range(6):
        paths.append(tmp_path / f"{k}.png")
        Image.new("RGB", (65, 40), (40 * k, 40 * k, 40 * k)).save(paths[-1])
    write_film(tmp_path / "film.mp4", paths, 12.5)
    with av.open(str(tmp_path / "film.mp4")) as film:
        assert float(film.streams.video[0].average_rate) == 12.5
        shown = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
    assert [image.shape for image in shown] == [(40, 64, 3)] * 6
    np.testing.assert_allclose([i.mean() for i in shown], 40.0 * np.arange(6), atol=4.0)


def test_no_film_writer_is_said_before_a_frame_is_drawn(
    drop: Path,
    tmp_path: Path,
    absent: Callable[..., None],
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Without PyAV the extra is named; film=false needs it not."""
    absent("av")
    assert render(drop, f"out={tmp_path / 'a'}", "film=true") == 2
    said = capsys.readouterr().err
    assert "aam-seals[render]" in said
    assert "film=false" in said
    assert not (tmp_path / "a").exists()
    assert render(drop, f"out={tmp_path / 'a'}", "end=0") == 0


def test_no_codec_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A build without a codec for MP4 is named, and no film is left."""
    from seals.view.films import files

    class Bare:
        codecs_available = frozenset({"gif"})

    monkeypatch.setattr(files, "refuse_missing", Bare)
    with pytest.raises(MissingExtra, match="no codec"):
        write_film(tmp_path / "film.mp4", [tmp_path / "0.png"], 25.0)
    assert not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    """A file in place of the folder is said in words."""
    (tmp_path / "taken").write_text("a file", encoding="utf-8")
    with pytest.raises(ConfigError, match="cannot be written"):
        Frames(tmp_path / "taken" / "film", {"run": "x"})


def test_the_card_names_the_film(drop: Path, tmp_path: Path) -> None:
    """Whoever finds frames can read what they show; a damaged card belongs to no film."""
    assert render(drop, f"out={tmp_path}", "camera=side") == 0
    card = json.loads((tmp_path / "render.json").read_text(encoding="utf-8"))
    assert (card["camera"], card["quality"], card["width"]) == ("side", "draft", 64)
    assert card["run"] == str(drop.resolve())
    (tmp_path / "render.json").write_text("{", encoding="utf-8")
    assert render(drop, f"out={tmp_path}", "camera=side") == 2


def test_settings_are_described() -> None:
    """Every field of the settings has its line in the docstring."""
    words = RenderSettings.__doc__ or ""
    missing = [f.name for f in dataclasses.fields(RenderSettings) if f"{f.name}:" not in words]
    assert not missing


@pytest.mark.slow
def test_the_films_of_the_gallery_are_made_by_one_command(tmp_path: Path) -> None:
    """A film under water in three small frames; a second call draws nothing anew."""
    from seals.experiments.photoreal import main as films

    words = ["target", "--out", str(tmp_path), "--renderer", "tiny", *SMALL, "fps=1", "end=2"]
    assert films(words) == 0
    frames = sorted(tmp_path.rglob("frame_*.png"))
    assert len(frames) == 3
    times = [p.stat().st_mtime_ns for p in (*frames, tmp_path / "target" / "log.parquet")]
    assert films(words) == 0
    assert times == [p.stat().st_mtime_ns for p in (*frames, tmp_path / "target" / "log.parquet")]


def test_the_run_of_a_film_takes_overrides(tmp_path: Path) -> None:
    """A shorter run for one frame: the words reach the simulation, not the renderer."""
    from seals.experiments.photoreal import main as films

    shorter = ["--run", "time.duration=0.2", "--run", "initial.position=[0,0,-0.7]"]
    words = ["target", "--out", str(tmp_path), "--renderer", "tiny", *SMALL, "fps=1", *shorter]
    assert films(words) == 0
    log = load_log(tmp_path / "target")
    assert log.time[-1] == pytest.approx(0.2)
    assert log.channel("position")[0] == pytest.approx([0.0, 0.0, -0.7])
