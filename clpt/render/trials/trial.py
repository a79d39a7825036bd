"""A trial of integrators: each makes small pictures, and the cheapest makes the whole picture.

A trial is a function of the scene and its seed, so all devices and workers choose the same
integrator. Its samples are few, have other seeds, and are no part of the picture: otherwise the
mean of the picture would depend on their values.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from clpt import device
from clpt.render.flow.scene_to_tables import Lowered
from clpt.render.trials import cost
from clpt.render.trials.cost import (
    GUIDE_RAYS,
    GUIDED_RAY,
    LIGHT_RAY,
    PHOTON_RAY,
    PLAIN_RAYS,
    ROUNDS,
    SAMPLES,
    SHARE,
    Trial,
)
from clpt.render.wavefront.device_scene import DeviceScene
from clpt.render.wavefront.strategy import Tuning
from clpt.render.wavefront.wavefront import Wavefront
from clpt.scene.integrators import Integrator

log = logging.getLogger(__name__)

SEED = 0x2545F491
QUIET = 0.4  # variance of small pictures: a guide, which must be compiled, is tried above it
LESSON = 8  # a trial trains its guide with at least 1/LESSON of the light paths of the film
FEWEST_LESSONS = 1 << 18


@dataclass(frozen=True)
class Ground:
    """The device of trials, and its tuning, see `Wavefront.create`."""

    device: device.Device
    tuning: Tuning
    looped: bool | None


class Tries:
    """Integrators that have been tried; the first is the choice of the scene."""

    def __init__(self, ground: Ground, samples: int):
        self._ground, self._samples = ground, samples
        self._scene: DeviceScene | None = None  # of the first trial; later trials share its trees
        self.ways: list[Lowered] = []
        self._trials: list[Trial] = []

    def add(self, way: Lowered) -> None:
        """Try an integrator. Raises as `Wavefront.create` does."""
        trial, self._scene = tried(self._ground, way, self._samples, self._scene)
        self.ways.append(way)
        self._trials.append(trial)

    @property
    def costs(self) -> list[float]:
        """The cost of each integrator over the cost of the first."""
        return cost.costs(self._trials)

    @property
    def best(self) -> int:
        """The number of the integrator of the lowest cost."""
        return int(np.argmin(self.costs))

    @property
    def noise(self) -> float:
        """The variance of ordinary pixels in pictures of the best integrator."""
        return cost.variances(self._trials, cost.ODD)[self.best]

    @property
    def rays(self) -> float:
        """The rays of the best integrator for the whole film."""
        trial = self._trials[self.best]
        return trial.rays / (trial.pictures[..., 0].size * SAMPLES) * self._samples


def decided(ground: Ground, lowered: Lowered, lower_as: Callable[[Integrator], Lowered]) -> Lowered:
    """Return a scene lowered for the cheapest of its candidates, with the costs in its reason.

    lowered: for the first candidate; lower_as: lowers the scene for another. A candidate that must
    be compiled is tried if the best so far has many rays to trace, and a guide only if that leaves
    noise.

    Raises as `Wavefront.create` does.
    """
    tries = Tries(ground, lowered.samples)
    tries.add(lowered)
    for way in lowered.candidates[1:]:
        if is_worth(way, tries.rays) and (not way.guiding or tries.noise > QUIET):
            tries.add(lower_as(way))
    costs, best = tries.costs, tries.ways[tries.best]
    named = zip(tries.ways, costs, strict=True)
    text = ", ".join(f"{name_of(way.integrator)} {figure:.2f}" for way, figure in named)
    log.info("a trial of small pictures: noise %.3g; costs: %s", tries.noise, text)
    reason = f"{lowered.reason}; of a trial's costs the lowest: {text}" if costs[1:] else ""
    return replace(best, reason=reason or lowered.reason, candidates=())


def is_worth(way: Integrator, rays: float) -> bool:
    """Return whether a film of so many rays is worth the compilation of another integrator."""
    return rays >= (GUIDE_RAYS if way.guiding else PLAIN_RAYS)


def name_of(way: Integrator) -> str:
    """Return the name of a candidate, for people."""
    if way.guiding:
        return "guiding"
    if way.has_photons:
        return way.kind
    return "light paths" if way.light_paths else "path"


def tried(
    ground: Ground, lowered: Lowered, samples: int, like: DeviceScene | None
) -> tuple[Trial, DeviceScene]:
    """Return the trial of a lowered scene, and the scene on the device.

    samples: of the whole film; like: the scene of an earlier trial, whose trees are shared.
    """
    settings = cost.settings(lowered.settings, cost.pixels_for(samples))
    settings["guide_paths"] = lessons(int(settings["guide_paths"]), samples)
    small = replace(lowered, settings=settings)
    wavefront = Wavefront.create(
        ground.device, small, ground.tuning, looped=ground.looped, trees=like or "fast"
    )
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
    return LIGHT_RAY if lowered.features.transport.weighed else 1.0
