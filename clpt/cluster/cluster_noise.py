"""Adaptive sampling over a cluster: this machine decides, and workers take the samples."""

from __future__ import annotations

from collections.abc import Callable

from clpt.render.renderer import Renderer
from clpt.render.wavefront.film_state import FilmState
from clpt.render.wavefront.tracer import OnBatch, Selection, Tracer

Take = Callable[[Selection, int, int, Callable[[FilmState], None], OnBatch], bool]


class FarmTracer(Tracer):
    """Adds the films of workers to that of a renderer on this machine.

    take: lets workers take samples of a selection, from the first to the end; it calls its fourth
    argument with each film, the fifth all the while, and returns whether it was not stopped.
    """

    def __init__(self, local: Renderer, take: Take):
        super().__init__(local._wavefront)
        self._local, self._take = local, take
        self._added: FilmState | None = None  # since `gather`

    def add(self, selection: Selection, first: int, end: int, on_batch: OnBatch) -> bool:
        """Add samples first to end - 1 of a selection; return whether it was not stopped."""
        return self._take(selection, first, end, self._note, on_batch)

    def gather(self) -> None:
        """Let the film hold all that was added so far."""
        if self._added is not None:
            self._local._set_words(self._local.film_state().plus(self._added))
            self._added = None

    def discard(self) -> None:
        """Forget what was added since `gather`."""
        self._added = None

    def use_all_pixels(self) -> None:
        """Let later renders sample every pixel: here there are none."""

    def _note(self, film: FilmState) -> None:
        self._added = film if self._added is None else self._added.plus(film)
