"""Light at points and along rays of a scene, with its standard error.

A point becomes a receiver: a white, matt, one-sided triangle of a tenth of a millimetre, just above
the point; or a white ball, where all directions count alike. A white surface of irradiance E has
the radiance E / pi, so a ray onto it measures E by every integrator. Each entry has REPLICAS
pixels, which are independent: their mean gives the value, and their scatter its standard error, by
the jackknife (Efron 1982): quantities such as color temperature are no linear functions of light.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import device as dev
from clpt.arrays import Floats, Image, Integers, vectors, whole
from clpt.errors import SceneError, UnknownKindError
from clpt.instruments.interpolation import TOLERANCE, Surface, interpolated
from clpt.instruments.quantities import QUANTITIES, Quantity
from clpt.render.options import RenderOptions, check_scene
from clpt.render.renderer import Renderer
from clpt.scene import Scene, shapes
from clpt.scene.cameras import Rays
from clpt.scene.integrators import Box, Film
from clpt.scene.materials import Diffuse
from clpt.scene.motion import rotation

if TYPE_CHECKING:
    from typing_extensions import Unpack

REPLICAS = 16  # pixels of an entry, whose scatter is its standard error
LONGEST_ROW = 4096  # pixels of the film
LIFT = 1e-4  # [m] of a receiver above its point, and its radius
FIRST_SAMPLES = 16  # of a pixel, before its error is looked at
AXES = np.concatenate([np.eye(3), -np.eye(3)])  # the sides of a cube


@dataclass(frozen=True)
class Measurement:
    """Values of a quantity of light, and their standard errors.

    values, errors: (...) as the points or directions are, float64; spectral quantities have an axis
    of bands behind, `tristimulus` has X, Y, Z. The color of darkness is NaN.
    unit: of both. wavelengths: middles of the bands (bands,) [nm], or None.
    samples: paths of each entry. measured: which entries were, where others are interpolated.
    """

    quantity: str
    unit: str
    values: Floats
    errors: Floats
    samples: int
    wavelengths: Floats | None = None
    measured: NDArray[np.bool_] | None = None

    @property
    def relative_error(self) -> float:
        """The largest standard error of entries with light, over the value."""
        lit = self.values > 0.0
        return float((self.errors[lit] / self.values[lit]).max()) if lit.any() else 0.0

    def at(self, entries: NDArray[np.bool_]) -> Measurement:
        """Return what some of the entries (...) measure, (n,)."""
        measured = None if self.measured is None else self.measured[entries]
        values, errors = self.values[entries], self.errors[entries]
        return dataclasses.replace(self, values=values, errors=errors, measured=measured)


class MeterOptions(RenderOptions, total=False):
    """Options of a `Meter`."""

    samples: int
    error: float | None
    bands: int
    device: dev.Device | str | int | None


class MeasureOptions(MeterOptions, total=False):
    """Options of `measure`, whose docstring has their meaning."""

    interpolate: int


def measure(
    scene: Scene,
    quantity: str,
    at: ArrayLike,
    directions: ArrayLike = (0.0, 1.0, 0.0),
    *,
    samples: int = 4096,
    error: float | None = None,
    interpolate: int = 1,
    bands: int = 47,
    device: dev.Device | str | int | None = None,
    **options: Unpack[RenderOptions],
) -> Measurement:
    """Measure light in a scene.

    quantity: a name in `QUANTITIES`. at: points (..., 3) [m]. directions: the points' normals, or
    those in which rays go from them; (..., 3), or one for all. samples: paths of each entry, at
    most. error: stop when each standard error is at most this share of its value. interpolate: of
    a map of points (h, w, 3), the widest step between measured points; see `interpolated`. bands:
    of spectral quantities. device, options: see `clpt.Renderer`. The scene's camera is not used;
    its film has the range of wavelengths.

    Raises UnknownKindError for a quantity, SceneError for points that cannot be used, and as
    `clpt.Renderer` does.
    """
    step = whole(interpolate, 1, where="interpolate")
    meter = Meter(scene, quantity, samples=samples, error=error, bands=bands, device=device,
                  **options)  # fmt: skip
    points = vectors(np.atleast_2d(at), "at")
    toward = np.broadcast_to(vectors(np.atleast_2d(directions), "directions"), points.shape)
    if step == 1:
        return meter.measure(points, toward)
    if points.ndim != 3:
        message = f"needs points of a map, (h, w, 3), not of shape {points.shape}"
        raise SceneError(message, where="interpolate")
    return meter.measure_map(Surface(points, toward, np.ones(points.shape[:2], bool)), step)


class Meter:
    """Measures a quantity at points of a scene; parameters: see `measure`."""

    def __init__(
        self,
        scene: Scene,
        quantity: str,
        *,
        samples: int = 4096,
        error: float | None = None,
        bands: int = 47,
        device: dev.Device | str | int | None = None,
        **options: Unpack[RenderOptions],
    ):
        check_scene(scene)
        if quantity not in QUANTITIES:
            raise UnknownKindError("quantity", quantity, QUANTITIES)
        if error is not None and not error > 0.0:
            raise SceneError(f"must be above 0, not {error!r}", where="error")
        self.scene, self.quantity, self.kind = scene, quantity, QUANTITIES[quantity]
        self.samples, self.error, self.bands = samples, error, bands
        self.device, self.options = device, options

    def measure(self, points: Floats, directions: Floats, seed: int | None = None) -> Measurement:
        """Return values at points (..., 3); seed: in place of the scene's."""
        scene = self.scene if seed is None else dataclasses.replace(self.scene, seed=seed)
        rows = points.reshape(-1, 3), directions.reshape(-1, 3)
        instrument = photometer(scene, self.kind, *rows, bands=self.bands)
        with Renderer(instrument, self.device, **self.options) as renderer:
            return self._read(renderer, points.shape[:-1])

    def measure_map(self, surface: Surface, step: int) -> Measurement:
        """Return values of a map (h, w), most of them interpolated; step: see `measure`.

        Raises SceneError for quantities along rays, and for those that are not linear in light.
        """
        if self.kind.at == "rays" or not self.kind.linear:
            why = "is measured along rays" if self.kind.at == "rays" else "is not linear in light"
            raise SceneError(f"{self.quantity} {why}", where="interpolate")
        parts: list[Measurement] = []

        def look(rows: Integers, columns: Integers) -> tuple[Floats, Floats]:
            seed = (self.scene.seed + len(parts)) % 2**32  # each look is independent
            part = self.measure(surface.points[rows, columns], surface.normals[rows, columns], seed)
            parts.append(part)
            return part.values.reshape(len(rows), -1), part.errors.reshape(len(rows), -1)

        tolerance = TOLERANCE if self.error is None else self.error
        values, errors, measured = interpolated(surface, look, step, tolerance)
        form = (*measured.shape, *parts[0].values.shape[1:])
        return dataclasses.replace(
            parts[0], values=values.reshape(form), errors=errors.reshape(form), measured=measured,
            samples=max(part.samples for part in parts),
        )  # fmt: skip

    def _read(self, renderer: Renderer, shape: tuple[int, ...]) -> Measurement:
        """Add samples until the errors are small enough; return the measured values."""
        count, error = math.prod(shape), self.error
        turns = len(AXES) if self.kind.everywhere else 1
        most = max(1, math.ceil(self.samples / (REPLICAS * turns)))
        step = most if error is None else min(most, FIRST_SAMPLES)
        while True:
            renderer.run(step)
            pixels = _pixels(renderer.image(), turns, count)
            measured = _measured(self.quantity, pixels, renderer.scene.film, shape)
            measured = dataclasses.replace(measured, samples=renderer.samples * REPLICAS * turns)
            step = min(renderer.samples, most - renderer.samples)
            if step <= 0 or (error is not None and measured.relative_error <= error):
                return measured


