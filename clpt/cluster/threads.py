"""Threads that the main thread starts and awaits, safe against Ctrl-C at any line."""

from __future__ import annotations

import _thread
import threading
from collections.abc import Callable
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import Any

TICK = 0.05  # seconds between two polls for changes without notice


class Threads:
    """Threads that work together until `over` is set.

    The main thread may be interrupted between starting a thread and noting it. So threads register
    themselves, and a thread that starts too late does nothing.
    """

    def __init__(self) -> None:
        # Ctrl-C may interrupt the main thread inside a Condition, which threading.Thread.start
        # uses, and leave it locked for ever or released twice. The interpreter's built-in locks,
        # queues and threads have no such moment.
        self._lock = threading.RLock()
        self._news: SimpleQueue[None] = SimpleQueue()
        self._at_work = 0
        self.over = False

    def start(self, action: Callable[[], Any]) -> None:
        """Run an action in a new thread."""

        def work() -> None:
            with self._lock:
                if self.over:
                    return
                self._at_work += 1
            try:
                action()
            finally:
                with self._lock:
                    self._at_work -= 1
                self.tell()

        _thread.start_new_thread(work, ())

    def tell(self) -> None:
        """Wake up a waiting thread."""
        self._news.put(None)

    def wait(self) -> None:
        """Wait for news, at most TICK."""
        with suppress(Empty):
            self._news.get(timeout=TICK)

    def end(self) -> None:
        """Set `over` and wait for the threads."""
        with self._lock:
            self.over = True
        while self._at_work:
            self.wait()


def on_all(action: Callable[[Any], Any], items: list[Any]) -> list[Any]:
    """Run an action for all items in parallel; return results, exceptions for failed items.

    All threads have ended when this returns or raises.
    """
    results: dict[int, Any] = {}

    def do(i: int) -> None:
        try:
            results[i] = action(items[i])
        except BaseException as error:
            results[i] = error

    threads = Threads()
    try:
        for i in range(len(items)):
            threads.start(lambda i=i: do(i))  # type: ignore[misc]
        while len(results) < len(items):
            threads.wait()
    finally:
        threads.end()
    return [results[i] for i in range(len(items))]
