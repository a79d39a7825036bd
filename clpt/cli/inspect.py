"""`clpt inspect`: what an image file holds, and the spectra of its pixels as numbers and a plot."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..formats import locate
from .process import terminal
from .process.ending import extra

if TYPE_CHECKING:
    import numpy as np

    from .files.image_contents import ImageContents

Pixel = tuple[int, int]  # x, y from the top left


class PixelType(click.ParamType):
    """X,Y in pixels."""

    name = "X,Y"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> Pixel:
        match = re.fullmatch(r"(\d{1,9}),(\d{1,9})", str(value).replace(" ", ""))
        if not match:
            self.fail(f"{value!r} does not look like 120,80", param, ctx)
        return int(match[1]), int(match[2])


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--at", "pixels", multiple=True, type=PixelType(), metavar="X,Y",
    help="A pixel, counted from 0,0 at the top left; may be given again.",
)  # fmt: skip
@click.option(
    "-o", "--output", type=click.Path(path_type=Path),
    help="Plot the pixels to this file: .png, .svg or .pdf. Needs clpt[plot].",
)  # fmt: skip
@click.option("--plot", is_flag=True, help="Plot them to FILE's name with .spectrum.png, here.")
@click.option("--json", "as_json", is_flag=True, help="Write JSON instead of tables.")
def inspect(
    file: Path, pixels: tuple[Pixel, ...], output: Path | None, plot: bool, as_json: bool
) -> None:
    """Show what the image or film FILE holds, and the values of its pixels.

    Of a spectral EXR file the values at its wavelengths are shown, of any other image its channels,
    linear.
    """
    if (plot or output is not None) and not pixels:
        raise click.UsageError("a plot is of pixels: name one by --at X,Y")
    locate(file)
    from .files.image_contents import contents  # here: help needs no numpy

    image = contents(file)
    values = {pixel: image.pixel(pixel) for pixel in pixels}
    if as_json:
        terminal.write(json.dumps(_as_json(image, values), indent=2))
    else:
        _print_tables(image, values)
    if plot or output is not None:
        with extra("plot", "a plot"):
            from . import plots  # here: matplotlib is an extra, and slow

        target = output or Path(f"{file.stem}.spectrum.png")
        plots.plot_pixels(target, image, values)
        terminal.say(str(target))


def _as_json(image: ImageContents, values: dict[Pixel, np.ndarray]) -> dict[str, Any]:
    """Return an image and the values of its pixels as JSON."""
    lambdas = {"wavelengths": image.lambdas.tolist()} if image.lambdas is not None else {}
    pixels = [{"at": pixel, "values": row.tolist()} for pixel, row in values.items()]
    return {**image.facts, "channels": image.labels, **lambdas, "pixels": pixels}


def _print_tables(image: ImageContents, values: dict[Pixel, np.ndarray]) -> None:
    """Print what an image is, and the values of its pixels."""
    from rich.table import Table

    from .console import output_console, shown

    console = output_console()
    console.print(shown(image.path))
    facts = Table(show_header=False)
    for name, value in image.facts.items():
        facts.add_row(shown(name), shown(value))
    console.print(facts)
    if not values:
        return
    console.print(shown(image.quantity))
    numbers = Table()
    numbers.add_column("wavelength" if image.lambdas is not None else "channel", justify="right")
    for x, y in values:
        numbers.add_column(f"{x},{y}", justify="right")
    for i, label in enumerate(image.labels):
        numbers.add_row(shown(label), *(f"{row[i]:.5g}" for row in values.values()))
    if image.colours is not None:
        names = [image.hex_colour(pixel) for pixel in values]
        numbers.add_section()
        numbers.add_row("sRGB", *(f"[on {name}]   [/] {name}" for name in names))
    console.print(numbers)