def _pixels(image: Image, turns: int, count: int) -> Floats:
    """Return pixels (REPLICAS, turns, count, channels) of an instrument's film."""
    pixels = image.astype(np.float64).reshape(-1, image.shape[-1])
    return pixels[: REPLICAS * turns * count].reshape(REPLICAS, turns, count, -1)


def _measured(quantity: str, pixels: Floats, film: Film, shape: tuple[int, ...]) -> Measurement:
    """Return what the pixels (REPLICAS, turns, count, channels) of a film measure."""
    kind = QUANTITIES[quantity]
    replicas = pixels.sum(axis=1) / (1.5 if kind.everywhere else 1.0)
    total = replicas.sum(axis=0)
    value = kind.value(total / REPLICAS, film)
    without = np.stack([kind.value((total - each) / (REPLICAS - 1), film) for each in replicas])
    spread = ((without - without.mean(axis=0)) ** 2).sum(axis=0)
    shape = (*shape, *value.shape[1:])
    return Measurement(
        quantity,
        kind.unit,
        value.reshape(shape),
        np.sqrt(spread * (REPLICAS - 1) / REPLICAS).reshape(shape),
        samples=0,
        wavelengths=film.band_centres if kind.spectral else None,
    )


def photometer(
    scene: Scene,
    quantity: Quantity,
    points: Floats,
    directions: Floats,
    *,
    bands: int = 47,
    lift: float = LIFT,
) -> Scene:
    """Return the scene with a camera that measures: `measure` renders it, and so can others.

    points (n, 3) [m]; directions (n, 3); bands: see `measure`; lift: of receivers above their
    points [m]: walls must be farther away. Pixel i, row by row, is of
    entry i modulo n; of a quantity without a normal, of orientation i // n modulo 6 of it.

    Raises SceneError for directions of length 0.
    """
    lengths = np.linalg.norm(directions, axis=1, keepdims=True)
    if not lengths.all():
        raise SceneError(f"row {np.argmin(lengths)} is 0, 0, 0", where="directions")
    directions = directions / lengths
    added: list[shapes.Shape] = []
    if quantity.at == "rays":
        camera = Rays(origins=points, directions=directions)
    else:
        camera, receivers = (
            _balls(points, lift, scene.seed)
            if quantity.everywhere
            else _discs(points, directions, lift)
        )
        added = [receivers]
    count = REPLICAS * len(points) * (len(AXES) if quantity.everywhere else 1)
    width = min(np.shape(camera.origins)[0], LONGEST_ROW)
    height = math.ceil(count / width)
    film = dataclasses.replace(
        scene.film, width=width, height=height, crop=None, filter=Box(radius=0.25)
    )
    return dataclasses.replace(
        scene,
        camera=camera,
        film=quantity.film(film, bands),
        shapes=[*scene.shapes, *added],
        noise=None,
    )


