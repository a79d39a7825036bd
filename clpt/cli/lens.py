"""`clpt lens`: what a lens does near its axis, its section and its spots."""

from __future__ import annotations

from pathlib import Path

import click

from ..errors import SceneError
from .process import terminal
from .process.extras import extra


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
    from .printing import lens as tables
    from .printing.console import output_console, shown

    made = lenses.read(lens) if Path(lens).suffix else lenses.library(lens)
    if f_number is not None:
        made = made.with_stop(lenses.paraxial.stop_radius(made, f_number))
    waves = _numbers(wavelengths, "--wavelengths", 200.0, 2000.0)
    angles = _numbers(fields, "--fields", -89.0, 89.0)
    console = output_console()
    source = f"; {made.source}" * bool(made.source)
    console.print(shown(f"{made.name}, {len(made.surfaces)} surfaces{source}"))
    console.print(tables.near_axis(made, waves))
    console.print(tables.of_spots(made, waves, angles))
    if plot is not None:
        with extra("plot", "a plot"):
            from .plots import lens as lens_plot  # here: matplotlib is an extra, and slow to import

        lens_plot.write(plot, made, waves, angles)
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
