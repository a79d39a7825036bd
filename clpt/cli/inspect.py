"""`clpt inspect`: what an image file holds, and the spectra of its pixels as numbers and a plot."""

from __future__ import annotations

import json
import re
from pathlib import Path

import click

from ..formats import locate
from .process import terminal
from .process.extras import extra

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
    from .files import shown_images  # here: help needs no numpy
    from .files.conversions import contents

    image = contents(file)
    values = {pixel: image.pixel(pixel) for pixel in pixels}
    if as_json:
        terminal.write(json.dumps(shown_images.as_json(image, values), indent=2))
    else:
        shown_images.print_tables(image, values)
    if plot or output is not None:
        with extra("plot", "a plot"):
            from .plots import pixels as plots  # here: matplotlib is an extra, and slow to import

        target = output or Path(f"{file.stem}.spectrum.png")
        plots.write(target, image, values)
        terminal.say(str(target))