def _discs(points: Floats, normals: Floats, lift: float) -> tuple[Rays, shapes.Shape]:
    """Return rays onto white triangles above points (n, 3), and the mesh of these."""
    first = np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(normals, first)
    turns = 2.0 * np.pi * np.arange(3)[:, None] / 3.0
    around = np.cos(turns) * first[:, None] + np.sin(turns) * second[:, None]
    corners = (points + lift * normals)[:, None] + lift * around
    mesh = shapes.Mesh(
        vertices=corners.reshape(-1, 3).astype(np.float32),
        faces=np.arange(3 * len(points), dtype=np.uint32).reshape(-1, 3),
        material=Diffuse(reflectance=1.0),
    )
    origins = points + 2.0 * lift * normals
    return Rays(origins=origins, directions=-normals, weights=np.pi), mesh


def _balls(points: Floats, lift: float, seed: int) -> tuple[Rays, shapes.Shape]:
    """Return rays onto white balls at points (n, 3), and the balls.

    Each replica of a point has six rays, against the axes of a frame that is turned at random. By
    the mean of |cos| over directions, 1/2, their irradiances sum to 3/2 of the scalar irradiance.
    """
    frames = _random_frames(REPLICAS * len(points), seed).reshape(REPLICAS, -1, 3, 3)
    normals = np.einsum("rnij,tj->rtni", frames, AXES).reshape(-1, 3)
    origins = np.tile(points, (REPLICAS * len(AXES), 1)) + 2.0 * lift * normals
    balls = shapes.Spheres(
        centers=points.astype(np.float32), radii=lift, material=Diffuse(reflectance=1.0)
    )
    return Rays(origins=origins, directions=-normals, weights=np.pi), balls


def _random_frames(count: int, seed: int) -> Floats:
    """Return rotations (count, 3, 3), even over all (Shoemake 1992)."""
    q = np.random.default_rng(seed).normal(size=(count, 4))
    unit = q / np.linalg.norm(q, axis=1, keepdims=True)
    return np.moveaxis(rotation(np.roll(unit, -1, axis=1).T), -1, 0)
