"""Pictures of fixed scenes: samples a second, verification, and points.

Tile means are verified beside a reference's, by Student's t. A reference is the mean and the
standard deviation s over `count` renders with different seeds. If another render has r times as
many samples, the difference of a tile's means has the variance s^2 (1 / r + 1 / count); divided by
its root it has Student's t distribution with count - 1 degrees of freedom. More samples a pixel
lower the variance of Sobol points by more than 1 / r, and smaller pixels do not raise it, so the
test is then conservative.
"""

from __future__ import annotations

import hashlib
import json
import math
import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from clpt import bvh, device
from clpt.arrays import Floats, Image
from clpt.bench import agreement, rays
from clpt.bench.figures import Figure
from clpt.bench.scenes import BENCHMARK_VERSION, PICTURES, SIZES, picture
from clpt.errors import ClptError
from clpt.render.makers.device_film import kernels_digest
from clpt.render.renderer import Renderer
from clpt.scene import Scene

FILE = Path(__file__).parent / "data" / "references.npz"
TILES = 8  # along each side
FALSE_ALARMS = 1e-4  # share of right pictures that the test rejects
ROUNDING = 1e-3  # relative difference between devices, of a tile's mean
PART = "pictures"
UNIT, POINTS = "Msamples/s", "points"
ALL = "all scenes"  # the name of the total's figure
CHECKED_RAYS = 1024  # of a set, to find the wrong stage


@dataclass(frozen=True)
class Reference:
    """Expected tile means of a scene.

    mean, deviation: (65, 3), of a render's `regions`; count: renders; samples: of all pixels of a
    render; films: digests of films by size, and their device class.
    """

    mean: Floats
    deviation: Floats
    count: int
    samples: int
    films: Mapping[str, str]


class Verdict(NamedTuple):
    """A picture beside its reference: share of wrong tiles, largest |t|, a complaint or ""."""

    share: float
    largest: float
    wrong: str


def regions(image: Image) -> Floats:
    """Return the means (65, 3) of the 8 x 8 tiles of a picture, row by row, and of all of it."""
    height, width = image.shape[:2]
    parts = image[..., :3].astype(np.float64)
    parts = parts.reshape(TILES, height // TILES, TILES, width // TILES, 3)
    means = parts.mean((1, 3)).reshape(-1, 3)
    return np.concatenate([means, means.mean(0, keepdims=True)])


def compare(image: Image, reference: Reference, samples: int) -> Verdict:
    """Compare a picture with its reference; samples: of all pixels together."""
    means = regions(image)
    share = reference.samples / samples + 1.0 / reference.count
    noise, rounding = reference.deviation * math.sqrt(share), ROUNDING * np.abs(reference.mean)
    expected: Floats = np.hypot(noise, rounding)
    with np.errstate(all="ignore"):
        t: Floats = np.abs(means - reference.mean) / np.maximum(expected, 1e-9)
    t = np.where(np.isfinite(means), t, np.inf)
    off = np.asarray((t > limit(reference.count - 1, FALSE_ALARMS / t.size)).any(1))
    tiles, largest = float(off[:-1].mean()), float(t.max())
    if off[:-1].any():
        return Verdict(tiles, largest, f"wrong: {max(tiles, 0.01):.0%} of tiles".replace("%", " %"))
    if off[-1]:
        ratio = means[-1].mean() / reference.mean[-1].mean() - 1.0
        return Verdict(0.0, largest, f"wrong: all of it is {100 * ratio:+.2g} % off")
    return Verdict(0.0, largest, "")


@cache
def limit(freedom: int, rate: float) -> float:
    """Return the |t| that is exceeded at a rate; freedom: degrees of freedom, odd.

    The distribution is Abramowitz and Stegun 26.7.3.
    """
    low, high = 0.0, 1e6
    for _ in range(80):
        middle = 0.5 * (low + high)
        angle = math.atan(middle / math.sqrt(freedom))
        term, total = math.cos(angle), 0.0
        for k in range(1, freedom, 2):
            total += term
            term *= (k + 1) / (k + 2) * math.cos(angle) ** 2
        inside = 2.0 / math.pi * (angle + math.sin(angle) * total)
        low, high = (middle, high) if 1.0 - inside > rate else (low, middle)
    return high


@cache
def references() -> Mapping[str, Reference]:
    """Return clpt's references by scene."""
    with np.load(FILE, allow_pickle=False) as file:
        about = json.loads(str(file["about"]))
        return {
            name: Reference(mean=file[f"{name}_mean"], deviation=file[f"{name}_deviation"], **more)
            for name, more in about["scenes"].items()
        }


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
    reference = references()[name]
    verdict = compare(image, reference, all_samples)
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


def _exact(reference: Reference, size: str, made_by: str, films: Collection[str]) -> bool | None:
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
