"""Live output to Foxglove by its WebSocket protocol: poses, readings, shapes and forces."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.environment.ground import solids_of
from seals.errors import ConfigError, optional_import
from seals.field_roles import roles
from seals.frames import quaternion_of
from seals.plugins.live.gate import Gate, private_addresses
from seals.rendering.gather import build_scene
from seals.rendering.meshes import triangles
from seals.rendering.scene import WORLD, Detail
from seals.run.immersed import surroundings
from seals.run.live_output import Beat, Pace
from seals.run.settings import RunSettings
from seals.schema import check_tree, count, param, parameters_of
from seals.world import World
from seals.world.actor import Actor

FAINT = 1e-3
"""Force below which there is no arrow [N]."""
COLOURS = ((0.1, 0.5, 0.9), (0.9, 0.4, 0.1), (0.2, 0.7, 0.3), (0.8, 0.2, 0.6), (0.6, 0.6, 0.1))
"""Of the forces of effects, in their order."""


def solids(messages: Any, stamp: Any, settings: RunSettings, world: World) -> Iterator[Any]:
    """Yield an entity for each frame of the scene, with its shapes; planes are left out.

    Args:
        messages: module of Foxglove.
        stamp: time, as a message.
        settings: of the run.
        world: of the run.
    """
    robots = {name: actor.robot for name, actor in world.actors.items()}
    scene = build_scene(robots, solids_of(surroundings(settings)), detail=Detail.visual)
    by_frame: dict[str, list[Any]] = {}
    for shape in scene.shapes:
        if shape.kind != "plane":
            frame = "world" if shape.frame == WORLD else scene.frames[shape.frame]
            vertices, faces = triangles(shape)
            placed = vertices @ shape.rotation.T + shape.position
            red, green, blue = shape.colour
            by_frame.setdefault(frame, []).append(
                messages.TriangleListPrimitive(
                    pose=_pose(messages, np.zeros(3), np.eye(3)),
                    points=[messages.Point3(x=x, y=y, z=z) for x, y, z in placed.tolist()],
                    indices=[int(k) for k in np.reshape(faces, -1)],
                    color=messages.Color(r=red, g=green, b=blue, a=1.0),
                )
            )
    for frame, parts in by_frame.items():
        yield messages.SceneEntity(
            timestamp=stamp,
            frame_id=frame.removeprefix("robot/"),
            id=frame,
            frame_locked=True,
            triangles=parts,
        )


def _arrows(messages: Any, stamp: Any, space: str, actor: Actor, scale: float) -> Iterator[Any]:
    """Yield an entity for each effect that pushes, with an arrow at each link.

    Args:
        messages: module of Foxglove.
        stamp: time, as a message.
        space: prefix of the links' frames.
        actor: whose ledger is read: the forces of the last step.
        scale: length of an arrow [m/N].
    """
    ledger = actor.ledger
    if not ledger.rows:
        return
    for k, effect in enumerate(ledger.effects):
        forces = ledger.wrenches[-1, k, :, :3]
        for link, force in zip(ledger.links, forces, strict=True):
            size = math.sqrt(float(force @ force))
            # one that fades takes its arrow away
            length = scale * size if size > FAINT else 0.0
            red, green, blue = COLOURS[k % len(COLOURS)]
            arrow = messages.ArrowPrimitive(
                pose=_pose(messages, np.zeros(3), _along(force, size)),
                shaft_length=0.8 * length,
                shaft_diameter=0.06 * length,
                head_length=0.2 * length,
                head_diameter=0.12 * length,
                color=messages.Color(r=red, g=green, b=blue, a=1.0),
            )
            yield messages.SceneEntity(
                timestamp=stamp,
                frame_id=f"{space}{link}",
                id=f"force/{space}{link}/{effect}",
                frame_locked=True,
                arrows=[arrow] if length else [],
            )


def _along(force: Floats, size: float) -> Floats:
    """Rotation whose x axis is along a force, shape (3, 3)."""
    if size <= FAINT:
        return np.eye(3)
    x = force / size
    aside = np.eye(3)[int(np.argmin(np.abs(x)))]
    y = np.cross(x, aside)
    y = y / np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _pose(messages: Any, place: Floats, turn: Floats) -> Any:
    x, y, z, w = quaternion_of(turn).tolist()
    a, b, c = place.tolist()
    return messages.Pose(
        position=messages.Vector3(x=a, y=b, z=c),
        orientation=messages.Quaternion(x=x, y=y, z=z, w=w),
    )


ROBOT, _WORLD_FRAME = "robot", "world"
SHAPES = 1.0
"""How often all shapes are sent [Hz]."""


def _sdk() -> Any:
    """Return the package of Foxglove.

    Raises:
        MissingExtra: it is not installed.
    """
    with optional_import(
        "live=foxglove needs foxglove-sdk", "Install it: pip install 'aam-seals[foxglove]'"
    ):
        import foxglove
    return foxglove


@roles(address="host port origins")
@dataclass(kw_only=True)
class LiveFoxglove:
    """Serves a run to Foxglove: poses, shapes, forces, readings, plots, parameters.

    Args:
        rate: of poses, forces and plots [Hz]; readings come at the rates of their sensors.
        speed: simulated seconds per second of real time, at most; 0 for no limit.
        host: address to listen on; the default is open to this machine alone.
        port: to listen on, 0 for any that is free.
        origins: pages of the web that may listen; other programs may in any case.
        force_scale: length of an arrow for a force [m/N].
    """

    rate: float = param(30.0, "Hz", bounds=(0.1, 1e3), tolerance=0.0, source="chosen", fit=False)
    speed: float = param(1.0, "1", bounds=(0.0, 1e3), tolerance=0.0, source="chosen", fit=False)
    host: str = "127.0.0.1"
    port: int = count(8765, bounds=(0, 65_535))
    origins: list[str] = field(default_factory=lambda: ["https://app.foxglove.dev"])
    force_scale: float = param(
        0.02, "m/N", bounds=(0.0, 100.0), tolerance=0.0, source="chosen", fit=False
    )

    def __post_init__(self) -> None:
        """Refuse what the fields do not allow, as the reading of a configuration does."""
        check_tree(self, where="live")

    def open(self, settings: RunSettings, folder: Path) -> None:
        """Listen.

        Raises:
            MissingExtra: foxglove-sdk is not installed.
            ConfigError: the address cannot be had.
        """
        foxglove = _sdk()
        self._beat, self._pace, self._shapes = Beat(self.rate), Pace(self.speed), Beat(SHAPES)
        self._settings = settings
        self._context = foxglove.Context()
        # before anyone connects: the server may not know a channel yet that it has advertised
        topics = ("/state", *(f"/sensors/{name}" for name in settings.sensors))
        self._channels: dict[str, Any] = {
            **{
                topic: _sdk().Channel(topic, message_encoding="json", context=self._context)
                for topic in topics
            },
            "/tf": foxglove.channels.FrameTransformsChannel("/tf", context=self._context),
            "/scene": foxglove.channels.SceneUpdateChannel("/scene", context=self._context),
        }
        try:
            self._gate = Gate(self.host, self.port, self.origins)
        except OSError as error:
            raise ConfigError(
                f"live.host={self.host} live.port={self.port} cannot be opened: "
                f"{error.strerror or error}.\n"
                "End the other program there, or choose another: live.port=0"
            ) from error
        self._server = self._hidden(foxglove, settings)
        self._gate.open(self._inner, self._server.port)
        print(
            f"Foxglove: open a connection to ws://{self.host}:{self._gate.port}, "
            "or https://app.foxglove.dev/?ds=foxglove-websocket&ds.url="
            f"ws://{self.host}:{self._gate.port}",
            flush=True,
        )

    def _hidden(self, foxglove: Any, settings: RunSettings) -> Any:
        """Start the server of the SDK where only the gate finds it; it asks nobody who he is."""
        for self._inner in private_addresses():
            with contextlib.suppress(RuntimeError):
                return foxglove.start_server(
                    name=f"SEALS {settings.name}",
                    host=self._inner,
                    port=0,
                    context=self._context,
                    capabilities=[foxglove.Capability.Parameters, foxglove.Capability.Time],
                    server_listener=_listener(foxglove, settings),
                )
        self._gate.close()
        raise ConfigError("live=foxglove finds no address of this machine.\nAllowed: 127.0.0.1")

    def tick(self, world: World) -> None:
        """Send new rows, and wait for the clock."""
        now = round(world.time * 1e9)
        actor = world.actors[ROBOT]
        for taken, name, values in actor.sensor_suite.arrived:
            reading = {k: _plain(v) for k, v in values.items()}
            self._channels[f"/sensors/{name}"].log(reading, log_time=round(taken * 1e9))
        if self._beat.due(world.time):
            self._server.broadcast_time(now)
            self._poses(world, now)
            robot = world.actors[ROBOT]
            kinematics, moving = robot.look()
            state: dict[str, Any] = {
                "time": world.time,
                "position": _xyz(kinematics.origins[0, 0]),
                "velocity": _xyz(moving.twists[0, 0, :3]),
                "angular_velocity": _xyz(moving.twists[0, 0, 3:]),
                "joints": robot.body.joint_positions().tolist(),
                "command": [] if robot.command is None else robot.command[0].tolist(),
                "stage": "" if robot.pilot is None else robot.pilot.stage,
            }
            self._channels["/state"].log(state, log_time=now)
        self._pace.wait(world.time)

    def _poses(self, world: World, now: int) -> None:
        """Send frames, shapes and forces."""
        messages = _sdk().messages
        stamp = messages.Timestamp(now // 10**9, now % 10**9)
        frames, entities = [], list[Any]()
        if self._shapes.due(world.time):
            # again and again: who connects late sees them, too
            entities += solids(messages, stamp, self._settings, world)
        for name, actor in world.actors.items():
            kinematics, _ = actor.look()
            origins, turns = kinematics.origins[0], kinematics.rotations[0]
            space = "" if name == ROBOT else f"{name}/"
            for k, link in enumerate(actor.robot.links):
                x, y, z, w = quaternion_of(turns[k]).tolist()
                frames.append(
                    messages.FrameTransform(
                        timestamp=stamp,
                        parent_frame_id=_WORLD_FRAME,
                        child_frame_id=f"{space}{link}",
                        translation=messages.Vector3(**_xyz(origins[k])),
                        rotation=messages.Quaternion(x=x, y=y, z=z, w=w),
                    )
                )
            entities += _arrows(messages, stamp, space, actor, self.force_scale)
        self._channels["/tf"].log(messages.FrameTransforms(transforms=frames), log_time=now)
        self._channels["/scene"].log(messages.SceneUpdate(entities=entities), log_time=now)

    def close(self) -> None:
        """Stop the server."""
        for channel in self._channels.values():
            channel.close()
        self._gate.close()
        self._server.stop()


def _xyz(values: Floats) -> dict[str, float]:
    return dict(zip("xyz", np.asarray(values, dtype=float).tolist(), strict=True))


def _plain(values: Floats) -> Any:
    """Three numbers as x, y, z, one as itself; those that are not finite as None."""
    flat = [float(v) if np.isfinite(v) else None for v in np.reshape(values, -1)]
    if len(flat) == 3:
        return dict(zip("xyz", flat, strict=True))
    return flat[0] if len(flat) == 1 else flat


def _listener(foxglove: Any, settings: RunSettings) -> Any:
    """Return what answers questions for parameters; they cannot be set while a run goes on."""
    values: dict[str, float] = {"time.step": settings.time.step}
    for section in ("effects", "actuators", "sensors"):
        for name, plugin in getattr(settings, section).items():
            for each in dataclasses.fields(plugin):
                value = getattr(plugin, each.name)
                if each.name in parameters_of(plugin) and isinstance(value, float):
                    values[f"{section}.{name}.{each.name}"] = value
    made = {key: foxglove.websocket.Parameter(key, value=value) for key, value in values.items()}

    class Answers(foxglove.websocket.ServerListener):  # type: ignore[misc]  # untyped base
        def on_get_parameters(
            self, client: Any, param_names: list[str], request_id: str | None = None
        ) -> list[Any]:
            wanted = param_names or list(made)
            return [made[name] for name in wanted if name in made]

        def on_set_parameters(
            self, client: Any, parameters: list[Any], request_id: str | None = None
        ) -> list[Any]:
            return [made[p.name] for p in parameters if p.name in made]

    return Answers()
