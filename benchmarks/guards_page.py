"""Guards of the web page of ``seals view``."""

from __future__ import annotations

from benchmarks.guard import FILES, Guard

DOOR, VIEW = "tests/unit/test_view_door.py", "tests/unit/test_view_session.py"
_DOORS = "seals.plugins.viewers.browser.server"
PAGE: dict[str, Guard] = {
    "token of the page": Guard(
        _DOORS,
        "if len(path) > _LONGEST or not hmac.compare_digest(given.encode(), self.token.encode()):",
        "if False:",
        DOOR,
        "another_path",
        "viser",
    ),
    "origin of the page": Guard(
        _DOORS, "if origin is not None and", "if False and", DOOR, "another_page", "viser"
    ),
    "names of the page": Guard(
        _DOORS,
        "if not names_this_machine(host, self.host):",
        "if False:",
        DOOR,
        "another_name",
        "viser",
    ),
    "signs of a name of the page": Guard(
        "seals.view.own_address",
        ' if _HOST.fullmatch(header) else ""',
        "",
        DOOR,
        "another_name",
        "viser",
    ),
    "door of the page": Guard(
        "seals.plugins.viewers.browser.server",
        ", closed_by(door):",
        ":",
        DOOR,
        "by_its_address or websocket_needs",
        "viser",
    ),
    "crowd before the page": Guard(
        _DOORS, "if len(door.open) >= MOST_CONNECTIONS:", "if False:", DOOR, "thousand", "viser"
    ),
    "silence before the page": Guard(
        _DOORS, '"open_timeout": PATIENCE', '"open_timeout": 600', DOOR, "silent", "viser"
    ),
    "host of the page": Guard(
        "seals.view.settings", 'host: str = "127.0.0.1"', 'host: str = "0.0.0.0"', FILES, "the_page"
    ),
    "sharing the page": Guard(
        "seals.plugins.viewers.browser.server",
        "Private(host=host",
        "viser.ViserServer(host=host",
        VIEW,
        "this_machine_alone",
        "viser",
    ),
    "range of the page": Guard(
        "seals.view.session",
        "if not (math.isfinite(value) and low <= value <= high):",
        "if False:",
        VIEW,
        "cannot_leave_the_range",
    ),
    "keys of the page": Guard(
        "seals.view.session", "refuse_unlisted(key, known,", "(key, known,", VIEW, "leave_the_range"
    ),
}
"""Every one of them by name."""
