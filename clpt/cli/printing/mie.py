"""A table of a medium of drops."""

from __future__ import annotations

from typing import Any

import numpy as np
from rich.table import Table

from .console import output_console


def print_medium(medium: Any, at: np.ndarray) -> None:
    """Print what a medium does at wavelengths [nm]."""
    table = Table(box=None, pad_edge=False)
    for heading in ("nm", "sigma_t [1/m]", "albedo", "mean cosine", "back [1/sr]"):
        table.add_column(heading, justify="right")
    phase = medium.phase
    moment = phase.values * phase.cosines
    g = np.pi * ((moment[:, 1:] + moment[:, :-1]) @ np.diff(phase.cosines))
    sigma_t, albedo = (each.sample(at) for each in (medium.sigma_t, medium.albedo))
    for row in zip(at, sigma_t, albedo, g, phase.values[:, 0], strict=True):
        table.add_row(*(f"{value:.6g}" for value in row))
    output_console().print(table)
