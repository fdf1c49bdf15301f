"""Fuzz targets: what peers send over a network, robots of other formats, sensors, exports."""

from __future__ import annotations

import contextlib
import io
import re
import socket
import struct
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import yaml

from benchmarks.fuzz_described import bent, first_step
from benchmarks.fuzz_targets import URDF, Target, robot_folder

_ODD = (
    "",
    "0",
    "-1",
    "nan",
    "1e400",
    "1e308",
    "1e-320",
    "a",
    "1 2 3",
    "0 0 0",
    "../../a",
    "x" * 900,
)


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        yield


def _state() -> Any:
    from seals.teleop.autopilot.link import FlightState

    rest = np.zeros(3)
    return FlightState(0.0, rest, rest, rest, np.eye(3), rest, rest, rest, {})


def _frames(data: Random) -> bytes:
    """Draw packets of an autopilot, each behind its length: counts that jump, wrong lengths."""
    raw = b""
    for _ in range(data.randint(1, 20)):
        magic = data.choice((18458, 18458, 29569, 0, 65535))
        number = data.choice((0, 1, 2, 3, 17, 2**31, 2**32 - 1, data.randint(0, 40)))
        count = data.choice((16, 16, 32, 0, 500))
        rate = data.choice((0, 400, 65535))
        pulses = struct.pack(f"<{count}H", *(data.choice((0, 1500, 65535)) for _ in range(count)))
        packet = struct.pack("<HHI", magic, rate, number) + pulses
        packet = packet[: data.choice((len(packet), len(packet), 1, 7))]
        raw += struct.pack("<H", len(packet)) + packet
    return raw


def _ardupilot() -> Target:
    """Packets of ArduPilot's JSON interface, by UDP, up to the end of the session."""
    from seals.teleop.autopilot.ardupilot import ArduPilot

    mouth = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    mouth.bind(("127.0.0.1", 0))
    state = _state()

    def load(path: Path) -> None:
        raw = path.read_bytes()
        link = ArduPilot("127.0.0.1", 0, timeout=0.01, speed=0.0, step=0.0025)
        try:
            while len(raw) > 2:
                size = int.from_bytes(raw[:2], "little")
                mouth.sendto(raw[2 : 2 + size], link._ear.getsockname())
                raw = raw[2 + size :]
            with _silence():
                link.meet()
                while link.exchange(state) is not None:
                    pass
        finally:
            link.close()

    sound = b"".join(
        struct.pack("<H", 40) + struct.pack("<HHI16H", 18458, 400, k, *[1500] * 16)
        for k in range(1, 9)
    )
    return Target(whole=sound, name="packets", load=load, draw=_frames)


def _messages(data: Random) -> bytes:
    """Draw a stream of MAVLink messages of many kinds, cut, repeated and damaged."""
    from pymavlink.dialects.v20 import common

    stream = common.MAVLink(None, srcSystem=data.randint(0, 255))
    kinds = list(common.mavlink_map.values())
    raw = b""
    for _ in range(data.randint(1, 30)):
        if data.random() < 0.5:
            controls = [data.choice((0.0, 1.0, np.nan, np.inf, -1e38)) for _ in range(16)]
            time = data.choice((0, 1, 2**64 - 1))
            message = common.MAVLink_hil_actuator_controls_message(
                time, controls, data.choice((0, 128, 255)), data.choice((0, 2**64 - 1))
            )
            raw += message.pack(stream)
        else:
            kind = data.choice(kinds)
            body = data.randbytes(data.choice((0, 1, 30, 255)))
            head = struct.pack("<BBBBBB", 253, len(body), data.choice((0, 1, 255)), 0, 9, 1)
            raw += head + kind.id.to_bytes(3, "little") + body + data.randbytes(2)
    whole = bytearray(raw)
    for _ in range(data.randint(0, 4)):
        whole[data.randrange(len(whole))] = data.randint(0, 255)
    return bytes(whole)


def _px4() -> Target:
    """Messages of PX4, by TCP, over some steps."""
    from seals.teleop.autopilot.px4 import Px4
    from seals.teleop.autopilot.settings import HilSettings

    state = _state()

    def load(path: Path) -> None:
        link = Px4("127.0.0.1", 0, 0.05, 0.0, 0.004, hil=HilSettings(), seed=1)
        peer = socket.create_connection(link._ear.getsockname())
        try:
            link.meet()
            peer.sendall(path.read_bytes()[: 1 << 16])
            with _silence():
                steps = (link.exchange(state) for _ in range(4))
                all(controls is not None for controls in steps)
        finally:
            peer.close()
            link.close()

    return Target(whole=_messages(Random(1)), name="stream", load=load, draw=_messages)


class _Bus:
    """Stand-in for a session of zenoh: hands each file to the subscribers."""

    def __init__(self) -> None:
        self.info, self.hear = self, list[Callable[[Any], None]]()

    def zid(self) -> str:
        return "1"

    def liveliness(self) -> Any:
        return self

    def declare_token(self, token: str) -> None:
        pass

    def declare_subscriber(self, key: str, hear: Callable[[Any], None]) -> None:
        self.hear.append(hear)


