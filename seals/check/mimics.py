"""Check for mimic joints, which the simulation does not support."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree import ElementTree

from seals.check.finding import RobotFinding, passed, warned
from seals.robot.settings import RobotSettings


def look_at_mimics(settings: RobotSettings) -> Iterator[RobotFinding]:
    """Yield a finding for every ``<mimic>`` that is not part of one gripper.

    Args:
        settings: the robot folder as configured.
    """
    root = ElementTree.fromstring(settings.urdf_path.read_bytes())
    for joint in root.findall("joint"):
        mimic = joint.find("mimic")
        if mimic is None or joint.get("type") == "fixed":
            continue
        name, leader = joint.get("name", ""), mimic.get("joint", "")
        words = f"{name} follows {leader} in the URDF"
        if any({name, leader} <= set(g.joints) for g in settings.grippers.values()):
            yield passed("mimic joint", f"{words}; one gripper moves both")
        else:
            advice = (
                "Here it moves on its own: name both in one entry under grippers: in robot.yaml, "
                "or make it fixed."
            )
            yield warned("mimic joint", words, advice)
