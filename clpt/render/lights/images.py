"""Images around the scene: texels, and a grid to choose directions by.

A grid has a weight at every corner of its cells and is bilinear inside them; it follows radiance
times solid angle. Cells are chosen by blocks, see clpt.render.lights.block_grids, points
in a cell by the bilinear function itself (kernels/core/grid.cl).
"""

from __future__ import annotations

import dataclasses
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import images, transforms
from clpt.arrays import Floats32, fits_single
from clpt.errors import SceneError
from clpt.images import spectral_exr
from clpt.images.spectral_exr import SpectralImage
from clpt.render.lights import block_grids
from clpt.render.records.lowering_cache import version
from clpt.render.spectra.look import Look
from clpt.render.textures.texels import bands, texels
from clpt.scene.lights import CubeMap, Envmap, Sky
from clpt.scene.roles import EMISSION
from clpt.spectra import Tabulated, luminance

PARTS = 128  # of an image's side, in which bright directions are told from dark ones
UNSEEN = 0.1  # share of the mean over bands in the weight of a texel: light of no colour counts too

FACES = "+x -x +y -y +z -z"
# Columns and rows of the faces in crosses of 4x3 and 3x4; the last one stands on its head.
_WIDE = ((2, 1), (0, 1), (1, 0), (1, 2), (1, 1), (3, 1))
_TALL = ((2, 1), (0, 1), (1, 0), (1, 2), (1, 1), (1, 3))


class Content(NamedTuple):
    """An image light as texels, and cells to choose among by their mean weights.

    grid: how blocks of cells and the cells in them are chosen; bands, number: of texels that are
    spectra, how many values they have, and which one by wavelength; notes: warnings of parts of
    files that are left out.
    """

    width: int
    height: int
    texels: Floats32
    corners: NDArray[Any]
    grid: block_grids.BlockGrid
    bands: int = 0
    number: Tabulated | None = None
    notes: tuple[str, ...] = ()


def extent(lamp: Envmap | CubeMap, look: Look, share: float) -> float:
    """Return the part of the sphere, 0 to 1, that sends a share of an image light's power.

    It has the brightest directions, and is 1 of a black image. It is counted in blocks, PARTS
    along each side of an image.
    """
    made = content(lamp, look)
    if isinstance(lamp, Envmap):
        even = _even(made.corners)
    else:
        even = _cube_weights(np.ones((6, made.height + 2, made.width + 2), np.float32))
    power, angle = _in_parts(made.corners), _in_parts(even)
    brightest = np.argsort(-power / angle)
    sums = np.cumsum(power[brightest])
    if not sums[-1] > 0.0:
        return 1.0
    held = np.searchsorted(sums, share * sums[-1]) + 1
    return float(angle[brightest[:held]].sum() / angle.sum())


