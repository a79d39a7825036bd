"""`clpt measure`: light at points or along rays, as numbers with units."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..choices import QUANTITIES
from ..formats import locate
from .options.scene_options import loading_options
from .options.values import Choice, ScenePath, Size
from .process import terminal

if TYPE_CHECKING:
    from ..scene import Scene


@click.command()
@click.argument("scene", type=ScenePath())
@click.option(
    "--at", "points", type=click.Path(path_type=Path), metavar="FILE.csv",
    help="Rows of x, y, z [m], perhaps with nx, ny, nz, the normal, or dx, dy, dz, a direction.",
)  # fmt: skip
@click.option(
    "--texels", metavar="NAME", help="In place of --at: the shape of this name, at its uvs' texels."
)
@click.option("--size", type=Size(), help="Of the map of --texels.", default="64x64")
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
    "--interpolate", type=click.IntRange(1), default=1, metavar="TEXELS",
    help="Of --texels: the widest step between measured texels; others are interpolated where "
    "light is smooth.",
)  # fmt: skip
@click.option(
    "--bands", type=click.IntRange(1, 1000), default=47, show_default=True,
    help="Of spectral quantities, over the wavelengths of the scene's film.",
)  # fmt: skip
@click.option("--device", metavar="NAME-OR-INDEX", help="Where to render, see `clpt devices`.")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path),
    help="A .csv file, in place of the terminal; of --texels also .exr, .npy, .hdr, .pfm, or .png "
    "in false colors.",
)  # fmt: skip
@loading_options
def measure(
    scene: Path,
    points: Path | None,
    texels: str | None,
    size: tuple[int, int],
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
    if (points is None) == (texels is None):
        raise click.UsageError("Give --at FILE.csv or --texels NAME.")
    if how["interpolate"] > 1 and texels is None:
        raise click.UsageError("--interpolate is for maps: give --texels NAME.")
    locate(scene)
    from .. import formats, instruments
    from ..files import output_files
    from ..instruments import tables

    if output is not None:
        output_files.check_writable(output)
    if points is None:
        text = _of_texels(formats.load(scene, **variables), str(texels), size, output, how)
    else:
        at, directions = tables.read_points(locate(points))
        toward = direction if directions is None else directions
        loaded = formats.load(scene, **variables)
        text = tables.written(at, instruments.measure(loaded, at=at, directions=toward, **how))
    if output is None:
        return terminal.write(text.rstrip("\n"))
    if text:
        output_files.write_text(output, text)
    return terminal.say(str(output))


def _of_texels(
    scene: Scene, name: str, size: tuple[int, int], output: Path | None, how: dict[str, Any]
) -> str:
    """Measure a shape; write an image, or return a table."""
    from .. import instruments
    from ..images.picture_files import check_output
    from ..instruments import tables

    in_image = output is not None and output.suffix.lower() != ".csv"
    if output is not None and in_image:
        check_output(output)
    surface = instruments.texels(scene, name, size)
    measured = instruments.bake(scene, name, size=size, **how)
    if output is not None and in_image:
        tables.write_map(output, measured)
        return ""
    return tables.written(surface.points, measured.at(surface.covered))
