"""`clpt kernels`: the OpenCL sources that a scene is rendered with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .. import output_files
from ..choices import LAYOUTS
from ..errors import SceneError
from ..formats import load, locate
from .options.loading_options import loading_options


@click.command()
@click.argument("scene", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", "folder", type=click.Path(path_type=Path), required=True,
    help="Folder for the files; created if missing.",
)  # fmt: skip
@click.option(
    "--lanes", type=click.Choice(["1", "8", "16"]), default="8", show_default=True,
    help="Paths per work-item: 1 as on a GPU, 8 or 16 as on a CPU.",
)  # fmt: skip
@click.option(
    "--layout", type=click.Choice(LAYOUTS), default="wide8", show_default=True,
    help="Acceleration structure of the triangles.",
)  # fmt: skip
@loading_options
def kernels(scene: Path, folder: Path, lanes: str, layout: str, variables: dict[str, Any]) -> None:
    """Write the OpenCL programs that render SCENE, one file each.

    Each is a complete program for any OpenCL compiler. No device is needed. On a CPU a render has
    their functions in one program.
    """
    locate(scene)
    from ..render.codegen.programs import film_sources, sources  # here: help needs no OpenCL
    from ..render.lowering.scene import lower

    features = lower(load(scene, **variables)).features
    queued = len(features.materials.kinds) > 1
    made = film_sources(features, layout)
    for own in features.passes:
        label = "light_" if own is not features else ""
        texts = sources(own, layout, int(lanes), queued=queued)
        made |= {f"{label}{name}": text for name, text in texts.items()}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, source in made.items():
            output_files.write_text(folder / f"{name}.cl", source.text)
    except OSError as error:
        raise SceneError(f"cannot be written: {error}", file=folder) from error
    for name, source in made.items():
        rows, files = source.text.count("\n"), len(source.files)
        click.echo(f"{folder / name}.cl  {rows:,} lines from {files} files")
