"""A lens near its axis, and exact rays: pupils that the film sees, spots, focus by distance.

All in float64 and millimetres. Near the axis a ray is a height and a slope (y, u); a surface of
curvature c from index n to n' makes n' u' = n u - y (n' - n) c, and a distance t makes y' = y + t u
(Hecht 2017, 6.2). z counts from the first surface's vertex towards the film. Rays go in both
directions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.lenses.prescription import LINE_D, Prescription, Surface

NO_POWER = 1e-9  # [1/mm], a lens of less power has no focus


@dataclass(frozen=True)
class Cardinal:
    """Properties of a lens near its axis, at a wavelength [nm]; lengths [mm].

    focal_length: of the whole lens; back_focus: from the last surface to the image of a far object;
    front_focus: from the first surface to the front focus, below 0 in front of it; entrance, exit:
    distances of the pupils behind the first and the last surface; entrance_radius, exit_radius: of
    the pupils; f_number: for a far object.
    """

    wavelength: float
    focal_length: float
    back_focus: float
    front_focus: float
    entrance: float
    entrance_radius: float
    exit: float
    exit_radius: float

    @property
    def f_number(self) -> float:
        return abs(self.focal_length) / (2.0 * self.entrance_radius)


def matrix(
    lens: Prescription, wavelength: float = LINE_D, first: int = 0, last: int | None = None
) -> np.ndarray:
    """Return the matrix (2, 2) that takes (y, u) in front of `first` to behind the surfaces.

    first, last: numbers of the surfaces, from 0, without `last`; None: to the end.
    """
    indices = lens.indices(wavelength)
    last = len(lens.surfaces) if last is None else last
    whole = np.eye(2)
    for i in range(first, last):
        surface = lens.surfaces[i]
        # Neither the conic constant nor r^4 and beyond change the curvature at the vertex.
        power = (indices[i + 1] - indices[i]) * surface.curvature
        refraction = np.array([[1.0, 0.0], [-power / indices[i + 1], indices[i] / indices[i + 1]]])
        whole = refraction @ whole
        if i + 1 < last:
            whole = np.array([[1.0, surface.thickness], [0.0, 1.0]]) @ whole
    return whole


def cardinal(lens: Prescription, wavelength: float = LINE_D) -> Cardinal:
    """Return the properties of a lens near its axis at a wavelength [nm].

    A length that is infinite, such as the focal length of a pinhole, is inf.
    """
    (a, _), (c, d) = matrix(lens, wavelength)
    c = 0.0 if abs(c) < NO_POWER else c
    stop, radius = lens.stop, lens.surfaces[lens.stop].semi_diameter
    entrance = exit_ = 0.0
    entrance_radius = exit_radius = radius
    if stop > 0:
        # From the first surface to the stop's vertex: y = 0 at the stop's centre.
        front = matrix(lens, wavelength, 0, stop)
        gap = lens.surfaces[stop - 1].thickness
        front = np.array([[1.0, gap], [0.0, 1.0]]) @ front
        entrance = _ratio(front[0, 1], front[0, 0])
        entrance_radius = abs(_ratio(radius, front[0, 0]))
    if stop + 1 < len(lens.surfaces) or lens.surfaces[stop].radius:
        # The stop stands in front of its own surface.
        rear = matrix(lens, wavelength, stop)
        exit_ = -_ratio(rear[0, 1], rear[1, 1])
        index = lens.indices(wavelength)[stop]
        # The pupil's size follows from the invariant n y u, of a ray through the stop's middle.
        exit_radius = abs(_ratio(radius * index, rear[1, 1]))
    return Cardinal(
        wavelength, _ratio(-1.0, c), _ratio(-a, c), _ratio(d, c),
        float(entrance), float(entrance_radius), float(exit_), float(exit_radius),
    )  # fmt: skip


def _ratio(a: float, b: float) -> float:
    """a / b, infinite where b is 0."""
    return math.copysign(math.inf, a) if abs(b) < 1e-12 else float(a / b)


def film_distance(lens: Prescription, focus: float) -> float:
    """Return the distance of the film behind the last surface [mm] that focuses at `focus` [mm].

    `focus` counts from the film. The whole lens moves; a lens without power, such as a pinhole,
    stays at its last thickness. Raises SceneError for a distance that is too near.
    """
    (a, b), (c, d) = matrix(lens, LINE_D)
    if abs(c) < NO_POWER and lens.surfaces[-1].thickness > 0.0:
        return lens.surfaces[-1].thickness
    if not c < -NO_POWER:
        raise SceneError("this lens forms no picture: its focal length is not above 0")
    # An object s in front of the first surface has its image x behind the last surface:
    # a s + b + x (c s + d) = 0, and s + length + x = focus. With s from that:
    # -c x^2 + x (c r - a + d) + a r + b = 0 with r = focus - length; the smaller x is a camera's.
    room = focus - lens.length
    p, q, r = -c, c * room - a + d, a * room + b
    inside = q * q - 4.0 * p * r
    if inside < 0.0 or room <= 0.0:
        nearest = _nearest(a, b, c, d) + lens.length
        raise SceneError(
            f"this lens cannot focus nearer than {nearest:.4g} mm from the film, asked {focus:.4g}"
        )
    return float(2.0 * r / (-q + math.sqrt(inside)))


def _nearest(a: float, b: float, c: float, d: float) -> float:
    """Return the least sum of the distances of an object and its image from the lens [mm].

    It is at a magnification of -1: c s + d = -1 and a + c x = -1.
    """
    return (-1.0 - d) / c + (-1.0 - a) / c


def stop_radius(lens: Prescription, f_number: float) -> float:
    """Return the semi-diameter of the stop [mm] at an f-number. Raises SceneError."""
    optics = cardinal(lens)
    if math.isinf(optics.f_number):
        raise SceneError("a lens without power has no f-number")
    if f_number < optics.f_number * (1.0 - 1e-3):
        raise SceneError(
            f"this lens opens to f/{optics.f_number:.3g} at most, asked f/{f_number:g}"
        )
    return lens.surfaces[lens.stop].semi_diameter * min(optics.f_number / f_number, 1.0)


NEWTON_STEPS = 12
ZONES = 64  # rings of the film
COARSE, FINE = (32, 16), (48, 24)  # cells of a grid over half of the pupil
ROUNDS = (COARSE, COARSE, FINE)
WAVELENGTHS = (380.0, 480.0, LINE_D, 780.0)  # [nm], of rays through lenses that disperse
RINGS = 24
MARGIN = 1.05  # zones cover this multiple of the film's radius: filters reach beyond the film


@dataclass
class Rays:
    """Rays (n, 3): origins [mm] and unit directions; alive (n,): whether no surface stopped it."""

    o: Floats
    d: Floats
    alive: NDArray[np.bool_]

    @staticmethod
    def of(o: Floats, d: Floats) -> Rays:
        """Return rays from points (n, 3) along directions (n, 3) of any length."""
        o, d = np.broadcast_arrays(np.asarray(o, np.float64), np.asarray(d, np.float64))
        length = np.linalg.norm(d, axis=1, keepdims=True)
        return Rays(o.copy(), d / length, np.ones(len(o), np.bool_))


def sag(surface: Surface, r2: Floats) -> Floats:
    """Return a surface's sag behind its vertex [mm]; r2: squared distances from the axis."""
    c = surface.curvature
    root = np.sqrt(np.maximum(1.0 - (1.0 + surface.conic) * c * c * r2, 0.0))
    z = c * r2 / (1.0 + root)
    for i, factor in enumerate(surface.aspheric):
        z = z + factor * r2 ** (i + 2)
    return np.asarray(z)


