"""`clpt kernels`: the OpenCL sources of a scene, or a single launch of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from clpt.files import output_files

from ..choices import LAYOUTS, MODES, PICTURE_SCENES
from ..errors import SceneError
from ..formats import load, locate
from .options.records import with_records
from .options.scene_options import loading_options
from .options.values import Choice, ScenePath
from .process import terminal

if TYPE_CHECKING:
    from ..scene import Scene

FIRST = "first"  # in the place of a stage's name: the first that is wrong


@dataclass(frozen=True)
class Programs:
    """Programs to write.

    lanes: paths of a work-item; layout: of trees; repro: a stage whose launch is written instead;
    device: that runs the stage.
    """

    lanes: str
    layout: str
    repro: str | None
    device: str | None


@click.command()
@click.argument("scene", type=ScenePath())
@click.option(
    "-o", "--output", "folder", type=click.Path(path_type=Path), required=True,
    help="Folder for the files; created if missing.",
)  # fmt: skip
@click.option(
    "--lanes", type=Choice(["1", "8", "16"]), default="8", show_default=True,
    help="Paths per work-item: 1 as on a GPU, 8 or 16 as on a CPU.",
)  # fmt: skip
@click.option(
    "--layout", type=Choice(LAYOUTS), default="wide8", show_default=True,
    help="Acceleration structure of the triangles.",
)  # fmt: skip
@click.option("--mode", type=Choice(MODES), help="What light is made of.")
@click.option(
    "--repro", metavar="STAGE",
    help="Write a program of its own, in C and in Python, that shows whether a device runs this "
    "stage right; `first`: the first stage that is wrong.",
)  # fmt: skip
@click.option("--device", help="Of --repro: index or part of the name of the device.")
@loading_options
@with_records(programs=Programs)
def kernels(
    scene: Path,
    folder: Path,
    mode: str | None,
    programs: Programs,
    variables: dict[str, Any],
) -> None:
    """Write the OpenCL programs that render SCENE, each to its file.

    Each is a complete program for any OpenCL compiler. No device is needed. On a CPU a render has
    their functions in a single program. SCENE may be a name of `clpt bench --list`.
    """
    plan = _opened(scene, mode, variables)
    if programs.repro is not None:
        _reproduce(plan, scene, folder, programs.repro, programs.device)
        return
    _write_texts(plan, folder, programs)


def _write_texts(plan: Scene, folder: Path, programs: Programs) -> None:
    """Write each program of a scene to its file."""
    from clpt.render.flow.programs import film_sources, sources  # here: help needs no OpenCL
    from clpt.render.flow.scene_to_tables import lower

    features = lower(plan).features
    queued = len(features.materials.kinds) > 1
    texts_by_name = film_sources(features, programs.layout)
    for features_of_pass in features.passes:
        label = "light_" if features_of_pass is not features else ""
        written = sources(features_of_pass, programs.layout, int(programs.lanes), queued=queued)
        texts_by_name |= {f"{label}{name}": text for name, text in written.items()}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, source in texts_by_name.items():
            output_files.write_text(folder / f"{name}.cl", source.text)
    except OSError as error:
        raise SceneError(f"cannot be written: {error}", file=folder) from error
    for name, source in texts_by_name.items():
        rows, files = source.text.count("\n"), len(source.files)
        terminal.say(f"{folder / name}.cl  {rows:,} lines from {files} files", err=False)


def _opened(scene: Path, mode: str | None, variables: dict[str, Any]) -> Scene:
    """Return a scene of a file, or of the benchmark where there is no such file."""
    built_in = str(scene) in PICTURE_SCENES and not scene.exists()
    if not built_in:
        locate(scene)
    from clpt.bench.scenes import PICTURES, build_scene, in_mode  # here: help needs no OpenCL

    if built_in:
        return in_mode(build_scene(str(scene)), mode or PICTURES[str(scene)].mode)
    return in_mode(load(scene, **variables), mode)


def _reproduce(plan: Scene, scene: Path, folder: Path, stage: str, which: str | None) -> None:
    """Write a program that shows whether a device runs a stage right."""
    from clpt.bench import agreement, launches

    from .. import device

    on = device.choose(which)
    witness = agreement.witness_of(on)
    only = () if stage == FIRST else (stage,)
    for comparison in agreement.checked(on, plan, witness, only):
        if only or comparison.problem:
            break
    else:
        raise SceneError(f"no stage is wrong beside {witness.name}", file=scene)
    verdict, launch = comparison.problem or "right", comparison.launch
    launches.write_program(folder, launch, str(scene), on.info, witness.name, verdict)
    terminal.say(f"{launch.stage} on {on.info.label}: {verdict}, beside {witness.name}", err=False)
    terminal.say(f"{folder / 'README.txt'} says how to run it without clpt", err=False)
