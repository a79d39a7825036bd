"""Calls of workers' functions, in the event loop of Dask's client."""

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

MOST_HELD = 4  # films that are received at a time; others wait at their workers

Call = concurrent.futures.Future[tasks.Reply]


class Calls:
    """Calls of a run to its workers.

    priority: among other renders of the same cluster. film_seconds: mean time to receive a film.
    """

    def __init__(self, client: Client, priority: Callable[[], float]):
        self.client, self.film_seconds = client, 0.0
        self._priority, self._gathering = priority, asyncio.Semaphore(MOST_HELD)

    def begin(self, call: Coroutine[Any, Any, Any]) -> concurrent.futures.Future[Any]:
        """Run a coroutine in Dask's event loop, from any thread."""
        return asyncio.run_coroutine_threadsafe(call, self.client.loop.asyncio_loop)

    def hang_up(self, address: str) -> None:
        """Stop waiting for a lost worker's answers: a stopped process stays silent."""
        self.client.loop.add_callback(self.client.rpc.remove, address)

    async def at(
        self, addresses: Collection[str], function: Callable[..., Any], *arguments: object
    ) -> tasks.Reply:
        """Run a function at a worker of `addresses`; return its reply, or an "error"."""
        from distributed import KilledWorker

        before = 0.0 if function is tasks.render_block else 0.5  # preparation goes first
        future = self.client.submit(
            function, *arguments, key=f"clpt-{function.__name__}-{secrets.token_hex(8)}",
            workers=[*addresses], priority=self._priority() + before,
        )  # fmt: skip
        getting: asyncio.Future[Any] | None = None
        try:
            await future._state.wait()
            async with self._gathering:
                began = time.monotonic()
                # Dask gathers for several calls at once: a cancelled call would cancel the others.
                getting = asyncio.ensure_future(self.client.gather(future, direct=True))
                reply = await asyncio.shield(getting)
                if function is tasks.render_block:
                    self.film_seconds = (time.monotonic() - began) / MOST_HELD
        except asyncio.CancelledError as error:
            if future.status != "cancelled":  # the client cancelled this call
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
    """Return the reply of a finished call."""
    return {"error": "it was cancelled"} if call.cancelled() else call.result()


def _outcome(done: asyncio.Future[Any]) -> BaseException | None:
    """Read the exception of an abandoned call, which asyncio logs otherwise."""
    return None if done.cancelled() else done.exception()