def _in_parts(weights: NDArray[Any]) -> NDArray[np.float64]:
    """Sums (n,) over the blocks of grids (k, rows, columns)."""
    sums = weights
    for axis in (2, 1):
        length = weights.shape[axis]
        sums = np.add.reduceat(sums, np.arange(0, length, -(-length // PARTS)), axis=axis)
    return sums.ravel().astype(np.float64)


def content(lamp: Envmap | CubeMap, look: Look) -> Content:
    """Return what an image light is made of, found once. Raises SceneError for what is no image."""
    given = lamp.image, lamp.scale, look.spectral
    by = version(lamp.image), *given[1:]
    if isinstance(lamp, CubeMap):
        return look.cache(_cube, *given, by=by)
    ends = look.lo, look.hi, lamp.mis_compensation
    return look.cache(_sphere, *given, *ends, by=(*by, *ends))


def mean_radiance(lamp: Envmap | CubeMap, made: Content) -> float:
    """Return the mean over all directions of an image light's radiance."""
    if isinstance(lamp, Envmap):
        cell = np.pi / (made.height - 1) * 2.0 * np.pi / made.width
    else:
        cell = made.width**-2.0
    return made.grid.total * cell / (4.0 * np.pi)


def _sphere(
    given: object, scale: float, spectral: bool, lo: float, hi: float, compensated: bool
) -> Content:
    """An image in latitude and longitude, its spectra from lo to hi [nm].

    compensated: its directions are chosen for what a material's own do not find.
    """
    where = "envmap.image"
    found = spectral_exr.find(given, emissive=True, where=where)
    notes: list[str] = []
    image = _loaded(given if found is None else found.to_rgb(), where, notes)
    image = _at_least_two_rows(image * np.float32(scale))
    height, width, _ = image.shape
    if found is None or not spectral:
        corners = _latitude_weights(_brightness(image))[None]
        values = texels(image.reshape(1, -1, 3), EMISSION, spectral)
        return Content(
            width,
            height,
            values,
            corners,
            _sphere_blocks(corners, compensated),
            notes=tuple(notes),
        )
    found = _scaled(found, scale, where)
    corners = _latitude_weights(luminance(image) + UNSEEN * _brightness(found.values))[None]
    values, number = bands(found, lo, hi)
    grid = _sphere_blocks(corners, compensated)
    return Content(width, height, values, corners, grid, values.shape[1], number)


def _sphere_blocks(corners: NDArray[Any], compensated: bool) -> block_grids.BlockGrid:
    """The blocks of weights (1, h, w + 1); compensated: as of `_sphere`."""
    directions = partial(sphere_directions, corners.shape[2] - 1)
    return block_grids.of(corners, directions, even=_even(corners) if compensated else None)


def _even(corners: NDArray[Any]) -> NDArray[Any]:
    """The weights of a light that is 1 everywhere, of the shape of those of an image."""
    column = _latitude_weights(np.ones((corners.shape[1], 1), np.float32))[None, :, :1]
    return np.broadcast_to(column, corners.shape)


def _cube(given: object, scale: float, spectral: bool) -> Content:
    """The faces of a cube, with their borders."""
    notes: list[str] = []
    faces = _faces(given, "cube_map.image", notes) * np.float32(scale)
    image, size = _bordered(faces), faces.shape[1]
    corners = _cube_weights(_brightness(image))
    values = texels(image.reshape(1, -1, 3), EMISSION, spectral)
    grid = block_grids.of(corners, cube_directions)
    return Content(size, size, values, corners, grid, notes=tuple(notes))


def axes_of(lamp: Envmap | CubeMap | Sky) -> NDArray[np.float64]:
    """Return where the light's own axes point, the columns of (3, 3)."""
    matrix = np.asarray(lamp.to_world, np.float64)
    where = f"{lamp.kind}.to_world"
    if matrix.shape != (4, 4) or transforms.is_singular(matrix) or not fits_single(matrix):
        raise SceneError("must be an invertible (4, 4) matrix", where=where)
    axes = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
    if np.abs(axes.T @ axes - np.eye(3)).max() > 1e-5:
        raise SceneError("must be a rotation: this one shears", where=where)
    return axes


def _at_least_two_rows(values: Floats32) -> Floats32:
    """An image (h, w, n) with a row for each pole."""
    return np.repeat(values, 2, axis=0) if len(values) == 1 else values


def _scaled(image: SpectralImage, scale: float, where: str) -> SpectralImage:
    """An image of spectra as a light's texels. Raises SceneError if a value is not finite."""
    values = _at_least_two_rows(image.values * np.float32(scale))
    if not np.isfinite(values).all():
        raise SceneError("has a texel that is not finite", where=where)
    return dataclasses.replace(image, values=np.maximum(values, np.float32(0.0)))


def _loaded(image: object, where: str, notes: list[str]) -> Floats32:
    """An image as (h, w, 3) float32 without negative values. Raises SceneError.

    notes: gets what its file says that is left out.
    """
    if spectral_exr.find(image, emissive=True, where=where) is not None:
        raise SceneError("spectral images can be an envmap only", where=where)
    if isinstance(image, (str, Path)):
        stored = images.read_stored(image)
        notes += [f"{image}: {note}" for note in stored.notes_of(raw=False)]
        stored = images.from_array(stored.decoded(), where)
    else:
        stored = images.from_array(image, where)
    values = stored.decoded()
    values = np.repeat(values, 3, axis=2) if values.shape[2] == 1 else values[..., :3]
    if not np.isfinite(values).all():
        raise SceneError("has a texel that is not finite", where=where)
    return np.maximum(values, np.float32(0.0))


def _faces(image: object, where: str, notes: list[str]) -> Floats32:
    """The six faces of a cube map (6, n, n, 3), in the order of FACES; notes: as of `_loaded`."""
    if isinstance(image, (list, tuple)) or (isinstance(image, np.ndarray) and image.ndim == 4):
        if len(image) != 6:
            raise SceneError(f"six faces are needed ({FACES}), found {len(image)}", where=where)
        faces = [_loaded(face, where, notes) for face in image]
    else:
        cross = _loaded(image, where, notes)
        height, width, _ = cross.shape
        if width * 3 == height * 4:
            n, places = width // 4, _WIDE
        elif width * 4 == height * 3:
            n, places = width // 3, _TALL
        else:
            raise SceneError(
                f"one image must be a cross of 4x3 or 3x4 faces, found {width}x{height}",
                where=where,
            )
        faces = [cross[r * n : (r + 1) * n, c * n : (c + 1) * n] for c, r in places]
        if places is _TALL:
            faces[5] = faces[5][::-1, ::-1]
    if any(face.shape != (faces[0].shape[0],) * 2 + (3,) for face in faces):
        raise SceneError("the faces must be squares of one size", where=where)
    return np.stack(faces).astype(np.float32)


def face_directions(a: ArrayLike, b: ArrayLike) -> NDArray[np.float64]:
    """Directions (6, ..., 3), not normalised, at face coordinates: a to the right, b down, [-1, 1].

    OpenGL's cube map (OpenGL 4.6 core, table 8.19).
    """
    a, b = np.broadcast_arrays(np.asarray(a, np.float64), np.asarray(b, np.float64))
    one = np.ones_like(a)
    rows = [(one, -b, -a), (-one, -b, a), (a, one, b), (a, -one, -b), (a, -b, one), (-a, -b, -one)]
    return np.stack([np.stack(row, axis=-1) for row in rows])


def sphere_directions(width: int, row: ArrayLike, column: ArrayLike) -> NDArray[np.float64]:
    """Directions (..., 3) at places of a grid in latitude and longitude, rows and columns 0 to 1.

    The grid begins in the middle of the first of `width` texels.
    """
    theta = np.pi * np.asarray(row, np.float64)
    phi = 2.0 * np.pi * (np.asarray(column, np.float64) + 0.5 / width)
    sine = np.sin(theta)
    return np.stack([np.sin(phi) * sine, np.cos(theta), -np.cos(phi) * sine], axis=-1)


def cube_directions(row: ArrayLike, column: ArrayLike) -> NDArray[np.float64]:
    """Directions (..., 3) at places of six faces, one below the other, rows and columns 0 to 1."""
    within, face = np.modf(np.minimum(6.0 * np.asarray(row, np.float64), 5.999999))
    d = face_directions(2.0 * np.asarray(column) - 1.0, 2.0 * within - 1.0)
    d = np.take_along_axis(d, face.astype(np.int64)[None, ..., None], axis=0)[0]
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def face_coordinates(d: ArrayLike) -> tuple[NDArray[np.int64], Any, Any]:
    """The face that a direction (..., 3) meets, and a and b there."""
    x, y, z = np.moveaxis(np.asarray(d, np.float64), -1, 0)
    major = np.argmax(np.abs([x, y, z]), axis=0)
    size = np.choose(major, np.abs([x, y, z]))
    negative = np.choose(major, [x, y, z]) < 0.0
    face = 2 * major + negative
    a = np.choose(face, [-z, z, x, x, x, -x]) / size
    b = np.choose(face, [-y, -y, z, -z, -y, -y]) / size
    return face, a, b


def _bordered(faces: Floats32) -> Floats32:
    """The faces (6, n + 2, n + 2, 3) with the nearest texels of their neighbours around them."""
    n = faces.shape[1]
    centers = (np.arange(-1, n + 1) + 0.5) / n * 2.0 - 1.0
    around = np.ones((n + 2, n + 2), bool)
    around[1:-1, 1:-1] = False
    rows, columns = np.nonzero(around)
    face, a, b = face_coordinates(face_directions(centers[columns], centers[rows]))
    column, row = (np.clip(((c + 1.0) * 0.5 * n).astype(int), 0, n - 1) for c in (a, b))
    bordered = np.empty((6, n + 2, n + 2, 3), np.float32)
    bordered[:, 1:-1, 1:-1] = faces
    bordered[:, rows, columns] = faces[face, row, column]
    return bordered


def _brightness(image: Floats32) -> Floats32:
    """The mean over the last axis; a product is many times faster than a sum over few."""
    count = image.shape[-1]
    return image @ np.full(count, 1.0 / count, np.float32)


def _latitude_weights(bright: Floats32) -> Floats32:
    """Weights (h, w + 1) at the texels' centres; the first column comes again at the end."""
    height, width = bright.shape
    rows = np.arange(height, dtype=np.float64)
    rows[0], rows[-1] = 0.25, height - 1.25  # the poles have no area, but light comes from there
    weights = np.empty((height, width + 1), np.float32)
    sines = np.sin(np.pi * rows / (height - 1)).astype(np.float32)
    np.multiply(bright, sines[:, None], out=weights[:, :width])
    weights[:, width] = weights[:, 0]
    return weights


def _cube_weights(bright: Floats32) -> NDArray[np.float64]:
    """Weights (6, 2n + 1, 2n + 1) at the texels' edges and centres, of bordered faces."""
    n = bright.shape[1] - 2
    wide = np.empty((6, 2 * n + 1, n + 2))
    wide[:, 1::2], wide[:, ::2] = bright[:, 1:-1], 0.5 * (bright[:, 1:] + bright[:, :-1])
    weights = np.empty((6, 2 * n + 1, 2 * n + 1))
    weights[..., 1::2], weights[..., ::2] = wide[..., 1:-1], 0.5 * (wide[..., 1:] + wide[..., :-1])
    return weights * _cube_angles(n)


@lru_cache(maxsize=2)
def _cube_angles(n: int) -> NDArray[np.float64]:
    """Solid angles (2n + 1, 2n + 1) of equal areas at the places of `_cube_weights`, on a scale."""
    at = np.linspace(-1.0, 1.0, 2 * n + 1)
    angles = (1.0 + at[None, :] ** 2 + at[:, None] ** 2) ** -1.5
    angles.flags.writeable = False
    return np.asarray(angles, np.float64)
