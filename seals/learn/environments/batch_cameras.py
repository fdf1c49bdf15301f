"""Batch cameras: poses and images of the cameras of N environments."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.arrays import Array
from seals.environment.ground import solids_of
from seals.errors import ConfigError, refuse_unlisted
from seals.learn.starts import generator_of
from seals.learn.task import Instant
from seals.multibody.tree import poses_in_base
from seals.rendering import Light, Poses, Scene
from seals.rendering.camera import Cameras, lengths, mounted, units
from seals.rendering.gather import build_scene
from seals.rendering.optics import Sight, SurfaceStill, to_bytes
from seals.rendering.scene import Shape
from seals.robot.model import RobotModel
from seals.run.settings import RunSettings
from seals.run.sight import sees, surface_of

if TYPE_CHECKING:
    from torch import Tensor

TARGET = "target"
"""Name of the ball that shows the target."""
RED = (0.85, 0.10, 0.08)
"""Its displayed colour: the only red thing in the scene."""
COLOURS = 3
VIEWS = 512
"""Pictures that the optics take at a time: memory stays bounded."""


class BatchCameras:
    """Cameras of N robots with held joints, rendered with a ball at each target.

    Args:
        settings: of the run; its cameras, renderer, optics and surroundings.
        robot: of the run.
        joints: held joint values [rad or m], shape (J,).
        ball: radius of the ball at the target [m].
        device: of the pictures.
        seed: of the noise of the sensors.

    Raises:
        ConfigError: cameras differ in their lens, sit on an unknown link, or the renderer draws
            one scene at a time.
    """

    def __init__(
        self,
        settings: RunSettings,
        robot: RobotModel,
        joints: Array,
        *,
        ball: float,
        device: str,
        seed: int,
    ) -> None:
        """Open the renderer."""
        import torch

        cameras = {n: s for n, s in settings.sensors.items() if sees(s)}
        lenses = {name: camera.lens for name, camera in cameras.items()}
        first = next(iter(lenses.values()))
        for name, lens in lenses.items():
            if lens != first:
                raise ConfigError(
                    f"sensors.{name} has another lens than other cameras: {lens} and {first}.\n"
                    "The picture of a learner combines all cameras: give equal width, height, "
                    "fov, near, "
                    "far."
                )
        self.lens = first
        if not hasattr(settings.viewer, "device"):
            raise ConfigError(
                f"viewer '{type(settings.viewer).__name__}' renders only one world at a time, but "
                "this batch has many.\n"
                "Use viewer=raycast"
            )
        self._device, self._renderer = device, replace(settings.viewer, device=device)
        dry = settings.environment.water_level is None
        optics = settings.optics
        self._optics = replace(optics, water_type="none") if dry else optics
        self._surface = surface_of(settings) or SurfaceStill()
        scene = with_ball(
            build_scene(
                {"robot": robot},
                solids_of(settings.environment),
                detail=settings.sight.detail,
                tile=settings.sight.tile,
            ),
            ball,
        )
        height = 0.5 * np.pi - optics.sun_zenith
        self._renderer.open(scene, Light(azimuth=optics.sun_azimuth, height=height))
        self._noise = generator_of(seed, device)

        def tensor(values: Any) -> Tensor:
            return torch.as_tensor(np.ascontiguousarray(values), device=device).double()

        places, turns = poses_in_base(robot.tree, joints)
        self._places, self._turns = tensor(places), tensor(turns)
        links = [_link_of(name, camera, robot) for name, camera in cameras.items()]
        mounts = [
            mounted(places[link], turns[link], camera.mount.arm, camera.mount.turn)
            for link, camera in zip(links, cameras.values(), strict=True)
        ]
        self._mounts, self._axes = (tensor(column) for column in zip(*mounts, strict=True))
        self._stretch = tensor(lengths(self.lens).copy()).float()
        self._rays = tensor(units(self.lens).copy()).float()
        self.shape = (COLOURS * len(cameras), self.lens.height, self.lens.width)

    def look(self, now: Instant) -> Tensor:
        """Render the images of all cameras, uint8, shape (N, 3 C, H, W).

        Args:
            now: of N environments.
        """
        import torch

        with torch.no_grad():
            place, turn, target = (
                torch.as_tensor(x, device=self._device).double()
                for x in (now.position, now.rotation, now.target)
            )
            ball = (
                target[:, None],
                torch.eye(3, device=self._device).double().expand(len(place), 1, 3, 3),
            )
            poses = Poses(
                torch.cat([place[:, None] + self._places @ turn.mT, ball[0]], 1),
                torch.cat([turn[:, None] @ self._turns, ball[1]], 1),
            )
            cameras = Cameras(place[:, None] + self._mounts @ turn.mT, turn[:, None] @ self._axes)
            picture = self._renderer.render(poses, cameras, self.lens)
            light = self._through_water(picture, cameras, now)
            image: Tensor = to_bytes(light).reshape(*picture.depth.shape, COLOURS)
            # cameras and colours become the channels
            return image.permute(0, 1, 4, 2, 3).reshape(len(place), *self.shape)

    def _through_water(self, picture: Any, cameras: Cameras, now: Instant) -> Tensor:
        """Return the radiance at the sensors through the water, linear, shape (N C, H, W, 3)."""
        import torch

        axes = cameras.rotation.float().flatten(0, 1)
        ways = self._rays @ axes[:, None].mT
        colour, depth, parts = (x.flatten(0, 1) for x in picture[:3])
        sky = torch.as_tensor(self._optics.sky(ways), device=self._device).float()
        colour = torch.where((parts == 0)[..., None], sky, colour)
        origin = cameras.origin.float().flatten(0, 1)
        time = torch.as_tensor(now.time, device=self._device).float()[:, 0]
        depth, times = depth * self._stretch, time.repeat_interleave(cameras.origin.shape[1])
        seen = [
            self._optics.look(
                Sight(colour[cut], depth[cut], origin[cut], ways[cut], None),
                self._surface,
                times[cut],
                self._noise,
            ).float()
            for cut in (slice(k, k + VIEWS) for k in range(0, len(colour), VIEWS))
        ]
        return torch.cat(seen)

    def seed(self, seed: int) -> None:
        """Reseed the sensor noise."""
        self._noise.manual_seed(seed)

    def snapshot(self) -> Tensor:
        """Return the state of the noise."""
        return self._noise.get_state()

    def restore(self, kept: Tensor) -> None:
        """Restore that state."""
        self._noise.set_state(kept.cpu())

    def close(self) -> None:
        """Release the renderer."""
        self._renderer.close()


def with_ball(scene: Scene, radius: float) -> Scene:
    """Return a scene with a red ball of a radius [m], whose frame is the last one.

    It is called ``target``.
    """
    ball = Shape(
        "sphere", (radius,), np.zeros(3), np.eye(3), RED, len(scene.names), len(scene.frames)
    )
    return Scene((*scene.shapes, ball), (*scene.names, TARGET), (*scene.frames, TARGET))


def _link_of(name: str, camera: Any, robot: RobotModel) -> int:
    link = robot.links[0] if camera.link == "root" else camera.link
    refuse_unlisted(
        link, robot.links, f"sensors.{name}.link={link} is no link of {robot.name}", label="Links"
    )
    return robot.links.index(link)
