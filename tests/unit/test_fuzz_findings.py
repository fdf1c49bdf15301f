"""What benchmarks/fuzz.py found, each as the smallest file that showed it."""

from __future__ import annotations

import json
import lzma
import re
import sqlite3
import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from seals.cli.train import _begun
from seals.control.key_events import read_track
from seals.coupling.body import locked_kick
from seals.errors import ConfigError, LogError, PhysicsError, RobotError
from seals.hydrostatics.meshes import MOST_WORK, hull_from_mesh
from seals.learn.comparison.runs import read_run
from seals.learn.training.loop import Rows
from seals.logs.arrays import read_npy
from seals.logs.check import refuse_if_bad
from seals.logs.native import read_native
from seals.logs.shipped import shipped_logs
from seals.plugins.readers.recording import ReaderMcap, ReaderRosbag2
from seals.scaffold.plug_ins import stated_of
from seals.scaffold.robot import scaffold_robot
from seals.sysid.data.join import join_logs
from seals.sysid.validation.answer import read_answer


@pytest.mark.parametrize(
    "header",
    [b"{'descr': '<f8', 'shape': FaFaF", b"{'descr': '''<f8'}\n", b"{'a\0': (\n\n", b"[" * 9000],
)
def test_a_damaged_array_header(header: bytes, tmp_path: Path) -> None:
    """The header is a Python literal; its tokeniser has errors of its own."""
    file = tmp_path / "a.npy"
    file.write_bytes(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + bytes(96))
    with pytest.raises(LogError, match="not a valid NumPy"):
        read_npy(file)


def test_a_cell_of_a_script_longer_than_a_table_allows(tmp_path: Path) -> None:
    """An open quote swallows the rest of the file, up to the limit of the reader of tables."""
    file = tmp_path / "keys.csv"
    file.write_text('t,control,value\n0.5,"' + "w" * 140_000 + "\n")
    with pytest.raises(ConfigError, match="is not a table"):
        read_track(file)


def _record(kind: int, body: bytes, length: int | None = None) -> bytes:
    return bytes([kind]) + struct.pack("<Q", len(body) if length is None else length) + body


def _chunk(size: int) -> bytes:
    return _record(6, struct.pack("<QQQII", 0, 0, 16, 0, 0) + struct.pack("<Q", size) + bytes(16))


@pytest.mark.parametrize(
    "record",
    [
        _chunk(1 << 32),
        _chunk(1 << 63),
        _record(5, b"", 1 << 25),
        _record(4, struct.pack("<HHI", 1, 1, 0xFFFFFFF0) + b"/a"),
        _record(0x7A, b"", 1 << 63),
        _record(6, struct.pack("<QQQII", 0, 0, 9, 0, 0) + struct.pack("<QBQ", 9, 5, 1 << 63)),
    ],
)  # fmt: skip
def test_a_length_that_the_file_does_not_have(record: bytes, tmp_path: Path) -> None:
    """No room is made for what a record of MCAP only claims to hold."""
    pytest.importorskip("mcap", reason="mcap is not installed")
    import resource

    file = tmp_path / "a.mcap"
    file.write_bytes(b"\x89MCAP0\r\n" + _record(1, bytes(8)) + record)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(LogError, match="not a valid MCAP"):
        ReaderMcap().read(file)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000


def _renamed(path: Path) -> None:
    raw = path.read_bytes()
    path.write_bytes(raw.replace(b"serialization_format", b"serialization_\xb7\xff\xfemat", 1))


def _nulled(path: Path) -> None:
    raw = path.read_bytes()
    path.write_bytes(raw.replace(b"CREATE TABLE topics", b"CREATE TABLE top\xb7cs", 1))


@pytest.mark.parametrize("spoil", [_renamed, _nulled])
def test_names_in_a_database_that_are_no_text(
    spoil: Callable[[Path], None], tmp_path: Path
) -> None:
    """SQLite hands out names of columns as they are; they may be no UTF-8."""
    file = tmp_path / "a.db3"
    base = sqlite3.connect(file)
    base.execute("CREATE TABLE topics(id, name, type, serialization_format)")
    base.execute("CREATE TABLE messages(id, topic_id, timestamp, data)")
    base.commit()
    base.close()
    spoil(file)
    with pytest.raises(LogError):
        ReaderRosbag2().read(file)


