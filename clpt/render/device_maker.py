"""A device that takes the samples of a film in its own memory."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import pyopencl as cl

from clpt import device as dev
from clpt.errors import DeviceError, MemoryBudgetError
from clpt.render.contents import Contents
from clpt.render.device_film import Apply, Changes, DeviceFilm
from clpt.render.maker import Call, Discarded, Held, Maker, Settle
from clpt.render.wavefront.adaptive import Adaptive
from clpt.render.wavefront.film_state import FilmState, Ranges
from clpt.render.wavefront.tracer import Tracer
from clpt.render.wavefront.wavefront import Counts
from clpt.scene import Scene
from clpt.scene.fingerprint import Plain


class DeviceMaker(Maker):
    """Takes samples on a device; home: their film."""

    shows_meanwhile = True

    def __init__(self, home: DeviceFilm):
        self._home, self.denoise, self.start = home, home.denoise, home.start
        self._discards = False

    @property
    def scene(self) -> Scene:
        """The scene that is rendered."""
        return self._home.scene

    @property
    def warnings(self) -> list[str]:
        """Warnings of the scene as it was lowered."""
        return self._home.warnings

    @property
    def home(self) -> DeviceFilm:
        """The film on the device."""
        return self._home

    @property
    def devices(self) -> tuple[dev.Device, ...]:
        """The device alone."""
        return (self._home.device,)

    @property
    def counts(self) -> Counts:
        """Counts of samples and rays so far, and of those that the film refused."""
        return self._home.wavefront.counts

    @property
    def classes(self) -> tuple[Mapping[str, Plain], ...]:
        """The class of the device."""
        return (self._home.device_class(),)

    # ---- samples

    def after(self, events: dev.Events) -> None:
        """Let commands that follow come after events of the caller."""
        self._home.wavefront.stream.after(events)

    @property
    def last(self) -> cl.Event:
        """The event of the last command."""
        return self._home.wavefront.stream.last

    def prepare(self) -> None:
        """Run every kernel of `run` once with nothing to do, and wait."""
        self._home.wavefront.render_samples(0, 0)

    def begin(self, call: Call, now: Contents, more: Contents) -> Settle:
        """Return what makes the film whole; see `Maker`.

        After an error at any line the film holds `more`, though some pixels may lack some of these
        samples, or `now` if none has begun. An error of the device makes nothing whole.
        """
        wavefront = self._home.wavefront
        wavefront.begun = False

        def settle(error: BaseException | None) -> Contents:
            begun = wavefront.begun
            if error is None:
                return more
            if isinstance(error, DeviceError) and not isinstance(error, MemoryBudgetError):
                if begun:
                    raise error
                return now
            wavefront.finish()
            if more.adaptive is not None:
                more.adaptive.finish()
                if call.noise is None and begun and call.end > call.first:
                    more.adaptive.skip(call.end)
            wavefront.refresh()
            return more if begun else now

        return settle

    def run(self, call: Call, adaptive: Adaptive | None, tick: Callable[[], bool]) -> bool:
        """Add samples to the film; return whether all were added. Raises Discarded."""

        def on_batch(_: object) -> bool:
            goes_on = tick()
            if not goes_on and self._discards:
                raise Discarded
            return goes_on

        wavefront = self._home.wavefront
        wavefront.leave.lower()  # that a `leave` raised which came too late for another call
        if call.noise is not None and adaptive is not None:
            return adaptive.run(call.end, call.noise, on_batch)
        finished = wavefront.render_samples(call.first, call.end, on_batch)
        if adaptive is not None:
            adaptive.skip(call.end)  # after a stop too: numbers are not used again
        return finished

    def enqueue(self, call: Call, adaptive: Adaptive | None) -> None:
        """Enqueue that all pixels get samples; wait for nothing."""
        wavefront = self._home.wavefront
        wavefront.enqueue(call.first, call.end)
        wavefront.stream.flush()
        if adaptive is not None:
            adaptive.skip(call.end)

    def leave(self) -> None:
        """Let a call that is told to stop leave paths in flight as they are."""
        if self._home.is_open:  # who sees the flag finds the reason soon
            self._home.wavefront.leave.raise_()
            self._discards = True

    def rest(self) -> None:
        """Note that no call is under way."""
        self._discards = False

    def tracer(self) -> Tracer:
        """Return what adds selections of samples to the film."""
        return Tracer(self._home.wavefront)

    # ---- the film

    def words(self, *names: str) -> FilmState:
        """Return the film on the host; names: of the arrays that are wanted, by default all."""
        return self._home.words(*names)

    def put(self, state: FilmState, counts: Counts | None = None) -> None:
        """Enqueue that the film is another one."""
        if counts is not None:
            self._home.wavefront.counts = counts
        self._home.put(state)

    def shown(self) -> DeviceFilm:
        """Return the film on the device."""
        return self._home

    def hold(self, taken: Ranges) -> Held:
        """Keep a copy of the film on the device, one at a time. Raises MemoryBudgetError."""
        self._home.hold()
        return Held(partial(self._home.words, held=True, taken=taken), self.counts, taken)

    def empty(self, *, seed: int | None = None, recover: bool = False) -> None:
        """Enqueue that the film is empty; recover: from an error at any line."""
        self._home.empty(seed=seed, recover=recover)

    def update(self, changes: Changes, events: dev.Events, apply: Apply) -> None:
        """Render another scene from now on."""
        self._home.update(changes, events, apply)

    def close(self) -> None:
        """Give the device's memory back."""
        self._home.close()
