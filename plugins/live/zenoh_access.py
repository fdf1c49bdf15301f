"""What a node of ROS 2 takes from others over zenoh, as rules of zenoh's access control."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

_GRAPH = "@ros2_lv/**"
"""Liveliness tokens, by which the nodes of ROS 2 know of each other."""
_EVERY = (
    *("put", "delete", "declare_subscriber", "query", "reply", "declare_queryable"),
    *("liveliness_token", "liveliness_query", "declare_liveliness_subscriber"),
)


def access(taken: Sequence[str], published: Sequence[str]) -> dict[str, Any]:
    """Return the value of ``access_control`` in the configuration of a session.

    Whatever others declare is kept as long as they are connected. Subscribers of what is published
    are needed, and asking for the graph; all else is dropped unseen, or a flood of it would fill
    the memory and the time of a run.

    Args:
        taken: keys of messages that are taken.
        published: keys that others may subscribe to.

    Example:
        >>> access(["0/cmd_vel/a/b"], [])["default_permission"]
        'deny'
    """
    rules = [
        _rule("told", "egress", _EVERY, ["**", _GRAPH]),
        _rule("asked", "ingress", ("liveliness_query", "declare_liveliness_subscriber"), [_GRAPH]),
        _rule("taken", "ingress", ("put",), taken),
        _rule("published", "ingress", ("declare_subscriber",), published),
    ]
    rules = [rule for rule in rules if rule["key_exprs"]]
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": "all"}],
        "policies": [{"rules": [rule["id"] for rule in rules], "subjects": ["all"]}],
    }


def _rule(name: str, flow: str, messages: Sequence[str], keys: Sequence[str]) -> dict[str, Any]:
    words = {"id": name, "permission": "allow", "flows": [flow]}
    return {**words, "messages": list(messages), "key_exprs": list(keys)}
