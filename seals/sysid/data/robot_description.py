"""Description of a robot from its folder: links, effects, actuators."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from seals.effects.effect import Effect
from seals.errors import LogError
from seals.robot.build import build_robot
from seals.robot.model import RobotModel
from seals.robot.urdf import read_urdf


@dataclass(frozen=True, kw_only=True)
class RobotDescription:
    """A robot as its folder describes it.

    Args:
        robot: links, joints, hulls.
        effects: of ``robot.yaml`` by instance name.
        actuators: of ``robot.yaml`` by instance name.
        listed: names of the movable joints in the order in which the URDF lists them.
        sea: waves of a run; None for what the log states.
    """

    robot: RobotModel
    effects: Mapping[str, Effect]
    actuators: Mapping[str, Effect]
    listed: tuple[str, ...] = ()
    sea: Any = None


def described(config: Any) -> RobotDescription | None:
    """Return the robot of a command's configuration, or None where none is given.

    Args:
        config: composed configuration with ``robot``, ``effects`` and ``actuators``.

    Raises:
        SealsError: the robot, an effect or an actuator cannot be used.
    """
    from omegaconf import OmegaConf

    from seals.config.build import build
    from seals.config.refusal import refusals
    from seals.schema import check_tree

    if not config.robot.folder:
        return None
    with refusals(()):
        settings: Any = OmegaConf.to_object(config.robot)
    check_tree(settings, where="robot")
    made = {
        section: {
            str(n): build(node, where=f"{section}.{n}") for n, node in config[section].items()
        }
        for section in ("effects", "actuators")
    }
    return RobotDescription(
        robot=build_robot(settings),
        effects=made["effects"],
        actuators=made["actuators"],
        listed=read_urdf(settings.urdf_path).listed,
    )


def describe_run(folder: Path) -> RobotDescription | None:
    """Return the robot that SEALS simulated in a run, or None for any other log.

    Raises:
        SealsError: the configuration of the run cannot be used.
        LogError: the water of the run was simulated, of which no law is known.
    """
    from seals.config.build import build
    from seals.run.replay_config import recalled

    if not (folder / ".hydra" / "config.yaml").is_file():
        return None
    config = recalled(folder, key="log")
    if config.get("fluid") is not None:
        raise LogError(
            f"log={folder} is a run in water that was simulated itself (fluid).\n"
            "A diagnosis needs laws: take a run without a fluid, see docs/limits.md."
        )
    found = described(config)
    if found is None:
        return None
    wave = None if config.get("wave") is None else build(config.wave, where="wave")
    # a run lists joints in the order of its model
    return replace(found, sea=wave, listed=found.robot.joints)


def describe_robot(robot: str) -> RobotDescription:
    """Return the description of a robot by its name or folder.

    Args:
        robot: installed name, or path of a robot folder.

    Raises:
        SealsError: there is no such robot, or it cannot be used.
    """
    from seals.config.compose import compose
    from seals.config.overrides import override

    found = described(compose([override("robot", robot)], root="diagnose"))
    assert found is not None
    return found
