"""Independent ways to the same mean, compared in blocks of pixels.

    python -m tests.together.agree --scenes 200 --seed 1
    python -m tests.together.agree --fixed --scenes 8 --both --way "light paths" --way vcm
    python -m tests.together.agree --scenes 0 --file scenes/bulb --file room.xml --samples 512

A scene is rendered EXPOSURES times with seeds of their own, by `path` and in another way; a block
of pixels has as many independent values of each. Welch's t-test gives a probability for each block.
Benjamini and Hochberg's procedure (1995) over all blocks of all comparisons calls some of them
different, at a false discovery rate of RATE. What it calls different is rendered again with other
seeds and CONFIRM times the samples, and counts if it is called different again.

Estimates have heavy tails: beside a lamp in fog the variance of a path is infinite, and a block
that has not met a bright path yet has too small a mean and too small a spread, which no test of its
own values can see. But other blocks have met some. So a block's tail is taken from all blocks of
its picture: what exceeds the block's own largest value there, on the average, it may lack
(`unseen`). A difference in that direction counts only beyond it.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
import json
import random
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

import clpt
from clpt.errors import ClptError
from clpt.render.flow.find import analyse
from clpt.render.flow.scene_to_tables import lower
from clpt.render.records.tables import LoweringCache
from clpt.render.transport import light_caches
from clpt.scene import Film, Scene, lights
from clpt.scene import materials as m
from clpt.scene.integrators import Independent, ParticleTracer, Path, Sobol, Vcm
from tests.pictures.support import ROUNDING, blocks, exposures
from tests.together.equivalents import every_shape
from tests.together.fixed import SCENES
from tests.together.strategies import scene_of

Values = NDArray[np.float64]
RATE = 1e-3  # false discoveries among what is called different
EXPOSURES = 12
SAMPLES = 32  # of an exposure
CONFIRM = 8  # times as many samples
SIDE = 4  # of a block [pixels]
WIDTH = 16  # of the film of a file [pixels]
RADIUS = 4e-4  # of photons, over the radius of a sphere around the scene
BIAS = 2e-3  # relative: what gathering within that radius, and offsets of rays, may change


# Statistics -----------------------------------------------------------------------------------


def unseen(values: Values) -> Values:
    """What each block (k, n) of a picture may lack, as bright values are rare: (n,).

    Of all values of all blocks, over their block's median, the mean excess over a block's largest.
    """
    over = values - np.median(values, axis=0)
    tail = np.sort(over.ravel())
    sums = np.append(np.cumsum(tail[::-1])[::-1], 0.0)
    largest = over.max(axis=0)
    first = np.searchsorted(tail, largest, side="right")
    found: Values = (sums[first] - largest * (tail.size - first)) / tail.size
    return found


def probabilities(ours: Values, other: Values, allowed: float = 0.0) -> Values:
    """How likely blocks (k, n) and (m, n) differ so much by chance, if their means are the same.

    allowed: a relative difference that is none.
    """
    va, vb = (
        v.var(axis=0, ddof=1) / len(v) + (ROUNDING * np.abs(v).mean(axis=0)) ** 2 + 1e-24
        for v in (ours, other)
    )
    away = ours.mean(axis=0) - other.mean(axis=0)
    lacks = np.where(away < 0.0, unseen(ours), unseen(other))
    away = np.maximum(np.abs(away) - lacks - allowed * np.abs(other).mean(axis=0), 0.0)
    freedom = (va + vb) ** 2 / (va**2 / (len(ours) - 1) + vb**2 / (len(other) - 1))
    found: Values = 2.0 * stats.t.sf(away / np.sqrt(va + vb), freedom)
    return found


def discoveries(p: Values, rate: float = RATE) -> NDArray[np.bool_]:
    """Which of the probabilities (n,) Benjamini and Hochberg's procedure calls different."""
    order = np.argsort(p)
    below = np.flatnonzero(p[order] <= rate * np.arange(1, len(p) + 1) / max(len(p), 1))
    found = np.zeros(len(p), bool)
    found[order[: below[-1] + 1 if len(below) else 0]] = True
    return found


# Ways -----------------------------------------------------------------------------------------

SHARP = (m.Dielectric, m.Conductor, m.ThinDielectric)


def _kinds(scene: Scene) -> set[type]:
    return {type(part) for one in every_shape(scene) for part in m.parts(one.material)}


def _depth(scene: Scene) -> dict[str, Any]:
    """Return how long paths are, at most as long as photons let them be, and what they see."""
    given = {
        name: getattr(scene.integrator, name)
        for name in ("max_depth", "hide_lights")
        if hasattr(scene.integrator, name)
    }
    if not 0 <= given.get("max_depth", 0) <= light_caches.DEEPEST:
        given["max_depth"] = light_caches.DEEPEST
    return given