def trace(
    lens: Prescription,
    rays: Rays,
    wavelength: float = LINE_D,
    backwards: bool = False,
    open_: bool = False,
) -> Rays:
    """Return rays as they leave the lens.

    wavelength [nm]; backwards: from the film to the front; open_: semi-diameters stop no ray; a
    ray ends only if it misses a surface or is totally reflected.
    """
    indices = lens.indices(wavelength)
    order = range(len(lens.surfaces))
    o, d, alive = rays.o.copy(), rays.d.copy(), rays.alive.copy()
    for i in reversed(order) if backwards else order:
        surface, vertex = lens.surfaces[i], lens.vertices[i]
        o[:, 2] -= vertex
        met, normal, there = intersect(surface, o, d)
        alive &= there
        if not open_:
            alive &= met[:, 0] ** 2 + met[:, 1] ** 2 <= surface.semi_diameter**2 * (1.0 + 1e-12)
        n, beyond = indices[i], indices[i + 1]
        if backwards:
            n, beyond = beyond, n
        d, passes = refract(d, normal, n / beyond)
        alive &= passes
        o = met
        o[:, 2] += vertex
    return Rays(o, d, alive)


def intersect(surface: Surface, o: Floats, d: Floats) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Return points where rays meet a surface, its normals towards -z, and whether they meet it.

    o, d: (n, 3), z from the vertex. A sphere or conic is solved in closed form (Welford 1986, 4.4);
    an asphere by Newton's method from its conic.
    """
    z = np.where(np.abs(d[:, 2]) < 1e-12, 1e-12, d[:, 2])
    p = o - d * (o[:, 2] / z)[:, None]
    c, k = surface.curvature, surface.conic
    f = c * (p[:, 0] ** 2 + p[:, 1] ** 2)
    g = z - c * (p[:, 0] * d[:, 0] + p[:, 1] * d[:, 1])
    inside = g * g - c * f * (1.0 + k * d[:, 2] ** 2)
    there = (inside >= 0.0) & (np.abs(d[:, 2]) > 1e-12)
    root = np.sign(z) * np.sqrt(np.maximum(inside, 0.0))
    t = f / np.where(g + root == 0.0, 1e-300, g + root)
    if surface.aspheric:
        for _ in range(NEWTON_STEPS):
            q = p + d * t[:, None]
            r2 = q[:, 0] ** 2 + q[:, 1] ** 2
            slope = _slope(surface, r2)
            down = d[:, 2] - slope * (q[:, 0] * d[:, 0] + q[:, 1] * d[:, 1])
            t = t - (q[:, 2] - sag(surface, r2)) / np.where(down == 0.0, 1e-300, down)
        q = p + d * t[:, None]
        there &= np.abs(q[:, 2] - sag(surface, q[:, 0] ** 2 + q[:, 1] ** 2)) < 1e-6
    q = p + d * np.where(there, t, 0.0)[:, None]
    slope = _slope(surface, q[:, 0] ** 2 + q[:, 1] ** 2)
    normal = np.stack([q[:, 0] * slope, q[:, 1] * slope, -np.ones(len(q))], axis=1)
    return q, normal / np.linalg.norm(normal, axis=1, keepdims=True), there


def _slope(surface: Surface, r2: Floats) -> Floats:
    """The derivative of the sag by r, over r."""
    c = surface.curvature
    root = np.sqrt(np.maximum(1.0 - (1.0 + surface.conic) * c * c * r2, 1e-12))
    slope = c / root
    for i, factor in enumerate(surface.aspheric):
        slope = slope + 2.0 * (i + 2) * factor * r2 ** (i + 1)
    return np.asarray(slope)


def refract(d: Floats, normal: Floats, ratio: float) -> tuple[Floats, NDArray[np.bool_]]:
    """Return directions behind a boundary, and whether light passes; ratio: n over n' behind."""
    cosine = -np.sum(d * normal, axis=1)
    side = np.where(cosine < 0.0, -1.0, 1.0)
    inside = 1.0 - ratio * ratio * (1.0 - cosine * cosine)
    beyond = side * np.sqrt(np.maximum(inside, 0.0))
    bent = ratio * d + (ratio * cosine - beyond)[:, None] * normal
    return bent, inside > 0.0


