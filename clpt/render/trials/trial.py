"""A trial of ways to render a scene: each makes small pictures, and the best one makes the picture.

It is a function of the scene and its seed, so whoever takes samples takes those of one way. Its
samples are few beside the picture's, of other seeds, and no part of it: its mean would else depend
on what they bring.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from clpt import device
from clpt.render.flow.scene_to_tables import Lowered
from clpt.render.transport import worth
from clpt.render.trials import cost
from clpt.render.trials.cost import GUIDED_RAY, LIGHT_RAY, PHOTON_RAY, ROUNDS, SAMPLES, Trial
from clpt.render.wavefront.device_scene import DeviceScene
from clpt.render.wavefront.strategy import Tuning
from clpt.render.wavefront.wavefront import Wavefront
from clpt.scene.integrators import Integrator, Vcm

log = logging.getLogger(__name__)

SEED = 0x2545F491
QUIET = 0.4  # variance of such pictures up to which no guide is tried: that takes a compilation
LESSON = 8  # of the light paths from which a guide learns at last, for each in a trial, at most
FEWEST_LESSONS = 1 << 18


@dataclass(frozen=True)
class Ground:
    """Where ways are tried: a device, and what suits it, see `Wavefront.create`."""

    device: device.Device
    tuning: Tuning
    looped: bool | None


class Tries:
    """Ways of which each has been tried, the one that the scene chose first; costs: of each."""

    def __init__(self, ground: Ground, samples: int):
        self._ground, self._samples = ground, samples
        self._scene: DeviceScene | None = None  # of the first way, whose trees all share
        self.ways: list[Lowered] = []
        self._trials: list[Trial] = []

    def add(self, way: Lowered) -> None:
        """Try a way. Raises what `Wavefront.create` raises."""
        trial, self._scene = tried(self._ground, way, self._samples, self._scene)
        self.ways.append(way)
        self._trials.append(trial)

    @property
    def costs(self) -> list[float]:
        """The cost of each way over that of the first one."""
        return cost.costs(self._trials)

    @property
    def best(self) -> int:
        """The number of the way of the lowest cost."""
        found = self.costs
        return min(range(len(found)), key=lambda i: (found[i], i))

    @property
    def noise(self) -> float:
        """The variance of the ordinary pixels of the best way's pictures."""
        return cost.variances(self._trials, cost.ODD)[self.best]

    @property
    def rays(self) -> float:
        """The rays that the best way would trace for the whole film."""
        trial = self._trials[self.best]
        return trial.rays / (trial.pictures[..., 0].size * SAMPLES) * self._samples


def decided(ground: Ground, lowered: Lowered, lower_as: Callable[[Integrator], Lowered]) -> Lowered:
    """Return a scene lowered for the best of its candidates, and why in its reason.

    lowered: for the first one; lower_as: lowers it for another. What has to be compiled is tried
    where the best way so far has much to trace, and a guide where that leaves noise too.

    Raises what `Wavefront.create` raises.
    """
    tries = Tries(ground, lowered.samples)
    tries.add(lowered)
    for way in lowered.candidates[1:]:
        if is_worth(way, tries.rays) and (not way.guiding or tries.noise > QUIET):
            tries.add(lower_as(way))
    costs, best = tries.costs, tries.ways[tries.best]
    named = zip(tries.ways, costs, strict=True)
    told = ", ".join(f"{name_of(way.integrator)} {figure:.2f}" for way, figure in named)
    log.info("a trial of small pictures: noise %.3g; costs: %s", tries.noise, told)
    reason = f"{lowered.reason}; of a trial's costs the lowest: {told}" if costs[1:] else ""
    return replace(best, reason=reason or lowered.reason, candidates=())


def is_worth(way: Integrator, rays: float) -> bool:
    """Return whether a film of so many rays is worth the compilation that trying a way takes."""
    return rays >= (worth.GUIDE_RAYS if way.guiding else worth.PLAIN_RAYS)


def name_of(way: Integrator) -> str:
    """Return what a candidate is called, for people."""
    if way.guiding:
        return "guiding"
    if isinstance(way, Vcm):
        return way.kind
    return "light paths" if way.light_paths else "path"


def tried(
    ground: Ground, lowered: Lowered, samples: int, like: DeviceScene | None
) -> tuple[Trial, DeviceScene]:
    """Return the pictures that a way makes of a scene, and what they took.

    samples: of the whole film; like: the scene as another way has it, None for the first one.
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
    """Return from how many light paths a guide learns in a trial, for a film of so many samples.

    paths: from which it would learn for the film. A coarser guide has more noise than it, so a
    trial comes as near to it as what other ways take allows.
    """
    return min(max(paths // LESSON, samples // worth.SHARE, FEWEST_LESSONS), paths)


def _ray(lowered: Lowered) -> float:
    """Return the time of a way's ray over one of `path`."""
    if lowered.features.transport.guided:
        return GUIDED_RAY
    if lowered.features.transport.merged:
        return PHOTON_RAY
    return LIGHT_RAY if lowered.features.transport.weighed else 1.0
