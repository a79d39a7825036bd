# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders for Blender: python worker.py PORT, with the connection's key at stdin."""

from __future__ import annotations

import json
import os
import sys
import threading
from contextlib import suppress
from multiprocessing.connection import Client, Connection
from queue import Empty, SimpleQueue
from typing import Any

IDLE = 300.0  # [s] without work, after which the process ends


class Link:
    """The connection to Blender. All that Blender sends is taken at once, so it never waits."""

    def __init__(self, connection: Connection):
        self.connection = connection
        self.inbox: SimpleQueue[dict[str, Any]] = SimpleQueue()
        self.is_seen = True  # whether Blender has taken the last picture of a viewport
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        """Take messages. When Blender closes the connection, this process ends."""
        try:
            while True:
                message = json.loads(self.connection.recv_bytes())
                if "seen" in message:
                    self.is_seen = True
                else:
                    self.inbox.put(message)
        except (EOFError, OSError):
            os._exit(0)

    def send(self, message: dict[str, Any], *pictures: Any) -> None:
        """Send a message, and arrays after it."""
        message["pictures"] = len(pictures)
        try:
            self.connection.send_bytes(json.dumps(message).encode())
            for picture in pictures:
                self.connection.send_bytes(picture.data.cast("B"))
        except OSError:
            os._exit(0)


def load() -> None:
    """Load clpt, while Blender reads its scene or nobody wants a picture yet."""
    with suppress(Exception):  # told when it is used
        import rendering  # noqa: F401


def main() -> None:
    """Answer messages until Blender closes the connection."""
    key = sys.stdin.buffer.read()
    threading.Thread(target=load, daemon=True).start()
    limit = threading.Timer(IDLE, os._exit, (0,))
    limit.daemon = True
    limit.start()
    try:
        connection = Client(("127.0.0.1", int(sys.argv[1])), authkey=key)
    except (OSError, EOFError):  # Blender has ended
        os._exit(0)
    limit.cancel()
    link = Link(connection)
    while True:
        try:
            message = link.inbox.get(timeout=IDLE)
        except Empty:
            return
        try:
            import rendering

            rendering.answer(link, message)
        except Exception as error:  # whatever happens, Blender is told
            lines = str(error).splitlines() or [""]
            link.send({"error": f"{type(error).__name__}: {lines[0]}"})


if __name__ == "__main__":
    main()
