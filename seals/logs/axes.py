"""Conversion of the axes of foreign logs to ENU and to body axes forward, left, up."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError, refuse_unlisted
from seals.field_roles import roles
from seals.frames import matrix_of, multiply, quaternion_of, unrotate
from seals.logs.channels import CHANNELS
from seals.logs.log import Log

WORLDS = {
    "enu": ("x", "y", "z"),
    "ned": ("y", "x", "-z"),
    "nwu": ("-y", "x", "z"),
    "neu": ("y", "x", "z"),
}
"""World axes by name -> where east, north and up are found among the log's own axes."""
BODIES = {
    "flu": ("x", "y", "z"),
    "frd": ("x", "-y", "-z"),
    "rfu": ("y", "-x", "z"),
}
"""Body axes by name -> where forward, left and up are found among the log's own axes."""
_INERTIAL = ("angular_velocity", "specific_force")
ORDERS = ("wxyz", "xyzw")
_AXIS = re.compile(r"^(-?)([xyz])$")
_EULER = re.compile(r"^(?:[xyz]{3}|[XYZ]{3})$")
_ANGLES = {"x": "roll", "y": "pitch", "z": "yaw"}


@roles(data="world body imu position quaternion inverse euler velocity")
@dataclass(kw_only=True)
class AxesSettings:
    """Axes of a foreign log; each field corrects one deviation from ENU and FLU.

    Args:
        world: axes of positions, attitude and world velocities: ``enu``, ``ned``, ``nwu``, or
            ``neu`` (left-handed: positions only).
        body: axes of gyroscope, accelerometer, body velocities and attitude: ``flu``, ``frd``,
            ``rfu``.
        imu: axes of gyroscope and accelerometer if they differ from ``body``; else empty.
        position: columns of the position that contain x, y, z of the world, such as
            ``[y,x,-z]``; empty for those of ``world``.
        heading: rotation of the position axes about the vertical relative to the attitude axes
            [rad]; the position is turned back by it.
        quaternion: order of the components in the columns w, x, y, z: ``wxyz`` or ``xyzw``.
        inverse: whether the quaternion rotates world vectors into body axes.
        euler: order of the rotations ``roll``, ``pitch``, ``yaw``, as in SciPy: ``ZYX``
            for yaw, pitch, roll about the body's own axes; small letters for fixed axes.
        velocity: axes of the velocity, ``body`` or ``world``.
    """

    world: str = "enu"
    body: str = "flu"
    imu: str = ""
    position: list[str] = field(default_factory=list)
    heading: float = 0.0
    quaternion: str = "wxyz"
    inverse: bool = False
    euler: str = ""
    velocity: str = "body"


def permutation(axes: Sequence[str], *, where: str) -> Floats:
    """Return the matrix of signed axes, shape (3, 3).

    Raises:
        LogError: an axis is unknown or named twice.

    Example:
        >>> permutation(["y", "x", "-z"], where="axes.position").tolist()
        [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]
    """
    found = np.zeros((3, 3))
    matches = [_AXIS.match(str(axis)) for axis in axes]
    for row, match in enumerate(matches[:3]):
        if match is not None:
            found[row, "xyz".index(match[2])] = -1.0 if match[1] else 1.0
    if len(matches) != 3 or abs(abs(np.linalg.det(found)) - 1.0) > 1e-9:
        raise LogError(
            f"{where}={list(axes)} is not allowed.\nAllowed: x, y and z once each, with or without "
            "a minus, such as [y,x,-z]"
        )
    return found


def with_axes(log: Log, axes: AxesSettings) -> tuple[Log, list[str]]:
    """Return a log in ENU and FLU, and a description of the conversions.

    Raises:
        LogError: a name is unknown, or a needed channel is not in the log.
    """
    world = permutation(_named(axes.world, WORLDS, "axes.world"), where="axes.world")
    body = permutation(_named(axes.body, BODIES, "axes.body"), where="axes.body")
    said: list[str] = []
    log = _attitude(log, axes, said)
    imu = permutation(_named(axes.imu or axes.body, BODIES, "axes.imu"), where="axes.imu")
    vectors = [c.stem for c in CHANNELS.values() if c.body and c.stem not in _INERTIAL]
    log = _turned(_turned(log, vectors, body), _INERTIAL, imu)
    for name, what in ((axes.body, "body"), (axes.imu, "sensor")):
        if name not in ("", "flu"):
            said.append(f"{what} axes {name} became forward, left, up")
    if axes.world != "enu":
        log = _turned(log, ["gps_position", "gps_velocity", "aim_velocity"], world)
        said.append(f"world axes {axes.world} became east, north, up")
    place = permutation(axes.position, where="axes.position") if axes.position else world
    c, s = np.cos(-axes.heading), np.sin(-axes.heading)
    log = _turned(log, ["position"], np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ place)
    if axes.position:
        said.append(f"position x, y, z are its columns {', '.join(axes.position)}")
    if axes.heading:
        said.append(f"the position was rotated by {-axes.heading:.4g} rad about the vertical")
    if "orientation_w" in log.columns:
        log = _turned_attitude(log, world, body)
    if _one_of(axes.velocity, ("body", "world"), "axes.velocity") == "world":
        # what stands in world columns was turned with the body axes above: undone here
        log = _turned(log, ["velocity"], world @ body.T)
        log = _into_body(log)
        said.append("velocity was rotated from world to body axes")
    return log, said