FOUND = sorted((Path(__file__).parent / "found").glob("*.bin*"))
"""Files that once ended in something else than a refusal, named by target and number.

Long repetitive ones are kept compressed, as ``.bin.xz``.
"""


@pytest.mark.parametrize("file", FOUND, ids=[file.name.partition(".")[0] for file in FOUND])
def test_what_fuzzing_found_ends_in_words(file: Path, tmp_path: Path) -> None:
    """Each file of the corpus is loaded or refused, within the bounds of the fuzzing."""
    from benchmarks.fuzz import TARGETS, one

    try:
        target = TARGETS[file.name.rpartition("_")[0]]()
    except ImportError as absent:
        pytest.skip(f"{absent.name} is not installed")
    raw = file.read_bytes()
    content = lzma.decompress(raw) if file.suffix == ".xz" else raw
    wrong = one(target, content, tmp_path)
    if wrong is not None and wrong.endswith(" s"):
        # the first of a process also pays for the engine's import, on a busy machine several times
        wrong = one(target, content, tmp_path)
    assert wrong is None


def test_a_cell_of_a_curve_longer_than_a_table_allows(tmp_path: Path) -> None:
    """The tables of trainings, read for a comparison and when one is taken up again."""
    (tmp_path / "evaluation.csv").write_text('step,loss\n1,"' + "w" * 140_000 + "\n")
    with pytest.raises(LogError, match="is not a table"):
        read_run(tmp_path, arm="a")
    with pytest.raises(ConfigError, match="is damaged"):
        Rows(tmp_path / "evaluation.csv", ["step", "loss"], keep=1)
    (tmp_path / "evaluation.csv").write_text("step,loss\nfive,1\n")
    with pytest.raises(ConfigError, match="is damaged"):
        Rows(tmp_path / "evaluation.csv", ["step", "loss"], keep=1)


def test_the_overrides_of_a_training_are_a_list(tmp_path: Path) -> None:
    """A number in place of the list is refused in words."""
    (tmp_path / ".hydra").mkdir()
    (tmp_path / ".hydra" / "overrides.yaml").write_text("5")
    with pytest.raises(ConfigError, match=r"overrides\.yaml: 5 .*\nAllowed: a list of texts"):
        _begun(tmp_path)


@pytest.mark.thorough
def test_a_thin_broken_mesh_of_many_triangles_is_given_up(tmp_path: Path) -> None:
    """Points are drawn as long as the work is bearable, not until enough of them lie inside."""
    rng = np.random.default_rng(2)
    corners = rng.uniform(-1.0, 1.0, (5_000, 1, 3)) + rng.uniform(-0.01, 0.01, (5_000, 3, 3))
    lines = [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in corners.reshape(-1, 3)]
    lines += [f"f {k} {k + 1} {k + 2}" for k in range(1, 15_000, 3)]
    (tmp_path / "a.obj").write_text("\n".join(lines) + "\n")
    with pytest.raises(RobotError, match=r"of (\d+) points lie inside the hull") as refusal:
        hull_from_mesh(tmp_path / "a.obj")
    drawn = int(re.search(r"of (\d+) points", str(refusal.value))[1])  # type: ignore[index]
    assert drawn * 5_000 <= 2 * MOST_WORK


@pytest.mark.parametrize(
    "part",
    [
        {"effects": [{"nnname": "payload"}]},
        {"effects": ["payload"]},
        {"reasons": 3},
        {"log": [1]},
        {"formula": "T = 3"},
        {"effects": [{"name": "payload", "link": [1]}]},
    ],
)
def test_an_answer_with_parts_of_another_kind(part: dict[str, object], tmp_path: Path) -> None:
    """A key that is misspelt or of another type is damage, not an error of Python's."""
    sound = {"verdict": "named", "effects": [{"name": "payload", "parameters": {}}]}
    (tmp_path / "diagnosis.json").write_text(json.dumps({**sound, **part}))
    with pytest.raises(ConfigError, match="is damaged"):
        read_answer(tmp_path)


