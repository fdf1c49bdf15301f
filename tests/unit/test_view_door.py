"""The door of the viewer's page: foreign pages, foreign names, no token, crowds, ways out."""

from __future__ import annotations

import contextlib
import http.client
import re
import socket
import time
from collections.abc import Iterator
from typing import Any

import pytest

from seals.plugins.viewers.browser import server as servers
from seals.plugins.viewers.browser.server import Door

viser = pytest.importorskip("viser", reason="viser is not installed")

TOKEN = "a" * 32
PATH = f"/{TOKEN}/"
FOREIGN_ORIGINS = [
    *("http://evil.example", "https://127.0.0.1:80", "null", "file://", "http://127.0.0.1"),
    *("http://127.0.0.1:1", "http://127.0.0.1.evil.example:80", "http://localhost:9", "", "x"),
    *("chrome-extension://abc", "http://[::1]:9"),
    *("http://127.0.0.1:8080@evil.example", "http://evil.example:8080", "ws://evil.example"),
    *("http://127.0.0.1:08080", "http://2130706433:8080", "data:text/html,x", "http://127.1:8080"),
    *("blob:http://127.0.0.1:8080/x", "http://127.0.0.1:8080 http://a", "http://localhost:8080"),
]
FOREIGN_HOSTS = [
    *("evil.example", "127.0.0.1.evil.example", "localhost.evil.example", "", "10.0.0.1"),
    *("127.0.0.2", "user@127.0.0.1", "127.0.0.1/a", "[::1", "0.0.0.0", "LOCALHOST.", "a b"),
    *("127.0.0.1#evil.example", "127.0.0.1:80:80", "127.0.0.1\t", "127.0.0.1%00.evil", "127.1"),
    *("2130706433", "0x7f.0.0.1", "\u0661\u0662\u0667.0.0.1", "127.0.0.1, a", "127.0.0.1?a"),
]
FOREIGN_PATHS = [
    *(
        "/",
        "",
        "//",
        f"/x{TOKEN}/",
        f"/{TOKEN[:-1]}/",
        f"/?{TOKEN}",
        f"//{TOKEN}/",
        f"/%61{TOKEN}/",
    ),
    *(f"/index.html?token={TOKEN}", f"/{TOKEN.upper()}/", f"/../{TOKEN}/", PATH + "a" * 2000),
    f"/{TOKEN}\u00e9/",
    *(f"/{TOKEN};/", f"/{TOKEN}%2f", f"/{TOKEN}\\", f"/{TOKEN}\0/", f"/./{TOKEN}/", f"{TOKEN}/"),
    *(f"/a/../{TOKEN}/", f"http://127.0.0.1/{TOKEN}/", f"/{TOKEN} /", f"/{TOKEN}a/"),
]


@pytest.mark.parametrize("origin", FOREIGN_ORIGINS)
def test_another_page_is_refused(origin: str) -> None:
    """The browser says where a script comes from; only the page itself is let in."""
    door = Door("127.0.0.1", token=TOKEN)
    assert "is another page" in door.refusal(PATH, "127.0.0.1:8080", origin)


@pytest.mark.parametrize("host", FOREIGN_HOSTS)
def test_another_name_is_refused(host: str) -> None:
    """A name that was made to lead here is not this machine's."""
    door = Door("127.0.0.1", token=TOKEN)
    assert "is not a name of this machine" in door.refusal(PATH, host, None)


@pytest.mark.parametrize("path", FOREIGN_PATHS)
def test_another_path_is_refused(path: str) -> None:
    """Without the token there is no page, wherever the rest leads."""
    door = Door("127.0.0.1", token=TOKEN)
    assert door.refusal(path, "127.0.0.1:8080", None) == "the address lacks the token"


