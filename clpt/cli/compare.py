"""`clpt compare`: figures of the difference between two images, and a picture of it."""

from __future__ import annotations

from pathlib import Path

import click

from ..formats import locate
from .process import terminal


@click.command()
@click.argument("a", type=click.Path(path_type=Path))
@click.argument("b", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", type=click.Path(path_type=Path),
    help="Write the difference: a - b as .exr, .hdr, .pfm or .npy; its size in false colours as "
    ".png, .jpg or .webp.",
)  # fmt: skip
@click.option(
    "--most", type=click.FloatRange(0.0, min_open=True), metavar="VALUE",
    help="The difference that is the brightest of the false colours.  "
    "[default: that which a pixel of a hundred is beyond]",
)  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="Write JSON instead of a table.")
def compare(a: Path, b: Path, output: Path | None, most: float | None, as_json: bool) -> None:
    """Measure how the image or film A differs from B.

    Spectral images of the same wavelengths are compared by their values, others by their colours,
    linear; B is the reference. The relative square error is the mean of (a - b)^2 / (b^2 + 0.01).
    """
    locate(a)
    locate(b)
    from .files import image_tools

    pair = image_tools.Pair.read(a, b)
    if as_json:
        terminal.write(image_tools.as_json(pair))
    else:
        terminal.say_lines(image_tools.as_text(pair))
    if output is not None:
        terminal.say(image_tools.write(pair, output, most))
