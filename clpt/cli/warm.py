"""`clpt warm`: compiles what scenes are rendered with, so that later renders begin at once."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from itertools import combinations, cycle
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..errors import SceneError, UnknownKindError
from ..formats import locate
from .options.records import Grouped, verbose_option, with_records
from .options.scene_options import SceneOptions, denoise_option, scene_options
from .options.values import ScenePath
from .process import terminal

if TYPE_CHECKING:
    from ..scene import Scene


@click.command(cls=Grouped)
@click.argument("scenes", type=ScenePath(), nargs=-1, required=True)
@scene_options
@denoise_option
@click.option(
    "--kinds", default="", metavar="NAME,..",
    help="Kinds of materials of which later scenes have some: every set of them is compiled, on "
    "the shapes of SCENES.",
)  # fmt: skip
@verbose_option("Log more; twice for everything.")
@click.option("--quiet", is_flag=True, help="Show no progress and no warnings.")
@with_records(options=SceneOptions)
def warm(
    scenes: tuple[Path, ...], options: SceneOptions, kinds: str, verbose: int, quiet: bool
) -> None:
    """Compile the programs of SCENES into the caches, and render nothing.

    Give the options of the renders that come: mode, size, device and others decide what is
    compiled. Scenes of the same kinds of materials, lights and shapes share programs.
    """
    for scene in scenes:
        locate(scene)
    from .display import display
    from .opening import DeviceFactory, open_scene

    for scene in scenes:
        shown, began = display(quiet, None), time.perf_counter()
        with ExitStack() as resources:
            plan, opened, loading = open_scene(scene, options, shown, resources)
            factory = DeviceFactory(opened, options)
            for variant in _variants(plan, tuple(filter(None, kinds.split(",")))):
                renderer = factory.make(variant, shown)
                with shown.phase("compiling for the first samples"):
                    renderer.prepare()
                renderer.close()
        builds, seconds = [on.builds for on in opened], time.perf_counter() - began
        programs, cached = sum(b.programs for b in builds), sum(b.cached for b in builds)
        terminal.say(
            f"{scene}: {programs} programs, {cached} of them found, in {seconds:.1f}"
            f" s; the scene took {loading:.1f} s of it",
            err=False,
        )


def _variants(scene: Scene, kinds: tuple[str, ...]) -> Iterator[Scene]:
    """Yield the scene, or, of several kinds of materials, a scene for each set of them.

    Shapes that give no light have the set's kinds in turn. Raises SceneError, UnknownKindError.
    """
    from ..scene.materials import LEAVES
    from ..scene.shapes import Instance

    if not kinds:
        yield scene
        return
    known = {cls.kind: cls for cls in LEAVES}
    for name in kinds:
        if name not in known:
            raise UnknownKindError("material", name, known, where="--kinds")
    plain = [
        i
        for i, shape in enumerate(scene.shapes)
        if shape.emission is None and not isinstance(shape, Instance)
    ]
    if len(plain) < len(kinds):
        message = f"{len(kinds)} kinds need as many shapes without light, not {len(plain)}"
        raise SceneError(message, where="--kinds")
    for count in range(1, len(kinds) + 1):
        for chosen in combinations(kinds, count):
            shapes = [*scene.shapes]
            for i, name in zip(plain, cycle(chosen), strict=False):
                shapes[i] = replace(shapes[i], material=known[name]())
            yield replace(scene, shapes=shapes)
