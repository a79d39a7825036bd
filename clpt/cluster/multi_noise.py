"""Adaptive sampling on several devices: the first one decides, and all take the samples."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from numpy.typing import NDArray

from clpt.cluster.crew import Crew, LostPicture
from clpt.cluster.device_worker import DeviceWorker
from clpt.errors import SceneError
from clpt.render.wavefront.adaptive import Adaptive
from clpt.render.wavefront.film_state import FilmState
from clpt.render.wavefront.tracer import OnBatch, Selection, Tracer
from clpt.render.wavefront.wavefront import Wavefront

Call = tuple[int, int, float | None]  # of `run`: first, end and noise, None for all pixels


class AdaptiveCrew:
    """Adaptive sampling on the first device of a crew, with the help of the others.

    What the first device has of it cannot be done by others alone: when it fails, all begins again
    on the next one, which takes the same samples and comes to the same decisions.

    base: the film before; first_sample: the number of the first sample of an empty one; arrays: the
    state then, see `Adaptive.arrays`, empty at the beginning.
    """

    def __init__(
        self, crew: Crew, base: FilmState, first_sample: int, arrays: Mapping[str, NDArray[Any]]
    ):
        self.crew, self.base = crew, base
        self._first, self._arrays = first_sample, arrays
        self._calls: list[Call] = []  # since
        self.adaptive = self._begun()

    def run(self, call: Call, tick: Callable[[], bool]) -> bool:
        """Add samples to the pixels with noise, or to all; return whether it was not stopped."""
        while True:
            try:
                if not self._restart_if_lost(tick):
                    return False
                finished = self._call(call, tick)
                break
            except LostPicture:
                continue
        self._calls.append(call)
        return finished

    def shown(self) -> DeviceWorker:
        """Let the film of the first device hold the picture; return that device."""
        while True:
            try:
                self._restart_if_lost(lambda: True)
                self.gather()
                return self.crew.first
            except LostPicture:
                continue

    def gather(self) -> None:
        """Add what other devices hold to the film of the first. Raises LostPicture."""
        crew = self.crew
        while True:
            helpers = [w for w in crew.workers if w.unsaved and w is not crew.keeper]
            if not helpers and not crew.lost:
                break
            for worker in helpers:
                held = list(worker.unsaved)
                try:
                    state = worker.take()
                except Exception as error:
                    worker.unsaved = held
                    crew.drop(worker, error)
                    continue
                self._add_to_first(state)
            if crew.lost and not crew.repeat(lambda: True):
                crew.lost.clear()
        crew.first.unsaved.clear()

    def _begun(self) -> Adaptive:
        """Begin on the first device."""
        crew = self.crew
        while True:
            crew.empty(crew.workers)
            first = crew.first
            try:
                first.show(self.base)
                renderer = first.renderer
                tracer = _AdaptiveTracer(renderer._wavefront, self)
                begun = renderer._adaptively(tracer, renderer.denoise, self._arrays)
                break
            except Exception as error:
                crew.drop(first, error)
        if not self._arrays:
            begun.skip(self.base.taken[-1][1] if self.base.taken else self._first)
        crew.keeper = first
        return begun

    def _restart_if_lost(self, tick: Callable[[], bool]) -> bool:
        """Begin again where the first device has failed; return whether it was not stopped."""
        crew = self.crew
        if crew.keeper in crew.workers:
            return True
        crew.lost.clear()
        crew.keeper = None
        self.adaptive = self._begun()
        return all(self._call(call, tick) for call in self._calls)

    def _call(self, call: Call, tick: Callable[[], bool]) -> bool:
        """Add the samples of one call of `run`; return whether it was not stopped.

        Raises LostPicture when the first device fails.
        """
        first, end, noise = call
        crew = self.crew
        keeper = crew.first
        try:
            if noise is not None:
                return self.adaptive.run(end, noise, lambda _: tick())
            finished = crew.run(crew.whole, ((first, end),), tick)
            if finished:
                self.adaptive.skip(end)
            return finished
        except (LostPicture, SceneError):
            raise
        except Exception as error:
            if not crew.workers:
                raise
            crew.drop(keeper, error)
            raise LostPicture from error

    def _add_to_first(self, state: FilmState) -> None:
        """Add a film to that of the first device. Raises LostPicture."""
        keeper = self.crew.first
        try:
            keeper.show(keeper.renderer.film_state().plus(state))
        except Exception as error:
            self.crew.drop(keeper, error)
            raise LostPicture from error


class CrewTracer(Tracer):
    """Adds samples to the films of all devices."""

    def __init__(self, wavefront: Wavefront, crew: Crew):
        super().__init__(wavefront)
        self.crew = crew

    def add(self, selection: Selection, first: int, end: int, on_batch: OnBatch) -> bool:
        """Add samples first to end - 1 of a selection; return whether it was not stopped."""
        return self.crew.run(selection, ((first, end),), lambda: on_batch(None))

    def use_all_pixels(self) -> None:
        """Let later renders sample every pixel."""
        self.crew.use_all_pixels()


class _AdaptiveTracer(CrewTracer):
    """Adds samples with the help of all devices to the film of the first."""

    def __init__(self, wavefront: Wavefront, noise: AdaptiveCrew):
        super().__init__(wavefront, noise.crew)
        self.noise = noise

    def gather(self) -> None:
        """Let the film hold all that was added so far."""
        self.noise.gather()

    def discard(self) -> None:
        """Forget what was added since `gather`."""
        crew = self.crew
        crew.lost.clear()
        crew.empty(w for w in crew.workers if w.unsaved and w is not crew.keeper)
        for worker in crew.workers:
            worker.unsaved = []
