"""Light paths of adaptive sampling: the same number for all pixels, as each path may reach any.

The number must not depend on the values of these paths, or their mean would be too dark where the
noise seems low by chance. So guides decide: light paths that stay out of the picture, a guide for
four light paths. The change of their mean while their number doubles gives the noise.

Let v be the relative variance of a sample of the camera in a cell, w that of a sample's light
paths. n and m of them leave v / n + w / m, and n + m is least for a limit e of that where
m = (w + sqrt(v w)) / e. The cell that wants most decides m; any cell's n is what that leaves it.

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

from clpt.arrays import Floats
from clpt.render.wavefront.bounce_loop import OnBatch
from clpt.render.wavefront.noise_meter import NoiseMeter, divide
from clpt.render.wavefront.tracer import Selection, Tracer
from clpt.render.wavefront.work_list import FOREVER

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
