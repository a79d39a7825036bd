"""The workers of a cluster: runs in which they take samples, and what is known of them."""

from __future__ import annotations

import asyncio
import queue
import time
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING

from clpt.cluster.blocks import Blocks
from clpt.cluster.feeding import Chosen, Feeder, Film, Job
from clpt.render.wavefront.film_state import Ranges
from clpt.render.wavefront.tracer import Selection
from clpt.scene.fingerprint import Plain

if TYPE_CHECKING:
    from distributed import Client

TICK = 0.2  # seconds, at most, between two calls of `tick`
FIRST_SECONDS, MOST_SECONDS = 2.0, 30.0  # that a block takes, at first and after some minutes
LEAST_SECONDS = 0.3  # of the last blocks, beside which the way to a worker is short
SHARE = 0.1  # of the time so far that a block takes, between these
CLIENT_SHARE = 0.5  # of the time, at most, in which this client gets and adds films


def set_lengths(blocks: Blocks, elapsed: float, film_seconds: float) -> None:
    """Set how long blocks should take, `elapsed` [s] after the beginning.

    film_seconds: in which a film comes in and is added. With many workers blocks are long enough
    that all of their films take at most CLIENT_SHARE of the time, and at the end not so short that
    workers wait for each other's films.
    """
    all_films = len(blocks.workers) * film_seconds
    usual = min(max(FIRST_SECONDS, SHARE * elapsed), MOST_SECONDS)
    blocks.seconds = max(usual, all_films / CLIENT_SHARE)
    blocks.least_seconds = max(LEAST_SECONDS, all_films)


class Farm:
    """The workers of a cluster: what is known of them stays from one run to the next.

    client, mixed, check_every, patience: see `ClusterRenderer`. waits: whether other renders need
    the workers now. blocks: of the present run, or of the last one; classes: of devices that take
    part, by what they are called; chosen: which class may; seconds: in which it rendered.
    """

    def __init__(self, client: Client, *, mixed: bool, check_every: int, patience: float):
        self.client, self.mixed = client, mixed
        self.check_every, self.patience = check_every, patience
        self.waits: Callable[[], bool] = lambda: False
        self.blocks = Blocks(0)
        self.classes: dict[str, dict[str, Plain]] = {}
        self.seconds = 0.0
        self.chosen = Chosen()
        self._add_seconds = 0.0
        self._cut = False  # whether a film of this run was stopped before its end

    def run(
        self, job: Job, selection: Selection, pixels: int, samples: tuple[int, int], taken: Ranges,
        add: Callable[[Film], None], tick: Callable[[], bool],
    ) -> bool:  # fmt: skip
        """Let workers take samples of a selection; return whether all were taken.

        pixels: of the picture; samples: first and end, of which `taken` are there already. add: is
        called with each film, at a stop with films that were cut too; tick: all the while; if it
        returns False the workers stop soon.

        Raises ClusterError when the scheduler is gone, no worker is left or fit, or a block fails
        again and again.
        """
        self._cut, (first, end) = False, samples
        share = selection.pixels / pixels
        self.blocks = Blocks(
            end, taken, seconds=FIRST_SECONDS, check_every=self.check_every, first=first,
            share=share, before=self.blocks,
        )  # fmt: skip
        films: queue.Queue[Film | None] = queue.Queue()
        feeder = Feeder(
            self.client, self.blocks, job, selection, films=films, mixed=self.mixed,
            patience=self.patience, chosen=self.chosen, waits=self.waits,
        )  # fmt: skip
        driven = asyncio.run_coroutine_threadsafe(feeder.run(), feeder.loop)
        began = self.seconds, time.perf_counter()
        try:
            self._collect(films, feeder, began, add, tick)
        finally:
            feeder.stop()
            while (film := films.get()) is not None:  # what is still on its way
                self._add(film, add)
            self._note(feeder, began)
        driven.result()
        return self.blocks.complete and not self._cut

    def _collect(
        self, films: queue.Queue[Film | None], feeder: Feeder, began: tuple[float, float],
        add: Callable[[Film], None], tick: Callable[[], bool],
    ) -> None:  # fmt: skip
        """Add films as they come, until the feeder ends."""
        while True:
            with suppress(queue.Empty):
                film = films.get(timeout=TICK)
                if film is None:
                    films.put(None)  # for the one who waits for the end
                    return
                self._add(film, add)
            self._note(feeder, began)
            film_seconds = max(self._add_seconds, feeder.film_seconds)
            set_lengths(self.blocks, self.seconds, film_seconds)
            if not tick():
                feeder.stop()

    def _add(self, film: Film, add: Callable[[Film], None]) -> None:
        began = time.perf_counter()
        add(film)
        self._cut |= not film.whole
        self._add_seconds = time.perf_counter() - began

    def _note(self, feeder: Feeder, began: tuple[float, float]) -> None:
        """Keep what the feeder has found out of the workers, and count seconds."""
        self.classes.update(feeder.classes)
        self.seconds = began[0] + time.perf_counter() - began[1]