def _by(integrator: Callable[[dict[str, Any]], Any]) -> Callable[[Scene], Scene | None]:
    return lambda scene: dataclasses.replace(scene, integrator=integrator(_depth(scene)))


def guided(scene: Scene) -> Scene | None:
    """With guiding, which takes scenes without media."""
    if any(one.interior or one.exterior for one in scene.shapes) or scene.camera.medium:
        return None
    return _by(lambda given: Path(guiding=True, **given))(scene)


def reusing(scene: Scene) -> Scene | None:
    """With path reuse, where pixels share vertices: on CPUs."""
    shared = _by(lambda given: Path(light_paths=0, reuse=True, **given))(scene)
    assert shared is not None
    return shared if lower(shared).features.film.reuse else None


def merged(scene: Scene) -> Scene | None:
    """With photons, of a radius as small as the scene allows: what they blur is a bias."""
    _, around = analyse(plain(scene), LoweringCache()).sphere
    return _by(lambda given: Vcm(radius=RADIUS * around, **given))(scene)


def traced(scene: Scene) -> Scene | None:
    """From lights alone: what is sharp would be black to the camera."""
    if _kinds(scene) & {*SHARP} or scene.film.bands:
        return None
    return dataclasses.replace(scene, integrator=ParticleTracer(**_depth(scene)))


def other_sampler(scene: Scene) -> Scene:
    own = isinstance(scene.sampler, Independent)
    return dataclasses.replace(plain(scene), sampler=Sobol() if own else Independent())


MANY = 24  # lamps for one: a tree chooses among them


def many_lamps(scene: Scene) -> Scene | None:
    """Each lamp at a point is many at its place, so that a tree chooses; and the film is dimmed."""
    bright = any(one.emission is not None for one in every_shape(scene)) or not scene.lights
    if bright or any(type(lamp) not in (lights.Point, lights.Spot) for lamp in scene.lights):
        return None
    film = dataclasses.replace(scene.film, exposure=scene.film.exposure / MANY)
    return dataclasses.replace(plain(scene), lights=scene.lights * MANY, film=film)


WAYS: dict[str, Callable[[Scene], Scene | None]] = {
    "light paths": _by(lambda given: Path(light_paths=1, **given)),
    "vcm": merged,
    "guiding": guided,
    "path reuse": reusing,
    "particle tracer": traced,
    "the other sampler": other_sampler,
    "many lamps": many_lamps,
}


def plain(scene: Scene) -> Scene:
    """The scene by paths from the camera alone."""
    return dataclasses.replace(scene, integrator=Path(light_paths=0, **_depth(scene)))


# Comparisons ----------------------------------------------------------------------------------


@dataclasses.dataclass
class Comparison:
    """Two ways to render a scene, and p of each block.

    called: blocks that are called different; confirmed: those of them that are so again.
    """

    scene: str
    way: str
    pair: tuple[Scene, Scene]
    p: Values
    means: tuple[float, float]
    seconds: float
    called: int = 0
    confirmed: int = 0

    def row(self) -> dict[str, Any]:
        least = float(self.p.min()) if self.p.size else 1.0
        return {
            "scene": self.scene, "way": self.way, "means": self.means, "blocks": self.p.size,
            "least_p": least, "called": self.called, "confirmed": self.confirmed,
            "seconds": round(self.seconds, 1),
        }  # fmt: skip


def block_values(scene: Scene, first_seed: int, samples: int) -> Values:
    """Blocks of independent exposures, of the mean of the colours: (EXPOSURES, n)."""
    images = exposures(scene, EXPOSURES, samples, first_seed)
    return blocks(images, SIDE).mean(axis=-1).reshape(EXPOSURES, -1)


def compare(
    name: str,
    way: str,
    pair: tuple[Scene, Scene],
    seed: int,
    samples: int,
    ours: Values | None = None,
) -> Comparison:
    """Render both, with other seeds for each; ours: the blocks of the first, if they are known."""
    start = time.process_time()
    if ours is None:
        ours = block_values(pair[0], seed, samples)
    other = block_values(pair[1], seed + EXPOSURES, samples)
    p = probabilities(other, ours, BIAS)
    means = float(ours.mean()), float(other.mean())
    return Comparison(name, way, pair, p, means, time.process_time() - start)


def compared(
    name: str, scene: Scene, ways: Sequence[str], seed: int, samples: int = SAMPLES
) -> Iterator[Comparison]:
    """Compare a scene with what some ways make of it; by paths alone it is rendered once."""
    ours: Values | None = None
    first = plain(scene)
    for way in ways:
        other = WAYS[way](scene)
        if other is not None:
            if ours is None:
                ours = block_values(first, seed, samples)
            yield compare(name, way, (first, other), seed, samples, ours)


