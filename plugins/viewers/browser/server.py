"""Web server of the viewer, on one address, without a public tunnel.

Access needs the token in the address and the same origin; connections are limited.
"""

from __future__ import annotations

import contextlib
import hmac
import http
import io
import logging
import secrets
import socket
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import urlsplit

from seals.errors import ConfigError, optional_import
from seals.view.own_address import names_this_machine

MOST_CONNECTIONS = 32
"""Connections at a time, those that have said nothing yet among them."""
MOST_MESSAGE = 1 << 22
"""Largest message that a page may send [byte]."""
PATIENCE = 5.0
"""Time that a connection may take to say what it wants [s]."""
_LONGEST = 240
_HEADERS = {
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Resource-Policy": "same-origin",
}
_DEAF = "Open the address that seals view printed, including everything after the port number.\n"


@dataclass
class Door:
    """Access control: admits requests with the token that come from the page itself.

    A page of any other site can make a browser ask for ``http://127.0.0.1:8080``, and its scripts
    can open a websocket there: the browser asks nobody. Such a page does not know the token, and
    the browser says in ``Origin`` where it comes from. A name that a stranger lets lead to this
    machine stands in ``Host``.

    Args:
        host: address that is listened on.
        token: first part of the path.
    """

    host: str
    token: str = field(default_factory=lambda: secrets.token_urlsafe(24))
    open: set[Any] = field(default_factory=set)

    def refusal(self, path: str, host: str, origin: str | None) -> str:
        """Return why a request is refused; empty if it is admitted.

        Args:
            path: what is asked for.
            host: whom it was asked of, the header ``Host``.
            origin: the page that asks, the header ``Origin``; None without one.

        Example:
            >>> door = Door("127.0.0.1", token="a")
            >>> door.refusal("/a/", "localhost:80", None)
            ''
            >>> door.refusal("/a/", "evil.example", None)
            "'evil.example' is not a name of this machine"
        """
        if not names_this_machine(host, self.host):
            return f"{host[:80]!r} is not a name of this machine"
        if origin is not None and urlsplit(origin).netloc.lower() != host.lower():
            return f"{origin[:80]!r} is another page"
        given = path.partition("?")[0].split("/")[1] if path.startswith("/") else ""
        if len(path) > _LONGEST or not hmac.compare_digest(given.encode(), self.token.encode()):
            return "the address lacks the token"
        return ""

    def answered(self, serve: Callable[..., Any]) -> Callable[..., Any]:
        """Return the response to a request: a refusal, or that of the page's server.

        Args:
            serve: takes connection and request; returns a response, or None for a websocket.
        """
        from websockets.datastructures import Headers, MultipleValuesError
        from websockets.http11 import Response

        def answer(connection: Any, request: Any) -> Any:
            try:
                host, origin = request.headers.get("Host", ""), request.headers.get("Origin")
            except MultipleValuesError:
                host, origin = "", None
            why = self.refusal(request.path, host, origin)
            if why:
                status = http.HTTPStatus.FORBIDDEN
                text = f"Refused: {why}.\n{_DEAF}".encode()
                more = {"Content-Type": "text/plain; charset=utf-8", **_HEADERS}
                return Response(status.value, status.phrase, Headers(**more), text)
            request.path = request.path[1 + len(self.token) :] or "/"
            response = serve(connection, request)
            if response is not None:
                response.headers.update(_HEADERS)
            return response

        return answer


@contextlib.contextmanager
def closed_by(door: Door) -> Iterator[None]:
    """Guard every websocket server opened inside the context with an access control.

    viser opens its server by itself and has no place for one.
    """
    from websockets.asyncio import server

    plain = server.serve

    class Counted(server.ServerConnection):
        """A connection that is dropped at once when there are too many."""

        def connection_made(self, transport: Any) -> None:
            super().connection_made(transport)
            if len(door.open) >= MOST_CONNECTIONS:
                transport.abort()
            else:
                door.open.add(self)

        def connection_lost(self, exc: Exception | None) -> None:
            door.open.discard(self)
            super().connection_lost(exc)

    quiet = logging.getLogger("seals.viewer.page")
    quiet.setLevel(logging.CRITICAL + 1)

    def serve(handler: Any, *words: Any, **more: Any) -> Any:
        more |= {"max_size": MOST_MESSAGE, "open_timeout": PATIENCE, "logger": quiet}
        more |= {
            "create_connection": Counted,
            "process_request": door.answered(more["process_request"]),
        }
        return plain(handler, *words, **more)

    server.serve = serve  # type: ignore[assignment, misc]
    try:
        yield
    finally:
        server.serve = plain  # type: ignore[misc]


def open_server(host: str, port: int) -> Any:
    """Open viser's server behind a `Door`; its ``address`` holds the token.

    Args:
        host: address to listen on.
        port: to listen on, 0 for any that is free.

    Raises:
        MissingExtra: viser is not installed.
        ConfigError: the address is none of this machine's, or the port is in use.
    """
    with optional_import("seals view needs viser", "Install it: pip install 'aam-seals[view]'"):
        import viser
    found = _free(host, port)

    class Private(viser.ViserServer):  # type: ignore[misc, name-defined, unused-ignore]
        """The server, without the tunnel to a public address that a page could ask it for."""

        def request_share_url(self, verbose: bool = True) -> None:
            """Share nothing: ``host`` determines who may open the page."""

    door = Door(host)
    # it greets in a table of its own
    with contextlib.redirect_stdout(io.StringIO()), closed_by(door):
        server = Private(host=host, port=found, label="SEALS", verbose=False)
    if server.get_port() != found:
        server.stop()
        raise _in_use(found)
    server.door = door
    server.address = f"http://{_shown(host)}:{found}/{door.token}/"
    return server


def _shown(host: str) -> str:
    """Return the host name of the address for a browser on this machine."""
    local = {"0.0.0.0": "127.0.0.1", "::": "[::1]"}
    return local.get(host, f"[{host}]" if ":" in host else host)


def _free(host: str, port: int) -> int:
    """Return the port if it is free, else another free one."""
    try:
        kind, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        with socket.socket(kind, socket.SOCK_STREAM) as trial:
            # a port that was left a moment ago counts as free, as it does for the server
            trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            trial.bind(address)
            return int(trial.getsockname()[1])
    except (socket.gaierror, UnicodeError) as cause:
        raise _no_address(host) from cause
    except PermissionError as cause:
        raise ConfigError(
            f"port={port} cannot be listened on.\nAllowed: 1024 to 65535, or 0 for any free port"
        ) from cause
    except OSError as cause:
        if "address already in use" in str(cause).lower():
            raise _in_use(port) from cause
        raise _no_address(host) from cause


def _in_use(port: int) -> ConfigError:
    return ConfigError(
        f"port={port} is in use by another program.\n"
        "Choose another one, or port=0 for any free port."
    )


def _no_address(host: str) -> ConfigError:
    return ConfigError(
        f"host={host} is not an address of this machine.\n"
        "Allowed: 127.0.0.1 for this machine alone, 0.0.0.0 for all, or one of its addresses"
    )
