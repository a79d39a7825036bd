"""The plot of `clpt mie`, by matplotlib: how much light goes where, a curve for a wavelength."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ...errors import SceneError
from .pixels import FAINT, FORMATS, INK, PAPER, save, strip

MOST_CURVES = 12


def write(path: Path, medium: Any, title: str) -> None:
    """Plot the phase function of a medium of droplets. Raises SceneError for a suffix that is
    unknown, and if the file cannot be written."""
    if path.suffix.lower() not in FORMATS:
        raise SceneError(f"a plot is written to {', '.join(FORMATS)}", file=path)
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
