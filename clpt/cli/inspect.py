"""`clpt inspect`: what an image file holds, and the spectra of its pixels as numbers and a plot."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.table import Table

from .files.film_contents import film_contents
from .files.image_contents import ImageContents, Pixel, read_contents
from .files.targets import is_film
from .printing.console import output_console, shown
from .process.extras import extra


class PixelType(click.ParamType):
    """X,Y in pixels."""

    name = "X,Y"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
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
    help="The plot, .png, .svg or .pdf; FILE's name with .spectrum.png in this folder by default.",
)  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="Write JSON instead of tables.")
def inspect(file: Path, pixels: tuple[Pixel, ...], output: Path | None, as_json: bool) -> None:
    """Show what the image or film FILE holds; plot the spectra of pixels, or their channels.

    Of a spectral EXR file the values at its wavelengths are shown, of any other image its channels,
    linear.
    """
    image = film_contents(file) if is_film(file) else read_contents(file)
    values = {pixel: image.pixel(pixel) for pixel in pixels}
    if as_json:
        click.echo(json.dumps(_as_json(image, values), indent=2))
    else:
        _print(image, values)
    if pixels:
        with extra("plot", "a plot"):
            from .plots import pixels as plots  # here: matplotlib is an extra, and slow to import

        target = output or Path(f"{file.stem}.spectrum.png")
        plots.write(target, image, values)
        click.echo(str(target), err=True)


def _as_json(image: ImageContents, values: dict[Pixel, np.ndarray]) -> dict[str, Any]:
    lambdas = {"wavelengths": image.lambdas.tolist()} if image.lambdas is not None else {}
    pixels = [{"at": pixel, "values": row.tolist()} for pixel, row in values.items()]
    return {**image.facts, "channels": image.labels, **lambdas, "pixels": pixels}


def _print(image: ImageContents, values: dict[Pixel, np.ndarray]) -> None:
    console = output_console()
    console.print(str(image.path), markup=False, highlight=False)
    facts = Table(show_header=False)
    for name, value in image.facts.items():
        facts.add_row(shown(name), shown(value))
    console.print(facts)
    if not values:
        return
    console.print(image.quantity, markup=False)
    numbers = Table()
    numbers.add_column("wavelength" if image.lambdas is not None else "channel", justify="right")
    for x, y in values:
        numbers.add_column(f"{x},{y}", justify="right")
    for i, label in enumerate(image.labels):
        numbers.add_row(label, *(f"{row[i]:.5g}" for row in values.values()))
    if image.colours is not None:
        names = [image.hex_colour(pixel) for pixel in values]
        numbers.add_section()
        numbers.add_row("sRGB", *(f"[on {name}]   [/] {name}" for name in names))
    console.print(numbers)
