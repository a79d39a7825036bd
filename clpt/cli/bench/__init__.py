"""`clpt bench`: how fast pictures, rays, stages, builds and starts of a device are."""

from __future__ import annotations

from pathlib import Path

import click

from ...choices import MODES, PICTURE_SIZES, TREES
from ..options.records import with_records
from ..options.values import Choice
from .settings import Report, Subject


@click.command()
@click.option("--scene", help="A scene's file or folder, or one of --list, made from formulas.")
@click.option(
    "--stage", "stages", multiple=True, metavar="NAME",
    help="What to measure: see --list; repeat it for several.  [default: all but shading]",
)  # fmt: skip
@click.option("--layout", "layouts", multiple=True, type=Choice(TREES), help="Of the trees.")
@click.option("--mode", type=Choice(MODES), help="What light is made of.")
@click.option("--device", help="Index or part of the name of a device, or all.")
@click.option(
    "--rounds", type=click.IntRange(1), default=5, show_default=True, help="Of each figure."
)
@click.option(
    "--size", type=Choice(PICTURE_SIZES), default="standard", show_default=True,
    help="Of the pictures; quick takes two minutes.",
)  # fmt: skip
@click.option(
    "--limit", type=click.FloatRange(1.0), default=900.0, show_default=True, metavar="SECONDS",
    help="That may pass without a figure, then the device counts as hanging.",
)  # fmt: skip
@click.option("--count", type=click.IntRange(64), help="Rays of a set.")
@click.option(
    "--json", "target", type=click.Path(path_type=Path), help="Append JSON lines to a file."
)
@click.option(
    "--compare", "record", type=click.Path(path_type=Path),
    help="JSON lines to compare with, earlier ones or of another device.",
)  # fmt: skip
@click.option(
    "--fail-below", type=float, metavar="RATIO",
    help="With --compare: exit with 3 if a figure is below this ratio, beyond noise.",
)  # fmt: skip
@click.option(
    "--plot", "plot", type=click.Path(path_type=Path),
    help="Plot the figures to a .png, .svg or .pdf; of several devices the last one's.",
)  # fmt: skip
@click.option(
    "--card", "card", type=click.Path(path_type=Path),
    help="Write a card of the pictures' points to an .svg or .png; of several devices the last "
    "one's.",
)  # fmt: skip
@click.option(
    "--first-light", "light", type=click.Path(path_type=Path), is_flag=False,
    flag_value=Path("first-light.md"), metavar="[FILE]",
    help="Check a device that nobody has tried, in five minutes; FILE gets what works, what is "
    "wrong, how fast it is, and what to report to whom.  [first-light.md]",
)  # fmt: skip
@click.option("--list", "list_all", is_flag=True, help="List what can be measured, and where.")
@with_records(subject=Subject, report=Report)
def bench(
    subject: Subject, report: Report, device: str | None, light: Path | None, list_all: bool
) -> int:
    """Measure pictures, rays, stages of rendering, builds and starts of an OpenCL device.

    Figures are medians of rounds; ± is half the distance of their quartiles. A result that cannot
    be true (a wrong picture, rays not traced, wrong hits, times below what memory allows)
    is refused: it is recorded without a value, and the exit status is 3.
    Each device is measured in a process of its own.
    """
    from .measuring import show_list, tell_of_devices  # here: help needs no OpenCL

    if list_all:
        show_list()
        return 0
    if light is not None:
        from .measuring import tell_of_first_light

        return tell_of_first_light(device, light, report.limit)
    report.check()
    return tell_of_devices(device, subject.settings(), report)
