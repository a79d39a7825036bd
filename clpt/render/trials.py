"""A trial of integrators: each makes small pictures, and the cheapest makes the whole picture.

A trial is a function of the scene and its seed, so all devices and workers choose the same
integrator. Its samples are few, have other seeds, and are no part of the picture: otherwise the
mean of the picture would depend on their values.

The cost of an integrator is variance times counted rays. Clocks play no part. The variance is that
of the mean of some samples, since samples are spread evenly over their domain, and integrators
differ in how much they gain from that.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from clpt import device
from clpt.arrays import Floats
from clpt.render.flow.scene_to_tables import Lowered, lower
from clpt.render.wavefront.device_scene import DeviceScene
from clpt.render.wavefront.strategy import Tuning
from clpt.render.wavefront.wavefront import Wavefront
from clpt.scene import Scene
from clpt.scene.integrators import Integrator

log = logging.getLogger(__name__)

SEED = 0x2545F491
QUIET = 0.4  # variance of small pictures: a guide, which must be compiled, is tried above it
LESSON = 8  # a trial trains its guide with at least 1/LESSON of the light paths of the film
FEWEST_LESSONS = 1 << 18


class Tries:
    """Integrators that have been tried; the first is the choice of the scene.

    on: the device of the trials; tuning: see `Wavefront.create`; samples: of the whole film.
    """

    def __init__(self, on: device.Device, tuning: Tuning, samples: int):
        self._device, self._tuning, self._samples = on, tuning, samples
        self._scene: DeviceScene | None = None  # of the first trial; later trials share its trees
        self.ways: list[Lowered] = []
        self._trials: list[Trial] = []

    def add(self, way: Lowered) -> None:
        """Try an integrator. Raises as `Wavefront.create` does."""
        trial, self._scene = tried(self._device, self._tuning, way, self._samples, self._scene)
        if way.integrator.guiding and self.ways and self.ways[self.best].integrator.reuse:
            trial = replace(trial, ray=trial.ray * UNSEEN)
        self.ways.append(way)
        self._trials.append(trial)

    @property
    def costs(self) -> list[float]:
        """The cost of each integrator over the cost of the first."""
        return costs(self._trials)

    @property
    def best(self) -> int:
        """The number of the integrator of the lowest cost."""
        return int(np.argmin(self.costs))

    @property
    def noise(self) -> float:
        """The variance of ordinary pixels in pictures of the best integrator."""
        return variances(self._trials, ODD)[self.best]

    @property
    def rays(self) -> float:
        """The rays of the best integrator for the whole film."""
        trial = self._trials[self.best]
        return trial.rays / (trial.pictures[..., 0].size * SAMPLES) * self._samples


def decided(
    on: device.Device,
    tuning: Tuning,
    scene: Scene,
    lowered: Lowered,
    texture_budget: int | None,
    *,
    shared: bool = False,
) -> Lowered:
    """Return a scene lowered for the cheapest of its candidates, with the costs in its reason.

    lowered: for the first candidate; texture_budget, shared: as of `lower`. A candidate that must
    be compiled is tried if the best so far has many rays to trace, and a guide only if that leaves
    noise.

    Raises as `Wavefront.create` does.
    """
    tries = Tries(on, tuning, lowered.samples)
    tries.add(lowered)
    for way in lowered.candidates[1:]:
        if is_worth(way, tries.rays) and (not way.guiding or tries.noise > QUIET):
            tries.add(lower(scene, texture_budget, replace(lowered, integrator=way), shared=shared))
    costs, best = tries.costs, tries.ways[tries.best]
    named = zip(tries.ways, costs, strict=True)
    text = ", ".join(f"{name_of(way.integrator)} {figure:.2f}" for way, figure in named)
    log.info("a trial of small pictures: noise %.3g; costs: %s", tries.noise, text)
    reason = f"{lowered.reason}; of a trial's costs the lowest: {text}" if costs[1:] else ""
    return replace(best, reason=reason or lowered.reason, candidates=())


def is_worth(way: Integrator, rays: float) -> bool:
    """Return whether a film of so many rays is worth the compilation of another integrator."""
    return rays >= (GUIDE_RAYS if way.guiding else SHARED_RAYS if way.reuse else PLAIN_RAYS)


def name_of(way: Integrator) -> str:
    """Return the name of a candidate, for people."""
    if way.guiding:
        return "guiding"
    if way.has_photons:
        return way.kind
    if way.reuse:
        return "path reuse"
    return "light paths" if way.light_paths else "path"


def tried(
    on: device.Device, tuning: Tuning, lowered: Lowered, samples: int, like: DeviceScene | None
) -> tuple[Trial, DeviceScene]:
    """Return the trial of a lowered scene, and the scene on the device.

    samples: of the whole film; like: the scene of an earlier trial, whose trees are shared.
    """
    settings = small_settings(lowered.settings, pixels_for(samples))
    settings["guide_paths"] = lessons(int(settings["guide_paths"]), samples)
    small = replace(lowered, settings=settings)
    wavefront = Wavefront.create(on, small, tuning, trees=like or "fast")
    seed, rays, pictures = int(lowered.settings["seed"]) ^ SEED, 0, []
    wavefront.paths.set_seed(seed)
    wavefront.learn(looped=wavefront.looped)
    for number in range(ROUNDS):
        wavefront.paths.set_seed(seed + number)
        wavefront.clear(learned=True)
        wavefront.render_samples(0, SAMPLES)
        pictures.append(wavefront.film.picture.get()[..., :3].astype(np.float64))
        rays += wavefront.counts.rays
    return Trial(np.array(pictures), rays, _ray(lowered)), wavefront.scene


def lessons(paths: int, samples: int) -> int:
    """Return the number of light paths that train a guide in a trial.

    paths: the number for the whole film; samples: of the whole film. A guide with less training
    leaves more noise, so a trial trains as much as it can afford.
    """
    return min(max(paths // LESSON, samples // SHARE, FEWEST_LESSONS), paths)


def _ray(lowered: Lowered) -> float:
    """Return the time of a ray, relative to the integrator `path`."""
    if lowered.features.transport.guided:
        return GUIDED_RAY
    if lowered.features.transport.merged:
        return PHOTON_RAY
    if lowered.features.film.reuse:
        return REUSE_RAY
    return LIGHT_RAY if lowered.features.transport.weighed else 1.0


FEWEST, PIXELS = 512, 2048  # of the small film, about
ROUNDS = 8  # pictures of each integrator, with different seeds
SAMPLES = 16  # of a pixel of each picture
BLOCK = 8  # side of a block of pixels
TRIM = 0.001  # share of the pixels that is left out: the noisiest
ODD = 0.01  # the same for the noise of ordinary pixels
SURE = 3.0  # standard deviations
LIGHT_RAY, GUIDED_RAY = 1.15, 1.3  # time of a ray, relative to `path`: bench/notes/guiding.md
PHOTON_RAY = 1.5  # the same of `vcm`
REUSE_RAY = 1.2  # the same with path reuse: bench/notes/light_paths.md
UNSEEN = 0.66  # of a guide's cost beside path reuse, since a trial does not see all that it gains
# For these sizes of films, and larger sizes, a trial costs less than it can save.
GUIDE_RAYS = 1 << 27  # rays, some 20 s of a core: longer than the compilation of a guide
PLAIN_RAYS = 1 << 30  # the same for the compilation of kernels without light paths
SHARED_RAYS = 1 << 26  # the same with path reuse
SHARE = 1 << 7  # samples of a film for each sample of an integrator in a trial


@dataclass(frozen=True)
class Trial:
    """Pictures of a few samples each.

    pictures: (rounds, height, width, 3); rays: the number of rays of all pictures; ray: the time of
    a ray, relative to the integrator `path`.
    """

    pictures: Floats
    rays: int
    ray: float = 1.0


def pixels_for(samples: int) -> int:
    """Return the number of pixels, about, of a small film; samples: of the whole film."""
    wanted = samples // (SHARE * ROUNDS * SAMPLES)
    return min(max(wanted, FEWEST), PIXELS)


def small_settings(of: NDArray[np.void], pixels: int = PIXELS) -> NDArray[np.void]:
    """Return the settings of a small film of the whole picture; of: settings of the picture.

    A small film has fewer photons, so the disks that gather them are larger. Its sides are
    multiples of BLOCK, so that groups of pixels that share paths have none beyond its edges.
    """
    small = of.copy()
    width, height = int(of["film_width"]), int(of["film_height"])
    scale = math.sqrt(pixels / (width * height))
    width, height = (BLOCK * max(round(size * scale / BLOCK), 1) for size in (width, height))
    margin = int(of["margin"])
    small["width"], small["height"] = small["film_width"], small["film_height"] = width, height
    small["crop_x"] = small["crop_y"] = 0
    small["tiles_x"] = -(-(width + 2 * margin) // 4)
    small["padded_pixels"] = 16 * small["tiles_x"] * -(-(height + 2 * margin) // 4)
    small["photon_pixels"] = min(int(of["photon_pixels"]), int(small["padded_pixels"]))
    small["radius"] = of["radius"] / scale
    return small


def variances(trials: Sequence[Trial], trim: float = TRIM) -> list[float]:
    """Return the variance of a picture of each trial; all have the same scene and rounds.

    It is relative to the mean of a block of pixels, as the mean of a pixel is too noisy; trim: the
    share of the worst pixels, which are left out. The variance of a trial misses light that it has
    hardly ever found. So where another trial has surely found more light in a block, the variance
    is at least the variance of finding that light once in all samples.
    """
    spread = [_in_blocks(trial.pictures.var(axis=0, ddof=1)) for trial in trials]
    means = [_in_blocks(trial.pictures.mean(axis=0)) for trial in trials]
    around = np.mean([_of_blocks(mean) for mean in means], axis=0)
    scale = np.maximum(around**2 + 1e-2 * around.mean() ** 2, 1e-300)
    count = BLOCK**2 * len(trials[0].pictures)
    variances_ = []
    for spread_here, mean in zip(spread, means, strict=True):
        least = np.zeros_like(around)
        for other, more in zip(spread, means, strict=True):
            missed = np.maximum(_of_blocks(more - mean), 0.0) ** 2
            least = np.maximum(least, count * missed - SURE**2 * _of_blocks(spread_here + other))
        error = np.sort((np.maximum(spread_here, least) / scale).mean(axis=-1), axis=None)
        variances_.append(float(error[: math.ceil(error.size * (1.0 - trim))].mean()))
    return variances_


def _in_blocks(picture: Floats) -> Floats:
    """Return whole blocks of a picture, (rows, BLOCK, columns, BLOCK, 3)."""
    height, width = (size - size % BLOCK for size in picture.shape[:2])
    return picture[:height, :width].reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, 3)


def _of_blocks(values: Floats) -> Floats:
    """Return the means of blocks, (rows, 1, columns, 1, 3)."""
    means: Floats = values.mean(axis=(1, 3), keepdims=True)
    return means


def costs(trials: Sequence[Trial]) -> list[float]:
    """Return the variance times the time of the rays of each trial, over the first trial's.

    All costs are 1 if the first trial has no noise.
    """
    products = [
        variance * trial.rays * trial.ray
        for variance, trial in zip(variances(trials), trials, strict=True)
    ]
    return [cost / products[0] if products[0] > 0.0 else 1.0 for cost in products]
