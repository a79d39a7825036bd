"""What an attacker can do: raw bytes to a port, and sockets with any headers."""

from __future__ import annotations

import json
import re
import socket
from contextlib import contextmanager
from typing import Any

from websockets.sync.client import ClientConnection, connect

from clpt.view.messages import Request
from clpt.view.server import Server


class Recorder:
    """Stands for a session: it notes what it is asked for."""

    def __init__(self) -> None:
        self.requests: list[Request] = []
        self.viewers = 0

    def state(self) -> dict[str, Any]:
        return {"type": "state"}

    def status(self) -> dict[str, Any]:
        return {"type": "status"}

    def watched(self, viewers: int) -> None:
        self.viewers = viewers

    def post(self, request: Request, reply: Any) -> None:
        self.requests.append(request)


def ask(
    server: Server, path: str, *headers: str, host: str | None = "", verb: str = "GET"
) -> tuple[int, dict[str, str], bytes]:
    """Return status, headers and content of a request; host: by default the server's own.

    path: within the page's folder, or with it.
    """
    room = server.access.room
    lines = [f"{verb} {path if path.startswith(room) else room[:-1] + path} HTTP/1.1"]
    if host is not None:
        lines.append(f"Host: {host or f'127.0.0.1:{server.port}'}")
    return answer_to(server, "\r\n".join([*lines, *headers, "", ""]).encode())


def answer_to(server: Server, sent: bytes) -> tuple[int, dict[str, str], bytes]:
    """Return status, headers and content after these bytes; status 0: the server hangs up."""
    with socket.create_connection((server.host, server.port), timeout=10) as raw:
        raw.sendall(sent)
        got = b""
        try:
            while chunk := raw.recv(65536):
                got += chunk
        except ConnectionResetError:
            pass
    head, _, content = got.partition(b"\r\n\r\n")
    status, *lines = head.decode("latin-1").split("\r\n")
    found = re.match(r"HTTP/1.1 (\d+)", status)
    pairs = (line.split(": ", 1) for line in lines)
    return (int(found[1]) if found else 0), {name.lower(): value for name, value in pairs}, content


def cookie(server: Server) -> str:
    """Return a cookie, as a browser that was given the address has it."""
    path = server.address.split(str(server.port), 1)[1]
    status, headers, _ = ask(server, path)
    assert status == 200
    return headers["set-cookie"].split(";")[0]


@contextmanager
def opened(
    server: Server, with_cookie: str, origin: str | None = "", host: str | None = None
) -> Any:
    """Yield a socket of a page; origin: by default the page's own, None for no such header."""
    own = f"127.0.0.1:{server.port}"
    headers = {"Cookie": with_cookie} if with_cookie else {}
    address = f"ws://{host or own}{server.access.room}socket"
    given = f"http://{own}" if origin == "" else origin
    raw = socket.create_connection((server.host, server.port), timeout=10)
    with connect(
        address, sock=raw, origin=given, additional_headers=headers, compression=None,
        max_size=None, open_timeout=10, close_timeout=1, ping_interval=None,
    ) as client:  # fmt: skip
        yield client


def do(client: ClientConnection, name: str, /, **values: Any) -> None:
    """Send a command."""
    client.send(json.dumps({"do": name, **values}))


def message(client: ClientConnection, kind: str) -> dict[str, Any]:
    """Return the next message of a type; others are passed over."""
    while True:
        received = client.recv(timeout=10)
        if isinstance(received, str) and (found := json.loads(received))["type"] == kind:
            return found


def frame(client: ClientConnection, timeout: float = 10) -> int:
    """Return the number of the next frame; messages are passed over. Raises TimeoutError."""
    while True:
        received = client.recv(timeout=timeout)
        if isinstance(received, bytes):
            length = int.from_bytes(received[:4], "little")
            return json.loads(received[4 : 4 + length])["frame"]
