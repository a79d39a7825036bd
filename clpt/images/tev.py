"""Pictures for tev and HDRView while they are rendered: a client of their protocol.

A packet is its length in bytes, itself included, as uint32, a type as uint8, and a payload, all
little endian; strings end with a zero (the viewer tev, "IPC"; HDRView speaks the same). Viewers
listen on 127.0.0.1:14158 and have no login.
"""

from __future__ import annotations

import logging
import socket
import struct
import threading
import time
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from clpt.choices import VIEWER
from clpt.errors import ClptError

log = logging.getLogger(__name__)

HOST, PORT = VIEWER, 14158
CREATE, UPDATE = 4, 6  # types of packets; the second is the form with offsets and strides
PACKET = 64 << 20  # bytes of pixels in a packet, at most
TIMEOUT = 5.0  # [s] that a viewer may take for anything
RETRY = 5.0  # [s] until a viewer that is lost is sought again

Layers = Mapping[str, NDArray[np.float32]]


class TevError(ClptError, OSError):
    """A viewer that cannot be reached."""


def address(text: str) -> tuple[str, int]:
    """Return host and port of HOST, HOST:PORT or :PORT. Raises ValueError."""
    host, _, port = text.rpartition(":") if ":" in text else (text, "", "")
    number = int(port) if port else PORT
    if not 0 < number < 65536:
        raise ValueError(f"{number} is no port")
    return host or HOST, number


def create(name: str, width: int, height: int, channels: list[str]) -> bytes:
    """Return the packet that makes an image, or empties the image of that name."""
    names = b"".join(_text(channel) for channel in channels)
    return _packet(
        CREATE, b"\1" + _text(name) + struct.pack("<iii", width, height, len(channels)) + names
    )


def update(name: str, channels: list[str], y: int, rows: NDArray[np.float32]) -> bytes:
    """The packet of rows (n, w, channels) float32 from row y on, a pixel's channels together."""
    height, width, count = rows.shape
    names = b"".join(_text(channel) for channel in channels)
    head = b"\0" + _text(name) + struct.pack("<i", count) + names
    place = struct.pack("<iiii", 0, y, width, height)
    steps = np.concatenate([np.arange(count), np.full(count, count)]).astype("<i8").tobytes()
    return _packet(UPDATE, head + place + steps + np.ascontiguousarray(rows, "<f4").tobytes())


class Viewer:
    """Sends pictures to a viewer in a thread of its own; a lost viewer stops nothing.

    name: of the image there; tell: called with a line when the viewer is lost, and found again.
    Raises TevError where there is none at first.
    """

    def __init__(self, name: str, host: str = HOST, port: int = PORT, tell: Callable = log.info):
        self.name, self.host, self.port, self._tell = name, host, port, tell
        self._channels: list[str] = []  # of the image that the viewer has
        self._wanted: NDArray[np.float32] | None = None
        self._names: list[str] = []
        self._changed, self._closing = threading.Condition(), False
        self._lost_at = -RETRY
        try:
            self._socket: socket.socket | None = self._connected()
        except OSError as error:
            where = f"{host}:{port}"
            message = f"there is no viewer at {where} ({error}); start tev or HDRView first"
            raise TevError(message) from error
        self._thread = threading.Thread(target=self._send_all, name="clpt-tev", daemon=True)
        self._thread.start()

    def show(self, layers: Layers) -> None:
        """Show channels (h, w) by name. Waits for nothing; only the newest picture is sent."""
        with self._changed:
            self._names = list(layers)
            self._wanted = np.stack([np.asarray(c, np.float32) for c in layers.values()], axis=2)
            self._changed.notify()

    def close(self) -> None:
        """Send the last picture and leave; it stays in the viewer. Takes TIMEOUT at most."""
        with self._changed:
            self._closing = True
            self._changed.notify()
        self._thread.join(2 * TIMEOUT)
        if self._socket is not None:
            self._socket.close()

    def _connected(self) -> socket.socket:
        connection = socket.create_connection((self.host, self.port), TIMEOUT)
        connection.settimeout(TIMEOUT)
        return connection

    def _send_all(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._wanted is not None or self._closing)
                picture, names, self._wanted = self._wanted, self._names, None
                if picture is None:
                    return
            try:
                self._send(picture, names)
            except OSError as error:
                self._lose(error)

    def _send(self, picture: NDArray[np.float32], names: list[str]) -> None:
        if self._socket is None:
            if time.monotonic() - self._lost_at < RETRY:
                return
            self._socket = self._connected()
            self._tell(f"clpt: the viewer at {self.host}:{self.port} is there again")
        height, width, count = picture.shape
        if names != self._channels:
            self._socket.sendall(create(self.name, width, height, names))
            self._channels = names
        rows = max(PACKET // (4 * width * count), 1)
        for y in range(0, height, rows):
            self._socket.sendall(update(self.name, names, y, picture[y : y + rows]))

    def _lose(self, error: OSError) -> None:
        if self._socket is not None:
            self._socket.close()
            self._tell(f"clpt: warning: the viewer at {self.host}:{self.port} is lost: {error}")
        self._socket, self._channels, self._lost_at = None, [], time.monotonic()


def _text(text: str) -> bytes:
    return text.encode().replace(b"\0", b"") + b"\0"


def _packet(kind: int, payload: bytes) -> bytes:
    return struct.pack("<IB", len(payload) + 5, kind) + payload
