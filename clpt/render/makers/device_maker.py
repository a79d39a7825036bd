"""The maker that takes samples on a device, into a film in its memory."""

from __future__ import annotations

from functools import partial

from clpt.errors import DeviceError, MemoryBudgetError
from clpt.render.film.state import FilmState, Ranges
from clpt.render.makers.contents import Contents, Settle
from clpt.render.makers.device_film import DeviceFilm
from clpt.render.makers.maker import Call, Discarded, Held, Maker, Tick
from clpt.render.wavefront.adaptive import Adaptive
from clpt.render.wavefront.wavefront import Counts


class DeviceMaker(Maker):
    """Takes samples on a device; home: their film."""

    shows_meanwhile = True

    def __init__(self, home: DeviceFilm):
        self._home, self.start = home, home.start
        self._discards = False

    @property
    def home(self) -> DeviceFilm:
        """The film on the device."""
        return self._home

    # ---- samples

    def begin(self, call: Call, now: Contents, more: Contents) -> Settle:
        """Return the function that ends a call; see `Maker`.

        After an error at any line the film has the contents `more`, although some pixels may lack
        some of the samples, or `now` if no sample has begun. After an error of the device the
        function raises that error if samples have begun.
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

    def run(self, call: Call, adaptive: Adaptive | None, tick: Tick) -> bool:
        """Add samples to the film; return whether all were added. Raises Discarded."""

        def on_batch(_: object) -> bool:
            goes_on = tick()
            if not goes_on and self._discards:
                raise Discarded
            return goes_on

        wavefront = self._home.wavefront
        wavefront.leave.lower()  # a late `leave` for a former call may have raised it
        if call.noise is not None and adaptive is not None:
            return adaptive.run(call.end, call.noise, on_batch)
        finished = wavefront.render_samples(call.first, call.end, on_batch)
        if adaptive is not None:
            adaptive.skip(call.end)  # also after a stop: numbers of samples are used once
        return finished

    def enqueue(self, call: Call, adaptive: Adaptive | None) -> None:
        """Enqueue samples of all pixels; wait for nothing."""
        wavefront = self._home.wavefront
        wavefront.enqueue(call.first, call.end)
        wavefront.stream.flush()
        if adaptive is not None:
            adaptive.skip(call.end)

    def leave(self, film: bool) -> None:
        """Set whether a call that stops may abandon paths in flight."""
        if film and self._home.is_open:  # `run` sees the reason soon after the flag
            self._home.wavefront.leave.raise_()
        self._discards = film

    # ---- the film

    def put(self, state: FilmState, counts: Counts | None = None) -> None:
        """Enqueue the words of another film."""
        if counts is not None:
            self._home.wavefront.counts = counts
        self._home.put(state)

    def hold(self, taken: Ranges) -> Held:
        """Copy the film on the device, over a former copy. Raises MemoryBudgetError."""
        self._home.wavefront.film.hold()
        return Held(partial(self._home.words, held=True, taken=taken), self.counts, taken)
