"""A run served to Foxglove, heard by a client that speaks the protocol itself."""

from __future__ import annotations

import json
import socket
import struct
import threading
from pathlib import Path
from typing import Any

import pytest

from seals.cli.main import main
from seals.logs.native import read_native

pytest.importorskip("foxglove", reason="needs aam-seals[foxglove]")
client = pytest.importorskip("websockets.sync.client", reason="needs websockets")


def free_port() -> int:
    """Return a port that nobody listens on."""
    with socket.socket() as ear:
        ear.bind(("127.0.0.1", 0))
        return int(ear.getsockname()[1])


class Listener(threading.Thread):
    """Client: subscribes to all JSON channels, the frames and the scene; asks for parameters."""

    def __init__(self, port: int) -> None:
        """Remember where."""
        super().__init__(daemon=True)
        self.port, self.channels, self.heard = port, dict[str, Any](), dict[str, list[Any]]()
        self.info: dict[str, Any] = {}
        self.parameters: dict[str, Any] = {}
        self.protocol, self.error = "", ""

    def connect(self) -> Any:
        """Connect as soon as the server is there."""
        for _ in range(600):
            try:
                return client.connect(
                    f"ws://127.0.0.1:{self.port}",
                    subprotocols=["foxglove.sdk.v1", "foxglove.websocket.v1"],
                    max_size=None,
                )
            except OSError:
                threading.Event().wait(0.05)
        raise TimeoutError

    def run(self) -> None:
        """Listen until the server leaves."""
        try:
            with self.connect() as link:
                self.protocol = str(link.subprotocol)
                for said in link:
                    self.take(link, said)
        except Exception as error:  # the end of the server among them: the test judges
            self.error = f"{type(error).__name__}: {error}"

    def take(self, link: Any, said: str | bytes) -> None:
        """Heed one message of the server."""
        if isinstance(said, bytes):
            # opcode 1: subscription, time of the log, payload
            if said[0] == 1:
                number, stamp = struct.unpack_from("<IQ", said, 1)
                self.heard.setdefault(self.channels[number]["topic"], []).append((stamp, said[13:]))
            return
        told = json.loads(said)
        if told["op"] == "serverInfo":
            self.info = told
            link.send(json.dumps({"op": "getParameters", "parameterNames": [], "id": "1"}))
        elif told["op"] == "parameterValues":
            self.parameters = {p["name"]: p["value"] for p in told["parameters"]}
        elif told["op"] == "advertise":
            for channel in told["channels"]:
                number = 100 + channel["id"]
                self.channels[number] = channel
                wanted = {"id": number, "channelId": channel["id"]}
                link.send(json.dumps({"op": "subscribe", "subscriptions": [wanted]}))


def test_foxglove_sees_poses_forces_readings_and_parameters(tmp_path: Path) -> None:
    """What a client hears is what the log of the run says."""
    listener = Listener(free_port())
    listener.start()
    words = ["robot=auv", "water=fossen", "guide=hover", "initial.position=[0,0,-2]"]
    live = ["live=foxglove", f"live.port={listener.port}", "time.duration=1"]
    assert main(["run", *words, *live, f"hydra.run.dir={tmp_path / 'run'}"]) == 0
    listener.join(timeout=10)
    assert listener.protocol in ("foxglove.sdk.v1", "foxglove.websocket.v1")
    assert "parameters" in listener.info["capabilities"]
    topics = {c["topic"]: c for c in listener.channels.values()}
    assert {"/tf", "/scene", "/state", "/sensors/imu"} <= {*topics}
    assert topics["/tf"]["schemaName"] == "foxglove.FrameTransforms"
    assert topics["/scene"]["schemaName"] == "foxglove.SceneUpdate"
    log = read_native(tmp_path / "run")
    stamp, raw = listener.heard["/state"][-1]
    state = json.loads(raw)
    row = round(stamp * 1e-9 / 0.004)
    assert state["position"]["z"] == pytest.approx(log.columns["position_z"][row], abs=1e-9)
    stamp, raw = listener.heard["/sensors/imu"][-1]
    imu = json.loads(raw)
    assert imu["specific_force"]["z"] == pytest.approx(9.81, abs=0.5)
    # frames and forces are Protobuf: names stand in them as text
    assert b"world" in listener.heard["/tf"][-1][1]
    scene = b"".join(raw for _, raw in listener.heard["/scene"])
    assert b"force/" in scene
    assert b"buoyancy" in scene
    assert listener.parameters["effects.water_drag.coefficient_z"] == 37.0


@pytest.mark.parametrize("word", ["live.host=203.0.113.1", "live.prt=1"])
def test_an_address_that_cannot_be_had_is_refused(
    word: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In two lines."""
    words = ["robot=ball", "live=foxglove", "live.port=0", word, f"hydra.run.dir={tmp_path / 'x'}"]
    words = [w for w in words if not (w == "live.port=0" and word.startswith("live.port"))]
    assert main(["run", *words]) == 2
    err = capsys.readouterr().err
    assert word.partition("=")[0] in err
    assert len(err.strip().splitlines()) == 2
