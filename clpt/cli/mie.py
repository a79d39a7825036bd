"""`clpt mie`: a medium of droplets, from their index and sizes, for a scene file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from clpt.files import output_files

from ..choices import DROP_SIZES
from ..errors import SceneError
from .options.records import with_records
from .options.values import Choice
from .process import terminal
from .process.ending import extra

if TYPE_CHECKING:
    import numpy as np

DIGITS = 6  # of the table in a file


@dataclass(frozen=True)
class Drops:
    """Drops: sizes, see `clpt.mie.sizes`, share of the volume, indices; radius [um].

    k: absorption of the drops; host: index of the medium around them; wavelengths: of the table.
    """

    radius: float
    law: str
    spread: float
    share: float
    radii: int
    index: str
    k: str
    host: str
    wavelengths: str


@click.command()
@click.argument("radius", type=float)
@click.option(
    "--law", default="log_normal", show_default=True, type=Choice(DROP_SIZES),
    help="How many drops have which radius: RADIUS is that of all, the median, or the effective"
    " radius (Hansen and Travis 1974).",
)  # fmt: skip
@click.option(
    "--spread", type=float, default=0.1, show_default=True,
    help="Of log_normal the standard deviation of ln(radius), of gamma the effective variance.",
)  # fmt: skip
@click.option(
    "--share", type=float, default=1e-7, show_default=True,
    help="Of the volume; 1e-7 is 0.1 g of water in a cubic metre.",
)  # fmt: skip
@click.option(
    "--index", default="water", show_default=True, metavar="N",
    help="Of the drops: a number, water, a glass, a file.",
)  # fmt: skip
@click.option(
    "--k", default="0", show_default=True, metavar="K",
    help="Their absorption: a number, or a file.",
)  # fmt: skip
@click.option(
    "--host", default="1", show_default=True, metavar="N",
    help="The index of what is around them.",
)  # fmt: skip
@click.option(
    "--wavelengths", default="360,830,10", show_default=True, metavar="FROM,TO,STEP",
    help="Of the table [nm].",
)  # fmt: skip
@click.option(
    "--radii", type=click.IntRange(2, 10000), default=200, show_default=True,
    help="That stand for all.",
)  # fmt: skip
@click.option(
    "-o", "--output", type=click.Path(path_type=Path),
    help="The medium as .json, for `media` of a scene.",
)  # fmt: skip
@click.option(
    "--plot", type=click.Path(path_type=Path),
    help="The phase function by angle and wavelength, .png, .svg or .pdf.",
)  # fmt: skip
@with_records(drops=Drops)
def mie(drops: Drops, output: Path | None, plot: Path | None) -> None:
    """Make the medium of spheres of RADIUS micrometres: fog, mist, milk.

    It follows from Mie's theory (1908), for each wavelength. Without -o, a table of it is shown.
    """
    from .. import mie as theory  # here: help needs no numpy
    from ..formats.native.write import write_medium

    at = _wavelengths(drops.wavelengths)
    medium = theory.droplets(
        theory.sizes(drops.law, drops.radius * 1e-6, drops.spread, drops.radii), drops.share,
        index=_index(drops.index, "eta"), k=_index(drops.k, "k"),
        host=_index(drops.host, "eta"), lambdas=at,
    )  # fmt: skip
    if output is not None:
        if output.suffix.lower() != ".json":
            raise SceneError("a medium is written as .json", file=output)
        try:
            output_files.write_text(output, write_medium(medium, DIGITS) + "\n")
        except OSError as error:
            raise SceneError(f"cannot be written: {error.strerror}", file=output) from None
        terminal.say(str(output))
    if plot is not None:
        with extra("plot", "a plot"):
            from . import plots  # here: matplotlib is an extra, and slow

        title = f"{drops.law}, {drops.radius:g} um, {drops.index} in {drops.host}"
        plots.plot_phase(plot, medium, title)
        terminal.say(str(plot))
    if output is None and plot is None:
        _print_medium(medium, at)


def _wavelengths(text: str) -> np.ndarray:
    import numpy as np

    try:
        first, last, step = map(float, text.split(","))
        if not (0.0 < first <= last and step > 0.0 and (last - first) / step < 2000.0):
            raise ValueError
    except ValueError:
        message = f"{text!r} does not look like 360,830,10 with a first, a last and a step"
        raise SceneError(message, where="--wavelengths") from None
    return np.arange(first, last + 1e-6 * step, step)


def _index(text: str, column: Any) -> Any:
    try:
        return float(text)
    except ValueError:
        pass
    if Path(text).suffix:
        from .. import spectra

        return spectra.read_index(Path(text), column)
    return text


def _print_medium(medium: Any, at: np.ndarray) -> None:
    """Print coefficients and phase function of a medium at wavelengths [nm]."""
    import numpy as np
    from rich.table import Table

    from .console import output_console

    table = Table(box=None, pad_edge=False)
    for heading in ("nm", "sigma_t [1/m]", "albedo", "mean cosine", "back [1/sr]"):
        table.add_column(heading, justify="right")
    phase = medium.phase
    moment = phase.values * phase.cosines
    g = np.pi * ((moment[:, 1:] + moment[:, :-1]) @ np.diff(phase.cosines))
    sigma_t, albedo = (each.sample(at) for each in (medium.sigma_t, medium.albedo))
    for row in zip(at, sigma_t, albedo, g, phase.values[:, 0], strict=True):
        table.add_row(*(f"{value:.6g}" for value in row))
    output_console().print(table)