def judged(found: list[Comparison], seed: int, samples: int) -> list[Comparison]:
    """Those whose blocks are called different, and again with more samples; all are marked."""
    if not found:
        return []
    calls = discoveries(np.concatenate([one.p for one in found]))
    ends = np.cumsum([one.p.size for one in found])
    for one, called in zip(found, np.split(calls, ends[:-1]), strict=True):
        one.called = int(called.sum())
        if one.called:
            again = compare(one.scene, one.way, one.pair, seed + 1000, CONFIRM * samples)
            one.confirmed = int((discoveries(again.p) & called).sum())
            one.seconds += again.seconds
    return [one for one in found if one.confirmed]


def drawn(seed: int) -> Scene:
    """A random scene, with as small and plain a film as there is."""
    choose = random.Random(seed)
    scene = scene_of(lambda most: choose.randint(0, most))
    film = Film(width=8, height=8, mode=scene.film.mode)
    return dataclasses.replace(scene, film=film, noise=None)


def read(path: FilePath) -> Scene:
    """A scene of a file, with a small and plain film of its shape."""
    scene = clpt.load(path)
    high = scene.film.height / scene.film.width
    film = Film(width=WIDTH, height=max(SIDE, round(WIDTH * high)), mode=scene.film.mode)
    return dataclasses.replace(scene, film=film, noise=None)


def chosen(scene: Scene, seed: int, most: int) -> list[str]:
    """Return some ways that a scene can be rendered in, drawn; at most so many."""
    ways = [way for way in WAYS if WAYS[way](scene) is not None]
    return [str(way) for way in np.random.default_rng(seed).permutation(ways)[:most]]


def attempt(
    name: str, made: Callable[[], Scene], mode: str | None, seed: int, given: argparse.Namespace
) -> Iterator[dict[str, Any] | Comparison]:
    """Compare a scene in some ways; a row where that cannot be done."""
    try:
        scene = made()
        if mode is not None:
            name = f"{name}, {mode}"
            scene = dataclasses.replace(scene, film=dataclasses.replace(scene.film, mode=mode))
        ways = given.way or chosen(scene, seed, given.ways)
        for found in compared(name, scene, ways, seed, given.samples):
            lit = max(found.means) > 0.0
            yield found if lit else {"scene": name, "way": found.way, "dark": True}
    except ClptError as error:
        yield {"scene": name, "refused": str(error)[:120]}
    except (AssertionError, ValueError, RuntimeError) as error:
        yield {"scene": name, "failed": f"{type(error).__name__}: {error}"[:400]}


def main() -> int:
    """Compare scenes; 1 where some differ, or cannot be rendered."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=200, help="that are drawn")
    parser.add_argument("--fixed", action="store_true", help="those of the tests before these")
    parser.add_argument("--file", action="append", default=[], type=FilePath, help="a scene more")
    parser.add_argument("--both", action="store_true", help="each in RGB and in spectral mode")
    parser.add_argument("--seed", type=int, default=1, help="of the first scene")
    parser.add_argument("--way", action="append", choices=list(WAYS), help="in place of drawn ones")
    parser.add_argument("--ways", type=int, default=1, help="of a scene, drawn too; at most")
    parser.add_argument("--samples", type=int, default=SAMPLES, help="of each exposure")
    given = parser.parse_args()
    scenes = dict(SCENES) if given.fixed else {}
    scenes |= {str(path): functools.partial(read, path) for path in given.file}
    seeds = range(given.seed, given.seed + given.scenes)
    scenes |= {f"seed {seed}": functools.partial(drawn, seed) for seed in seeds}
    found: list[Comparison] = []
    failed = 0
    for seed, (name, made) in enumerate(scenes.items(), given.seed):
        for mode in ("rgb", "spectral") if given.both else (None,):
            for one in attempt(name, made, mode, seed, given):
                if isinstance(one, Comparison):
                    found.append(one)
                else:
                    failed += "failed" in one
                print(json.dumps(one.row() if isinstance(one, Comparison) else one), flush=True)
    different = judged(found, given.seed, given.samples)
    for one in found:
        if one.called:
            print(json.dumps(one.row()), flush=True)
    blocks_ = sum(one.p.size for one in found)
    least = min((float(one.p.min()) for one in found if one.p.size), default=1.0)
    total: dict[str, Any] = {
        "comparisons": len(found), "blocks": blocks_, "called": sum(o.called for o in found),
        "least_p": least, "bonferroni": min(1.0, least * blocks_),
    }  # fmt: skip
    print(json.dumps({**total, "different": len(different), "failed": failed}))
    return int(bool(different) or failed > 0)


if __name__ == "__main__":
    sys.exit(main())
