"""A run as a node of ROS 2, seen by a second process without SEALS; recordings in MCAP."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.cli.main import main
from seals.logs.native import read_native
from seals.plugins.controllers.direct import Direct
from seals.plugins.live.ros_messages import CAMERA, Messages, camera_messages
from seals.rendering.camera import Lens
from seals.rendering.camera_view import Shot
from seals.rendering.picture import Picture
from tests.unit.ros_listener import decode

pytest.importorskip("zenoh", reason="needs aam-seals[ros2]")
pytest.importorskip("rosbags", reason="needs aam-seals[ros2]")

LISTENER = Path(__file__).with_name("ros_listener.py")
TWIST = "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"
TF = "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"
"""Hashes of the types as ROS 2 publishes them."""
VEHICLE = ["robot=auv", "water=fossen", "initial.position=[0,0,-2]", "initial.rpy=[0,0,1.5708]"]
SENSORS = ["+sensor@sensors.depth=pressure", "sensors.depth.noise=0", "sensors.depth.drift=0"]


@pytest.mark.thorough
def test_a_node_of_ros_sees_a_run_and_steers_it(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Keys, hashes, tokens and attachments are those of rmw_zenoh; a Twist moves the vehicle."""
    with socket.socket() as ear:
        ear.bind(("127.0.0.1", 0))
        port = ear.getsockname()[1]
    listener = subprocess.Popen(
        [sys.executable, str(LISTENER), str(port), "60", TWIST], stdout=subprocess.PIPE, text=True
    )
    try:
        assert listener.stdout is not None
        assert listener.stdout.readline() == "ready\n"
        live = ["live=ros2", "live.domain=7", "live.namespace=boat", "live.record=true"]
        live += [f"live.connect=[tcp/127.0.0.1:{port}]", "guide=commanded", "time.duration=2"]
        where = f"hydra.run.dir={tmp_path / 'run'}"
        assert main(["run", *VEHICLE, *SENSORS, *live, where]) == 0
        seen: dict[str, Any] = json.loads(listener.communicate(timeout=30)[0])
    finally:
        listener.kill()
        listener.wait()
    assert all(seen["numbers"].values())
    assert {"boat/odom", "boat/tf", "boat/clock", "boat/imu", "boat/depth"} == {*seen["counts"]}
    assert seen["counts"]["boat/odom"] > 50
    assert seen["keys"]["boat/tf"] == f"7/boat/tf/tf2_msgs::msg::dds_::TFMessage_/{TF}"
    last, log = seen["last"], read_native(tmp_path / "run")
    odom = last["boat/odom"]
    row = int(np.argmin(np.abs(log.time - stamp(odom))))
    place = odom["pose"]["pose"]["position"]
    for axis in "xyz":
        assert place[axis] == pytest.approx(log.columns[f"position_{axis}"][row], abs=1e-9)
    assert odom["header"]["frame_id"] == "world"
    # it heads north: forwards is towards y
    assert place["y"] > 0.15
    assert abs(place["x"]) < 0.05
    frames = {f["child_frame_id"]: f for f in last["boat/tf"]["transforms"]}
    assert {odom["child_frame_id"], "imu", "depth"} <= {*frames}
    depth = last["boat/depth"]
    assert depth["fluid_pressure"] == pytest.approx(101325 + 998.2 * 9.81 * 2.0, rel=0.01)
    imu = last["boat/imu"]
    assert imu["linear_acceleration"]["z"] == pytest.approx(9.81, abs=0.5)
    assert imu["orientation_covariance"][0] == -1.0
    tokens = seen["tokens"]
    nodes = [token.split("/") for token in tokens if "/NN/" in token]
    assert nodes[0][:2] == ["@ros2_lv", "7"]
    assert nodes[0][3:] == ["0", "0", "NN", "%", "%boat", "seals"]
    (published,) = {token for token in tokens if "/MP/" in token and "%tf/" in token}
    assert published.endswith(f"/%boat%tf/tf2_msgs::msg::dds_::TFMessage_/{TF}/::,10:,:,:,,")
    (taken,) = {token for token in tokens if "/MS/" in token}
    assert f"/%boat%cmd_vel/geometry_msgs::msg::dds_::Twist_/{TWIST}/" in taken
    assert "refused: a message on cmd_vel" in capfd.readouterr().out
    _check_recording(tmp_path)


