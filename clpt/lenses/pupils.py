"""Exit pupils: the part of a lens's rear plane that sends light to a point of the film."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats
from clpt.lenses.glasses import LINE_D
from clpt.lenses.paraxial import cardinal
from clpt.lenses.prescription import Prescription
from clpt.lenses.tracing import Rays, trace

ZONES = 64  # rings of the film
COARSE, FINE = (32, 16), (48, 24)  # cells of a grid over half of the pupil
ROUNDS = (COARSE, COARSE, FINE)
WAVELENGTHS = (380.0, 480.0, LINE_D, 780.0)  # [nm], of rays through lenses that disperse


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
