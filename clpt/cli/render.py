"""`clpt render`: a scene file to image files."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import click

from ..render.film_renderer import MOST_SAMPLES
from ..scene import Scene
from . import checkpoints, outputs, report
from .display import Display
from .display import display as display_of
from .frame_values import Frames
from .frames import render_frames
from .grading import Grading, grading, grading_options, names_option
from .on_cluster import Where, render_on_cluster
from .rendering import render_samples
from .scene_options import AnyRenderer, denoise_option, open_renderer, scene_options
from .several_scenes import one_by_one
from .so_far import PictureSoFar
from .standard_output import FORMATS
from .stopping import STATUS, stops
from .tev_viewer import EVERYWHERE, Address, showing
from .verbosity import verbose_option


class SampleRange(click.ParamType):
    """FIRST:END, numbers of samples without the last; returned as two numbers."""

    name = "FIRST:END"

    def convert(self, value: Any, param: Any, ctx: Any) -> tuple[int, int]:
        found = re.fullmatch(r"(\d{1,10}):(\d{1,10})", str(value).strip())
        if not found or not int(found[1]) < int(found[2]) <= MOST_SAMPLES:
            self.fail(f"{value!r} is no range of samples such as 0:1024", param, ctx)
        return int(found[1]), int(found[2])


class Duration(click.ParamType):
    """A time such as 30s, 5m, 1h30m or 2.5; returned in seconds."""

    name = "TIME"
    least = 1e-6

    def convert(self, value: Any, param: Any, ctx: Any) -> float:
        text = str(value).strip().lower()
        number = r"(\d+(?:\.\d+)?)"
        found = re.fullmatch(rf"(?:{number}h)?(?:{number}m)?(?:{number}s?)?", text)
        if not text or not found:
            self.fail(f"{value!r} does not look like 30s, 5m or 1h30m", param, ctx)
        hours, minutes, rest = (float(n or 0) for n in found.groups())
        seconds = 3600 * hours + 60 * minutes + rest
        if not self.least <= seconds < 1e9:
            self.fail(f"{value!r} is no time to render in", param, ctx)
        return seconds


class Period(Duration):
    """A time, or 0."""

    least = 0.0


@click.command()
@click.argument(
    "scenes", metavar="SCENE...", nargs=-1, required=True, type=click.Path(path_type=Path)
)
@click.option(
    "-o", "--output", "paths", multiple=True, type=click.Path(path_type=Path, allow_dash=True),
    help="Where to write: .exr .png .hdr .pfm .npy, or - for the standard output; may be given "
    "several times; {scene} is the scene's name, {camera} that of --camera all.  "
    "[default: {scene}.exr and {scene}.png]",
)  # fmt: skip
@click.option(
    "--format", "form", type=click.Choice(FORMATS), help="Of the picture of -o -.  [default: png]"
)
@click.option(
    "--every", type=Duration(),
    help="How often to write the picture so far, from the first sample of all pixels on.",
)  # fmt: skip
@click.option("--spp", type=click.IntRange(1, 2**31 - 1), help="Samples per pixel.")
@click.option(
    "--noise", type=click.FloatRange(0.0), metavar="SHARE",
    help="Stop sampling pixels with less noise, such as 0.02 of their light, after --denoise "
    "if that is given; 0: never.",
)  # fmt: skip
@click.option("--time", "limit", type=Duration(), help="Stop after 30s, 5m, 1h30m.")
@click.option(
    "--samples",
    "numbers",
    type=SampleRange(),
    help="Take samples of these numbers only, END without: -o a.film, for `clpt merge`.",
)
@click.option(
    "--checkpoint",
    "period",
    type=Period(),
    help="How often to save what there is beside the picture, as NAME.resume.exr, and keep that "
    "file; 0: never.  [default: 5m, after ten minutes; removed at the end]",
)
@click.option(
    "--resume/--no-resume",
    default=None,
    help="Go on from NAME.resume.exr, which must be there; or leave it alone.  [default: go on if "
    "it is there]",
)
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), help="Seed of the random numbers.")
@click.option(
    "--frames", type=Frames(),
    help="Render an animation: 1:240, with the last one. Complete frames stay.",
)  # fmt: skip
@click.option(
    "--fps", type=click.FloatRange(0.0, min_open=True), default=24.0, show_default=True,
    help="Frames a second, of {time} and of the video.",
)  # fmt: skip
@click.option("--video", type=click.Path(path_type=Path), help="Write the frames as .mp4 too.")
@scene_options
@denoise_option
@click.option(
    "--cluster", type=Where(), help="Render on the workers of tls://HOST:PORT, or of local:N."
)
@click.option(
    "--keys", type=click.Path(path_type=Path),
    help="Folder of the cluster's keys.  [default: that of clpt cluster start on this machine]",
)  # fmt: skip
@click.option(
    "--tev", type=Address(), is_flag=False, flag_value=EVERYWHERE,
    help="Show the picture in tev or HDRView while it is rendered.  [default: 127.0.0.1:14158]",
)  # fmt: skip
@grading_options
@names_option
@verbose_option("Print memory, trees, programs and stages; log more, twice for everything.")
@click.option("--quiet", is_flag=True, help="Show no progress and no warnings.")
@one_by_one
def render(
    scene: Path,
    paths: tuple[Path, ...],
    every: float | None,
    limit: float | None,
    frames: range | None,
    fps: float,
    video: Path | None,
    numbers: tuple[int, int] | None,
    period: float | None,
    resume: bool | None,
    cluster: str | None,
    keys: Path | None,
    tev: tuple[str, int] | None,
    exposure: float,
    tone: str | None,
    view: str | None,
    display: str | None,
    look: str | None,
    ocio: str,
    names: str,
    verbose: int,
    quiet: bool,
    **options: Any,
) -> int:
    """Render each SCENE: a scene file, a mesh or a folder.

    The scene decides what no option sets. With --time or --noise but no --spp the render goes on
    until the time is over, or the noise is below the limit. The time counts from the command's
    start, kernels included. Ctrl-C stops it within a second; the picture so far is written, and the
    exit status is 130. SIGTERM and SIGHUP do the same, with the statuses 143 and 129.

    A render with checkpoints goes on where it was saved, to the bit, also with more samples; with
    another scene, setting or version it says what differs, and ends.

    With --frames every frame gets files of its own: name.0001.exr, or what #### or %04d in -o says.
    -D values may have {frame}, {time} in seconds, and arithmetic of them such as {360*frame/240};
    SCENE may be scene.####.json. Frames that are complete, and of the same scene and options, are
    not rendered again. A frame is a device's, or with --cluster of all workers; --time is that of
    each.

    Of several scenes one that fails does not keep the others from being rendered; the exit status
    tells of it at the end.
    """
    graded = grading(
        exposure=exposure, tone=tone, view=view, display=display, look=look, ocio=ocio, names=names
    )
    if tev is not None and (frames is not None or cluster is not None):
        raise click.UsageError(
            "--tev shows one picture of this machine: not with these options yet"
        )
    if frames is not None:
        if numbers or period is not None or resume is not None:
            raise click.UsageError("frames go on by themselves: leave out what saves one picture")
        if every is not None:
            raise click.UsageError("each frame is written when it is complete: leave out --every")
        return render_frames(
            scene, paths, frames, fps, video, graded, limit, display_of(quiet, None),
            cluster=cluster, keys=keys, profiling=bool(verbose), **options,
        )  # fmt: skip
    if video is not None:
        raise click.UsageError("--video needs --frames")
    targets = outputs.checked(paths or outputs.default(scene))
    if numbers and (options["spp"] or options["noise"]):
        raise click.UsageError("--samples says how many there are; leave out --spp and --noise")
    shown = display_of(quiet, limit)
    began = time.perf_counter()
    saved_at = checkpoints.path_of(scene, targets)
    saved = checkpoints.find(saved_at, resume, shown.note)
    if cluster is not None:
        return render_on_cluster(
            scene, targets, shown, cluster, keys=keys, limit=limit, graded=graded, numbers=numbers,
            period=period, every=every, saved=saved, **options,
        )  # fmt: skip
    first, end = numbers or (0, None)

    def accept(plan: Scene) -> None:
        checkpoints.check_range(plan, numbers)
        if saved is not None:
            checkpoints.check(saved, saved_at, plan, first, end)

    resources = click.get_current_context().with_resource(ExitStack())
    renderer, loading = open_renderer(
        scene, shown, resources, accept, profiling=bool(verbose), first_sample=first, **options
    )
    resources.callback(renderer.close)
    if saved is not None:
        checkpoints.go_on(renderer, saved, saved_at, shown.note)
    end = end or options["spp"]
    if end is None and limit is None and not options["noise"]:
        end = renderer.scene.spp
    if verbose:
        report.before(renderer, loading)
    ready = time.perf_counter()
    left = shown.limit = None if limit is None else max(began + limit - ready, 0.0)
    writer = checkpoints.Checkpoints(
        renderer, saved_at, period, saved is not None, targets, shown.note
    )
    viewed = showing(tev, scene.name, renderer, shown.note)

    def stats_so_far() -> dict[str, str | int | float]:
        return outputs.metadata(renderer, scene, time.perf_counter() - ready)

    so_far = PictureSoFar(every, targets, renderer, stats_so_far, graded, shown.note)
    with stops() as stopped, viewed as show_picture:

        def after_pass() -> None:
            writer.after_pass()
            so_far.after_pass()
            show_picture()

        with _rescuing(writer, renderer, targets, stats_so_far, graded, shown), shown.rendering():
            render_samples(
                renderer, end, left, shown.show, renderer.scene.noise, stopped, after_pass
            )
        writer.save(bool(stopped))
        stats = stats_so_far()
        outputs.write_all(targets, renderer, stats, graded, shown.note)
        writer.finish(bool(stopped))
    share = float(stats["spp"])
    if share < 1.0:
        shown.note(f"clpt: warning: only {share:.1%} of the pixels have a sample; others are black")
    rejected = renderer.counts.rejected
    if rejected:
        shown.note(
            f"clpt: warning: {rejected} samples were not finite, or too bright, and count as black"
        )
    if renderer.counts.full:
        shown.note("clpt: warning: pixels are too bright for the film: lower film.exposure")
    if verbose:
        report.after(renderer)
    for on in renderer.devices:
        if stopped and on.compilers is not None:
            on.compilers.kill()
    return STATUS + stopped[0] if stopped else 0


@contextmanager
def _rescuing(
    writer: checkpoints.Checkpoints,
    renderer: AnyRenderer,
    targets: tuple[Path, ...],
    stats: Callable[[], dict[str, str | int | float]],
    graded: Grading,
    shown: Display,
) -> Iterator[None]:
    """Write the film and the picture so far, where they can be read, if a render fails inside."""

    def write_film() -> None:
        writer.save(False, failed=True)

    def write_picture() -> None:
        if renderer.counts.samples:
            outputs.write_all(targets, renderer, stats(), graded, shown.note)

    try:
        yield
    except Exception:
        for step in write_film, write_picture:
            try:
                step()
            except outputs.FAILURES as error:
                shown.note(f"clpt: warning: {error}")
        writer.finish(True)
        raise
