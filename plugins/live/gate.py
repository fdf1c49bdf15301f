"""Gate in front of a WebSocket server that checks neither who asks nor how much."""

from __future__ import annotations

import asyncio
import contextlib
import secrets
import socket
import threading
from collections.abc import Iterator, Sequence

from seals.view.own_address import names_this_machine

MOST_CONNECTIONS = 32
"""Connections at a time, those that have said nothing yet among them."""
PATIENCE = 5.0
"""Time that a connection may take to say what it wants [s]."""
MOST_HEAD = 1 << 13
"""Longest request [byte]."""
MOST_SAID = 1 << 20
"""Data that a client may send over its connection; it asks, the server tells [byte]."""
_CHUNK = 1 << 16


def refusal(head: bytes, listened: str, origins: Sequence[str]) -> str:
    r"""Return why a request is refused; empty if it is admitted.

    A page of any site can have a browser open a WebSocket to this machine; the browser says in
    ``Origin`` where the page comes from. Programs say nothing there, or a scheme of their own.

    Args:
        head: of the request, with the empty line that ends it.
        listened: address that is listened on.
        origins: pages of the web that are admitted.

    Example:
        >>> head = b"GET / HTTP/1.1\r\nHost: localhost\r\nOrigin: http://evil.example\r\n\r\n"
        >>> refusal(head, "127.0.0.1", ["https://app.foxglove.dev"])
        "'http://evil.example' is another page"
    """
    first, *lines = head.decode("latin-1").split("\r\n")[:-2]
    fields: dict[str, list[str]] = {}
    for line in lines:
        name, _, value = line.partition(":")
        fields.setdefault(name.lower(), []).append(value.strip())
    hosts, pages = fields.get("host", []), fields.get("origin", [])
    if not first.startswith("GET ") or any(not n.replace("-", "").isalnum() for n in fields):
        return "it is not a request of a WebSocket"
    if len(hosts) != 1 or not names_this_machine(hosts[0], listened):
        return f"{', '.join(hosts)[:80]!r} is not a name of this machine"
    web = pages and (pages[0] == "null" or pages[0].lower().startswith(("http:", "https:")))
    if len(pages) > 1 or (web and pages[0].lower() not in origins):
        return f"{', '.join(pages)[:80]!r} is another page"
    return ""


def private_addresses() -> Iterator[str]:
    """Yield addresses of this machine to hide a server at: two that nobody guesses, its own."""
    for _ in range(2):
        # all of 127.0.0.0/8 is this machine on Linux
        yield "127.{}.{}.{}".format(*(1 + secrets.randbelow(254) for _ in range(3)))
    yield "127.0.0.1"


class Gate:
    """Listens at an address, and passes on what it admits.

    Args:
        host: to listen on.
        port: likewise, 0 for any that is free.
        origins: pages of the web that are admitted.

    Raises:
        OSError: the address cannot be had.
    """

    def __init__(self, host: str, port: int, origins: Sequence[str]) -> None:
        """Listen; nobody is served before `open`."""
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self._ear = socket.create_server((host, port), family=family)
        self.port = int(self._ear.getsockname()[1])
        self._host, self._origins = host, [origin.lower() for origin in origins]
        self._behind = ("", 0)
        self._loop = asyncio.new_event_loop()
        self._tasks: set[asyncio.Task[None]] = set()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)

    def open(self, host: str, port: int) -> None:
        """Serve what a server at an address of this machine says."""
        self._behind = (host, port)
        self._thread.start()
        started = asyncio.start_server(self._meet, sock=self._ear, limit=MOST_HEAD)
        self._server = asyncio.run_coroutine_threadsafe(started, self._loop).result()

    async def _meet(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Serve one connection; one too many is dropped at once."""
        task = asyncio.current_task()
        if task is None or len(self._tasks) >= MOST_CONNECTIONS:
            writer.transport.abort()
            return
        self._tasks.add(task)
        try:
            with contextlib.suppress(OSError, EOFError, TimeoutError, asyncio.LimitOverrunError):
                await self._serve(reader, writer)
        finally:
            self._tasks.discard(task)
            writer.transport.abort()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), PATIENCE)
        why = refusal(head, self._host, self._origins)
        if why:
            text = f"Refused: {why}.\n".encode("utf-8", "replace")
            said = f"Content-Type: text/plain\r\nContent-Length: {len(text)}\r\n"
            writer.write(f"HTTP/1.1 403 Forbidden\r\n{said}Connection: close\r\n\r\n".encode())
            writer.write(text)
            await writer.drain()
            writer.close()
            await asyncio.wait_for(writer.wait_closed(), PATIENCE)
            return
        back, forth = await asyncio.open_connection(*self._behind)
        try:
            forth.write(head)
            ways = (_passed(reader, forth, MOST_SAID), _passed(back, writer, None))
            tasks = [asyncio.create_task(way) for way in ways]
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
        finally:
            forth.transport.abort()

    def close(self) -> None:
        """End all connections and release the address."""
        if self._thread.is_alive():
            asyncio.run_coroutine_threadsafe(self._end(), self._loop).result()
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join()
        self._loop.close()
        self._ear.close()

    async def _end(self) -> None:
        self._server.close()
        for task in tuple(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)


async def _passed(
    reader: asyncio.StreamReader, writer: asyncio.StreamWriter, most: int | None
) -> None:
    """Pass data on until its end, or until there was too much."""
    count = 0
    with contextlib.suppress(OSError):
        while data := await reader.read(_CHUNK):
            count += len(data)
            if most is not None and count > most:
                return
            writer.write(data)
            await writer.drain()
