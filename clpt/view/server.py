"""Serves the page and its socket to browsers, and trusts none of them.

Every connection must ask for a name of the server (or a page elsewhere could reach it by another
name, "DNS rebinding"), and have a cookie, which a token buys a single time.
A socket must also come from the server's own page.
"""

from __future__ import annotations

import asyncio
import contextlib
import http
import logging
import socket
import struct
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from importlib import resources
from typing import Any
from urllib.parse import parse_qs, urlsplit

from websockets.asyncio.server import Server as SocketServer
from websockets.asyncio.server import ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.frames import CloseCode, Frame, Opcode
from websockets.http11 import Request as HttpRequest
from websockets.http11 import Response

from clpt.errors import ClptError
from clpt.view.access import LOOPBACK, Access, is_wildcard, outward_address
from clpt.view.messages import (
    COMMANDS,
    LARGEST_MESSAGE,
    PREPARING,
    CommandError,
    answering,
    as_json,
    parse,
)
from clpt.view.session import Session

log = logging.getLogger(__name__)
quiet = logging.getLogger(f"{__name__}.connections")
quiet.setLevel(logging.CRITICAL)  # what strangers send is nothing to report

MOST_VIEWERS = 8
MOST_STRANGERS = 64  # connections that have not become a viewer's; beyond, the oldest is dropped
HELLO_SECONDS = 5.0  # a connection sends its request within them
PING_SECONDS = 20.0  # between pings, and until an answer
CLOSE_SECONDS = 1.0  # the other end agrees within them that a socket is closed
MOST_FRAGMENTS = 64  # of a message
FRAME_RATE, FRAME_BURST = 240.0, 480.0  # parts of messages, pings and confirmations of a viewer
MOST_FRAMES = 2  # on their way to a viewer, who has not confirmed them
MOST_MESSAGES = 256  # that wait for a viewer
PRESENT = ("state", "status", "wheel")  # types of messages that the next of the type makes untrue
RATE, BURST = 60.0, 120.0  # messages a second of a viewer, and how many at once
SEND_SECONDS = 20.0  # after which a viewer who takes nothing is left
SOCKET = "socket"
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
}
SAFETY = {
    "Content-Security-Policy": (
        "default-src 'self'; img-src 'self' blob:; base-uri 'none'; form-action 'none'; "
        "frame-ancestors 'none'; object-src 'none'; "
        "require-trusted-types-for 'script'; trusted-types 'none'"  # no text becomes markup
    ),
    "X-Frame-Options": "DENY",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}


def page_files() -> dict[str, tuple[str, bytes]]:
    """Return the files of the page: type and content by name; no other name exists."""
    folder = resources.files("clpt.view") / "static"
    files = {}
    for file in folder.iterdir():
        kind = TYPES.get(f".{file.name.rpartition('.')[2]}")
        if kind is not None:
            files[file.name] = kind, file.read_bytes()
    files[""] = files["index.html"]
    return files


class Rate:
    """A limit on how often something happens: `rate` times a second, and `burst` at once."""

    def __init__(self, rate: float, burst: float):
        self.rate, self.burst = rate, burst
        self.left, self._at = burst, time.monotonic()

    def allows(self) -> bool:
        """Return whether once more is within the rate, and count it."""
        now = time.monotonic()
        self.left = min(self.burst, self.left + self.rate * (now - self._at)) - 1.0
        self._at = now
        return self.left >= 0.0


