"""`clpt lens`: what a lens does near its axis, its section and its spots."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..errors import SceneError
from .process import terminal
from .process.ending import extra

if TYPE_CHECKING:
    from rich.table import Table

    from ..lenses import Prescription


@click.command()
@click.argument("lens")
@click.option(
    "--wavelengths", default="486.1327,587.5618,656.2725", show_default=True,
    metavar="A,B,...", help="At which it is looked at [nm]; by default the lines F, d and C.",
)  # fmt: skip
@click.option(
    "--fields", default="0,10,20", show_default=True, metavar="A,B,...",
    help="Angles of the points whose spots are drawn [degrees].",
)  # fmt: skip
@click.option("--f-number", type=float, help="To which the stop closes; as far open as it is.")
@click.option(
    "--plot", type=click.Path(path_type=Path),
    help="The section with rays, and spot diagrams, .png, .svg or .pdf.",
)  # fmt: skip
def lens(
    lens: str, wavelengths: str, fields: str, f_number: float | None, plot: Path | None
) -> None:
    """Describe LENS: a file (.dat, .zmx, .txt) or a name of the library.

    Lengths are in millimetres; pupils stand behind the first and the last surface. A spot's size is
    the root of its mean squared radius.
    """
    from .. import lenses  # here: help needs no numpy
    from .console import output_console, shown

    prescription = lenses.read(lens) if Path(lens).suffix else lenses.library(lens)
    if f_number is not None:
        prescription = prescription.with_stop(lenses.tracing.stop_radius(prescription, f_number))
    waves = _numbers(wavelengths, "--wavelengths", 200.0, 2000.0)
    angles = _numbers(fields, "--fields", -89.0, 89.0)
    console = output_console()
    source = f"; {prescription.source}" * bool(prescription.source)
    console.print(shown(f"{prescription.name}, {len(prescription.surfaces)} surfaces{source}"))
    console.print(_near_axis(prescription, waves))
    console.print(_spots(prescription, waves, angles))
    if plot is not None:
        with extra("plot", "a plot"):
            from . import plots  # here: matplotlib is an extra, and slow

        plots.plot_lens(plot, prescription, waves, angles)
        terminal.say(str(plot))


def _numbers(text: str, option: str, low: float, high: float) -> list[float]:
    try:
        values = [float(part) for part in text.split(",")]
        if not 1 <= len(values) <= 12 or not all(low <= value <= high for value in values):
            raise ValueError
    except ValueError:
        message = f"{text!r} is no list of 1 to 12 numbers from {low:g} to {high:g}"
        raise SceneError(message, where=option) from None
    return values


def _near_axis(lens: Prescription, waves: Sequence[float]) -> Table:
    """Return paraxial properties of a lens, a row for each wavelength [nm]."""
    from rich.table import Table

    from .. import lenses

    table = Table(box=None, pad_edge=False)
    headings = ("nm", "focal length", "back focus", "f-number", "entrance pupil", "exit pupil")
    for heading in headings:
        table.add_column(heading, justify="right")
    for wavelength in waves:
        points = lenses.cardinal(lens, wavelength)
        table.add_row(
            f"{wavelength:g}", f"{points.focal_length:.5g}", f"{points.back_focus:.5g}",
            f"{points.f_number:.4g}",
            f"{2.0 * points.entrance_radius:.4g} at {points.entrance:.4g}",
            f"{2.0 * points.exit_radius:.4g} at {points.exit:.4g}",
        )  # fmt: skip
    return table


def _spots(lens: Prescription, waves: Sequence[float], angles: Sequence[float]) -> Table:
    """Return the spots of points at angles [degrees], a row for each and a wavelength [nm]."""
    from rich.table import Table

    from ..lenses import tracing

    table = Table(box=None, pad_edge=False)
    for heading in ("degrees", "nm", "spot [um]", "light through"):
        table.add_column(heading, justify="right")
    for angle in angles:
        for wavelength in waves:
            spot = tracing.spot(lens, angle, wavelength)
            size = f"{spot.radius * 1e3:.4g}" if len(spot.points) else "-"
            table.add_row(f"{angle:g}", f"{wavelength:g}", size, f"{spot.through:.3f}")
    return table
