"""Plots by matplotlib, which is an extra."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon

from clpt.files import output_files

from ..errors import SceneError
from ..images import to_srgb8
from ..lenses import Prescription, cardinal, tracing
from ..lenses.prescription import AIR, LINE_D
from ..lenses.tracing import Rays, intersect, refract, sag
from ..spectra import cie_xyz, xyz_to_rgb
from .files.image_contents import ImageContents, Pixel

if TYPE_CHECKING:
    from ..bench.figures import Figure as Measurement

FORMATS = (".png", ".svg", ".pdf")
INK, FAINT, PAPER = "#22262b", "#d9dde2", "#ffffff"
LINES = ("#22262b", "#c1440e", "#1f6f8b", "#6a8d2f", "#8c4a94", "#c9931a")
CHANNELS = {"R": "#c94f43", "G": "#4e9a51", "B": "#4a6fb5", "A": "#9aa1a9", "Y": "#6b7178"}
WIDTH = 12.0  # [nm] of these bands, at half their height
DOTS: dict[str, Any] = {"marker": "o", "markersize": 3.2, "clip_on": False}
MARKED = 64  # the most bands with dots
SPAN = 30.0  # ratio of stages' speeds above which the scale is logarithmic
BAR, HEAD = 0.25, 0.9  # [inches] of a figure, and of a panel's title and axis
COLOURS = (*LINES[2:3], *LINES[1:2], *LINES[3:])
MOST_CURVES = 12
GLASS = "#cfe3ee"
RAYS = 7  # drawn of each point


def check_format(path: Path) -> None:
    """Raise SceneError for a file whose suffix is unknown."""
    if path.suffix.lower() not in FORMATS:
        raise SceneError(f"a plot is written to {', '.join(FORMATS)}", file=path)


def plot_pixels(path: Path, image: ImageContents, values: dict[Pixel, np.ndarray]) -> None:
    """Plot the values (n,) of pixels to a file: spectra over wavelength, or channels as bars.

    Raises SceneError if its suffix is unknown or it cannot be written.
    """
    check_format(path)
    figure = Figure(figsize=(8.0, 4.6), dpi=120, facecolor=PAPER, layout="constrained")
    (_spectra if image.lambdas is not None else _bars)(figure, image, values)
    figure.suptitle(image.path.name, x=0.012, ha="left", color=INK, weight="bold", size=11)
    save(figure, path)


def strip(lambdas: np.ndarray) -> np.ndarray:
    """Return the colours of narrow bands of light (1, n, 3) uint8, as far as a screen has them."""
    offsets = np.linspace(-1.0, 1.0, 33)
    rgb = np.maximum(xyz_to_rgb(cie_xyz(lambdas[:, None] + WIDTH * offsets)), 0.0)
    rgb = np.average(rgb, axis=1, weights=1.0 - np.abs(offsets))
    return to_srgb8((rgb / max(float(rgb.max()), 1e-6))[None].astype(np.float32))


def _spectra(figure: Figure, image: ImageContents, values: dict[Pixel, np.ndarray]) -> None:
    assert image.lambdas is not None
    axes, below = figure.subplots(
        2, 1, sharex=True, gridspec_kw={"height_ratios": [1.0, 0.055], "hspace": 0.0}
    )
    dots = DOTS if len(image.lambdas) <= MARKED else {}
    handles: list[Any] = []
    for i, (pixel, row) in enumerate(values.items()):
        colour = LINES[i % len(LINES)]
        (line,) = axes.plot(image.lambdas, row, color=colour, linewidth=1.6, **dots)
        handles.append((line, _swatch(image, pixel)))
    finite = [row[np.isfinite(row)] for row in values.values()]
    top = max([float(v.max()) for v in finite if v.size] + [0.0])
    low = min([float(v.min()) for v in finite if v.size] + [0.0])
    reflects = image.quantity == "reflectance" and top <= 1.0
    axes.set_ylim(low * 1.05, 1.0 if reflects else (top * 1.08 or 1.0))
    ends = image.lambdas[0], image.lambdas[-1]
    if ends[0] < ends[1]:
        axes.set_xlim(*ends)
        fine = np.linspace(*ends, 1024)
        below.imshow(strip(fine), extent=(*ends, 0.0, 1.0), aspect="auto")
    _dress(axes, image.quantity)
    axes.tick_params(axis="x", length=0, labelbottom=False)
    below.set_yticks([])
    below.set_xlabel("wavelength [nm]", color=INK)
    below.tick_params(colors=INK, labelsize=9)
    for side in below.spines.values():
        side.set_visible(False)
    figure.legend(
        handles, [f"{x}, {y}" for x, y in values], handler_map={tuple: HandlerTuple(ndivide=None)},
        frameon=False, labelcolor=INK, fontsize=9, handlelength=3.6, title="pixel x, y",
        title_fontsize=9, alignment="left", loc="outside right upper",
    )  # fmt: skip


def _bars(figure: Figure, image: ImageContents, values: dict[Pixel, np.ndarray]) -> None:
    axes = figure.subplots()
    count = len(image.labels)
    wide = 0.8 / count
    for i, row in enumerate(values.values()):
        for c, (label, value) in enumerate(zip(image.labels, row, strict=True)):
            at = i - 0.4 + wide * (c + 0.5)
            colour = CHANNELS.get(label.rpartition(".")[2], LINES[c % len(LINES)])
            height = float(value) if np.isfinite(value) else 0.0
            axes.bar(at, height, wide * 0.92, color=colour)
            if count * len(values) <= 24:
                text = f"{label}\n{value:.3g}"
                axes.annotate(
                    text, (at, max(height, 0.0)), (0, 3), textcoords="offset points",
                    ha="center", va="bottom", fontsize=8, color=INK,
                )  # fmt: skip
    axes.margins(y=0.16)
    _dress(axes, image.quantity)
    axes.set_xticks(range(len(values)), [f"{x}, {y}" for x, y in values])
    axes.set_xlim(-0.6, len(values) - 0.4)
    axes.set_xlabel("pixel x, y", color=INK)
    if image.colours is not None:
        swatches = [_swatch(image, pixel) for pixel in values]
        figure.legend(
            swatches, [f"{x}, {y}" for x, y in values], frameon=False, labelcolor=INK, fontsize=9,
            title="colour", title_fontsize=9, alignment="left", loc="outside right upper",
        )  # fmt: skip


def _swatch(image: ImageContents, pixel: Pixel) -> Patch:
    return Patch(facecolor=image.hex_colour(pixel) or PAPER, edgecolor=FAINT, linewidth=0.8)


def _dress(axes: Axes, quantity: str) -> None:
    """Give a plot what all share: a quiet grid, and no frame but the ground."""
    axes.set_ylabel(quantity, color=INK)
    axes.grid(axis="y", color=FAINT, linewidth=0.8)
    axes.set_axisbelow(True)
    axes.tick_params(colors=INK, labelsize=9, length=0)
    for name, side in axes.spines.items():
        side.set_visible(name == "bottom")
        side.set_color(INK)


def save(figure: Figure, path: Path) -> None:
    """Write a figure. Raises SceneError where that cannot be done."""
    try:
        with output_files.replacing(path) as partial:
            figure.savefig(partial)
    except OSError as error:
        raise SceneError(f"cannot be written: {error}", file=path) from error


def plot_phase(path: Path, medium: Any, title: str) -> None:
    """Plot the phase function of a medium of droplets. Raises SceneError for a suffix that is
    unknown, and if the file cannot be written."""
    check_format(path)
    figure = Figure(figsize=(8.0, 4.6), dpi=120, facecolor=PAPER, layout="constrained")
    axes, phase = figure.subplots(), medium.phase
    seen = np.flatnonzero((phase.wavelengths >= 400.0) & (phase.wavelengths <= 700.0))
    rows = seen if len(seen) else np.arange(len(phase.values))
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, MOST_CURVES).astype(int))]
    theta = np.degrees(np.arccos(phase.cosines))
    for row in rows:
        at = phase.wavelengths[row] if len(phase.wavelengths) else 550.0
        colour = strip(np.array([at]))[0, 0] / 255.0
        axes.semilogy(theta, phase.values[row], color=colour, lw=0.9, label=f"{at:g} nm")
    axes.set(xlim=(0.0, 180.0), xlabel="angle by which light turns [degrees]", ylabel="[1/sr]")
    axes.set_xticks(range(0, 181, 20))
    axes.grid(color=FAINT, lw=0.6)
    axes.legend(fontsize=7, ncols=2, frameon=False)
    figure.suptitle(title, x=0.012, ha="left", color=INK, weight="bold", size=11)
    save(figure, path)


def plot_lens(path: Path, lens: Prescription, waves: list[float], angles: list[float]) -> None:
    """Draw a lens. Raises SceneError for an unknown suffix, or where it cannot be written."""
    check_format(path)
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
        points = tracing.spot(lens, angle, wavelength).points * 1e3
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


def plot_figures(
    path: Path, title: str, figures: Sequence[Measurement], then: Mapping[int, float]
) -> None:
    """Plot figures to a file.

    then: values to compare with, by the indices of figures. Raises SceneError if the file cannot be
    written.
    """
    from ..bench import PARTS  # here: the other plots measure nothing
    from ..bench.pictures import POINTS

    check_format(path)
    good = [(i, figure) for i, figure in enumerate(figures) if figure.rounds and not figure.refused]
    measured = [(i, figure) for i, figure in good if figure.unit != POINTS]  # a unit a panel
    panels = {
        part: [(i, figure) for i, figure in measured if figure.part == part]
        for part in PARTS
        if any(figure.part == part for _, figure in measured)
    }
    if not panels:
        raise SceneError("there is no figure to plot", file=path)
    heights = [HEAD + BAR * len(rows) for rows in panels.values()]
    sheet = Figure(
        figsize=(8.0, 0.5 + sum(heights)), dpi=120, facecolor=PAPER, layout="constrained"
    )
    column = sheet.subplots(len(panels), 1, squeeze=False, height_ratios=heights)[:, 0]
    for axes, (part, rows) in zip(column, panels.items(), strict=True):
        _panel(axes, part, rows, then)
    sheet.suptitle(title, x=0.012, ha="left", color=INK, weight="bold", size=11)
    if then:
        mark = Line2D([], [], color=INK, marker="|", linestyle="", markersize=10)
        sheet.legend(
            [mark], ["in the record compared with"], frameon=False, labelcolor=INK, fontsize=9,
            loc="outside lower right",
        )  # fmt: skip
    save(sheet, path)


def _panel(
    axes: Axes,
    part: str,
    rows: Sequence[tuple[int, Measurement]],
    then: Mapping[int, float],
) -> None:
    values = [figure.value for _, figure in rows]
    shown = [*values, *(then[i] for i, _ in rows if i in then)]
    logarithmic = part == "stages" and max(shown) > SPAN * min(shown)
    kinds = list(dict.fromkeys(_kind(figure) for _, figure in rows))
    for row, (i, figure) in enumerate(rows):
        colour = COLOURS[kinds.index(_kind(figure)) % len(COLOURS)]
        axes.barh(row, figure.value, 0.72, color=colour)
        edge = figure.value * (1.0 + figure.spread)
        axes.plot([figure.value * (1.0 - min(figure.spread, 0.99)), edge], [row, row], color=INK)
        if i in then:
            axes.plot(then[i], row, marker="|", color=INK, markersize=11, markeredgewidth=2)
            edge = max(edge, then[i])
        text = f"{figure.value:.3g}"
        if "of_copy" in figure.more:
            text += f"   {figure.more['gbytes']:.2g} GB/s, {figure.more['of_copy']:.1%} of a copy"
        axes.annotate(
            text, (edge, row), (5, 0), textcoords="offset points", va="center", fontsize=8,
            color=INK,
        )  # fmt: skip
    low = min(shown) / 2 if logarithmic else 0.0
    axes.set_xscale("log" if logarithmic else "linear")
    axes.set_xlim(low, max(shown) * (30.0 if logarithmic else 1.25))
    axes.set_yticks(range(len(rows)), [figure.name for _, figure in rows])
    axes.set_ylim(len(rows) - 0.4, -0.6)
    scene = rows[0][1].scene if len({figure.scene for _, figure in rows}) == 1 else ""
    axes.set_title(f"{part}{' of ' if scene else ''}{scene}", loc="left", size=10, color=INK)
    direction = ", less is better" if rows[0][1].less_is_better else ""
    axes.set_xlabel(f"{rows[0][1].unit}{direction}", color=INK, size=9)
    axes.grid(axis="x", color=FAINT, linewidth=0.8)
    axes.set_axisbelow(True)
    axes.tick_params(colors=INK, labelsize=8, length=0, which="both")
    for name, side in axes.spines.items():
        side.set_visible(name == "left")
        side.set_color(INK)


def _kind(figure: Measurement) -> str:
    """Return the layout, which decides a figure's colour in its panel."""
    return str(figure.more.get("layout", "")) if figure.part in ("rays", "build") else ""