@pytest.mark.parametrize("link", [2, "gripper", None])
def test_an_answer_tells_a_link_by_its_number_or_name(
    link: int | str | None, tmp_path: Path
) -> None:
    """Links of a robot's folder have names, those of a log numbers."""
    effect = {"name": "payload", "parameters": {}, "link": link}
    (tmp_path / "diagnosis.json").write_text(json.dumps({"verdict": "named", "effects": [effect]}))
    assert read_answer(tmp_path).effects[0].link == link


def test_a_motor_that_states_no_thrust(tmp_path: Path) -> None:
    """Its moment is stated as a share of the thrust: without one it states nothing."""
    inertia = "<inertia><ixx>.1</ixx><iyy>.1</iyy><izz>.1</izz></inertia>"
    inertial = f"<inertial><mass>1</mass>{inertia}</inertial>"
    links = "".join(f"<link name='{name}'>{inertial}</link>" for name in ("body", "rotor_0"))
    joint = "<joint name='j' type='revolute'><parent>body</parent><child>rotor_0</child>"
    motor = "<plugin filename='a.so' name='p'><jointName>j</jointName><linkName>rotor_0</linkName>"
    motor += "<motorConstant>0</motorConstant><momentConstant>0.01</momentConstant></plugin>"
    axis = "<axis><xyz>0 0 1</xyz></axis></joint>"
    text = f"<sdf version='1.9'><model name='m'>{links}{joint}{axis}{motor}</model></sdf>"
    (found,) = stated_of(ElementTree.fromstring(text)).motors
    assert found.values == {}
    (tmp_path / "a.sdf").write_text(text)
    scaffold_robot("made", tmp_path / "a.sdf", parent=tmp_path)


def test_a_robot_without_inertia_at_a_joint_stop() -> None:
    """The stop changes no momentum; about an axis without inertia that says nothing."""
    inertia = np.diag([1.0, 1.0, 1.0, 0.0, 1.0, 1.0])
    with pytest.raises(PhysicsError, match="no inertia about an axis"):
        locked_kick(inertia, np.ones(6))
    inertia[3, 3] = 0.5
    assert np.allclose(locked_kick(inertia, np.ones(6)), 1.0)


@pytest.mark.parametrize("channels", [1 << 70, [None], {"position": 3}, "a"])
def test_channels_of_another_kind(channels: object) -> None:
    """Logs are joined before anything else looks at what their sensors state."""
    log = read_native(shipped_logs()["hidden_effect/flight_a"])
    log = replace(log, meta={**log.meta, "sensors": {"channels": channels}})
    with pytest.raises(LogError, match=r"sensors\.channels: meta.yaml says"):
        refuse_if_bad(log)


def test_logs_with_a_channel_that_states_no_noise_are_joined() -> None:
    """Its noise is that of the vehicle, as in a single log."""
    log = read_native(shipped_logs()["hidden_effect/flight_a"])
    channels = {**log.meta["sensors"]["channels"], "counter": {"rate": 10}}
    log = replace(log, meta={**log.meta, "sensors": {"channels": channels}})
    refuse_if_bad(log)
    assert "counter" not in join_logs([log, log]).meta["logs"][1]["sigma"]


def test_rotors_that_are_no_list() -> None:
    """The check of the thrust leaves the complaint to that of the description."""
    log = read_native(shipped_logs()["hidden_effect/flight_a"])
    meta = {**log.meta, "vehicle": {**log.meta["vehicle"], "rotors": True}}
    with pytest.raises(LogError, match="rotors"):
        refuse_if_bad(replace(log, meta=meta))


def test_a_twin_that_diverges_leaves_the_others_alone() -> None:
    """A fit with a robot that is not the log's comes to states whose inertia has no inverse."""
    from seals.batch.tree import solved

    matrix = np.stack([2.0 * np.eye(3), np.zeros((3, 3)), np.full((3, 3), np.nan)])
    found = solved(matrix, np.ones((3, 3)))
    assert found[0].tolist() == [0.5, 0.5, 0.5]
    assert np.isnan(found[1:]).all()
