"""Threads that the main thread starts and waits for, though Ctrl-C may come at any line of it."""

from __future__ import annotations

import _thread
import threading
from collections.abc import Callable
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import Any

TICK = 0.05  # seconds between two looks at what may have changed untold


class Threads:
    """Threads that work together until they are over.

    Who starts a thread may be interrupted before it knows of it. So the threads themselves say that
    they have begun, and one that begins too late does nothing.

    over: whether they are to end.
    """

    def __init__(self) -> None:
        # Ctrl-C may come while the main thread uses a Condition, as threading.Thread does when it
        # starts, and leaves it taken for ever or given back twice. What the interpreter itself has
        # of locks, queues and threads knows no such moment.
        self._lock = threading.RLock()
        self._news: SimpleQueue[None] = SimpleQueue()
        self._at_work = 0
        self.over = False

    def start(self, action: Callable[[], Any]) -> None:
        """Do something in a thread of its own."""

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
        """Wake up who waits for news."""
        self._news.put(None)

    def wait(self) -> None:
        """Wait for news, but not for long."""
        with suppress(Empty):
            self._news.get(timeout=TICK)

    def end(self) -> None:
        """Let the threads know that they are over, and wait for them."""
        with self._lock:
            self.over = True
        while self._at_work:
            self.wait()


def on_all(action: Callable[[Any], Any], items: list[Any]) -> list[Any]:
    """Do something with every item at once, in threads; return the results or what was raised.

    None is at work any more when this ends, however it does.
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
