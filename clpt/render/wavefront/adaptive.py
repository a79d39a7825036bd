"""Adaptive sampling: a pixel gets samples until the noise around it is below a limit.

The film is cut into squares, and their pixels into the two colours of a chessboard: two cells. The
pixels of a cell's partner alone decide how many samples the cell gets, never its own. Samples of
different pixels are independent of each other, so a pixel's number of samples is independent of
their values, and its mean has no bias: exactly, not in the limit. (To stop by a cell's own samples
makes a picture too dark: cells whose samples all missed the light seem to have no noise.)

For that a partner's decision must not depend on how long the cell itself was sampled either. Where
a cell has finished and its partner has not, the cell is sampled on as the partner's guide, and
these samples do not go into the picture.

For a denoised picture the noise after denoising decides, see clpt.render.wavefront.noise.
It falls slower than the noise of samples, so nothing is decided ahead.

Light paths, where the scene has them, reach all pixels, so their number is the same for all. It
must not depend on the values of these paths, or their mean would be too dark where the noise seems
low by chance. So guides decide: light paths that stay out of the picture, a guide for four light
paths. The change of their mean while their number doubles gives the noise.

Let v be the relative variance of a sample of the camera in a cell, w that of a sample's light
paths. With n samples and m light paths the variance is v / n + w / m. For a limit e of the
variance, n + m is least at m = (w + sqrt(v w)) / e. The cell with the largest m decides m for all;
then the n of each cell follows from e.

A cell's n must not depend on its own samples. So the two colours of the chessboard decide m
separately, each by guides and by the samples of its own pixels: from that the cells of the other
colour take their n. The picture gets the larger m, which leaves less noise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats, Integers
from clpt.errors import SceneError
from clpt.render.records import Features
from clpt.render.wavefront.bounce_loop import OnBatch
from clpt.render.wavefront.noise import DenoisedNoise, NoiseMeter, divide
from clpt.render.wavefront.path_buffers import FOREVER
from clpt.render.wavefront.tracer import Selection, Tracer
from clpt.render.wavefront.wavefront import Wavefront
from clpt.scene import checked_noise
from clpt.scene.integrators import PIXELWISE

GUIDES = 4  # light paths of the picture for each guide
GUIDE_NUMBERS = 1 << 30  # the number of the first guide, above all light paths of the picture


class LightRounds:
    """The light paths of a picture, in samples: a wavefront's `light_paths` for each pixel.

    next: the first sample whose light paths are not in the picture; stop: (2,) how many samples
    each colour's pixels want; variance: (cells,) of a sample's light paths, relative.
    """

    def __init__(self, meter: NoiseMeter, tracer: Tracer):
        self.wavefront, self.meter, self._tracer = meter.wavefront, meter, tracer
        self.next = 0
        self._pixels = int(meter.pixels.sum())
        self.stop = np.full(2, FOREVER)
        self.variance = np.zeros(len(meter.pixels))
        self._measured_at = np.zeros(2, np.int64)  # samples when each colour was measured last
        self._guides = 0  # samples of light paths that are guides
        size = self.wavefront.film.group_bytes
        self._sums = self.wavefront.buffers.allocate(
            "the film of light paths that are guides", size
        )

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the state, for `restore`: arrays by name; wait for the device."""
        sums = np.zeros(self._sums.size // 4, np.uint32)
        if self._guides:
            sums = self.wavefront.stream.read(self._sums, sums)
        return {
            "next": np.int64(self.next), "stop": self.stop, "variance": self.variance,
            "measured_at": self._measured_at, "guides": np.int64(self._guides),
            "sums": sums,
        }  # fmt: skip

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Go on from a state of the same film."""
        if arrays["sums"].nbytes != self._sums.size:
            raise ValueError("the guides are of another film")
        self.next, self._guides = int(arrays["next"]), int(arrays["guides"])
        self.stop[:], self.variance[:] = arrays["stop"], arrays["variance"]
        self._measured_at[:] = arrays["measured_at"]
        self.wavefront.stream.write(self._sums, arrays["sums"])

    @property
    def wanted(self) -> int:
        """The number of samples that is enough for both colours."""
        return int(self.stop.max())

    @property
    def open(self) -> bool:
        """Whether the number of some colour is not decided."""
        return self.wanted == FOREVER

    def skip(self, samples: int) -> None:
        """Note that the picture has the light paths of all samples up to this number."""
        self.next = max(self.next, samples)
        self.stop = np.maximum(self.stop, samples)

    def reopen(self) -> None:
        """Forget how many are wanted, for another limit of noise."""
        self.stop[:] = FOREVER

    def sample(self, end: int, on_batch: OnBatch) -> bool:
        """Add light paths up to a sample, at most `wanted`; return whether it was not stopped."""
        first, end = self.next, min(end, self.wanted)
        if first >= end:
            return True
        self.next = end
        return self._tracer.add(Selection("lights", self._pixels), first, end, on_batch)

    def measure(self, look: int, on_batch: OnBatch) -> bool:
        """Estimate the variance by guides, at a look after some number of samples.

        The film then has the guides in place of the picture's light paths, and must be restored.
        Returns whether it was not stopped.
        """
        wavefront, loop = self.wavefront, self.wavefront.loops[0]
        first, end = self._guides, look // GUIDES
        self._guides = 0  # where an interrupt ends this, all are traced again
        wavefront.film.set_group(wavefront.light_group, self._sums if first else None)
        start = math.ceil(GUIDE_NUMBERS / loop.per_sample)
        guides = Selection("guides", self._pixels)
        if not self._tracer.add(guides, start + first, start + end, on_batch):
            self._guides = first
            return False
        self._tracer.gather()
        wavefront.film.copy_group(wavefront.light_group, self._sums)
        self._guides = end
        undecided = np.tile(self.stop == FOREVER, len(self.variance) // 2)
        begun, ended = loop.numbers(start, start + end)
        variance = self.meter.measure_lights(undecided, float(ended - begun))
        if self.meter.knows_brightness:
            self.variance[undecided] = end * variance[undecided]
            self._measured_at[self.stop == FOREVER] = look
        return True

    def decide(self, limit: float, camera: Floats, ahead: int, steps: int) -> None:
        """Decide how many are wanted.

        limit: of a pixel's relative variance; camera: (cells,) that of a sample of the camera, as
        far as it is known, else 0; ahead, steps: see clpt.render.wavefront.adaptive.
        """
        at, needed = self._measured_at, self._of_colours(self._needed(limit, camera))
        sure = (self.stop == FOREVER) & (at > 0) & (needed <= ahead * at)
        step = np.maximum(at // steps, 1)
        wanted = np.maximum(np.ceil(np.where(sure, needed, 0.0) / step) * step, at)
        self.stop[sure] = wanted[sure]

    def left_over(self, limit: float, camera: Floats) -> Floats:
        """Return the variance that light paths leave to the camera's samples, (cells,) float64."""
        taken = np.maximum(self._of_colours(self._needed(limit, camera)), self._measured_at)
        return limit - divide(self.variance, np.tile(taken, len(self.variance) // 2))

    def noisy(self, limit: float, camera: Floats) -> NDArray[np.bool_]:
        """Return whether a cell wants more light paths than there are so far, (cells,) bool."""
        return (self.next < self.wanted) & (self._needed(limit, camera) > self.next)

    def _needed(self, limit: float, camera: Floats) -> Floats:
        """Return the number of samples whose light paths each cell wants, (cells,)."""
        return (self.variance + np.sqrt(self.variance * camera)) / limit

    def _of_colours(self, values: Floats) -> Floats:
        """The largest value among the cells of each colour, (2,)."""
        return values.reshape(-1, 2).max(axis=0)


LEAST = 8  # samples of a pixel at the first look at the film; the second look measures noise
AHEAD = 4  # a look decides for cells that need at most so many times the samples at the look
STEPS = 4  # decided numbers of samples are multiples of 1/STEPS of the samples at the look
OPEN = FOREVER  # of a cell whose number of samples is not decided


def checked(noise: float, features: Features) -> float:
    """Return a limit of noise. Raises SceneError where it makes no sense."""
    noise = checked_noise(noise)
    if features.transport.light_paths:
        message = "the integrator particle_tracer cannot choose which pixels its paths reach"
        raise SceneError(f"{message}; leave it out, or choose path", where="noise")
    if features.transport.weighed and features.film.layers.lights:
        message = f"light paths that decide of noise would be in {features.film.layers.lights[0]}"
        raise SceneError(f"{message}; leave it out, or choose light_paths 0", where="noise")
    if features.transport.merged:
        message = "neighbouring pixels share the photons of the integrator vcm"
        raise SceneError(f"{message}; leave it out, or vcm.merging", where="noise")
    if features.film_weights:
        message = f"neighbouring pixels share samples under the filter {features.film.filter.kind}"
        raise SceneError(f"{message}; give the scene `noise`, or film.filtering", where="noise")
    if features.transport.sampler not in [cls.kind for cls in PIXELWISE]:
        message = (
            f"neighbouring pixels share the points of the sampler {features.transport.sampler}"
        )
        raise SceneError(f"{message}; leave it out, or choose sobol", where="noise")
    return float(noise)


class Adaptive:
    """The number of samples that each cell of a wavefront's film gets, see `NoiseMeter`.

    A cell's partner is the other colour of its square or, where that has no pixel, of a square
    beside it.

    noise: the limit; next: (cells,) the first sample that a cell's pixels do not have;
    stop: (cells,) how many samples they will have. tracer: adds samples to the film. denoised:
    measures the noise of a denoised picture.
    """

    def __init__(
        self,
        wavefront: Wavefront,
        tracer: Tracer | None = None,
        denoised: DenoisedNoise | None = None,
    ):
        self.wavefront, self._meter = wavefront, NoiseMeter(wavefront)
        self._tracer, self._denoised = tracer or Tracer(wavefront), denoised
        self._pixels = self._meter.pixels
        self._rate = _rate(wavefront.features)
        count = len(self._pixels)
        self._partner = _partners(self._pixels, self._meter.across)
        self._lights = (
            LightRounds(self._meter, self._tracer) if wavefront.features.transport.weighed else None
        )
        self.noise = 0.0
        self.next = np.zeros(count, np.int64)
        self.stop = np.full(count, OPEN)
        self._begun = self.next  # what `next` becomes when the samples under way have ended
        self._level = 0  # samples at the last look
        self._measured_at = np.zeros(count, np.int64)  # samples when a cell was last measured
        self._variance = np.full(count, np.inf)  # of a sample, relative; of n over n^rate
        self._has_guides = False  # whether the film has samples of guides beside the picture's
        self._kept: dict[str, NDArray[Any]] | None = None

    @property
    def active(self) -> float:
        """The share of the picture's pixels that get more samples."""
        active = self.next < self.stop
        if self._lights is not None and self.noise:
            active |= self._lights.noisy(self.noise**2, self._known_variance)
        return float(self._pixels[active].sum() / self._pixels.sum())

    @property
    def level(self) -> float | None:
        """The noise of the picture so far: the root of the mean square of the noise of its cells.

        None before the first cells are measured. Cells that are not measured yet are left out.
        """
        known = np.isfinite(self._variance) & (self._pixels > 0) & (self.next > 0)
        if not known.any():
            return None
        variance = self._variance[known] / self.next[known].astype(float) ** self._rate
        pixels = self._pixels[known]
        return math.sqrt(float((pixels * variance).sum() / pixels.sum()))

    @property
    def _known_variance(self) -> Floats:
        """The variance of a sample where it is known, else 0."""
        return np.where(np.isfinite(self._variance), self._variance, 0.0)

    def skip(self, samples: int) -> None:
        """Note that every pixel has all samples up to this number, whatever its noise."""
        self.next[:] = samples
        self._level = max(self._level, samples)
        self.stop[self.stop < samples] = samples
        if self._lights is not None:
            self._lights.skip(samples)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the state, for `restore`: arrays by name, as `keep` kept it, or as it is now."""
        return self._read() if self._kept is None else self._kept

    def keep(self) -> None:
        """Keep the state as it is now, which outlives the device; wait for that."""
        self._kept = self._read()

    def _read(self) -> dict[str, NDArray[Any]]:
        state = {
            "next": self.next, "stop": self.stop, "measured_at": self._measured_at,
            "variance": self._variance, "noise": np.float64(self.noise),
            "level": np.int64(self._level), **self._meter.arrays(),
        }  # fmt: skip
        if self._lights is not None:
            state |= {f"lights_{name}": array for name, array in self._lights.arrays().items()}
        return {name: np.array(array) for name, array in state.items()}

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Go on from a state of the same film. Raises KeyError, ValueError for another film."""
        self.next[:], self.stop[:] = arrays["next"], arrays["stop"]
        self._measured_at[:], self._variance[:] = arrays["measured_at"], arrays["variance"]
        self.noise, self._level = float(arrays["noise"]), int(arrays["level"])
        self._meter.restore(arrays)
        if self._lights is not None:
            names = [name for name in arrays if name.startswith("lights_")]
            self._lights.restore({name.removeprefix("lights_"): arrays[name] for name in names})

    def become(self, other: Adaptive) -> None:
        """Take the state of another, as on another device."""
        vars(self).update(vars(other))

    def run(self, end: int, noise: float, on_batch: OnBatch) -> bool:
        """Add samples until the noise is below a limit, or all pixels have `end`.

        noise: of a square's pixels the root of the mean square of the standard error of their
        luminance, relative to the mean luminance of the 4x4 pixels around. on_batch: see
        `Wavefront.render_samples`. Returns whether it was not stopped.
        """
        if noise != self.noise:
            self.noise = 0.0  # until all is decided: an interrupt may come at any line
            self.stop[:] = np.where(self._pixels > 0, OPEN, 0)
            if self._lights is not None:
                self._lights.reopen()
            self._decide(noise)
            self.noise = noise
        try:
            while self._goes_on(end):
                if not self._round(end, on_batch):
                    return False
        finally:
            self._tracer.use_all_pixels()
        return True

    def finish(self) -> None:
        """Remove samples of guides from the film, wherever an interrupt has left `run`."""
        if self._has_guides:
            self._give_film_back()
        self.next = np.maximum(self.next, self._begun)
        self._tracer.use_all_pixels()
        self.noise = 0.0  # all is decided again

    def _goes_on(self, end: int) -> bool:
        """Whether samples are missing before sample `end`."""
        lights = self._lights is not None and self._lights.next < min(self._lights.wanted, end)
        return lights or bool((self.next < np.minimum(self.stop, end)).any())

    def _round(self, end: int, on_batch: OnBatch) -> bool:
        """Sample up to the next look or to `end`, look, and decide; return whether to go on."""
        look = self._next_look()
        ends = np.minimum(self.stop, min(look, end))
        # Pixels stay black without samples of the camera, and dark without light paths.
        self._begun = np.maximum(self.next, ends)
        finished = self._lights is None or self._lights.sample(min(look, end), on_batch)
        finished = finished and self._sample(ends, on_batch)
        self.next = self._begun  # after a stop too: numbers are not used again
        if not finished:
            return False
        if end < look:
            return True
        self._level = look
        guide_cells = np.zeros(len(self.stop), bool)
        guide_cells[self._partner[(self.stop == OPEN) & (self._pixels > 0)]] = True
        overrun = guide_cells & (self.next < look)  # finished, and still a guide
        lights = self._lights if self._lights is not None and self._lights.open else None
        self._tracer.gather()
        if lights is not None or overrun.any():
            self._tracer.keep()
            self._has_guides = True
        try:
            if lights is not None and not lights.measure(look, on_batch):
                return False
            if not self._sample(np.where(overrun, look, 0), on_batch):
                return False
            self._tracer.gather()
            self._measure(guide_cells)
        finally:
            if self._has_guides:
                self._give_film_back()
        self._decide(self.noise)
        return True

    def _next_look(self) -> int:
        """The number of samples at the next look: a power of two, as Sobol points are best."""
        return 1 << math.ceil(math.log2(max(LEAST, 1.5 * self._level)))

    def _sample(self, ends: Integers, on_batch: OnBatch) -> bool:
        """Add samples to every cell up to its end; return whether it was not stopped."""
        behind = (self.next < ends) & (self._pixels > 0)
        for first in np.unique(self.next[behind]):
            stops = np.where(behind & (self.next == first), ends, 0)
            chosen = Selection("camera", int(self._pixels[stops > 0].sum()), stops)
            if not self._tracer.add(chosen, int(first), int(stops.max()), on_batch):
                return False
        return True

    def _measure(self, cells: NDArray[np.bool_]) -> None:
        """Estimate the relative variance of a sample in these cells."""
        if not cells.any():
            return
        if self._denoised is None:
            # From n samples to 2n variance falls by 2^rate - 1 times the variance at 2n.
            relative = self._meter.measure(cells) / (2.0**self._rate - 1.0)
            known = cells & (self._measured_at > 0)
        elif self._level < 2 * LEAST:
            return
        else:
            relative, known = self._denoised.measure(cells), cells
        self._variance[known] = self._level**self._rate * relative[known]
        self._measured_at[cells] = self._level

    def _decide(self, noise: float) -> None:
        """Decide the number of samples of cells whose partners are measured well enough."""
        limit: Any = noise**2
        if self._lights is not None:
            self._lights.decide(limit, self._known_variance, AHEAD, STEPS)
            limit = self._lights.left_over(limit, self._known_variance)[self._partner]
        measured_at = self._measured_at[self._partner]
        needed = divide(self._variance[self._partner], limit) ** (1.0 / self._rate)
        ahead = AHEAD if self._denoised is None else 1
        sure = (self.stop == OPEN) & (needed <= ahead * measured_at) & (self._pixels > 0)
        step = np.maximum(measured_at // STEPS, 1)
        wanted = np.ceil(np.where(sure, needed, 0.0) / step) * step
        self.stop[sure] = np.maximum(wanted, measured_at)[sure]

    def _give_film_back(self) -> None:
        """Restore the samples that the film had before."""
        self._tracer.give_back()
        self._has_guides = False


def _rate(features: Features) -> float:
    """Return how fast variance falls with samples, `Sampler.rate`; beside light paths 1."""
    transport = features.transport
    rates = {cls.kind: cls.rate for cls in PIXELWISE}
    return 1.0 if transport.weighed else rates[transport.sampler]


def _partners(pixels: Integers, across: int) -> Integers:
    """Return the cell that decides about each cell: of the other colour, with pixels.

    pixels: of each cell. In a film of a single pixel the cell is its own partner, and the mean has
    a bias of the order of 1 over the samples.
    """
    cells = np.arange(len(pixels))
    partner = cells ^ 1
    row, column = np.divmod(cells // 2, across)
    for rows, columns in ((0, -1), (-1, 0)):  # only the last square may have a single pixel
        beside = (row + rows) * across + column + columns
        usable = (row + rows >= 0) & (column + columns >= 0)
        other = np.where(usable, 2 * beside + 1 - cells % 2, partner)
        partner = np.where((pixels[partner] == 0) & (pixels[other] > 0), other, partner)
    return np.where(pixels[partner] == 0, cells, partner)
