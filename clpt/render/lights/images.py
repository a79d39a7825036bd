"""Images around the scene, of files and of the sky: texels, and a grid to choose directions by.

A grid has a weight, radiance times solid angle, at every corner of its cells and is bilinear inside
them. Cells are chosen by blocks, see clpt.render.lights.block_grids; points in a cell by the
bilinear function itself (kernels/core/grid.cl).
"""

from __future__ import annotations

import dataclasses
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import images
from clpt.arrays import Floats, Floats32
from clpt.errors import SceneError
from clpt.files import budget, disk_cache
from clpt.images import spectral_exr
from clpt.images.spectral_exr import SpectralImage
from clpt.render.lights import block_grids
from clpt.render.lights.block_grids import grid_members
from clpt.render.lights.check import rotation
from clpt.render.materials.encoder import Encoder
from clpt.render.records.tables import version
from clpt.render.spectra.find import Look
from clpt.render.textures.texels import bands, negative_notes, texels
from clpt.scene.lights import CubeMap, Envmap, Light, Sky
from clpt.scene.params import fields_of
from clpt.scene.pixels import image_file
from clpt.scene.roles import EMISSION
from clpt.sky import dome
from clpt.sky.dome import (
    COLUMNS,
    ROWS,
    SUN_COLUMNS,
    SUN_RADIUS,
    SUN_ROWS,
    directions,
    elevations,
    horizon,
)
from clpt.spectra import Tabulated, air, data, luminance
from clpt.spectra.air import LAMBDAS

PARTS = 128  # blocks along an image's side; each is a bright or a dark direction
UNSEEN = 0.1  # share of the mean over bands in a texel's weight: invisible light counts too

FACES = "+x -x +y -y +z -z"
# Columns and rows of the faces in crosses of 4x3 and 3x4; the last face is upside down.
_WIDE = ((2, 1), (0, 1), (1, 0), (1, 2), (1, 1), (3, 1))
_TALL = ((2, 1), (0, 1), (1, 0), (1, 2), (1, 1), (1, 3))


class Content(NamedTuple):
    """An image light as texels, and cells to choose among by their mean weights.

    grid: chooses blocks of cells and cells in them; bands: values of a spectral texel;
    number: of the band by wavelength; notes: warnings of ignored parts of files.
    """

    width: int
    height: int
    texels: Floats32
    corners: NDArray[Any]
    grid: block_grids.BlockGrid
    bands: int = 0
    number: Tabulated | None = None
    notes: tuple[str, ...] = ()

    @property
    def strength(self) -> float:
        """The mean of its radiance over all directions."""
        if len(self.corners) == 1:
            cell = np.pi / (self.height - 1) * 2.0 * np.pi / self.width
        else:
            cell = self.width**-2.0
        return self.grid.total * cell / (4.0 * np.pi)

    def extent(self, share: float) -> float:
        """Return the fraction of the sphere, 0 to 1, that emits a share of the power.

        The brightest directions count first, in blocks, PARTS along each side of an image. 1 for a
        black image.
        """
        if len(self.corners) == 1:
            even = _even(self.corners)
        else:
            even = _cube_weights(np.ones((6, self.height + 2, self.width + 2), np.float32))
        power, angle = _in_parts(self.corners), _in_parts(even)
        brightest = np.argsort(-power / angle)
        sums = np.cumsum(power[brightest])
        if not sums[-1] > 0.0:
            return 1.0
        held = np.searchsorted(sums, share * sums[-1]) + 1
        return float(angle[brightest[:held]].sum() / angle.sum())

    def record(self, lamp: Light, encoder: Encoder) -> tuple[str, dict[str, ArrayLike]]:
        """Append the texels and the grid; return the name and the members of the record.

        Raises SceneError for a transform that is no rotation.
        """
        axes = rotation(lamp)
        encoder.warnings.update(self.notes)
        members: dict[str, ArrayLike] = {name: axes[:, i] for i, name in enumerate("xyz")}
        members |= {
            "width": self.width,
            "height": self.height,
            "texels": encoder.store.append_floats("texels", self.texels),
            **grid_members(self.corners, self.grid, encoder),
        }
        if self.number is None:
            return lamp.kind, members
        members |= {"bands": self.bands, "number": encoder.spectra.row(self.number)}
        return f"spectral_{lamp.kind}", members