def _commands(kind: str) -> Callable[[], Target]:
    """Return the target of a command by ROS 2, up to the guide or controller that takes it."""

    def build() -> Target:
        from types import SimpleNamespace

        from seals.plugins.live.ros2 import COMMANDS, VELOCITY, LiveRos2, ZenohNode
        from seals.plugins.live.ros_messages import Messages

        bus, store, told = _Bus(), Messages().store, list[Any]()
        node = ZenohNode(bus, 0, "a", "", store)
        live: Any = LiveRos2()
        live._guide = live._controller = SimpleNamespace(tell=told.append)
        live._yaw, live._last = 0.5, 0.0

        def take(message: Any) -> None:
            if kind == VELOCITY:
                live._steer(SimpleNamespace(time=0.1), message)
            else:
                told.append(np.asarray(message.data, dtype=float))

        shape = "geometry_msgs/msg/Twist" if kind == VELOCITY else "std_msgs/msg/Float64MultiArray"
        node.subscribe(kind, shape, take)

        def load(path: Path) -> None:
            with _silence():
                bus.hear[0](SimpleNamespace(payload=path.read_bytes()))

        numbers = struct.pack("<6d", *range(6))
        whole = b"\0\1\0\0" + numbers
        if kind == COMMANDS:
            whole = b"\0\1\0\0" + struct.pack("<IIII", 0, 0, 6, 0) + numbers
        return Target(whole=whole, name="message", load=load)

    return build


_SDF = (
    '<sdf version="1.9"><model name="m"><link name="body"><pose>0 0 0 0 0 0</pose><inertial>'
    "<mass>1</mass><inertia><ixx>.1</ixx><iyy>.1</iyy><izz>.1</izz></inertia></inertial>"
    '<collision name="c"><geometry><box><size>1 1 1</size></box></geometry></collision></link>'
    '<link name="rotor_0"><inertial><mass>.1</mass><inertia><ixx>.1</ixx><iyy>.1</iyy>'
    '<izz>.1</izz></inertia></inertial></link><joint name="j" type="revolute"><parent>body</parent>'
    "<child>rotor_0</child><axis><xyz>0 0 1</xyz><limit><lower>-1</lower><upper>1</upper></limit>"
    "</axis></joint><plugin filename='motor.so' name='p'><jointName>j</jointName><linkName>rotor_0"
    "</linkName><motorConstant>1e-5</motorConstant><momentConstant>0.01</momentConstant>"
    "<turningDirection>cw</turningDirection><maxRotVelocity>900</maxRotVelocity></plugin></model>"
    "</sdf>"
)
_MJCF = (
    '<mujoco model="m"><default><geom density="500"/></default><worldbody><body name="b" '
    'pos="0 0 1"><freejoint/><geom type="box" size="0.1 0.1 0.1" mass="1"/><site name="s" '
    'pos="0 0 0"/><body name="c" pos="0.2 0 0"><joint name="j" type="hinge" axis="0 0 1" '
    'range="-1 1"/><geom type="capsule" size="0.05 0.1" mass="0.1"/></body></body></worldbody>'
    '<actuator><motor name="a" joint="j" gear="1"/><velocity name="v" site="s" gear="0 0 1 0 0 0"/>'
    "</actuator></mujoco>"
)
_MACROS = (
    '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
    '<xacro:include filename="$(find near)/part.xacro"/><xacro:property name="m" value="1"/>'
    + URDF.partition('<robot name="r">')[2].replace('value="1"', 'value="${m}"', 1)
)
_PART = b'<robot xmlns:xacro="http://www.ros.org/wiki/xacro"/>'


def _bent_xml(whole: str, hostile: tuple[str, ...]) -> Callable[[Random], bytes]:
    """Return a grammar: texts and attributes odd, elements moved, repeated, dropped, hostile."""
    spots = [m.span(1) for m in re.finditer(r'(?:="|>)([^<>"]+)(?="|<)', whole)]
    shape = re.compile(r"<([\w:]+)(?:[^>]*/>|[^>]*>.*?</\1>)")
    starts = [m.start() for m in re.finditer(r"<\w", whole)]
    found = [shape.match(whole, start) for start in starts]
    elements = [m.group(0) for m in found if m][1:]

    def draw(data: Random) -> bytes:
        text = whole
        for _ in range(data.randint(1, 3)):
            kind = data.randint(0, 4)
            if kind < 2:
                old = whole[slice(*data.choice(spots))]
                text = text.replace(old, data.choice(_ODD), 1)
                continue
            one = data.choice(elements)
            other = data.choice((*elements, *hostile))
            count = data.choice((0, 1, 2, 40))
            text = text.replace(one, other * count if kind == 2 else one + other * count, 1)
        return text.encode()

    return draw


