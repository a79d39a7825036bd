"""`clpt convert`: an image or film in another format, or for a screen."""

from __future__ import annotations

from pathlib import Path

import click

from ..formats import locate
from .options.grading import GradingOptions, grading_options
from .options.records import with_records
from .process import terminal


@click.command()
@click.argument("source", type=click.Path(path_type=Path))
@click.argument("target", type=click.Path(path_type=Path))
@click.option("--layer", metavar="NAME", help="Take this layer of an .exr in place of the picture.")
@grading_options
@with_records(graded=GradingOptions)
def convert(source: Path, target: Path, layer: str | None, graded: GradingOptions) -> None:
    """Write the image or film SOURCE as TARGET, in another format or for a screen.

    SOURCE is any image that clpt reads, a film or a checkpoint; the suffix of TARGET is .exr, .png,
    .jpg, .webp, .hdr, .pfm or .npy. A spectral .exr becomes its colours.
    """
    grading = graded.grading
    locate(source)
    from .files.image_tools import write_converted

    for line in write_converted(source, target, layer, grading):
        terminal.say(line)
