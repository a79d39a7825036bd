"""`clpt render`: scene files to image files."""

from __future__ import annotations

import time
from pathlib import Path

import click

from ...formats import locate
from ..files import targets
from ..options.grading import grading_options, names_option
from ..options.headings import grouped
from ..options.records import with_records
from ..options.scene_options import denoise_option, scene_options
from ..options.scene_path import ScenePath
from ..options.verbosity import verbose_option
from ..options.workers import worker_options
from .settings import Job, Settings, picture_options, tev_option

EXAMPLES = (
    ("clpt render scenes/cornell_box --spp 1k -o box.exr -o box.png", "Two files of one picture."),
    ("clpt render pawn.ply --camera 45,20 --env sky.exr --tone agx", "A mesh under a sky."),
    ("clpt render scenes/prism --noise 2% --time 10m", "Until there is little noise, or no time."),
    ("clpt render truck.glb --exposure auto -o truck.jpg", "As bright as a screen shows it."),
    ("clpt render room.xml --cluster local:2 --every 30s", "Two workers; a picture to look at."),
)


@click.command(cls=grouped(EXAMPLES))
@click.argument("scenes", metavar="SCENE...", nargs=-1, required=True, type=ScenePath())
@picture_options
@scene_options
@denoise_option
@worker_options("Render on the workers of tls://HOST:PORT, or of local:N.")
@tev_option
@grading_options
@names_option
@verbose_option("Print memory, trees, programs and stages; log more, twice for everything.")
@click.option("--quiet", is_flag=True, help="Show no progress and no warnings.")
@with_records(settings=Settings)
def render(scenes: tuple[Path, ...], form: str | None, settings: Settings) -> int:
    """Render each SCENE: a scene file, a mesh or a folder.

    The scene decides what no option sets. With --time or --noise but no --spp the render goes on
    until the time is over, or the noise is below the limit. The time is that of rendering, which
    begins when the scene is read and its kernels are compiled. Ctrl-C stops it within a second;
    the picture so far is written, and the exit status is 130. SIGTERM and SIGHUP do the same, with
    the statuses 143 and 129.

    A render with checkpoints goes on where it was saved, to the bit, also with more samples; with
    another scene, setting or version it says what differs, and ends.

    With --frames every frame gets files of its own: name.0001.exr, or what #### or %04d in -o says.
    -D values may have {frame}, {time} in seconds, and arithmetic of them such as {360*frame/240};
    SCENE may be scene.####.json. Frames that are complete, and of the same scene and options, are
    not rendered again. Each device renders whole frames, with --cluster all workers render one
    together; --time is per frame.

    If one scene of several fails, the others are still rendered; the exit status shows it.
    """
    settings.check()
    from .several_scenes import one_by_one  # here: help needs neither OpenCL nor loaders

    return one_by_one(_rendered, scenes, settings, form)


def _rendered(job: Job) -> int:
    """Render the picture of a scene, or its frames; return the exit status."""
    began = time.perf_counter()
    from ..printing.display import display

    if job.animation.frames is not None:
        from .frames import render_frames

        return render_frames(job, display(job.quiet, None))
    locate(job.scene)
    targets.checked(job.targets)
    name = targets.name_of(job.scene)
    shown = display(job.quiet, job.until.limit, name)
    shown.begin(f"{name} ...")
    from .picture import render_picture

    return render_picture(job, shown, began)