def _imported(name: str, whole: str, hostile: tuple[str, ...], **more: bytes) -> Target:
    """Return the target of a file on its way into a robot's folder."""
    from seals.scaffold.robot import scaffold_robot

    def load(path: Path) -> None:
        with tempfile.TemporaryDirectory() as place, _silence():
            near = {"near": path.parent / "near"}
            scaffold_robot("made", path, parent=Path(place), packages=near)

    beside = {f"near/{key}.xacro": raw for key, raw in more.items()}
    return Target(
        whole=whole.encode(), name=name, load=load, draw=_bent_xml(whole, hostile), beside=beside
    )


_SDF_HOSTILE = (
    *(
        "<include><uri>model://../../etc</uri></include>",
        "<include><uri>file:///dev/zero</uri></include>",
    ),
    *("<model name='n'>" * 90 + "</model>" * 90, "<pose relative_to='body'>0 0 0 0 0 0</pose>"),
    "<plugin filename='l.so' name='x'><cla>nan</cla><link_name>body</link_name></plugin>",
    "<collision name='d'><geometry><mesh><uri>/dev/zero</uri></mesh></geometry></collision>",
    "<joint name='k' type='revolute'><parent>rotor_0</parent><child>body</child></joint>",
)
_MJCF_HOSTILE = (
    *(
        "<include file='/dev/zero'/>",
        "<body>" * 90 + "</body>" * 90,
        "<replicate count='1000000'/>",
    ),
    *("<freejoint/>", "<joint type='ball'/>", "<geom type='mesh' mesh='a'/>", "<flexcomp/>"),
    *("<asset><mesh name='a' file='/dev/zero'/></asset>", "<compiler meshdir='../..'/>"),
    *("<option timestep='0'/>", "<size memory='900G'/>", "<frame euler='1 2 3'/>", "<plugin/>"),
    "<asset><hfield name='h' nrow='99999' ncol='99999' size='1 1 1 1'/></asset>",
)
_MACROS_HOSTILE = (
    *('<xacro:include filename="$(find near)/../../a"/>', '<link name="${10**10**8}"/>'),
    *('<xacro:include filename="$(find gone)/a.xacro"/>', '<link name="$(env HOME)"/>'),
    '<xacro:macro name="a" params=""><xacro:a/></xacro:macro><xacro:a/>',
    "<xacro:include filename=\"${'$(find near)/part.xacro'}\"/>",
)
_SONAR: dict[str, Any] = {
    "sensor": "sonar", "rate": 10.0, "beams": 8, "bins": 16, "rays": 4, "sector": 2.0,
    "beam_width": 0.1, "vertical_width": 0.3, "nearest": 0.3, "farthest": 10.0, "pulse": 0.0,
    "frequency": 7e5, "source_level": 190.0, "noise": 60.0, "strengths": {"a": -10.0},
    "acidity": 8.0, "speckle": True, "multipath": True, "threshold": 10.0,
    "position": [0, 0, 0], "rpy": [0, 0, 0],
}  # fmt: skip
_LIDAR: dict[str, Any] = {"sensor": "lidar", "position": [0, 0, 0], "rpy": [0, 0, 0], "rate": 5.0}


def _seeing(name: str, tree: dict[str, Any]) -> Callable[[], Target]:
    """Return the target of a robot's file with a scanning sensor, up to its first reading."""

    def build() -> Target:
        import dataclasses

        from seals.registry import get

        kind = get("sensor", name).load()
        known = {f.name: f.default for f in dataclasses.fields(kind)}
        plain = {k: v for k, v in known.items() if isinstance(v, int | float | bool)}
        whole = {**plain, **tree}

        def form(sensor: Any) -> bytes:
            return yaml.safe_dump({"urdf": "r.urdf", "sensors": {"eye": sensor}}).encode()

        return robot_folder(
            form(whole),
            first_step("backend=free", "water=fossen", "environment.tank_bottom=-3"),
            lambda data: form(bent(data, whole)),
        )

    return build


def _exported(part: str) -> Callable[[], Target]:
    """Return the target of a policy's file on its way to ONNX."""

    def build() -> Target:
        import json

        from benchmarks.fuzz_stored import STORED
        from seals.learn.export import onnx_of
        from seals.learn.policy import load_policy

        sound = STORED["card" if part == "card.json" else "weights"]()
        if part == "card.json":
            tree = json.loads(sound.whole)
            sound.draw = lambda data: json.dumps(bent(data, tree)).encode()
        sound.load = lambda folder: onnx_of(load_policy(folder))
        return sound

    return build


PEERS: dict[str, Callable[[], Target]] = {
    "ardupilot": _ardupilot,
    "px4": _px4,
    "ros2_velocity": _commands("cmd_vel"),
    "ros2_commands": _commands("commands"),
    "sdf": lambda: _imported("a.sdf", _SDF, _SDF_HOSTILE),
    "mjcf": lambda: _imported("a.xml", _MJCF, _MJCF_HOSTILE),
    "xacro_package": lambda: _imported("a.xacro", _MACROS, _MACROS_HOSTILE, part=_PART),
    "sonar": _seeing("sonar", _SONAR),
    "lidar": _seeing("lidar", _LIDAR),
    "export_card": _exported("card.json"),
    "export_weights": _exported("policy.safetensors"),
}
"""Targets of the network and of imports, by name."""
