"""Tables of what a lens does."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table

from ... import lenses
from ...lenses import spots


def near_axis(lens: lenses.Prescription, waves: Sequence[float]) -> Table:
    """Return what a lens does near its axis, a row for each wavelength [nm]."""
    table = Table(box=None, pad_edge=False)
    headings = ("nm", "focal length", "back focus", "f-number", "entrance pupil", "exit pupil")
    for heading in headings:
        table.add_column(heading, justify="right")
    for wavelength in waves:
        found = lenses.cardinal(lens, wavelength)
        table.add_row(
            f"{wavelength:g}", f"{found.focal_length:.5g}", f"{found.back_focus:.5g}",
            f"{found.f_number:.4g}", f"{2.0 * found.entrance_radius:.4g} at {found.entrance:.4g}",
            f"{2.0 * found.exit_radius:.4g} at {found.exit:.4g}",
        )  # fmt: skip
    return table


def of_spots(lens: lenses.Prescription, waves: Sequence[float], angles: Sequence[float]) -> Table:
    """Return the spots of points at angles [degrees], a row for each and a wavelength [nm]."""
    table = Table(box=None, pad_edge=False)
    for heading in ("degrees", "nm", "spot [um]", "light through"):
        table.add_column(heading, justify="right")
    for angle in angles:
        for wavelength in waves:
            spot = spots.spot(lens, angle, wavelength)
            size = f"{spot.radius * 1e3:.4g}" if len(spot.points) else "-"
            table.add_row(f"{angle:g}", f"{wavelength:g}", size, f"{spot.through:.3f}")
    return table
