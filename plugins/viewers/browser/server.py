"""Web server of the viewer, on one address, without a public tunnel."""

from __future__ import annotations

import contextlib
import io
import socket
from typing import Any

from seals.errors import ConfigError, optional_import
from seals.plugins.viewers.browser.door import Door, closed_by


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
            """Share nothing: whom the page is open to is said by ``host``."""

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
            f"port={port} may not be listened on.\nAllowed: 1024 to 65535, or 0 for any"
        ) from cause
    except OSError as cause:
        if "address already in use" in str(cause).lower():
            raise _in_use(port) from cause
        raise _no_address(host) from cause


def _in_use(port: int) -> ConfigError:
    return ConfigError(
        f"port={port} is in use by another program.\n"
        "Choose another one, or say port=0 for any that is free."
    )


def _no_address(host: str) -> ConfigError:
    return ConfigError(
        f"host={host} is not an address of this machine.\n"
        "Allowed: 127.0.0.1 for this machine alone, 0.0.0.0 for all, or one of its addresses"
    )
