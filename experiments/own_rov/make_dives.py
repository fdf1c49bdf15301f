"""Writes ``dive_1.bin.gz`` and ``dive_2.bin.gz``: dives of the ROV as ArduSub logs them.

The vehicle is the robot ``rov``, simulated by SEALS, with a fault that its files do not state; the
DataFlash file is written after the public description of the format
(https://ardupilot.org/dev/docs/code-overview-adding-a-new-log-message.html).
"""

from __future__ import annotations

import gzip
import struct
import sys
from pathlib import Path

import numpy as np

from seals.arrays import Floats
from seals.frames import matrix_of
from seals.run.build import run_settings
from seals.run.simulation import simulate
from seals.untrusted_io import read_yaml

ROV = Path(__file__).parents[2] / "robots" / "rov"
STEP, ROWS, SECONDS = 0.0025, 4, 24.0
"""Step [s], steps from row to row, and length of a dive [s]."""
REVERSED = (3, 4, 5, 8)
"""Thrusters whose parameter MOT_n_DIRECTION is -1."""
NOISE = {"place": 0.01, "turn": 0.003, "depth": 0.005}
"""1-sigma of the filter's position [m], of its attitude [rad] and of the depth [m]."""
DIVES = {
    1: "[[1.5,0.5,-3.5],[0.3,-1.0,-2.5],[0,0,-3]]",
    2: "[[0.5,1.2,-2.5],[-1.2,0.4,-3.5],[0,0,-3]]",
}
_CODES = {"c": "h", "C": "H", "n": "4s", "N": "16s", "Z": "64s"}
FORMATS = {
    "FMT": (128, "BBnNZ", "Type,Length,Name,Format,Columns"),
    "PARM": (64, "QNf", "TimeUS,Name,Value"),
    "MSG": (65, "QZ", "TimeUS,Message"),
    "IMU": (66, "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ"),
    "ATT": (67, "Qffffff", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw"),
    "XKF1": (68, "QBffffff", "TimeUS,C,VN,VE,VD,PN,PE,PD"),
    "RCOU": (71, "QHHHHHHHH", "TimeUS,C1,C2,C3,C4,C5,C6,C7,C8"),
    "CTUN": (74, "Qff", "TimeUS,Alt,BAlt"),
}


def packed(name: str, *values: object) -> bytes:
    """Return one message."""
    kind, letters, _ = FORMATS[name]
    layout = "<" + "".join(_CODES.get(letter, letter) for letter in letters)
    return b"\xa3\x95" + bytes([kind]) + struct.pack(layout, *values)


def pulses(force: Floats) -> Floats:
    """Return the pulse widths of commanded forces [us], by the table in the robot's data sheet."""
    points = np.array(read_yaml(ROV / "datasheet.yaml")["motors"]["points"], dtype=float)
    kept = np.concatenate(([True], np.diff(points[:, 1]) > 0.0))
    share = np.interp(force, points[kept, 1], points[kept, 0])
    way = np.where(np.isin(np.arange(8) + 1, REVERSED), -1.0, 1.0)
    widths: Floats = np.round(1500.0 + 400.0 * way * share)
    return widths


def dive(number: int, *fault: str) -> bytes:
    """Return a dive of the faulty vehicle as a DataFlash log.

    Args:
        number: of the dive, 1 or 2.
        fault: overrides of the run.
    """
    rates = ("controller.rate=100", "guide.rate=100")
    run = run_settings([
        "robot=rov", "water=fossen", "guide=waypoints", f"guide.places={DIVES[number]}",
        "guide.speed=0.7", "guide.rest=0.5", "guide.repeat=true", "initial.position=[0,0,-3]",
        f"time.step={STEP}", f"time.duration={SECONDS}", f"seed={number}", *rates, *fault,
    ])  # fmt: skip
    log = simulate(run).log
    draw = np.random.default_rng(number)
    columns = ("t", "position", "velocity", "orientation", "angular_velocity", "specific_force")
    at = slice(None, None, ROWS)
    t, place, speed, q, gyro, accel = (
        log.time[at] if name == "t" else log.channel(name)[at] for name in columns
    )
    turn = matrix_of(np.roll(q, -1, axis=1))
    sent = pulses(log.channel("thruster_cmd")[at]).astype(int)
    # FLU in ENU becomes FRD in NED
    ned = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    frd = np.diag([1.0, -1.0, -1.0])
    own = ned @ turn @ frd
    place, moved = (place + draw.normal(0.0, NOISE["place"], place.shape)) @ ned.T, np.einsum(
        "nij,nj->ni", ned @ turn, speed
    )  # fmt: skip
    roll = np.arctan2(own[:, 2, 1], own[:, 2, 2])
    pitch, yaw = -np.arcsin(own[:, 2, 0]), np.arctan2(own[:, 1, 0], own[:, 0, 0])
    angles = np.stack([roll, pitch, yaw], axis=1) + draw.normal(0.0, NOISE["turn"], (len(t), 3))
    angles = np.degrees(angles)
    angles[:, 2] %= 360.0
    gauge = log.channel("position")[at][:, 2] + draw.normal(0.0, NOISE["depth"], len(t))
    raw = b"".join(
        packed("FMT", kind, 3 + struct.calcsize("<" + "".join(_CODES.get(c, c) for c in letters)),
               name.encode(), letters.encode(), labels.encode())
        for name, (kind, letters, labels) in FORMATS.items()
    )  # fmt: skip
    raw += packed("MSG", 1, b"ArduSub V4.5.0")
    for k in range(8):
        way = -1.0 if k + 1 in REVERSED else 1.0
        raw += packed("PARM", 1, f"SERVO{k + 1}_FUNCTION".encode(), 33.0 + k)
        raw += packed("PARM", 1, f"MOT_{k + 1}_DIRECTION".encode(), way)
    parts = [raw]
    for k, time in enumerate(t):
        stamp = 5_000_000 + round(time * 1e6)
        parts.append(packed("IMU", stamp, 0, *(frd @ gyro[k]), *(frd @ accel[k])))
        parts.append(packed("RCOU", stamp, *sent[k]))
        if k % 5 == 0:
            rolled, pitched, headed = angles[k]
            parts.append(packed("ATT", stamp, 0.0, rolled, 0.0, pitched, 0.0, headed))
            parts.append(packed("XKF1", stamp, 0, *moved[k], *place[k]))
            parts.append(packed("CTUN", stamp, 0.0, gauge[k]))
    return b"".join(parts)


def main(folder: str, *fault: str) -> None:
    """Write both dives into a folder; ``fault`` holds overrides of the runs."""
    for number in DIVES:
        raw = gzip.compress(dive(number, *fault), mtime=0)
        (Path(folder) / f"dive_{number}.bin.gz").write_bytes(raw)


if __name__ == "__main__":
    main(*sys.argv[1:])
