"""Arms and grippers of a new robot, from the chains of its movable joints."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

import numpy as np

from seals.multibody.tree import poses_in_base
from seals.robot.model import RobotModel
from seals.scaffold.legs import legs_of

_TOOL = r"tool|tcp|palm|hand|grip|flange|(^|_)ee($|_)|end_?eff"

SURFACE = r"fin(?![a-z])|fins|rudder|elevator|aileron|elevon|flap|wing|sail|wheel|tilt|tail"
"""Names of joints and links that turn in the flow instead of reaching for things."""
_CLAW, _FINGER = r"claw|pincer|chel[ai]|cheliped", r"finger|dactyl|pollex|pincer|thumb|jaw"


class Limbs(NamedTuple):
    """Entries of ``arms:``, ``grippers:`` and ``legs:``, the other joints, the stance's source."""

    arms: dict[str, dict[str, Any]]
    grippers: dict[str, dict[str, Any]]
    others: list[str]
    legs: dict[str, dict[str, Any]] = {}  # noqa: RUF012  of a tuple, never written to
    stance: str = ""


def limbs_of(robot: RobotModel, passed_over: set[str]) -> Limbs:
    """Return arms and grippers of a robot.

    A chain of joints is an arm; where it branches into fingers, these are its gripper. Four chains
    of three joints that do not branch and are not named like claws are legs, beside arms.

    Args:
        robot: as read from the URDF.
        passed_over: joints that belong to rotors.
    """
    below = _below(robot, passed_over)
    arms: dict[str, dict[str, Any]] = {}
    grippers: dict[str, dict[str, Any]] = {}
    others: list[str] = []
    chains = [_claw(robot, *_chain(first, below)) for first in below[-1]]
    plain = [c for c, ends in chains if not ends and not _named(robot, c, _CLAW)]
    legs = legs_of(robot, plain)
    if legs:
        walking = {name for leg in legs.values() for name in leg["joints"]}
        chains = [(c, ends) for c, ends in chains if robot.joints[c[0]] not in walking]
    lone = [c for c, ends in chains if len(c) == 1 and not ends]
    long = [(c, ends) for c, ends in chains if len(c) > 1 or ends]
    fingers = [
        c[0] for c in lone if np.isfinite(robot.upper[c[0]]) and not _named(robot, c, SURFACE)
    ]
    if 2 <= len(fingers) == len(lone) and not long and not legs:
        # single joints side by side on the base itself are fingers, not arms
        return Limbs({}, {"gripper": _gripper(robot, fingers, below)}, [])
    long += [(c, []) for c in lone if c[0] in fingers]
    others = [robot.joints[c[0]] for c in lone if c[0] not in fingers]
    for number, (chain, ends) in enumerate(long, start=1):
        mark = f"_{number}" if len(long) > 1 else ""
        arms[f"arm{mark}"] = _arm(robot, chain, ends)
        if ends:
            grippers[f"gripper{mark}"] = _gripper(robot, ends, below)
    return Limbs(arms, grippers, others, legs)


def _named(robot: RobotModel, chain: list[int], words: str) -> bool:
    """Return whether the name of a joint of a chain, or of its link, matches ``words``."""
    names = [n for j in chain for n in (robot.joints[j], robot.links[robot.tree.child[j]])]
    return any(re.search(words, name, re.IGNORECASE) for name in names)


def _claw(robot: RobotModel, chain: list[int], ends: list[int]) -> tuple[list[int], list[int]]:
    """Separate the only moving finger of a claw from its chain."""
    claw = not ends and len(chain) > 1 and _named(robot, chain, _CLAW)
    if claw and _named(robot, chain[-1:], _FINGER):
        return chain[:-1], chain[-1:]
    return chain, ends


def _below(robot: RobotModel, passed_over: set[str]) -> dict[int, list[int]]:
    """Movable joints directly below each movable joint; -1 stands for the base."""
    tree = robot.tree
    below: dict[int, list[int]] = {-1: [], **{j: [] for j in range(tree.joints)}}
    for j, link in enumerate(tree.child):
        if robot.joints[j] in passed_over:
            continue
        above = tree.parent[link]
        while above > 0 and (
            tree.joint[above] < 0 or robot.joints[tree.joint[above]] in passed_over
        ):
            above = tree.parent[above]
        below[tree.joint[above] if above > 0 else -1].append(j)
    return below


def _chain(first: int, below: dict[int, list[int]]) -> tuple[list[int], list[int]]:
    """Joints from the first one to the end or to a fork, and the joints behind the fork."""
    chain = [first]
    while len(below[chain[-1]]) == 1:
        chain.append(below[chain[-1]][0])
    return chain, below[chain[-1]]


def _arm(robot: RobotModel, chain: list[int], ends: list[int]) -> dict[str, Any]:
    """One entry of ``arms:``; the tool is the link that holds the fingers or has a tool's name."""
    tree = robot.tree
    last = tree.child[chain[-1]]
    fixed = [k for k in range(tree.links) if _hangs(robot, k, last)]
    tools = [k for k in fixed if re.search(_TOOL, robot.links[k], re.IGNORECASE)]
    tool = tree.parent[tree.child[ends[0]]] if ends else (tools[-1] if tools else last)
    stowed = np.clip(0.0, robot.lower[chain], robot.upper[chain])
    return {
        "joints": [robot.joints[j] for j in chain],
        "tool": robot.links[tool],
        "stowed": [round(float(x), 4) + 0.0 for x in stowed],
    }


def _gripper(robot: RobotModel, ends: list[int], below: dict[int, list[int]]) -> dict[str, Any]:
    """One entry of ``grippers:``; it is open at the joint limit with the larger gap of the tips."""
    fingers = [_all_below(first, below) for first in ends]
    joints = [j for finger in fingers for j in finger]
    tips = []
    for finger in fingers:
        # the last link that is fixed to the child of the joint
        start = robot.tree.child[finger[-1]]
        tips.append(max(k for k in range(robot.tree.links) if _hangs(robot, k, start)))
    low = np.where(np.isfinite(robot.lower[joints]), robot.lower[joints], 0.0)
    high = np.where(np.isfinite(robot.upper[joints]), robot.upper[joints], 0.5)
    wide = []
    for values in (low, high):
        # mean distance of the tips' centres of mass from their middle [m]
        q = np.zeros(robot.tree.joints)
        q[joints] = values
        origins, turns = poses_in_base(robot.tree, q)
        places = origins[tips] + np.einsum("lij,lj->li", turns[tips], robot.centre[tips])
        wide.append(float(np.linalg.norm(places - places.mean(axis=0), axis=1).mean()))
    opened, closed = (low, high) if wide[0] >= wide[1] else (high, low)
    return {
        "joints": [robot.joints[j] for j in joints],
        "open": [round(float(x), 4) + 0.0 for x in opened],
        "closed": [round(float(x), 4) + 0.0 for x in closed],
        "tips": [robot.links[k] for k in tips],
    }


def _all_below(joint: int, below: dict[int, list[int]]) -> list[int]:
    return [joint, *(j for child in below[joint] for j in _all_below(child, below))]


def _hangs(robot: RobotModel, link: int, top: int) -> bool:
    """Return whether a link is ``top`` or fixed to it through fixed joints."""
    while link != top and link > 0 and robot.tree.joint[link] < 0:
        link = robot.tree.parent[link]
    return link == top