def test_the_page_itself_is_let_in() -> None:
    """By each name of this machine, through a forwarded port, by websocket and without."""
    door = Door("127.0.0.1", token=TOKEN)
    for host in ("127.0.0.1:8080", "localhost:9000", "[::1]:8080", "127.0.0.1", "LocalHost:1"):
        assert door.refusal(PATH, host, None) == ""
        assert door.refusal(f"/{TOKEN}", host, f"http://{host}") == ""
    outside = Door("0.0.0.0", token=TOKEN)
    assert outside.refusal(PATH, "192.168.1.7:8080", "http://192.168.1.7:8080") == ""
    assert outside.refusal(PATH, f"{socket.gethostname()}:8080", None) == ""
    assert outside.refusal(PATH, "evil.example:8080", None) != ""


def test_tokens_differ_and_are_long() -> None:
    """Nobody guesses one."""
    tokens = {Door("127.0.0.1").token for _ in range(100)}
    assert len(tokens) == 100
    assert min(map(len, tokens)) >= 32


@pytest.fixture
def server() -> Iterator[Any]:
    """The viewer's server, as ``seals view`` opens it."""
    from seals.plugins.viewers.browser.server import open_server

    found = open_server("127.0.0.1", 0)
    yield found
    found.stop()


def ask(server: Any, path: str, **headers: str) -> tuple[int, dict[str, str], bytes]:
    """What the server answers to a request."""
    line = http.client.HTTPConnection("127.0.0.1", server.get_port(), timeout=20)
    try:
        line.putrequest("GET", path, skip_host="Host" in headers)
        for key, value in headers.items():
            line.putheader(key, value)
        line.endheaders()
        answer = line.getresponse()
        return answer.status, {k.lower(): v for k, v in answer.getheaders()}, answer.read()
    finally:
        line.close()


def test_the_page_by_its_address(server: Any) -> None:
    """The printed address opens the page; the page tells nobody where it came from."""
    found = re.fullmatch(r"http://127\.0\.0\.1:\d+(/[\w-]{32,}/)", server.address)
    assert found, server.address
    status, headers, body = ask(server, found[1])
    assert status == 200
    assert b"<title>" in body
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["x-frame-options"] == "DENY"
    status, _, body = ask(server, "/")
    assert status == 403
    assert b"lacks the token" in body
    assert b"<html" not in body
    assert ask(server, found[1], Host="evil.example")[0] == 403
    assert ask(server, found[1], Origin="http://evil.example")[0] == 403


WAYS_OUT = [
    *(
        "../../../../../../etc/passwd",
        "%2e%2e/%2e%2e/%2e%2e/%2e%2e/etc/passwd",
        "..%2f..%2fetc/passwd",
    ),
    *(
        "/etc/passwd",
        "//etc/passwd",
        "%00",
        "..\\..\\etc\\passwd",
        "./../index.html",
        "%252e%252e/a",
    ),
    *("a" * 900, "....//....//etc/passwd", "index.html/../../_viser.py", ".", "assets"),
]


@pytest.mark.parametrize("way", WAYS_OUT)
def test_no_path_leads_out_of_the_page(server: Any, way: str) -> None:
    """Only the files of the page are served, to those who know the token too."""
    path = server.address.partition("/")[2].partition("/")[2].partition("/")[2]
    status, _, body = ask(server, f"/{path}{way}")
    assert status in (404, 403) or b"<title>Viser" in body
    assert b"root:" not in body
    assert b"import " not in body[:200]


def _socket(server: Any, path: str, **headers: str) -> Any:
    from websockets.sync.client import connect

    port = server.get_port()
    host = headers.pop("Host", f"127.0.0.1:{port}")
    origin: Any = headers.pop("Origin", f"http://127.0.0.1:{port}")
    line = socket.create_connection(("127.0.0.1", port), timeout=20)
    return connect(
        f"ws://{host}{path}",
        sock=line,
        origin=origin,
        subprotocols=[f"viser-v{viser.__version__}"],  # type: ignore[list-item]
        open_timeout=20,
    )


