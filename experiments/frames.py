"""Pictures of a run at chosen instants, drawn from its log by the engine's software renderer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.environment.ground import solids_of
from seals.environment.settings import EnvironmentSettings
from seals.errors import MissingExtra
from seals.logs import Log
from seals.robot.build import build_robot
from seals.run.settings import RunSettings

WATER = np.array([40.0, 110.0, 160.0])
"""Colour that water adds over distance."""
SKY = np.array([150.0, 195.0, 235.0])
"""Colour of the sky above; it fades to white."""
CLARITY = 2.5
"""Distance in which water takes two thirds of the sight [m]."""
_SAND, _STONE = (0.87, 0.8, 0.62, 1.0), (0.6, 0.6, 0.6, 1.0)


@dataclass(frozen=True, kw_only=True)
class View:
    """Where a picture is taken from.

    Args:
        distance: from what is looked at [m].
        yaw: heading of the camera's place [deg].
        pitch: downwards is negative [deg].
        size: width and height in pixels.
    """

    distance: float = 1.15
    yaw: float = 40.0
    pitch: float = -12.0
    size: tuple[int, int] = (480, 360)


def draw_frames(
    log: Log, settings: RunSettings, times: Sequence[float], view: View | None = None
) -> list[Any]:
    """Return one picture an instant, arrays of shape (height, width, 3) in 0 to 255.

    Args:
        log: of the run.
        settings: of the run.
        times: instants [s].
        view: camera; it looks at the middle between the robot and its nearest object.

    Raises:
        MissingExtra: the engine is not installed.
    """
    try:
        import pybullet as p
    except ImportError as cause:
        raise MissingExtra("frames need pybullet.\nInstall it: pip install pybullet") from cause
    client = p.connect(p.DIRECT)
    try:
        stage = _Stage(p, client, settings)
        return [stage.picture(log, float(time), view or View()) for time in times]
    finally:
        p.disconnect(client)


def write_sheet(path: Path, pictures: Mapping[str, Any], *, columns: int = 4) -> Path:
    """Write pictures with their titles as one PNG sheet."""
    from matplotlib.figure import Figure

    rows = -(-len(pictures) // columns)
    figure = Figure(figsize=(3.2 * columns, 2.6 * rows), dpi=110, layout="constrained")
    for number, (title, picture) in enumerate(pictures.items(), start=1):
        axes = figure.add_subplot(rows, columns, number)
        axes.imshow(picture)
        axes.set_title(title, fontsize=9)
        axes.set_axis_off()
    figure.savefig(path)
    return path


class _Stage:
    """Robot, objects and ground, for drawing only."""

    def __init__(self, p: Any, client: int, settings: RunSettings) -> None:
        from seals.config.source import find_robot

        self._p, self._client, self._settings = p, client, settings
        self.water = settings.environment.water_level
        _ground(p, client, settings.environment)
        load = {"useFixedBase": True, "physicsClientId": client}
        self._robot = p.loadURDF(str(settings.robot.urdf_path), **load)
        self._joints = build_robot(settings.robot).joints
        self._things = {
            name: p.loadURDF(str(find_robot(thing.robot).settings.urdf_path), **load)
            for name, thing in settings.objects.items()
        }

    def picture(self, log: Log, time: float, view: View) -> Any:
        """One picture at one instant."""
        row = int(np.searchsorted(log.time, time).clip(0, log.rows - 1))
        here = self._place(self._robot, log, row, "")
        joints = log.channel("joint_position")[row] if self._joints else []
        self._bend(self._robot, dict(zip(self._joints, joints, strict=True)))
        places = [
            self._place(body, log, row, f"object_{name}_") for name, body in self._things.items()
        ]
        near = min(places, key=lambda q: float(np.linalg.norm(q - here)), default=here)
        far = float(np.linalg.norm(near - here)) > 1.2
        return self._shot(here if far else 0.5 * (here + near), view)

    def _place(self, body: int, log: Log, row: int, prefix: str) -> Floats:
        p, client = self._p, self._client
        place = np.array([log.columns[f"{prefix}position_{a}"][row] for a in "xyz"])
        turn = [float(log.columns[f"{prefix}orientation_{a}"][row]) for a in "xyzw"]
        # the engine places the centre of mass in principal axes
        info = p.getDynamicsInfo(body, -1, physicsClientId=client)
        at, q = p.multiplyTransforms(place.tolist(), turn, info[3], info[4])
        p.resetBasePositionAndOrientation(body, at, q, physicsClientId=client)
        return place

    def _bend(self, body: int, joints: Mapping[str, float]) -> None:
        p, client = self._p, self._client
        for k in range(p.getNumJoints(body, physicsClientId=client)):
            name = p.getJointInfo(body, k, physicsClientId=client)[1].decode()
            if name in joints:
                p.resetJointState(body, k, float(joints[name]), physicsClientId=client)

    def _shot(self, target: Floats, view: View) -> Any:
        p, (width, height) = self._p, view.size
        look = p.computeViewMatrixFromYawPitchRoll(
            target.tolist(), view.distance, view.yaw, view.pitch, 0.0, 2
        )
        lens = p.computeProjectionMatrixFOV(50.0, width / height, 0.02, 60.0)
        _, _, colours, depth, _ = p.getCameraImage(
            width,
            height,
            look,
            lens,
            lightDirection=[1.0, -0.6, 2.0],
            shadow=0,
            renderer=p.ER_TINY_RENDERER,
            physicsClientId=self._client,
        )
        image = np.reshape(colours, (height, width, 4))[:, :, :3].astype(float)
        nothing = np.reshape(depth, (height, width)) >= 1.0
        fade = np.linspace(0.0, 1.0, height)[:, None, None]
        image = np.where(nothing[..., None], SKY + fade * (255.0 - SKY), image)
        if self.water is not None:
            points, eye = _points(np.reshape(depth, (height, width)), look, lens)
            image = _under_water(image, points, eye, self.water)
        return image.clip(0, 255).astype(np.uint8)


def _ground(p: Any, client: int, environment: EnvironmentSettings) -> None:
    """Planes as wide slabs, the rest as it is."""
    for solid in solids_of(environment):
        if solid.kind == "plane":
            size: tuple[float, ...] = (40.0, 40.0, 0.1)
            lower = np.array([0.0, 0.0, 0.05])
        else:
            size, lower = solid.size, np.zeros(3)
        if solid.kind in ("plane", "box"):
            shape = {"shapeType": p.GEOM_BOX, "halfExtents": [0.5 * edge for edge in size]}
        elif solid.kind == "sphere":
            shape = {"shapeType": p.GEOM_SPHERE, "radius": size[0]}
        else:
            shape = {"shapeType": p.GEOM_CYLINDER, "radius": size[0], "length": size[1]}
        sand = solid.name in ("tank_bottom", "ground_level", "slope", "land")
        look = p.createVisualShape(
            **shape, rgbaColor=_SAND if sand else _STONE, physicsClientId=client
        )
        p.createMultiBody(
            0.0,
            -1,
            look,
            (solid.position - lower).tolist(),
            solid.quaternion.tolist(),
            physicsClientId=client,
        )


def _points(depth: Floats, look: Any, lens: Any) -> tuple[Floats, Floats]:
    """World points of all pixels (height, width, 3), and the camera's place (3,)."""
    height, width = depth.shape
    u = (np.arange(width) + 0.5) / width * 2.0 - 1.0
    v = 1.0 - (np.arange(height) + 0.5) / height * 2.0
    x, y = np.meshgrid(u, v)
    clip = np.stack((x, y, 2.0 * depth - 1.0, np.ones_like(x)), axis=-1)
    view = np.reshape(look, (4, 4)).T
    whole = np.linalg.inv(np.reshape(lens, (4, 4)).T @ view)
    found = clip @ whole.T
    return found[..., :3] / found[..., 3:], np.linalg.inv(view)[:3, 3]


def _under_water(image: Floats, points: Floats, eye: Floats, level: float) -> Floats:
    """Mix in the colour of water by the way that the sight goes through it."""
    way = np.linalg.norm(points - eye, axis=-1)
    low, high = np.minimum(points[..., 2], eye[2]), np.maximum(points[..., 2], eye[2])
    share = np.clip((level - low) / np.maximum(high - low, 1e-9), 0.0, 1.0)
    through = np.minimum(way * share, 60.0)
    kept = np.exp(-through / CLARITY)[..., None] * np.where(through > 0.0, 0.88, 1.0)[..., None]
    mixed: Floats = image * kept + WATER * (1.0 - kept)
    return mixed


def stage_times(log: Log) -> dict[str, float]:
    """Return an instant near the end of every stage of a log, by number and name."""
    stages = log.meta.get("guide", {}).get("stages", [])
    ends = [row["time"] for row in stages[1:]] + [float(log.time[-1])]
    return {
        f"{k + 1} {row['name']}": max(row["time"], end - 0.1)
        for k, (row, end) in enumerate(zip(stages, ends, strict=True))
    }
