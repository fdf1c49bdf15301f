"""Visual scene of a run: robots, objects and ground as shapes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from seals.environment.ground import solids_of
from seals.rendering.gather import build_scene
from seals.rendering.scene import Detail, Scene
from seals.robot.build import build_robot
from seals.robot.model import RobotModel
from seals.run.fleet import fleet_of
from seals.run.immersed import surroundings
from seals.run.objects import object_robot
from seals.run.settings import RunSettings


class Stage(NamedTuple):
    """Robot, objects and ground of a run as a visual scene.

    Args:
        settings: of the run.
        robots: robots and objects by the name of their actor, the robots first.
        scene: their shapes and those of the ground; its frames are ``actor/link``.
        walls: parts of the scene that hold a simulated water together; best seen through.
    """

    settings: RunSettings
    robots: Mapping[str, RobotModel]
    scene: Scene
    walls: frozenset[int]

    def frame(self, actor: str, link: str) -> int:
        """Return the number of a link among the frames of the scene."""
        return self.scene.frames.index(f"{actor}/{link}")


def build_stage(settings: RunSettings) -> Stage:
    """Build the visual scene of a run.

    Raises:
        SealsError: the robot, an object or a mesh cannot be used.
    """
    from seals.config.source import find_robot

    robots = {name: build_robot(own.robot) for name, own in fleet_of(settings).items()}
    for name, thing in settings.objects.items():
        robots[name] = build_robot(object_robot(find_robot(thing.robot)))
    scene = build_scene(robots, solids_of(surroundings(settings)), detail=Detail.visual)
    fluid = settings.fluid
    around = [] if fluid is None else fluid.solids(settings.environment)
    return Stage(settings, robots, scene, frozenset(scene.part(f"world/{n}") for n in around))