def zones(lens: Prescription, distance: float, radius: float) -> Floats:
    """Return an ellipse of the rear plane for each ring of the film, (ZONES, 3) [mm].

    The rear plane touches the last surface. `distance`: from it to the film; radius: of the film
    [mm]. A row has the ellipse's centre, on the radius towards the point on the film, its half axis
    along that radius, and its half axis across. All light that reaches the ring comes through the
    ellipse, at any wavelength; a ring without light has zeros.
    """
    places = np.linspace(0.0, radius, ZONES + 1)
    waves = WAVELENGTHS if lens.disperses else (LINE_D,)
    low, high = _start(lens, distance, places)
    inside: NDArray[np.bool_] = np.zeros((len(places), 1), np.bool_)
    for cells in ROUNDS:
        x, y, step = _grid(low, high, cells)
        inside = np.zeros(x.shape, np.bool_)
        for wavelength in waves:
            inside = inside | _seen(lens, distance, places, x, y, wavelength)
        any_ = np.asarray(inside.any(axis=1))
        far = np.asarray(np.where(inside, x, -np.inf).max(axis=1)) + step[:, 0]
        near = np.asarray(np.where(inside, x, np.inf).min(axis=1)) - step[:, 0]
        top = np.where(inside, y, 0.0).max(axis=1) + step[:, 1]
        low = np.where(any_[:, None], np.stack([near, np.zeros(len(near))], 1), low)
        high = np.where(any_[:, None], np.stack([far, top], 1), high)
    rows = np.zeros((ZONES, 3))
    for i in range(ZONES):
        both = inside[i : i + 2]
        if not both.any():
            continue
        lit = [i + j for j in (0, 1) if both[j].any()]
        first, last = min(low[j, 0] for j in lit), max(high[j, 0] for j in lit)
        across, middle, along = max(high[j, 1] for j in lit), (first + last) / 2, (last - first) / 2
        most = 0.0
        for j in lit:
            # The far corner of each cell that passes light.
            u = (np.abs(x[j][inside[j]] - middle) + 0.5 * step[j, 0]) / along
            v = (y[j][inside[j]] + 0.5 * step[j, 1]) / across
            most = max(most, float(np.max(u * u + v * v)))
        rows[i] = middle, along * math.sqrt(most), across * math.sqrt(most)
    return rows


