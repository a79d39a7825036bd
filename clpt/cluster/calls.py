"""Functions that are run at workers, in the event loop of Dask's client."""

from __future__ import annotations

import asyncio
import concurrent.futures
import secrets
import time
from collections.abc import Callable, Collection, Coroutine
from typing import TYPE_CHECKING, Any

from clpt.cluster import tasks

if TYPE_CHECKING:
    from distributed import Client

MOST_HELD = 4  # films that come in at a time; further ones stay at their workers

Call = concurrent.futures.Future[tasks.Reply]


class Calls:
    """Calls of a run to its workers.

    priority: among other renders of the same cluster. film_seconds: in which a film comes in,
    beside others.
    """

    def __init__(self, client: Client, priority: Callable[[], float]):
        self.client, self.film_seconds = client, 0.0
        self._priority, self._gathering = priority, asyncio.Semaphore(MOST_HELD)

    def begin(self, call: Coroutine[Any, Any, Any]) -> concurrent.futures.Future[Any]:
        """Let Dask's event loop do something. From any thread."""
        return asyncio.run_coroutine_threadsafe(call, self.client.loop.asyncio_loop)

    def hang_up(self, address: str) -> None:
        """Wait no longer for what a worker sends that is gone: it may be stopped, and silent."""
        self.client.loop.add_callback(self.client.rpc.remove, address)

    async def at(
        self, addresses: Collection[str], function: Callable[..., Any], *arguments: object
    ) -> tasks.Reply:
        """Run a function at one of some workers and return what it returns, or an "error"."""
        from distributed import KilledWorker

        before = 0.0 if function is tasks.render_block else 0.5  # what gets workers ready
        future = self.client.submit(
            function, *arguments, key=f"clpt-{function.__name__}-{secrets.token_hex(8)}",
            workers=[*addresses], priority=self._priority() + before,
        )  # fmt: skip
        getting: asyncio.Future[Any] | None = None
        try:
            await future._state.wait()
            async with self._gathering:
                began = time.monotonic()
                # Dask gathers for several calls at once: to cancel one would cancel all of them.
                getting = asyncio.ensure_future(self.client.gather(future, direct=True))
                reply = await asyncio.shield(getting)
                if function is tasks.render_block:
                    self.film_seconds = (time.monotonic() - began) / MOST_HELD
        except asyncio.CancelledError as error:
            if future.status != "cancelled":  # it is this call that is not wanted any more
                raise
            return {"error": f"the scheduler cancelled a task {error}"}
        except Exception as error:
            first = next(iter(str(error).splitlines()), "")
            killed = isinstance(error, KilledWorker)
            return {"error": f"{type(error).__name__}: {first}", "killed": killed}
        finally:
            future.release()
            if getting is not None:
                getting.add_done_callback(_outcome)
        return reply if isinstance(reply, dict) else {"error": "it sent no reply that can be read"}


def reply_of(call: Call) -> tasks.Reply:
    """Return what a call has come to that is done."""
    return {"error": "it was cancelled"} if call.cancelled() else call.result()


def _outcome(done: asyncio.Future[Any]) -> BaseException | None:
    """Return what a call has raised that nobody waits for: else asyncio logs it."""
    return None if done.cancelled() else done.exception()
