"""Fixed scenes and sizes of the picture benchmark, and the speeds of 1000 points.

After a change here or to the scenes, raise BENCHMARK_VERSION and write new references by
`python -m clpt.bench.make_references`.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from clpt.bench.scenes import build_scene
from clpt.scene import Scene
from clpt.scene.integrators import Box, Film

BENCHMARK_VERSION = 1


@dataclass(frozen=True)
class Size:
    """Width and height of a square picture [pixels], a multiple of 8, and its samples a pixel."""

    side: int
    samples: int

    @property
    def all_samples(self) -> int:
        """Samples of all pixels together."""
        return self.side**2 * self.samples


@dataclass(frozen=True)
class Kept:
    """The mode of a scene, and the speed [Msamples/s] that counts 1000 points."""

    mode: str
    reference: float


SIZES = {"quick": Size(128, 64), "standard": Size(384, 64), "large": Size(1024, 128)}
PICTURES = {  # speeds of about two cores with AVX-512, by PoCL
    "cornell": Kept("rgb", 10.0),
    "atrium": Kept("rgb", 1.0),
    "spheres": Kept("rgb", 20.0),
    "glass": Kept("spectral", 12.0),
    "mist": Kept("spectral", 5.0),
}


def picture(name: str, size: str, seed: int = 0) -> Scene:
    """Return a scene of PICTURES with a box filter and a film whose size is a key of SIZES.

    Raises UnknownKindError for a scene that the benchmark does not have.
    """
    scene, side = build_scene(name), SIZES[size].side
    film = Film(width=side, height=side, mode=PICTURES[name].mode, filter=Box())
    return dataclasses.replace(scene, film=film, seed=seed, spp=SIZES[size].samples)