def _start(lens: Prescription, distance: float, places: Floats) -> tuple[Floats, Floats]:
    """Return the first search region (n, 2): the last surface, or a smaller exit pupil."""
    size = lens.surfaces[-1].semi_diameter
    low, high = np.full((len(places), 2), -size), np.full((len(places), 2), size)
    low[:, 1] = 0.0
    optics = cardinal(lens)
    away = distance - optics.exit  # of the pupil, from the film
    if math.isfinite(away) and away > 0.0:
        share = distance / away
        middle, reach = places * (1.0 - share), 2.0 * optics.exit_radius * share
        if reach < 0.25 * size:
            low[:, 0], high[:, 0], high[:, 1] = middle - reach, middle + reach, reach
    return low, high


def _grid(low: Floats, high: Floats, cells: tuple[int, int]) -> tuple[Floats, Floats, Floats]:
    """Return centres of cells, x and y (n, m), and their size (n, 2)."""
    step = (high - low) / np.array(cells)
    i, j = (each.ravel() for each in np.meshgrid(*(np.arange(c) + 0.5 for c in cells)))
    return low[:, :1] + step[:, :1] * i, low[:, 1:] + step[:, 1:] * j, step


def _seen(
    lens: Prescription, distance: float, places: Floats, x: Floats, y: Floats, wavelength: float
) -> NDArray[np.bool_]:
    o = np.zeros((*x.shape, 3))
    o[..., 0], o[..., 2] = places[:, None], lens.length + distance
    d = np.stack([x - o[..., 0], y, np.full(x.shape, -distance)], axis=-1)
    rays = trace(lens, Rays.of(o.reshape(-1, 3), d.reshape(-1, 3)), wavelength, backwards=True)
    return rays.alive.reshape(x.shape)


