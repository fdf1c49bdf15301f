"""Arm with a three-finger gripper, common to the manipulators.

At joint zero it hangs straight down along -z; all its pitch axes are +y, so that positive angles
swing it backwards. Its links are as dense as the robots that carry it, 8 % above water: moving it
under water shifts the centre of gravity as far as that of buoyancy, and nothing tips.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from seals.robots.workshop.links import Joint, Link
from seals.robots.workshop.pieces import Piece, ball, box, rod, turned

UPPER, FORE, WRIST = 0.130, 0.110, 0.035
"""Lengths of the links [m]; WRIST is that of the extra link of an arm with a roll joint."""
KNUCKLE = (0.036, -0.045)
"""Distance of the finger joints from the palm's axis, and their height in the palm [m]."""
PAD = (0.004, 0.018, 0.026)
"""Finger-tip pad: thickness, width, height [m]."""
PAD_AT = (-0.009, 0.0, -0.062)
"""Centre of the pad in the finger, x outwards: its face lies 25 mm from the axis at angle 0 [m]."""
OPEN, CLOSED = -0.6, 0.26
"""Finger angles with the pads 120 mm apart, and with the three pads almost touching [rad]."""
STOP = 0.04
"""Travel of the fingers beyond open and closed, so that no servo rests on a stop [rad]."""
PITCH = (0.0, 1.0, 0.0)
SERVO = 6.2
"""Largest speed of the arm's servos: 60 degrees in 0.17 s [rad/s]."""


def arm(
    parent: str, at: Sequence[float], *, prefix: str = "", yaw: float = 0.0, roll: bool = False
) -> list[Joint]:
    """Return the joints of an arm hung below a link.

    Args:
        parent: link that carries the arm.
        at: axis of the shoulder in that link [m].
        prefix: put in front of all names.
        yaw: of the whole arm in that link [rad].
        roll: whether a fourth joint turns the palm about its own axis.
    """
    p = prefix
    joints = [
        Joint(
            name=f"{p}shoulder",
            parent=parent,
            child=f"{p}upper",
            at=at,
            rpy=(0.0, 0.0, yaw),
            axis=PITCH,
            limits=(-0.35, 1.6),
            effort=4.0,
            speed=SERVO,
        ),
        Joint(
            name=f"{p}elbow",
            parent=f"{p}upper",
            child=f"{p}fore",
            at=(0.0, 0.0, -UPPER),
            axis=PITCH,
            limits=(-1.75, 0.1),
            effort=2.5,
            speed=SERVO,
        ),
        Joint(
            name=f"{p}wrist",
            parent=f"{p}fore",
            child=f"{p}wrist_link" if roll else f"{p}palm",
            at=(0.0, 0.0, -FORE),
            axis=PITCH,
            limits=(-1.3, 0.7 if roll else 1.6),
            effort=1.5,
            speed=SERVO,
        ),
    ]
    if roll:
        joints.append(
            Joint(
                name=f"{p}roll",
                parent=f"{p}wrist_link",
                child=f"{p}palm",
                at=(0.0, 0.0, -WRIST),
                axis=(0.0, 0.0, 1.0),
                limits=(-1.6, 1.6),
                effort=1.0,
                speed=SERVO,
            )
        )
    return joints + [joint for k in range(3) for joint in _finger(p, k)]


def _finger(p: str, k: int) -> list[Joint]:
    """Knuckle of finger k, closing with positive angles, and the fixed joint of its pad."""
    turn = 2.0 * math.pi * k / 3.0
    out, height = KNUCKLE
    knuckle = Joint(
        name=f"{p}finger_{k + 1}",
        parent=f"{p}palm",
        child=f"{p}finger_{k + 1}",
        at=(out * math.cos(turn), out * math.sin(turn), height),
        rpy=(0.0, 0.0, turn),
        axis=PITCH,
        limits=(OPEN - STOP, CLOSED + STOP),
        effort=0.5,
        speed=5.0,
    )
    pad = Joint(
        name=f"{p}pad_{k + 1}", parent=f"{p}finger_{k + 1}", child=f"{p}tip_{k + 1}", at=PAD_AT
    )
    return [knuckle, pad]


def links(*, prefix: str = "", roll: bool = False) -> list[Link]:
    """Return the links of the arm, shoulder first."""
    found = [
        Link(name=f"{prefix}upper", stem="upper", pieces=_upper(), hull_mesh=True),
        Link(name=f"{prefix}fore", stem="fore", pieces=_fore(), hull_mesh=True),
    ]
    if roll:
        found.append(
            Link(name=f"{prefix}wrist_link", stem="wrist", pieces=_wrist(), hull_mesh=True)
        )
    found.append(Link(name=f"{prefix}palm", stem="palm", pieces=_palm(), hull_mesh=True))
    for k in range(3):
        found.append(Link(name=f"{prefix}finger_{k + 1}", pieces=_finger_pieces(), stem="finger"))
        pad = box(PAD, (0, 0, 0), 0.002, colour="rubber", solid=True, wet=True)
        name = f"{prefix}tip_{k + 1}"
        found.append(Link(name=name, pieces=[pad], stem="tip", friction=1.2, spinning=0.002))
    return found


def _upper() -> list[Piece]:
    axle = rod(0.020, (0, -0.024, 0), (0, 0.024, 0), colour="dark")
    tube = rod(0.018, (0, 0, 0.018), (0, 0, -0.132), 0.130, colour="shell", solid=True, wet=True)
    elbow = rod(0.016, (0, -0.020, -UPPER), (0, 0.020, -UPPER), 0.035, colour="dark")
    return [axle, tube, elbow]


def _fore() -> list[Piece]:
    tube = rod(0.0155, (0, 0, -0.002), (0, 0, -0.122), 0.076, colour="shell", solid=True, wet=True)
    wrist = rod(0.014, (0, -0.019, -FORE), (0, 0.019, -FORE), 0.022, colour="dark")
    return [tube, wrist]


def _wrist() -> list[Piece]:
    return [rod(0.015, (0, 0, 0), (0, 0, -0.03), 0.023, colour="dark", solid=True, wet=True)]


def _palm() -> list[Piece]:
    body = rod(0.030, (0, 0, -0.010), (0, 0, -0.050), 0.1225, colour="shell", solid=True, wet=True)
    neck = rod(0.012, (0, 0, 0.0), (0, 0, -0.012), colour="dark")
    mounts = [
        box(
            (0.016, 0.022, 0.016),
            (KNUCKLE[0] * math.cos(a), KNUCKLE[0] * math.sin(a), KNUCKLE[1] + 0.004),
            colour="dark",
            turn=turned("z", a),
        )
        for a in (0.0, 2.0 * math.pi / 3.0, 4.0 * math.pi / 3.0)
    ]
    return [body, neck, *mounts]


def _finger_pieces() -> list[Piece]:
    blade = box((0.014, 0.016, 0.075), (0, 0, -0.0375), 0.0182, colour="dark", solid=True, wet=True)
    knuckle = ball(0.009, (0, 0, 0), colour="shell")
    return [blade, knuckle]
