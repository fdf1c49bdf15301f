"""``seals check``: is this robot folder sane?"""

from __future__ import annotations

from seals.errors import ConfigError


def check(arguments: list[str]) -> int:
    """Compose the robot, print every finding about it, and return 1 when one of them is a fault."""
    from omegaconf import OmegaConf

    from seals.config.compose import compose
    from seals.config.fields import check_tree
    from seals.config.refusal import refusals
    from seals.config.unknown import refuse_unknown

    if not any(word.startswith("robot=") for word in arguments):
        raise ConfigError("robot is not given.\nWrite: seals check robot=NAME or robot=FOLDER")
    config = compose(arguments)
    refuse_unknown(config, where="")
    with refusals(arguments):
        settings = OmegaConf.to_object(config.robot)
    check_tree(settings, where="robot")

    from seals.robot.check import check_robot

    findings = check_robot(settings)
    for finding in findings:
        print(finding)
    if not findings:
        print(f"{config.robot.name}: nothing to remark.")
    faults = [f for f in findings if getattr(f, "severity", "error") in ("error", "refuse")]
    return 1 if faults else 0