def _named(name: str, known: dict[str, tuple[str, str, str]], where: str) -> tuple[str, ...]:
    return known[_one_of(name, tuple(known), where)]


def _one_of(name: str, known: Sequence[str], where: str) -> str:
    refuse_unlisted(name, known, f"{where}={name} is not allowed", error=LogError)
    return name


def _turned(log: Log, stems: Sequence[str], turn: Floats) -> Log:
    """Return a log with vector channels mapped by a matrix; missing components count as NaN."""
    if np.array_equal(turn, np.eye(3)):
        return log
    columns: dict[str, Floats] = {}
    for stem in stems:
        if log.has(stem):
            values = log.channel(stem)
            # a zero of the matrix must not spread the NaN of another column
            parts = [
                sum(turn[i, k] * values[:, k] for k in range(3) if turn[i, k] != 0.0)
                for i in range(3)
            ]
            named = {f"{stem}_{axis}": part for axis, part in zip("xyz", parts, strict=True)}
            # a component that was not measured gets no column
            columns |= {
                name: part
                for name, part in named.items()
                if name in log.columns or np.isfinite(part).any()
            }
    return log.with_columns(columns)


def _attitude(log: Log, axes: AxesSettings, said: list[str]) -> Log:
    """Return a log whose quaternion is converted to w, x, y, z from body to world."""
    _one_of(axes.quaternion, ORDERS, "axes.quaternion")
    if axes.euler:
        log = _from_euler(log, axes.euler)
        said.append(f"attitude from {axes.euler} angles of roll, pitch, yaw")
    if "orientation_w" not in log.columns:
        return log
    if axes.quaternion == "xyzw":
        q = [log.columns[f"orientation_{x}"] for x in "wxyz"]
        log = log.with_columns({f"orientation_{x}": q[k] for k, x in enumerate("xyzw")})
        said.append("quaternion order x, y, z, w became w, x, y, z")
    if axes.inverse:
        log = log.with_columns(
            {f"orientation_{x}": -log.columns[f"orientation_{x}"] for x in "xyz"}
        )
        said.append("the quaternion was inverted")
    return log


def _from_euler(log: Log, order: str) -> Log:
    from scipy.spatial.transform import Rotation

    if not _EULER.match(order):
        raise LogError(f"axes.euler={order} is not allowed.\nAllowed: such as ZYX, XYZ, zyx, xyz")
    names = [_ANGLES[letter] for letter in order.lower()]
    missing = [name for name in set(names) if name not in log.columns]
    if missing:
        raise LogError(
            f"axes.euler={order} needs the column {missing[0]}.\n"
            f"Map it: columns: {{...: {missing[0]}}}"
        )
    angles = np.stack([log.columns[name] for name in names], axis=1)
    good = np.isfinite(angles).all(axis=1)
    q = np.full((log.rows, 4), np.nan)
    q[good] = Rotation.from_euler(order, angles[good]).as_quat()
    columns = {key: value for key, value in log.columns.items() if key not in _ANGLES.values()}
    columns |= {f"orientation_{axis}": q[:, k] for k, axis in enumerate("xyzw")}
    return replace(log, columns=columns)


def _turned_attitude(log: Log, world: Floats, body: Floats) -> Log:
    """Return a log whose attitude is P R B^T for axes maps P of the world and B of the body."""
    if np.linalg.det(world) < 0.0:
        # a left-handed world cannot hold a rotation: its attitude is taken as it stands
        world = np.eye(3)
    if np.array_equal(world, np.eye(3)) and np.array_equal(body, np.eye(3)):
        return log
    q = np.stack([log.columns[f"orientation_{axis}"] for axis in "xyzw"], axis=1)
    q = multiply(np.broadcast_to(quaternion_of(world), q.shape), q)
    q = multiply(q, np.broadcast_to(quaternion_of(body.T), q.shape))
    return log.with_columns({f"orientation_{axis}": q[:, k] for k, axis in enumerate("xyzw")})


def _into_body(log: Log) -> Log:
    if not (log.has("velocity") and "orientation_w" in log.columns):
        raise LogError("axes.velocity=world needs velocity and orientation in the log.")
    q = np.stack([log.columns[f"orientation_{axis}"] for axis in "xyzw"], axis=1)
    velocity = log.channel("velocity")
    held = np.isfinite(q).all(axis=1)
    if not np.any(held & np.isfinite(velocity).all(axis=1)):
        raise LogError(
            "axes.velocity=world needs velocity and orientation in the same rows.\n"
            "Give rate=HZ, so that all channels share rows."
        )
    turned = np.full(velocity.shape, np.nan)
    turned[held] = unrotate(matrix_of(q[held]), velocity[held])
    return log.with_columns({f"velocity_{axis}": turned[:, k] for k, axis in enumerate("xyz")})
