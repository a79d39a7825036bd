"""The plot of `clpt lens`, by matplotlib: the section with rays, and spots below it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from ...errors import SceneError
from ...lenses import Prescription, cardinal, spots
from ...lenses.glasses import AIR, LINE_D
from ...lenses.tracing import Rays, intersect, refract, sag
from .pixels import FAINT, FORMATS, INK, LINES, PAPER, save, strip

GLASS = "#cfe3ee"
RAYS = 7  # drawn of each point


def write(path: Path, lens: Prescription, waves: list[float], angles: list[float]) -> None:
    """Draw a lens. Raises SceneError for an unknown suffix, or where it cannot be written."""
    if path.suffix.lower() not in FORMATS:
        raise SceneError(f"a plot is written to {', '.join(FORMATS)}", file=path)
    figure = Figure(figsize=(9.0, 7.0), dpi=120, facecolor=PAPER, layout="constrained")
    grid = figure.add_gridspec(2, len(angles), height_ratios=[1.7, 1.0])
    _section(figure.add_subplot(grid[0, :]), lens, angles)
    drawn = [figure.add_subplot(grid[1, i]) for i in range(len(angles))]
    for axes, angle in zip(drawn, angles, strict=True):
        _spot(axes, lens, angle, waves)
    drawn[0].set_ylabel("[um]", color=INK)
    points = cardinal(lens)
    title = f"{lens.name}: f = {points.focal_length:.4g} mm, f/{points.f_number:.3g}"
    figure.suptitle(title, x=0.012, ha="left", color=INK, weight="bold", size=11)
    save(figure, path)


def _section(axes: Axes, lens: Prescription, angles: list[float]) -> None:
    outlines = []
    for surface, vertex in zip(lens.surfaces, lens.vertices, strict=True):
        y = np.linspace(-surface.semi_diameter, surface.semi_diameter, 81)
        outlines.append(np.column_stack([vertex + sag(surface, y * y), y]))
    for i, surface in enumerate(lens.surfaces[:-1]):
        if surface.glass != AIR:
            body = np.concatenate([outlines[i], outlines[i + 1][::-1]])
            axes.add_patch(Polygon(body, facecolor=GLASS, edgecolor=INK, lw=0.8, zorder=2))
    stop = lens.surfaces[lens.stop].semi_diameter
    tall = max(surface.semi_diameter for surface in lens.surfaces)
    for side in (-1.0, 1.0):
        at = [lens.vertices[lens.stop]] * 2
        axes.plot(
            at, [side * stop, side * max(1.25 * stop, 0.6 * tall)], color=INK, lw=2.2, zorder=4
        )
    film = lens.length + min(cardinal(lens).back_focus, 1e4)
    front = -0.25 * (film if np.isfinite(film) else lens.length) - tall * 0.3
    for colour, angle in zip(LINES, angles, strict=False):
        for ray in _rays(lens, angle, front, film):
            axes.plot(ray[:, 0], ray[:, 1], color=colour, lw=0.7, zorder=3)
    if np.isfinite(film):
        axes.axvline(film, color=INK, lw=1.0)
    axes.axhline(0.0, color=FAINT, lw=0.8, zorder=1)
    axes.set_aspect("equal")
    axes.set_xlabel("[mm]", color=INK)
    axes.set_ylim(-1.5 * tall, 1.5 * tall)


def _rays(lens: Prescription, angle: float, front: float, film: float) -> list[np.ndarray]:
    """Return the paths (n, 2) in z and y of transmitted rays in the section's plane."""
    points = cardinal(lens)
    heights = np.linspace(-1.6, 1.6, 400) * points.entrance_radius
    o = np.column_stack([0.0 * heights, heights, np.full(len(heights), points.entrance)])
    rays = Rays.of(o, np.array([[0.0, np.tan(np.radians(angle)), 1.0]]))
    rays.o += rays.d * ((front - points.entrance) / rays.d[:, 2:])
    ways, d, alive, indices = [rays.o], rays.d, rays.alive, lens.indices(LINE_D)
    for i, surface in enumerate(lens.surfaces):
        shifted = ways[-1] - [0.0, 0.0, lens.vertices[i]]
        met, normal, there = intersect(surface, shifted, d)
        alive = alive & there & (np.abs(met[:, 1]) <= surface.semi_diameter)
        d, passes = refract(d, normal, indices[i] / indices[i + 1])
        alive &= passes
        met[:, 2] += lens.vertices[i]
        ways.append(met)
    if np.isfinite(film):
        ways.append(ways[-1] + d * ((film - ways[-1][:, 2:]) / d[:, 2:]))
    lit = np.flatnonzero(alive)
    if not len(lit):
        return []
    chosen = lit[np.unique(np.linspace(0, len(lit) - 1, RAYS).astype(int))]
    whole = np.stack(ways, axis=1)[chosen]
    return [np.asarray(way) for way in whole[:, :, [2, 1]]]


def _spot(axes: Axes, lens: Prescription, angle: float, waves: list[float]) -> None:
    middle, reach = None, 1.0
    for wavelength in waves:
        points = spots.spot(lens, angle, wavelength).points * 1e3
        if not len(points):
            continue
        if middle is None:
            middle = points.mean(axis=0)
        points = points - middle
        reach = max(reach, 1.1 * float(np.abs(points).max()))
        colour = strip(np.array([wavelength]))[0, 0] / 255.0
        axes.plot(*points.T, ".", color=colour, ms=1.6, label=f"{wavelength:.4g} nm")
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach))
    axes.set_aspect("equal")
    axes.set_title(f"{angle:g} degrees", color=INK, size=9)
    axes.tick_params(colors=INK, labelsize=7)
    axes.grid(color=FAINT, lw=0.5)
    if middle is not None:
        axes.legend(fontsize=6, frameon=False, loc="upper right", markerscale=4)
