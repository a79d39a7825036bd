"""Photons and a guide of directions: light paths leave them for paths from the camera.

Here stand the number of photons in a pass, the radius of the disks that gather them, the cells of
the guide (transport/guiding/guide.cl), and the number of light paths that train it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from clpt.records import PHOTON
from clpt.render.geometry.find import Geometry
from clpt.scene.cameras import Camera
from clpt.scene.integrators import MOST_GUIDE_PATHS, Vcm

# of a path with photon merging, whose vertices have places in memory; many files ask for 65
DEEPEST = 65
FIRST_STORED = 2  # the surface of a light path that may store its first photon
MIB = 1 << 20
FEWEST_CELLS = 1 << 10
GROUPS = 8  # of wavelengths, where light disperses
FEW_GROUPS = 2
RADIUS = 1.25  # of a disk in pixels
LEAST, MOST = 5e-4, 1e-2  # radii, over that of the scene
SPLITS = 24  # rounds of splitting triangles that look large from the camera
MOST_SPLIT = 1 << 15  # in a round
BOX = np.array(  # numbers of the corners of a box's sides: bit k is the end along axis k
    [
        (0, 1, 3), (0, 3, 2), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4),
        (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 3, 7), (1, 7, 5),
    ]
)  # fmt: skip
PHOTON_WORDS = PHOTON.words + 2  # with the number of its cell, and its place in the order
PHOTON_BYTES = 4 * PHOTON_WORDS


def photon_places(integrator: Vcm) -> int:
    """Return the most photons of a light path: all its surfaces but the first and last."""
    depth = integrator.max_depth
    return (DEEPEST if depth < 0 else min(depth, DEEPEST)) - FIRST_STORED


def photon_pixels(integrator: Vcm, number: int) -> int:
    """Return the number of pixels whose light paths store photons, at most `number`.

    It is at least 1: the least memory, 1 MiB, holds all photons of a pixel.
    """
    each = PHOTON_BYTES * photon_places(integrator) * integrator.light_paths
    return min(number, integrator.photon_memory * MIB // each)


def first_radius(
    camera: Camera, geometry: Geometry, film: tuple[int, int], scene_radius: float
) -> float:
    """Return the radius for a picture [m]: some pixels at the distance of visible surfaces.

    film: width and height of the whole [pixels]; scene_radius: of a sphere around the scene [m].
    The distance of surfaces is the median over the picture, as if no surface hid another. The
    radius is a power of the square root of 2, so that small changes of a scene rarely change it.
    """
    least, most = LEAST * scene_radius, MOST * scene_radius
    view = camera.view_of(*film)
    if view is None:
        return _rounded(math.sqrt(least * most))
    far = _median_distance(_triangles(geometry) - view.origin, view.axis, view.angle)
    pixel = far * view.width / film[0]
    return _rounded(float(np.clip(RADIUS * pixel, least, most)) if far else least)


def _rounded(radius: float) -> float:
    """The nearest power of the square root of 2."""
    return float(2.0 ** (round(2.0 * math.log2(radius)) / 2.0))


def _median_distance(triangles: NDArray[np.float64], axis: NDArray, angle: float) -> float:
    """The median distance [m] of surfaces in a cone from the origin; 0 if the cone is empty.

    triangles: (n, 3, 3); axis: of the cone, unit length; angle: from the axis to the edge of the
    cone [rad]. Triangles that look large are split.
    """
    kept = []
    for _ in range(SPLITS):
        middles, distance, size = _measures(triangles)
        apart = np.arccos(np.clip(middles @ axis / distance, -1.0, 1.0))
        seen = apart < angle + np.arcsin(np.minimum(size / distance, 1.0))
        large = seen & (size > distance / 4.0)
        if not large.any() or large.sum() > MOST_SPLIT:
            break
        a, b, c = np.moveaxis(triangles[large], 1, 0)
        ab, bc, ca = (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        halves = np.concatenate([np.stack(part, axis=1) for part in parts])
        kept.append(triangles[seen & ~large])
        triangles = halves
    triangles = np.concatenate([*kept, triangles])
    middles, distance, _ = _measures(triangles)
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    share = np.abs((across * middles).sum(axis=1)) / distance**3
    share[middles @ axis < math.cos(angle) * distance] = 0.0
    order = np.argsort(distance)
    summed = np.cumsum(share[order])
    if not len(summed) or not summed[-1] > 0.0:
        return 0.0
    return float(distance[order][np.searchsorted(summed, summed[-1] / 2.0)])


def _measures(triangles: NDArray[np.float64]) -> tuple[NDArray, NDArray, NDArray]:
    """Return the middles of triangles, their distances from the origin, and the longest sides."""
    middles = triangles.mean(axis=1)
    sides = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2)
    return middles, np.maximum(np.linalg.norm(middles, axis=1), 1e-30), sides.max(axis=1)


def _triangles(geometry: Geometry) -> NDArray[np.float64]:
    """The corners (n, 3, 3) of triangles, and of the sides of boxes around all other shapes [m]."""
    world = geometry.faces.max(axis=1, initial=0) < geometry.world_vertices
    corners = geometry.vertices[geometry.faces[world]].astype(np.float64)
    boxes = np.concatenate([geometry.boxes, geometry.instances.boxes]).astype(np.float64)
    units = np.array([[i >> axis & 1 for axis in range(3)] for i in range(8)])
    points = boxes[:, None, 0] + (boxes[:, None, 1] - boxes[:, None, 0]) * units
    return np.concatenate([corners, points[:, BOX].reshape(-1, 3, 3)])


GUIDE_CELLS = 1 << 15  # rows, a power of two
GUIDE_SIDE = 0.14  # of a cell, over the scene's radius
FINE_GUIDE_PATHS = MOST_GUIDE_PATHS  # with so many light paths cells are smaller
FINE_GUIDE_CELLS, FINE_GUIDE_SIDE = 1 << 16, 0.1
GUIDE_BINS = 256  # of a row
GUIDE_PATHS = 1 << 20  # light paths that train a guide
LONG_GUIDE_PATHS = 1 << 22  # the most light paths of a guide that a trial has chosen
LESSON = 8  # samples of the film for each light path of such a guide
LONG_LESSON = 64  # the same beyond LONG_PATHS


def guide_paths_for(samples: int) -> int:
    """Return the number of light paths that train a guide; samples: of the whole film.

    A light path takes about as long as a sample; four times as many light paths leave .7 to .9 of
    the variance.
    """
    some = min(max(_power_below(samples // LESSON), GUIDE_PATHS), LONG_GUIDE_PATHS)
    return max(some, min(_power_below(samples // LONG_LESSON), MOST_GUIDE_PATHS))


def guide_cells_for(paths: int) -> tuple[int, float]:
    """Return the rows of a guide, and the side of its cells over the scene's radius.

    paths: light paths that train it.
    """
    fine = paths >= FINE_GUIDE_PATHS
    return (FINE_GUIDE_CELLS, FINE_GUIDE_SIDE) if fine else (GUIDE_CELLS, GUIDE_SIDE)


def _power_below(number: int) -> int:
    """The largest power of two up to a number."""
    return 1 << max(number.bit_length() - 1, 0)
