"""Recognition of requests that a browser sends to this machine under a foreign name."""

from __future__ import annotations

import contextlib
import ipaddress
import re
import socket
from urllib.parse import urlsplit

LOCAL = ("localhost", "127.0.0.1", "::1")
_HOST = re.compile(r"(?:[\w.-]+|\[[0-9A-Fa-f:.]+\])(?::\d{1,5})?", re.ASCII)
"""A name or an address, with or without a port, and nothing beside it."""


def names_this_machine(header: str, listened: str) -> bool:
    """Return whether a header ``Host`` names this machine.

    A name that a stranger lets lead to this machine is not one of its own.

    Args:
        header: as it was sent.
        listened: address that is listened on.

    Example:
        >>> names_this_machine("localhost:80", "127.0.0.1")
        True
        >>> names_this_machine("evil.example", "127.0.0.1")
        False
    """
    name = _name(f"http://{header}") if _HOST.fullmatch(header) else ""
    if not name or name in LOCAL or name == listened.lower():
        return bool(name)
    if listened in LOCAL:
        return False
    # listened on from outside: by an address, or by the name of this machine
    with contextlib.suppress(ValueError):
        ipaddress.ip_address(name)
        return True
    return name in (socket.gethostname().lower(), socket.getfqdn().lower())


def _name(address: str) -> str:
    """Return the name of the machine in an address; empty if there is none."""
    try:
        parts = urlsplit(address)
        return "" if parts.username is not None or parts.path else (parts.hostname or "").lower()
    except ValueError:
        return ""
