"""The plots of `clpt inspect`, by matplotlib."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple
from matplotlib.patches import Patch

from clpt.files import output_files

from ...errors import SceneError
from ...images import to_srgb8
from ...spectra import cie_xyz, xyz_to_rgb
from ..files.image_contents import ImageContents, Pixel

FORMATS = (".png", ".svg", ".pdf")
INK, FAINT, PAPER = "#22262b", "#d9dde2", "#ffffff"
LINES = ("#22262b", "#c1440e", "#1f6f8b", "#6a8d2f", "#8c4a94", "#c9931a")
CHANNELS = {"R": "#c94f43", "G": "#4e9a51", "B": "#4a6fb5", "A": "#9aa1a9", "Y": "#6b7178"}
WIDTH = 12.0  # [nm] of these bands, at half their height
DOTS: dict[str, Any] = {"marker": "o", "markersize": 3.2, "clip_on": False}
MARKED = 64  # the most bands with dots


def write(path: Path, image: ImageContents, values: dict[Pixel, np.ndarray]) -> None:
    """Plot the values (n,) of pixels to a file: spectra over wavelength, or channels as bars.

    Raises SceneError if its suffix is unknown or it cannot be written.
    """
    if path.suffix.lower() not in FORMATS:
        raise SceneError(f"a plot is written to {', '.join(FORMATS)}", file=path)
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