def test_a_websocket_needs_token_name_and_origin(server: Any) -> None:
    """A script of another page gets no scene and moves no slider; the page itself does."""
    from websockets.exceptions import InvalidStatus

    path = server.address[server.address.index("/", 8) :]
    for where, headers in (
        ("/", {}),
        (f"/x{path}", {}),
        (path, {"Origin": "http://evil.example"}),
        (path, {"Origin": "null"}),
        (path, {"Host": "evil.example", "Origin": "http://evil.example"}),
    ):
        with pytest.raises(InvalidStatus) as refusal, _socket(server, where, **headers):
            pass
        assert refusal.value.response.status_code == 403
    assert not server.get_clients()
    with _socket(server, path.rstrip("/")) as line:
        assert line.recv(timeout=20)


@pytest.mark.thorough
def test_a_thousand_connections_do_no_harm(server: Any) -> None:
    """Those beyond a small number are dropped at once; the page opens when they are gone."""
    port = server.get_port()
    lines = []
    start = time.monotonic()
    for _ in range(1000):
        line = socket.socket()
        line.settimeout(5.0)
        with contextlib.suppress(OSError):
            line.connect(("127.0.0.1", port))
        lines.append(line)
    time.sleep(0.5)
    assert len(server.door.open) <= servers.MOST_CONNECTIONS
    dropped = sum(_is_dropped(line) for line in lines)
    assert dropped >= 1000 - servers.MOST_CONNECTIONS
    for line in lines:
        line.close()
    path = server.address[server.address.index("/", 8) :]
    while True:
        with contextlib.suppress(OSError, http.client.HTTPException):
            if ask(server, path)[0] == 200:
                break
        assert time.monotonic() - start < 60.0
    assert len(server.door.open) <= 2


def _is_dropped(line: socket.socket) -> bool:
    line.settimeout(0.001)
    try:
        return line.recv(1) == b""
    except TimeoutError:
        return False
    except OSError:
        return True


@pytest.mark.thorough
def test_silent_connections_are_ended(server: Any) -> None:
    """Who says nothing keeps nobody else out for long."""
    line = socket.create_connection(("127.0.0.1", server.get_port()))
    line.settimeout(servers.PATIENCE + 10.0)
    line.sendall(b"GET / HT")
    start = time.monotonic()
    with contextlib.suppress(OSError):
        while line.recv(4096):
            pass
    assert time.monotonic() - start < servers.PATIENCE + 5.0
    line.close()


@pytest.mark.parametrize(
    "raw",
    [
        b"POST /%s HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
        b"GET %s HTTP/1.0\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
        b"GET / HTTP/1.1\r\nHost: a\r\nHost: 127.0.0.1\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n" + b"A: b\r\n" * 5000 + b"\r\n",
        b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: \xff\xfe\r\n\r\n",
        b"GET \xff HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
        b"\r\n" * 100,
        bytes(10_000),
    ],
)
def test_strange_requests_are_refused(
    server: Any, raw: bytes, capfd: pytest.CaptureFixture[str]
) -> None:
    """Nothing is served, nothing is printed, and the page goes on."""
    with socket.create_connection(("127.0.0.1", server.get_port()), timeout=20) as line:
        said = b""
        with contextlib.suppress(OSError):
            line.sendall(raw)
            line.shutdown(socket.SHUT_WR)
            while more := line.recv(4096):
                said += more
    assert b" 200 " not in said[:20]
    path = server.address[server.address.index("/", 8) :]
    assert ask(server, path)[0] == 200
    assert "Traceback" not in capfd.readouterr().err


def test_the_door_stands_before_this_server_alone(server: Any) -> None:
    """Other servers of websockets in the process are opened as before."""
    from websockets.asyncio import server as plain

    inside = plain.serve
    with servers.closed_by(Door("127.0.0.1")):
        assert plain.serve is not inside
    assert plain.serve is inside
    assert inside.__module__ == "websockets.asyncio.server"