def stamp(message: dict[str, Any]) -> float:
    """Return the time of a message [s]."""
    when = message["header"]["stamp"]
    return float(when["sec"] + when["nanosec"] * 1e-9)


def _check_recording(folder: Path) -> None:
    """The file is read by the library of MCAP and by SEALS, as a log of the same motion."""
    from mcap.reader import make_reader

    with (folder / "run" / "ros2.mcap").open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        assert summary is not None
        kinds = {c.topic: summary.schemas[c.schema_id].name for c in summary.channels.values()}
        assert kinds["/odom"] == "nav_msgs/msg/Odometry"
        found = [m for _, c, m in reader.iter_messages() if c.topic == "/imu"]
        begin = summary.statistics.message_start_time * 1e-9
    assert decode("Imu", found[0].data)["header"]["frame_id"] == "imu"
    words = [f"log={folder / 'run' / 'ros2.mcap'}", f"out={folder / 'converted'}"]
    assert main(["convert", *words]) == 0
    made, log = read_native(folder / "converted"), read_native(folder / "run")
    there = np.isfinite(made.columns["position_y"])
    expected = np.interp(made.time[there] + begin, log.time, log.columns["position_y"])
    assert made.columns["position_y"][there] == pytest.approx(expected, abs=1e-3)


def test_pictures_and_points_are_in_optical_axes() -> None:
    """A pixel's point lies at its depth along its ray; colours are bytes."""
    depth = np.full((2, 4), np.inf, dtype=np.float32)
    depth[1, 3] = 2.0
    colour = np.zeros((2, 4, 3))
    colour[0, 0, 1] = 1.0
    lens = Lens(width=4, height=2, fov=2.0 * np.arctan(0.5))
    picture = Picture(colour, depth, np.zeros((2, 4), dtype=np.int32))
    shot = Shot(0, 1.25, picture, lens, ("rgb", "depth"), np.zeros(3), np.eye(3))
    messages = Messages()
    head = messages.header(1.25, "eye")
    read = {}
    assert {topic: kind for topic, kind, _ in camera_messages(messages.store, head, shot)} == CAMERA
    for topic, kind, value in camera_messages(messages.store, head, shot):
        raw = bytes(messages.store.serialize_cdr(value, kind))
        read[topic] = decode(kind.rpartition("/")[2], raw)
    assert read["image_raw"]["data"][:6] == [0, 255, 0, 0, 0, 0]
    assert read["image_raw"]["step"] == 12
    assert read["depth/image_raw"]["encoding"] == "32FC1"
    info = read["camera_info"]
    assert info["k"] == pytest.approx([4.0, 0.0, 1.5, 0.0, 4.0, 0.5, 0.0, 0.0, 1.0])
    points = np.frombuffer(bytes(read["points"]["data"]), "<f4")
    # 1.5 pixels right of the middle and half a pixel below it, at a focal length of 4
    assert points.tolist() == pytest.approx([1.5 / 4 * 2, 0.5 / 4 * 2, 2.0])
    assert read["points"]["header"]["stamp"] == {"sec": 1, "nanosec": 250000000}


def test_commands_of_a_topic_stay_within_the_limits() -> None:
    """Numbers that are missing or none rest."""
    from seals.run.assembly import ROBOT, build_world
    from seals.run.build import run_settings

    words = ["robot=auv", "water=fossen", "controller=direct", "guide=commanded"]
    settings = run_settings(words)
    assert isinstance(settings.controller, Direct)
    settings.controller.tell(np.array([5.0, np.nan, 1e6, -1e6]))
    world = build_world(settings)
    world.step()
    command = world.actors[ROBOT].command
    world.close()
    assert command is not None
    assert command[0].tolist() == [5.0, 0.0, 40.0, -40.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        ("live=ros3", "ros2"),
        ("live.listen=[tcp/203.0.113.1:7]", "live.listen"),
    ],
)
def test_a_mistyped_output_is_refused(
    word: str, expected: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In two lines."""
    live = [word] if word.startswith("live=") else ["live=ros2", "live.connect=[]", word]
    assert main(["run", *VEHICLE, "guide=hover", *live, f"hydra.run.dir={tmp_path / 'x'}"]) == 2
    err = capsys.readouterr().err
    assert expected in err
    assert len(err.strip().splitlines()) == 2
