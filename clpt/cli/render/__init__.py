"""`clpt render`: scene files to image files."""

from __future__ import annotations

import re
import time
from dataclasses import replace
from pathlib import Path

import click

from ...errors import SceneError
from ...formats import locate
from ..files import targets
from ..files.targets import STANDARD, standard_output
from ..options.grading import grading_options, names_option
from ..options.records import grouped, verbose_option, with_records
from ..options.scene_options import denoise_option, scene_options, worker_options
from ..options.values import ScenePath
from ..process import ending, terminal
from .settings import Job, Settings, picture_options, tev_option

EXAMPLES = (
    ("clpt render scenes/cornell_box --spp 1k -o box.exr -o box.png", "Two files of one picture."),
    ("clpt render pawn.ply --camera 45,20 --env sky.exr --tone agx", "A mesh under a sky."),
    ("clpt render scenes/prism --noise 2% --time 10m", "Until there is little noise, or no time."),
    ("clpt render truck.glb --exposure auto -o truck.jpg", "As bright as a screen shows it."),
    ("clpt render room.xml --cluster local:2 --every 30s", "Two workers; a picture to look at."),
)
NAME = "{scene}"  # in the name of an output, the scene's
CAMERA = "{camera}"  # the camera's, or its number
ALL = "all"  # the name of no camera: each of them


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
    not rendered again. Each device renders whole frames, with --cluster all workers render a
    frame together; --time is per frame.

    If a scene of several fails, the others are still rendered; the exit status shows it.
    """
    settings.check()
    return one_by_one(scenes, settings, form)


def _rendered(job: Job) -> int:
    """Render the picture of a scene, or its frames; return the exit status."""
    began = time.perf_counter()
    from ..display import display

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


def one_by_one(scenes: tuple[Path, ...], settings: Settings, form: str | None) -> int:
    """Render scenes, of the camera `all` each; form: of the picture of -o -.

    Returns the exit status of a single scene; of several 0, or the largest status, and at a signal
    its status at once.
    """
    paths = settings.paths
    with standard_output(paths, form) as named:
        of_cameras = settings.options.loading.variables.get("camera") == ALL
        several = len(scenes) > 1 or of_cameras or settings.animation.frames is not None
        if STANDARD in paths and several:
            raise click.UsageError("-o - is for one picture")
        if set(paths) == {STANDARD} and settings.every is not None:
            raise click.UsageError("--every writes a file again and again; -o - is none")
        settings = replace(settings, paths=named)
        jobs = [settings.of(scene).named(NAME, targets.name_of(scene)) for scene in scenes]
        if of_cameras:
            jobs = [job_of_camera for job in jobs for job_of_camera in _of_cameras(job)]
        return _all(jobs) if len(jobs) > 1 else _rendered(jobs[0])


def _of_cameras(job: Job) -> list[Job]:
    """Return a job for each of a scene's cameras; the job itself where these cannot be told."""
    loading = job.options.loading
    variables = {key: value for key, value in loading.variables.items() if key != "camera"}
    try:
        scene = replace(loading, variables=variables).read(job.scene)
    except SceneError:
        return [job]  # it fails by itself, and says why
    names = [entry.partition(" ")[2] for entry in scene.extra.get("cameras", ())]
    if ALL in names:
        return [job]
    if not names:
        return [job.with_variables(variables)]
    if len({*names}) < len(names) or not all(names):
        names = [str(number) for number in range(len(names))]
    if not job.paths:
        usual = tuple(path.with_stem(f"{path.stem}.{CAMERA}") for path in job.targets)
        job = replace(job, paths=usual)
    jobs = []
    for number, name in enumerate(names):
        job_of_camera = job.named(CAMERA, re.sub(r"[^\w.-]", "_", name))
        job_of_camera = job_of_camera.with_variables(variables | {"camera": str(number)})
        jobs.append(replace(job_of_camera, camera=str(number)))
    return jobs


def _check_distinct(jobs: list[Job]) -> None:
    """Raise SceneError where two scenes or cameras would be written to the same file."""
    owners: dict[Path, Job] = {}
    for job in jobs:
        for path in job.files:
            other = owners.setdefault(path.absolute(), job)
            if other.scene is not job.scene:
                message = f"{other.scene} and {job.scene} would both be written there"
                raise SceneError(f"{message}; -o '{NAME}.exr' names them by the scene", file=path)
            if other is not job:
                message = "several cameras would be written there"
                raise SceneError(f"{message}; -o '{CAMERA}.exr' names them", file=path)


def _all(jobs: list[Job]) -> int:
    """Render each scene; return the status of all."""
    _check_distinct(jobs)
    for job in jobs:
        targets.checked(job.targets)
    statuses: list[int] = []
    for number, job in enumerate(jobs, start=1):
        if not job.quiet:
            which = "" if job.camera is None else f", camera {job.camera}"
            terminal.say(f"{job.scene}{which} ({number} of {len(jobs)})")
        status = _rendered_of_several(job)
        if status > ending.BAD_INPUT:
            return status  # a signal
        statuses.append(status)
    failed = [str(job.scene) for job, status in zip(jobs, statuses, strict=True) if status]
    if failed:
        ending.complain(f"{len(failed)} of {len(jobs)} scenes failed: {', '.join(failed)}")
    return max(statuses)


def _rendered_of_several(job: Job) -> int:
    """Render a scene of several; return the status."""
    try:
        return _rendered(job)
    except Exception as error:
        message, status = ending.message_of(error)
        ending.complain(message if str(job.scene) in message else f"{job.scene}: {message}")
        return status
