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
from clpt.render.analysis import guides
from clpt.render.lowering.scene import Lowered
from clpt.render.trials import cost
from clpt.render.trials.cost import GUIDED_RAY, LIGHT_RAY, Trial
from clpt.render.wavefront.strategy import Tuning
from clpt.render.wavefront.wavefront import Wavefront
from clpt.scene.integrators import Integrator

log = logging.getLogger(__name__)

ROUNDS = 8  # pictures of each way, each of another seed
SAMPLES = 16  # of a pixel of each
SEED = 0x2545F491
QUIET = 0.4  # variance of such pictures up to which no guide is tried: that takes a compilation


@dataclass(frozen=True)
class Ground:
    """Where ways are tried: a device, and what suits it, see `Wavefront.create`."""

    device: device.Device
    tuning: Tuning
    looped: bool | None


def decided(ground: Ground, lowered: Lowered, lower_as: Callable[[Integrator], Lowered]) -> Lowered:
    """Return a scene lowered for the best of its candidates, and why in its reason.

    lowered: for the first one; lower_as: lowers it for another. The first one is tried at first:
    if it has little noise, guiding is not.

    Raises what `Wavefront.create` raises.
    """
    ways, trials = [lowered], [tried(ground, lowered)]
    (noise,) = cost.variances(trials, cost.ODD)
    for way in lowered.candidates[1:]:
        if not way.guiding or noise > QUIET:
            ways.append(lower_as(way))
            trials.append(tried(ground, ways[-1]))
    found = cost.costs(trials)
    best = min(range(len(ways)), key=lambda i: (found[i], i))
    told = ", ".join(f"{name_of(w.integrator)} {c:.2f}" for w, c in zip(ways, found, strict=True))
    log.info("a trial of small pictures: noise %.3g; costs: %s", noise, told)
    reason = f"{lowered.reason}; of a trial's costs the lowest: {told}" if found[1:] else ""
    return replace(ways[best], reason=reason or lowered.reason, candidates=())


def name_of(way: Integrator) -> str:
    """Return what a candidate is called, for people."""
    if way.guiding:
        return "guiding"
    return "light paths" if way.light_paths else "path"


def tried(ground: Ground, lowered: Lowered) -> Trial:
    """Return the pictures that a way makes of a scene, and what they took."""
    transport, settings = lowered.features.transport, cost.settings(lowered.settings)
    settings["guide_paths"] = min(settings["guide_paths"], guides.PATHS)  # it learns better later
    small = replace(lowered, settings=settings)
    wavefront = Wavefront.create(
        ground.device, small, ground.tuning, looped=ground.looped, tree_quality="fast"
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
    time = GUIDED_RAY if transport.guided else LIGHT_RAY if transport.weighed else 1.0
    return Trial(np.array(pictures), rays, time)
