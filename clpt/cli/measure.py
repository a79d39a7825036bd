"""`clpt measure`: light at points or along rays, as numbers with units."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..choices import QUANTITIES
from ..formats import locate
from .options.scene_options import loading_options
from .options.values import Choice, ScenePath
from .process import terminal


@click.command()
@click.argument("scene", type=ScenePath())
@click.option(
    "--at", "points", type=click.Path(path_type=Path), required=True, metavar="FILE.csv",
    help="Rows of x, y, z [m], perhaps with nx, ny, nz, the normal, or dx, dy, dz, a direction.",
)  # fmt: skip
@click.option("--quantity", type=Choice(QUANTITIES), default="illuminance", show_default=True)
@click.option(
    "--direction", type=(float, float, float), default=(0.0, 1.0, 0.0), show_default=True,
    metavar="X Y Z", help="The normal, or the direction, of rows without one.",
)  # fmt: skip
@click.option(
    "--samples", type=click.IntRange(1, 2**31 - 1), default=4096, show_default=True,
    help="Paths of each point, at most.",
)  # fmt: skip
@click.option(
    "--error", type=click.FloatRange(0.0, min_open=True),
    help="Stop when all standard errors are at most this share of the value, such as 0.01.",
)  # fmt: skip
@click.option(
    "--bands", type=click.IntRange(1, 1000), default=47, show_default=True,
    help="Of spectral quantities, over the wavelengths of the scene's film.",
)  # fmt: skip
@click.option("--device", metavar="NAME-OR-INDEX", help="Where to render, see `clpt devices`.")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="A .csv file, in place of the terminal."
)
@loading_options
def measure(
    scene: Path,
    points: Path,
    direction: tuple[float, float, float],
    output: Path | None,
    variables: dict[str, Any],
    **how: Any,
) -> None:
    """Measure light in SCENE at points or along rays, with standard errors.

    Quantities at points: irradiance, spectral_irradiance, scalar_irradiance, illuminance,
    scalar_illuminance, photon_flux_density, tristimulus, and by `clpt[measure]` cct, cri and rf.
    Along rays: radiance, spectral_radiance, luminance.
    """
    locate(scene)
    locate(points)
    from .. import formats, instruments
    from ..files import output_files
    from ..instruments import tables

    if output is not None:
        output_files.check_writable(output)
    at, directions = tables.read_points(points)
    loaded = formats.load(scene, **variables)
    measured = instruments.measure(
        loaded, how.pop("quantity"), at, direction if directions is None else directions, **how
    )
    text = tables.written(at, measured)
    if output is None:
        terminal.write(text.rstrip("\n"))
    else:
        output_files.write_text(output, text)
        terminal.say(str(output))