def _in_parts(weights: NDArray[Any]) -> NDArray[np.float64]:
    """Return sums (n,) over the blocks of grids (k, rows, columns)."""
    sums = weights
    for axis in (2, 1):
        length = weights.shape[axis]
        sums = np.add.reduceat(sums, np.arange(0, length, -(-length // PARTS)), axis=axis)
    return sums.ravel().astype(np.float64)


def envmap_content(lamp: Envmap, look: Look) -> Content:
    """Return the content of an envmap, cached. Raises SceneError for an unreadable image."""
    source = lamp.image, lamp.scale, look.spectral, look.lo, look.hi, lamp.mis_compensation
    return look.cache(_sphere, *source, by=(version(lamp.image), *source[1:]))


def cube_content(lamp: CubeMap, look: Look) -> Content:
    """Return the content of a cube map, cached. Raises SceneError for an unreadable image."""
    source = lamp.image, lamp.scale, look.spectral
    return look.cache(_cube, *source, by=(version(lamp.image), *source[1:]))


def _sphere(
    source: object, scale: float, spectral: bool, lo: float, hi: float, compensated: bool
) -> Content:
    """Return an image in latitude and longitude, with spectra from lo to hi [nm].

    compensated: directions are chosen for light that sampling of materials misses.
    """
    where = "envmap.image"
    spectra = spectral_exr.find(source, emissive=True, where=where)
    notes: list[str] = []
    if spectra is None:
        image = _loaded(source, where, notes)
    else:  # the colour of a spectrum may be negative
        image = _loaded(spectra.to_rgb(), where, notes, tells=False)
    image = _at_least_two_rows(image * np.float32(scale))
    height, width, _ = image.shape
    if spectra is None or not spectral:
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
    notes += negative_notes(spectra.values, image_file(source) or where)
    spectra = _scaled(spectra, scale, where)
    corners = _latitude_weights(luminance(image) + UNSEEN * _brightness(spectra.values))[None]
    values, number = bands(spectra, lo, hi)
    grid = _sphere_blocks(corners, compensated)
    return Content(width, height, values, corners, grid, values.shape[1], number, tuple(notes))


def _sphere_blocks(corners: NDArray[Any], compensated: bool) -> block_grids.BlockGrid:
    directions = partial(sphere_directions, corners.shape[2] - 1)
    return block_grids.of(corners, directions, even=_even(corners) if compensated else None)


def _even(corners: NDArray[Any]) -> NDArray[Any]:
    """Return the weights of a light of radiance 1, in the shape of an image's weights."""
    column = _latitude_weights(np.ones((corners.shape[1], 1), np.float32))[None, :, :1]
    return np.broadcast_to(column, corners.shape)


def _cube(source: object, scale: float, spectral: bool) -> Content:
    """Return the faces of a cube, with their borders."""
    notes: list[str] = []
    faces = _faces(source, "cube_map.image", notes) * np.float32(scale)
    image, size = _bordered(faces), faces.shape[1]
    corners = _cube_weights(_brightness(image))
    values = texels(image.reshape(1, -1, 3), EMISSION, spectral)
    grid = block_grids.of(corners, cube_directions)
    return Content(size, size, values, corners, grid, notes=tuple(notes))


def _at_least_two_rows(values: Floats32) -> Floats32:
    """Return an image (h, w, n) with a row for each pole."""
    return np.repeat(values, 2, axis=0) if len(values) == 1 else values


def _scaled(image: SpectralImage, scale: float, where: str) -> SpectralImage:
    """Return an image of spectra times a scale. Raises SceneError if a value is not finite."""
    values = _at_least_two_rows(image.values * np.float32(scale))
    budget.check_time()
    if not np.isfinite(values).all():
        raise SceneError("has a texel that is not finite", where=where)
    return dataclasses.replace(image, values=np.maximum(values, np.float32(0.0)))


def _loaded(image: object, where: str, notes: list[str], *, tells: bool = True) -> Floats32:
    """Return an image as (h, w, 3) float32 without negative values. Raises SceneError.

    notes: warnings of ignored parts of its file are appended, and if it tells, of negative values.
    """
    if spectral_exr.find(image, emissive=True, where=where) is not None:
        raise SceneError("spectral images can be an envmap only", where=where)
    if (file := image_file(image)) is not None:
        stored = images.read_stored(file)
        notes += [f"{file}: {note}" for note in stored.notes_of(raw=False)]
        stored = images.from_array(stored.decoded(), where)
    else:
        stored = images.from_array(image, where)
    values = stored.decoded()
    values = np.repeat(values, 3, axis=2) if values.shape[2] == 1 else values[..., :3]
    if not np.isfinite(values).all():
        raise SceneError("has a texel that is not finite", where=where)
    if tells:
        notes += negative_notes(values, file or where)
    return np.maximum(values, np.float32(0.0))


def _faces(image: object, where: str, notes: list[str]) -> Floats32:
    """Return the faces of a cube map (6, n, n, 3), in the order of FACES; notes: see `_loaded`."""
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
    """Return directions (6, ..., 3), not normalised, at face coordinates in [-1, 1].

    a runs to the right, b down.

    OpenGL's cube map (OpenGL 4.6 core, table 8.19).
    """
    a, b = np.broadcast_arrays(np.asarray(a, np.float64), np.asarray(b, np.float64))
    unit = np.ones_like(a)
    rows = [
        (unit, -b, -a), (-unit, -b, a), (a, unit, b), (a, -unit, -b), (a, -b, unit), (-a, -b, -unit)
    ]  # fmt: skip
    return np.stack([np.stack(row, axis=-1) for row in rows])


def sphere_directions(width: int, row: ArrayLike, column: ArrayLike) -> NDArray[np.float64]:
    """Return directions (..., 3) at points of a latitude-longitude grid, rows and columns 0 to 1.

    The grid begins in the middle of the first of `width` texels.
    """
    theta = np.pi * np.asarray(row, np.float64)
    phi = 2.0 * np.pi * (np.asarray(column, np.float64) + 0.5 / width)
    sine = np.sin(theta)
    return np.stack([np.sin(phi) * sine, np.cos(theta), -np.cos(phi) * sine], axis=-1)


def cube_directions(row: ArrayLike, column: ArrayLike) -> NDArray[np.float64]:
    """Return directions (..., 3) at points of six stacked faces, rows and columns 0 to 1."""
    within, face = np.modf(np.minimum(6.0 * np.asarray(row, np.float64), 5.999999))
    d = face_directions(2.0 * np.asarray(column) - 1.0, 2.0 * within - 1.0)
    d = np.take_along_axis(d, face.astype(np.int64)[None, ..., None], axis=0)[0]
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def face_coordinates(d: ArrayLike) -> tuple[NDArray[np.int64], Any, Any]:
    """Return the face that a direction (..., 3) meets, and the coordinates a and b there."""
    x, y, z = np.moveaxis(np.asarray(d, np.float64), -1, 0)
    major = np.argmax(np.abs([x, y, z]), axis=0)
    size = np.choose(major, np.abs([x, y, z]))
    negative = np.choose(major, [x, y, z]) < 0.0
    face = 2 * major + negative
    a = np.choose(face, [-z, z, x, x, x, -x]) / size
    b = np.choose(face, [-y, -y, z, -z, -y, -y]) / size
    return face, a, b


def _bordered(faces: Floats32) -> Floats32:
    """Return faces (6, n + 2, n + 2, 3), bordered by the nearest texels of their neighbours."""
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
    """Return the mean over the last axis; a product is faster than a sum over few values."""
    count = image.shape[-1]
    return image @ np.full(count, 1.0 / count, np.float32)


def _latitude_weights(bright: Floats32) -> Floats32:
    """Return weights (h, w + 1) at texels' centres; the last column repeats the first."""
    height, width = bright.shape
    rows = np.arange(height, dtype=np.float64)
    rows[0], rows[-1] = 0.25, height - 1.25  # the poles have no area, but light comes from there
    weights = np.empty((height, width + 1), np.float32)
    sines = np.sin(np.pi * rows / (height - 1)).astype(np.float32)
    np.multiply(bright, sines[:, None], out=weights[:, :width])
    weights[:, width] = weights[:, 0]
    return weights


def _cube_weights(bright: Floats32) -> NDArray[np.float64]:
    """Return weights (6, 2n + 1, 2n + 1) of bordered faces at texels' edges and centres."""
    n = bright.shape[1] - 2
    wide = np.empty((6, 2 * n + 1, n + 2))
    wide[:, 1::2], wide[:, ::2] = bright[:, 1:-1], 0.5 * (bright[:, 1:] + bright[:, :-1])
    weights = np.empty((6, 2 * n + 1, 2 * n + 1))
    weights[..., 1::2], weights[..., ::2] = wide[..., 1:-1], 0.5 * (wide[..., 1:] + wide[..., :-1])
    return weights * _cube_angles(n)


@lru_cache(maxsize=2)
def _cube_angles(n: int) -> NDArray[np.float64]:
    """Return relative solid angles (2n + 1, 2n + 1) of equal areas at points of `_cube_weights`."""
    at = np.linspace(-1.0, 1.0, 2 * n + 1)
    angles = (1.0 + at[None, :] ** 2 + at[:, None] ** 2) ** -1.5
    angles.flags.writeable = False
    return np.asarray(angles, np.float64)


MOST = 0.75  # share of samples that the sun may take


class SkyContent(NamedTuple):
    """The radiance of a sky.

    texels, sun (n, bands or 4): of the dome and of the sun's disc; number: band by wavelength of
    spectra; corners, grid: to choose directions by; sun_share: of samples; strength: mean radiance.
    """

    texels: NDArray[np.float32]
    sun: NDArray[np.float32]
    number: Tabulated | None
    corners: Floats
    grid: block_grids.BlockGrid
    sun_share: float
    strength: float

    def extent(self, share: float) -> float:
        """Return 0 if the sun's disc gets such a share of the samples, else 1."""
        return 0.0 if self.sun_share >= share else 1.0

    def record(self, lamp: Light, encoder: Encoder) -> tuple[str, dict[str, ArrayLike]]:
        """Append the texels and the grid; return the name and the members of the record.

        Raises SceneError for a transform that is no rotation.
        """
        fields = fields_of(lamp)
        x, y, z = rotation(lamp).T
        turn, up = np.radians([fields[name] for name in ("sun_azimuth", "sun_elevation")])
        members: dict[str, ArrayLike] = {
            "x": np.cos(turn) * x - np.sin(turn) * z,
            "y": y,
            "z": np.sin(turn) * x + np.cos(turn) * z,
            "width": COLUMNS,
            "height": ROWS,
            "texels": encoder.store.append_floats("texels", self.texels),
            "sun_texels": encoder.store.append_floats("texels", self.sun),
            **grid_members(self.corners, self.grid, encoder),
            "horizon": horizon(fields["altitude"]),
            "sun_cos": np.cos(up),
            "sun_sin": np.sin(up),
            "sun_radius": np.sin(SUN_RADIUS),
            "sun_share": self.sun_share,
        }
        if self.number is None:
            return "sky", members
        members |= {"bands": self.texels.shape[1], "number": encoder.spectra.row(self.number)}
        return "spectral_sky", members


def sky_content(lamp: Sky, look: Look) -> SkyContent:
    """Return the radiance of a sky, cached."""
    source = *dome.numbers(lamp), look.spectral, look.lo, look.hi
    return look.cache(_sky_content, *source, by=(repr(source),))


def kept_sky(numbers: tuple[float, ...], ground: tuple[float, ...]) -> tuple[Floats, Floats]:
    """Return the arrays of `dome.unscaled`, from the cache folder if possible."""
    code = *Path(dome.__file__).parent.glob("*.py"), Path(air.__file__)
    tables = (data.ROOT / name for name in ("sky.csv", "air.csv"))
    text = repr((numbers, ground)).encode()
    around, disc = disk_cache.remembered(
        (*sorted(code), *tables), [text], lambda: dome.unscaled(numbers, ground)
    )
    return around, disc


def _sky_content(
    numbers: tuple[float, ...], ground: tuple[float, ...], spectral: bool, lo: float, hi: float
) -> SkyContent:
    """Return the content of a sky, with spectra from lo to hi [nm]."""
    around, sun = dome.images(kept_sky, numbers, ground)
    at = horizon(numbers[1])
    flat = (f.reshape(1, -1, f.shape[-1]) for f in (around, sun))
    images = [SpectralImage(f.astype(np.float32), LAMBDAS, True) for f in flat]
    colours = [np.maximum(image.to_rgb(), 0.0) for image in images]
    seen = [
        luminance(colour) + UNSEEN * image.values.mean(axis=2)
        for colour, image in zip(colours, images, strict=True)
    ]
    if spectral:
        (dome_texels, number), (disc, _) = bands(images[0], lo, hi), bands(images[1], lo, hi)
    else:
        dome_texels, disc = (texels(colour, EMISSION, False) for colour in colours)
    half = seen[0].reshape(2, ROWS + 1, -1)
    weights = np.concatenate([half, half[..., -2::-1]], axis=2).astype(np.float64)
    rows = np.clip(np.arange(ROWS + 1), 0.25, ROWS - 0.25) / ROWS
    root = np.stack([1.0 - rows, rows])
    span = np.array([0.5 * np.pi - at, 0.5 * np.pi + at])[:, None]
    angle = np.stack([elevations(at, rows), elevations(at, 1.0 + rows)])
    area = 2.0 * root * span * np.cos(angle) * 2.0 * np.pi / (ROWS * COLUMNS)
    corners = weights * area[..., None]
    cell = 2.0 * 0.5 * np.pi / ROWS, 2.0 * np.pi / COLUMNS
    grid = block_grids.of(corners, partial(directions, at), cell)
    shining = _sun_power(seen[1].reshape(SUN_ROWS, SUN_COLUMNS))
    total = grid.total + shining
    share = min(shining / total, MOST) if total > 0.0 else 0.0
    return SkyContent(
        dome_texels, disc, number if spectral else None, corners, grid, share, total / (4.0 * np.pi)
    )


def _sun_power(bright: NDArray[Any]) -> float:
    """Return brightness times solid angle of the sun's disc, from its image (rows, columns)."""
    at = np.linspace(-1.0, 1.0, 101)
    a, b = np.meshgrid(at, at)
    inside = 1.0 - a * a - b * b
    keep = inside > 0.0
    row = (0.5 + 0.5 * b[keep]) * (SUN_ROWS - 1)
    column = np.sqrt(inside[keep]) * (SUN_COLUMNS - 1)
    radiance = bright[np.rint(row).astype(int), np.rint(column).astype(int)]
    return float(radiance.mean() * np.pi * np.sin(SUN_RADIUS) ** 2)