class Connection(ServerConnection):
    """A connection whose other end cannot let memory grow.

    The library bounds what a message holds and how many wait. It answers each ping, though nobody
    may read the answers, and keeps all parts of a message, though empty parts cost nothing to send.
    Both are counted here.

    strangers: all that are no viewer's yet, in their order; the first leaves where they are many.
    """

    def __init__(self, *args: Any, strangers: dict[Connection, None], **options: Any):
        super().__init__(*args, **options)
        self._strangers = strangers
        self._frames = Rate(FRAME_RATE, FRAME_BURST)
        self._fragments, self._refused = 0, False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self._strangers[self] = None
        if len(self._strangers) > MOST_STRANGERS:
            first = next(iter(self._strangers))
            del self._strangers[first]
            first.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        self.is_known()
        super().connection_lost(exc)

    def is_known(self) -> None:
        """Note that it is no stranger any more."""
        self._strangers.pop(self, None)

    def process_event(self, event: Any) -> None:
        if isinstance(event, Frame):
            self._fragments = self._fragments + 1 if event.opcode is Opcode.CONT else 0
            if self._fragments > MOST_FRAGMENTS or not self._frames.allows():
                self._refuse()
        if not self._refused:
            super().process_event(event)

    def _refuse(self) -> None:
        """Take nothing more, say why, and leave, whether or not the other end does."""
        if not self._refused:
            self._refused = True
            self.protocol.fail(CloseCode.POLICY_VIOLATION, "too many messages")
            self.send_data()
            self.loop.call_later(CLOSE_SECONDS, self.transport.abort)


class Viewer:
    """A socket of a page: what waits to be sent to it."""

    def __init__(self, connection: ServerConnection):
        self.connection = connection
        self.messages: deque[tuple[str, str]] = deque()  # types, and texts
        self.frame: tuple[int, bytes] | None = None  # the newest that was not sent
        self.unconfirmed: deque[int] = deque()
        self.wake = asyncio.Event()
        self.rate = Rate(RATE, BURST)

    def tell(self, message: dict[str, Any]) -> None:
        """Queue a message; a message about the present replaces a queued message of its kind."""
        kind = message["type"]
        if kind in PRESENT:
            self.messages = deque(queued for queued in self.messages if queued[0] != kind)
        self.messages.append((kind, as_json(message)))
        if len(self.messages) > MOST_MESSAGES:  # it takes nothing
            self.messages.clear()
            self.leave()
        self.wake.set()

    def leave(self) -> None:
        """End the socket at once."""
        self.connection.transport.abort()

    def offer(self, frame: int, data: bytes) -> None:
        """Queue a picture; it replaces a queued picture."""
        self.frame = frame, data
        self.wake.set()

    def confirm(self, frame: int) -> None:
        """Note that the viewer has a frame, and those before it; such a message is not counted."""
        while self.unconfirmed and self.unconfirmed[0] <= frame:
            self.unconfirmed.popleft()
            self.rate.left += 1.0
        self.wake.set()

    async def send_all(self) -> None:
        """Send what waits, until the viewer is gone."""
        try:
            while True:
                await self.wake.wait()
                self.wake.clear()
                while self.messages:
                    await self._send(self.messages.popleft()[1])
                if self.frame is not None and len(self.unconfirmed) < MOST_FRAMES:
                    (number, data), self.frame = self.frame, None
                    self.unconfirmed.append(number)
                    await self._send(data)
                    self.wake.set()
        except asyncio.TimeoutError:
            self.leave()
        except ConnectionClosed:
            pass

    async def _send(self, data: str | bytes) -> None:
        await asyncio.wait_for(self.connection.send(data), SEND_SECONDS)