def axis_solid_angle(lens: Prescription, distance: float) -> float:
    """Return the projected solid angle [sr] of the light at the centre of the film.

    pi sin^2 of the steepest ray that passes, at the line d; the stop is round.
    """
    low, high = 0.0, lens.surfaces[-1].semi_diameter
    for _ in range(40):
        middle = 0.5 * (low + high)
        o = np.array([[0.0, 0.0, lens.length + distance]])
        rays = trace(lens, Rays.of(o, np.array([[middle, 0.0, -distance]])), backwards=True)
        low, high = (middle, high) if rays.alive[0] else (low, middle)
    return math.pi * low * low / (low * low + distance * distance)


@dataclass(frozen=True)
class Spot:
    """Points (n, 2) where a far point's light meets the film [mm], each of the same power.

    through: part of the light into the entrance pupil that reaches the film.
    """

    points: Floats
    through: float

    @property
    def radius(self) -> float:
        """Root mean square distance from the centroid [mm]."""
        return float(np.sqrt(np.mean(np.sum((self.points - self.points.mean(axis=0)) ** 2, 1))))


def pupil_points() -> Floats:
    """Return points (n, 2) evenly over the unit disk: 6 i + 3 on the ring i."""
    circles = []
    for i in range(RINGS):
        turns = 2.0 * math.pi * (np.arange(6 * i + 3) + 0.5) / (6 * i + 3)
        circles.append((i + 0.5) / RINGS * np.stack([np.cos(turns), np.sin(turns)], 1))
    return np.concatenate(circles)


def bundle(lens: Prescription, angle: float) -> Rays:
    """Return parallel rays to the entrance pupil, from a point at an angle [degrees] in y."""
    optics = cardinal(lens)
    slope = math.tan(math.radians(angle))
    disk = optics.entrance_radius * pupil_points()
    o = np.column_stack([disk, np.full(len(disk), optics.entrance)])
    d = np.array([[0.0, slope, 1.0]])
    # From a plane perpendicular to the rays, in front of all glass.
    far = optics.entrance + lens.length + 10.0 * optics.entrance_radius
    rays = Rays.of(o, d)
    rays.o -= rays.d * (far / rays.d[:, 2:])
    return rays


def spot(lens: Prescription, angle: float, wavelength: float = LINE_D) -> Spot:
    """Return the spot of a far point at an angle [degrees] and a wavelength [nm].

    The film is at the paraxial focus of the line d.
    """
    rays = trace(lens, bundle(lens, angle), wavelength)
    at = (lens.length + cardinal(lens).back_focus - rays.o[:, 2]) / rays.d[:, 2]
    points = (rays.o + at[:, None] * rays.d)[rays.alive, :2]
    return Spot(points, float(rays.alive.mean()))


@dataclass(frozen=True)
class FocusedLens:
    """A lens at an f-number, focused on a distance.

    back: from the film to the last surface [mm]; zones: ellipses of the rear plane by rings of the
    film, see `clpt.lenses.tracing.zones`; solid_angle: projected, of the pupil that the film's
    middle sees [sr]; film_radius: that the zones cover [mm].
    """

    prescription: Prescription
    back: float
    zones: Floats
    solid_angle: float
    film_radius: float


@lru_cache(maxsize=64)
def focused_lens(
    lens: Prescription, f_number: float, focus: float, shift: float, film_radius: float
) -> FocusedLens:
    """Return a lens before its film.

    f_number: 0 for the widest stop; focus: distance of the sharp plane from the film [mm]; shift:
    of the film away from the lens [mm]; film_radius: that the zones cover [mm]. Raises SceneError
    for an f-number, a focus or a shift that the lens cannot have.
    """
    try:
        stopped = lens if f_number == 0.0 else lens.with_stop(stop_radius(lens, f_number))
    except SceneError as error:
        raise SceneError(error.message, where="lens.f_number") from None
    try:
        back = film_distance(lens, focus) + shift
    except SceneError as error:
        raise SceneError(error.message, where="lens.focus_distance") from None
    if not back > 0.0:
        raise SceneError(
            f"the film would stand {-back:.4g} mm inside of the lens", where="lens.film_shift"
        )
    angle = axis_solid_angle(stopped, back)
    if not angle > 0.0:
        raise SceneError("no light comes through to the middle of the film", where="lens")
    return FocusedLens(stopped, back, zones(stopped, back, film_radius), angle, film_radius)
