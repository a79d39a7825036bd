"""`clpt view`: a scene in the browser, rendered while it is watched and steered."""

from __future__ import annotations

from pathlib import Path

import click

from ...choices import MOST_SEED
from ...formats import locate
from ..options.grading import grading_options
from ..options.records import grouped, verbose_option, with_records
from ..options.scene_options import scene_options, worker_options
from ..options.values import Count, Noise, ScenePath
from .settings import Settings

EXAMPLES = (
    ("clpt view scenes/cornell_box", "Opens the page in this machine's browser."),
    ("clpt view pawn.ply --env sky.exr --size 640x360", "A mesh under a sky."),
    ("clpt view scenes/prism --host 0.0.0.0 --no-browser", "For the browsers of other machines."),
)


@click.command(cls=grouped(EXAMPLES))
@click.argument("scene", type=ScenePath())
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="0: any that is free.")
@click.option(
    "--host", default="127.0.0.1", show_default=True,
    help="Where to listen; any but this machine's own lets in whoever has the address.",
)  # fmt: skip
@click.option("--no-browser", is_flag=True, help="Print the address, and open nothing.")
@click.option(
    "-o", "--output", "folder", default=".", show_default=True,
    type=click.Path(path_type=Path, exists=True, file_okay=False),
    help="Folder that gets what the page saves.",
)  # fmt: skip
@click.option(
    "--open", "opened", type=click.Path(path_type=Path, exists=True, dir_okay=False),
    metavar="VIEW.json", help="Begin with a view that the page has saved.",
)  # fmt: skip
@worker_options("Render on workers, as of `clpt render`.")
@click.option("--spp", type=Count(), help="Samples per pixel: 256, 1k, 1M.")
@click.option("--noise", type=Noise(), help="As of `clpt render`.")
@click.option("--seed", type=click.IntRange(0, MOST_SEED), help="Seed of the random numbers.")
@scene_options
@grading_options
@verbose_option("Log more, twice for everything.")
@click.option("--quiet", is_flag=True, help="Show no progress and no warnings.")
@with_records(settings=Settings)
def view(scene: Path, settings: Settings, verbose: int) -> int:
    """Show the scene file, mesh or folder SCENE in the browser, and let it be steered.

    The line that is printed is the page's address. It opens the page once, on this machine; the
    page makes addresses for others. The scene's file is read again when it changes. Ctrl-C ends it.
    """
    locate(scene)
    from .page import show  # here: help needs neither OpenCL nor a server

    return show(scene, settings)
