"""`clpt warm`: compiles what scenes are rendered with, so that later renders begin at once."""

from __future__ import annotations

import time
from contextlib import ExitStack
from pathlib import Path

import click

from ..formats import locate
from .options.records import Grouped, verbose_option, with_records
from .options.scene_options import SceneOptions, denoise_option, scene_options
from .options.values import ScenePath
from .process import terminal


@click.command(cls=Grouped)
@click.argument("scenes", type=ScenePath(), nargs=-1, required=True)
@scene_options
@denoise_option
@verbose_option("Log more; twice for everything.")
@click.option("--quiet", is_flag=True, help="Show no progress and no warnings.")
@with_records(options=SceneOptions)
def warm(scenes: tuple[Path, ...], options: SceneOptions, verbose: int, quiet: bool) -> None:
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
            renderer = DeviceFactory(opened, options).make(plan, shown)
            with shown.phase("compiling for the first samples"):
                renderer.prepare()
        builds, seconds = [on.builds for on in renderer.devices], time.perf_counter() - began
        programs, cached = sum(b.programs for b in builds), sum(b.cached for b in builds)
        terminal.say(
            f"{scene}: {programs} programs, {cached} of them found, in {seconds:.1f}"
            f" s; the scene took {loading:.1f} s of it",
            err=False,
        )
        renderer.close()
