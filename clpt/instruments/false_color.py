"""Pictures of numbers: false colors with a scale and contour lines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from clpt.errors import SceneError
from clpt.files import output_files


def write_false_color(
    path: str | Path,
    values: ArrayLike,
    unit: str = "cd/m^2",
    *,
    low: float | None = None,
    high: float | None = None,
    logarithmic: bool = False,
    contours: ArrayLike = (),
) -> None:
    """Write values (h, w) as a .png in false colors, with a scale.

    low, high: ends of the scale; None: those of the values, of the positive ones if logarithmic.
    contours: levels of lines, with their numbers. Needs matplotlib, `clpt[plot]`. Raises
    SceneError.
    """
    array = np.asarray(values, np.float64)
    if array.ndim != 2 or not np.isfinite(array).any():
        raise SceneError(f"must be (h, w) with finite numbers, not {array.shape}", where="values")
    try:
        from matplotlib import colors
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise SceneError("false colors need matplotlib: pip install 'clpt[plot]'") from None
    shown = array[np.isfinite(array) & (array > 0.0)] if logarithmic else array
    if not shown.size:
        raise SceneError("a logarithmic scale needs a positive number", where="values")
    ends = (
        (float(np.nanmin(shown)) if low is None else low),
        (float(np.nanmax(shown)) if high is None else high),
    )
    if not ends[0] < ends[1]:
        ends = ends[0], ends[0] + max(abs(ends[0]), 1.0) * 1e-3
    height, width = array.shape
    figure = Figure(figsize=(1.0 + 6.0, 6.0 * height / width + 0.4), dpi=150, layout="constrained")
    axes = figure.add_subplot()
    norm = (colors.LogNorm if logarithmic else colors.Normalize)(*ends)
    image = axes.imshow(array, cmap="turbo", norm=norm, interpolation="nearest")
    levels = np.sort(np.atleast_1d(np.asarray(contours, np.float64)))
    if levels.size:
        lines = axes.contour(array, levels=levels, colors="white", linewidths=0.8)
        axes.clabel(lines, fmt="%g", fontsize=7)
    axes.set_axis_off()
    figure.colorbar(image, ax=axes, label=unit, shrink=0.9)
    with output_files.replacing(Path(path)) as partial:
        FigureCanvasAgg(figure).print_png(str(partial))
