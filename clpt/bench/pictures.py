"""Pictures of fixed scenes: samples a second, verification, and points."""

from __future__ import annotations

import hashlib
import json
import math
import time
from collections.abc import Collection, Iterator, Sequence
from typing import Any

import numpy as np

from clpt import bvh, device
from clpt.bench import agreement, rays, tiles
from clpt.bench.figures import Figure
from clpt.bench.picture_scenes import BENCHMARK_VERSION, PICTURES, SIZES, picture
from clpt.errors import ClptError
from clpt.render.makers.device_film import kernels_digest
from clpt.render.renderer import Renderer
from clpt.scene import Scene

PART = "pictures"
UNIT, POINTS = "Msamples/s", "points"
ALL = "all scenes"  # the name of the total's figure
CHECKED_RAYS = 1024  # of a set, to find the wrong stage


def measure(
    on: device.Device, rounds: int, size: str, only: Collection[str] = ()
) -> Iterator[Figure]:
    """Yield figures of the scenes of PICTURES, then their score if all are measured.

    size: a key of SIZES; only: names of scenes, by default all. Raises DeviceError.
    """
    figures = []
    plain = device.Device.open(on.info)  # a render is not profiled
    for name in PICTURES:
        if not only or name in only:
            figures.append(_measure(on, plain, name, size, rounds))
            yield figures[-1]
    if len(figures) == len(PICTURES):
        yield score(figures, size)


def score(figures: Sequence[Figure], size: str) -> Figure:
    """Return the geometric mean of the scenes' points, refused if any picture is wrong."""
    wrong = [figure.scene for figure in figures if figure.refused or not figure.rounds]
    more = {"size": size, "benchmark_version": BENCHMARK_VERSION}
    if wrong:
        figure = Figure(PART, ALL, POINTS, (), "", more)
        return figure.refuse(f"no score: {', '.join(wrong)} did not pass")
    each = [[speed * figure.more["points_each"] for speed in figure.rounds] for figure in figures]
    rounds = tuple(np.exp(np.mean(np.log(each), axis=0)).tolist())
    return Figure(PART, ALL, POINTS, rounds, "", more)


def _measure(on: device.Device, plain: device.Device, name: str, size: str, rounds: int) -> Figure:
    """Measure a scene after an uncounted round; all rounds must render the same film."""
    scene, samples = picture(name, size), SIZES[size].samples
    all_samples = SIZES[size].all_samples
    start = time.perf_counter()
    with Renderer(scene, plain) as renderer:
        ready = time.perf_counter() - start
        seconds, films = [], set()
        for _ in range(rounds + 1):
            renderer.update(camera=scene.camera)  # begins at sample 0
            start = time.perf_counter()
            renderer.run(samples)
            seconds.append(time.perf_counter() - start)
            films.add(film_digest(renderer))
        image, made_by = renderer.image(), film_class(renderer)
        layout = str(renderer._device_class()["layout"])
    reference = tiles.references()[name]
    verdict = tiles.compare(image, reference, all_samples)
    wrong = verdict.wrong
    if len(films) > 1:
        wrong = wrong or "wrong: its rounds made different films of the same samples"
    points_each = 1000.0 / PICTURES[name].reference
    speeds = tuple(all_samples * 1e-6 / taken for taken in seconds[1:])
    more: dict[str, Any] = {
        "size": size,
        "benchmark_version": BENCHMARK_VERSION,
        "mode": scene.film.mode,
        "points_each": points_each,
        "points": 0.0 if wrong else float(np.median(speeds)) * points_each,
        "ready": ready,
        "tiles_wrong": verdict.share,
        "largest_t": verdict.largest if math.isfinite(verdict.largest) else None,
        "exact": _exact(reference, size, made_by, films),
    }
    figure = Figure(PART, name, UNIT, speeds, name, more)
    return figure.refuse(f"{wrong}, {first_wrong_stage(on, scene, layout)}") if wrong else figure


def _exact(
    reference: tiles.Reference, size: str, made_by: str, films: Collection[str]
) -> bool | None:
    """Return whether the film equals the reference's; None for another device class."""
    known = reference.films.get(size)
    if known is None or reference.films["class"] != made_by:
        return None
    return set(films) == {known}


def first_wrong_stage(on: device.Device, scene: Scene, layout: str) -> str:
    """Return a line on the first wrong stage: `intersect` by `rays`, others by `agreement`.

    on: with a profiling queue; layout: of the render's triangles.
    """
    layouts = (layout,) if layout in bvh.TREES else bvh.TREES[:1]
    try:
        for figure in rays.measure(on, scene, 1, layouts, CHECKED_RAYS):
            if figure.refused:
                return f"first in intersect: {figure.refused}"
        return agreement.first_wrong(on, scene)
    except ClptError as error:
        return f"and the check of its stages failed: {error}"


def film_digest(renderer: Renderer) -> str:
    """Return the SHA-256 of the film's content."""
    state = renderer.film_state()
    hashed = hashlib.sha256(repr(state.scale).encode())
    for name, words in sorted(vars(state).items()):
        if isinstance(words, np.ndarray):
            hashed.update(f"{name} {words.dtype.str} {words.shape} ".encode() + words.tobytes())
    return hashed.hexdigest()


def film_class(renderer: Renderer) -> str:
    """Return the device class and the kernels' digest, which decide a film's last bits."""
    return json.dumps({**renderer._device_class(), "kernels": kernels_digest()}, sort_keys=True)