class Server:
    """A server in a thread of its own; an `Outlet` of a session.

    host: where it listens; port: 0 for any that is free. Raises ClptError where it cannot listen.
    """

    def __init__(self, host: str = "127.0.0.1", port: int = 0):
        self.host = host
        self.session: Session | None = None
        self._files = page_files()
        self._strangers: dict[Connection, None] = {}
        self._viewers: list[Viewer] = []
        self._steers: Viewer | None = None
        self._last_frame: tuple[int, bytes] | None = None
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(
            target=self._main, args=(port,), name="clpt view server", daemon=True
        )
        self._listening: Future[int] = Future()
        self._thread.start()
        self.port = self._listening.result()
        self.access = Access(self.port)
        self._wildcard = is_wildcard(host)
        self.announced = outward_address(host) if self._wildcard else host
        machine = socket.gethostname().lower()
        names = (machine, f"{machine}.local") if self._wildcard else ()
        self._hosts = {self._with_port(name) for name in (self.announced, *names, *LOOPBACK)}

    @property
    def address(self) -> str:
        """An address that opens the page, once."""
        place = f"{self._with_port(self.announced)}{self.access.room}"
        return f"http://{place}?token={self.access.new_token()}"

    def _with_port(self, host: str) -> str:
        """Return a host as a request for this server names it."""
        return f"[{host}]:{self.port}" if ":" in host else f"{host}:{self.port}"

    def _is_named(self, connection: ServerConnection, name: str) -> bool:
        """Return whether a request names this server: by its name, or by the address of the
        connection, where the server listens at all addresses.
        """
        if name.lower() in self._hosts:
            return True
        came = connection.transport.get_extra_info("sockname") if self._wildcard else None
        return came is not None and name == self._with_port(came[0].removeprefix("::ffff:"))

    def close(self) -> None:
        """Leave all viewers, and listen no more."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stop.set)
            self._thread.join()

    def show(self, session: Session) -> None:
        """Let viewers see and steer a session."""
        self.session = session
        self._call(self._begin)

    # what a session calls, from its thread

    def picture(self, header: dict[str, Any], data: bytes) -> None:
        """Offer a picture to all viewers: the header's length, the header as JSON, the file."""
        text = as_json(header).encode()
        packed = struct.pack("<I", len(text)) + text + data
        self._call(self._offer, header["frame"], packed)

    def message(self, message: dict[str, Any]) -> None:
        """Tell all viewers something."""
        self._call(self._tell, message)

    def _call(self, function: Callable[..., Any], *arguments: object) -> None:
        with contextlib.suppress(RuntimeError):  # the server has ended
            self._loop.call_soon_threadsafe(function, *arguments)

    def _begin(self) -> None:
        assert self.session is not None
        self._tell(self.session.state())
        self._tell_wheel()

    def _offer(self, frame: int, data: bytes) -> None:
        self._last_frame = frame, data
        for viewer in self._viewers:
            viewer.offer(frame, data)

    def _tell(self, message: dict[str, Any]) -> None:
        for viewer in self._viewers:
            viewer.tell(message)

    # the thread

    def _main(self, port: int) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._serve(port))
        except BaseException as error:
            if not self._listening.done():
                self._listening.set_exception(error)
            else:
                log.exception("the server ended")
        finally:
            self._loop.close()

    async def _serve(self, port: int) -> None:
        self._stop = asyncio.Event()
        try:
            server: SocketServer = await serve(
                self._talk, self.host, port,
                process_request=self._answer, compression=None, max_size=LARGEST_MESSAGE,
                max_queue=16, server_header=None, logger=quiet, close_timeout=CLOSE_SECONDS,
                open_timeout=HELLO_SECONDS, ping_interval=PING_SECONDS, ping_timeout=PING_SECONDS,
                create_connection=partial(Connection, strangers=self._strangers),  # type: ignore
            )  # fmt: skip
        except OSError as error:
            reason = error.strerror or str(error)
            raise ClptError(f"cannot listen at {self.host}:{port}: {reason}") from None
        async with server:
            self._listening.set_result(server.sockets[0].getsockname()[1])
            await self._stop.wait()

    def _answer(self, connection: ServerConnection, request: HttpRequest) -> Response | None:
        """Answer a request; None lets a socket be opened."""
        try:
            return self._checked_answer(connection, request)
        except Exception:  # of headers that are given twice, of paths that are none
            return _response(http.HTTPStatus.BAD_REQUEST, "the request makes no sense")

    def _checked_answer(
        self, connection: ServerConnection, request: HttpRequest
    ) -> Response | None:
        headers, url = request.headers, urlsplit(request.path)
        if getattr(request, "method", "GET") != "GET":  # older releases read nothing else
            return _response(http.HTTPStatus.METHOD_NOT_ALLOWED, "only GET is answered")
        if not self._is_named(connection, headers.get("Host", "")):
            return _response(http.HTTPStatus.FORBIDDEN, "this server has another name")
        tokens, room = parse_qs(url.query).get("token"), self.access.room
        if url.path == room and tokens:
            cookie = self.access.exchange(tokens[0])
            if cookie is not None:
                page = self._file("")
                page.headers["Set-Cookie"] = (
                    f"{self.access.cookie_name}={cookie}; HttpOnly; SameSite=Strict; Path={room}"
                )
                return page
        if not self.access.allows(headers.get("Cookie", "")):
            text = "Open the address that clpt has printed; it opens the page once."
            return _response(http.HTTPStatus.FORBIDDEN, text)
        if not url.path.startswith(room):
            return _response(http.HTTPStatus.NOT_FOUND, "there is no such page")
        name = url.path.removeprefix(room)
        if name != SOCKET:
            return self._file(name)
        host = headers["Host"]
        if headers.get("Origin") != f"http://{host}":
            return _response(http.HTTPStatus.FORBIDDEN, "the socket is for the page alone")
        if len(self._viewers) >= MOST_VIEWERS:
            return _response(http.HTTPStatus.SERVICE_UNAVAILABLE, "there are too many viewers")
        return None

    def _file(self, name: str) -> Response:
        if name not in self._files:
            return _response(http.HTTPStatus.NOT_FOUND, "there is no such page")
        kind, content = self._files[name]
        return _response(http.HTTPStatus.OK, content, kind)

    async def _talk(self, connection: ServerConnection) -> None:
        assert isinstance(connection, Connection)
        connection.is_known()
        if len(self._viewers) >= MOST_VIEWERS:  # several may have asked at once
            await connection.close(1013, "there are too many viewers")
            return
        viewer = Viewer(connection)
        self._viewers.append(viewer)
        if self._steers is None:
            self._steers = viewer
        sender = asyncio.ensure_future(viewer.send_all())
        try:
            self._welcome(viewer)
            async for message in connection:
                if not viewer.rate.allows():
                    await connection.close(1008, "too many messages")
                    break
                self._obey(viewer, message)
        except ConnectionClosed:
            pass
        finally:
            sender.cancel()
            self._viewers.remove(viewer)
            if self._steers is viewer:
                self._steers = self._viewers[0] if self._viewers else None
            self._tell_wheel()
            await asyncio.wait([sender], timeout=CLOSE_SECONDS)  # else it may be collected first

    def _welcome(self, viewer: Viewer) -> None:
        if self.session is not None:
            viewer.tell(self.session.state())
            viewer.tell(self.session.status())
        else:
            viewer.tell(PREPARING)
        if self._last_frame is not None:
            viewer.offer(*self._last_frame)
        self._tell_wheel()

    def _tell_wheel(self) -> None:
        """Tell each viewer who steers; tell the session how many watch."""
        for viewer in self._viewers:
            steers = viewer is self._steers
            viewer.tell({"type": "wheel", "steers": steers, "viewers": len(self._viewers)})
        if self.session is not None:
            self.session.watched(len(self._viewers))

    def _obey(self, viewer: Viewer, message: str | bytes) -> None:
        """Do what a message asks for, or say why not."""
        with answering(viewer.tell):
            request = parse(message)
            if COMMANDS[request.name].steers and viewer is not self._steers:
                raise CommandError("another viewer steers")
            if request.name == "shown":
                viewer.confirm(request.values["frame"])
            elif request.name == "steer":
                self._steers = viewer
                self._tell_wheel()
            elif request.name == "invite":
                viewer.tell({"type": "invitation", "address": self.address})
            elif self.session is not None:
                self.session.post(request, lambda reply: self._call(viewer.tell, reply))
            else:
                raise CommandError("the scene is not ready yet")


def _response(status: http.HTTPStatus, body: str | bytes, kind: str = "") -> Response:
    content = body.encode() if isinstance(body, str) else body
    headers = Headers(
        {
            **SAFETY,
            "Content-Type": kind or "text/plain; charset=utf-8",
            "Content-Length": str(len(content)),
            "Connection": "close",
        }
    )
    return Response(status.value, status.phrase, headers, content)
