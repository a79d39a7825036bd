"""`clpt render --frames`: an animation, frame by frame, over devices; and a video of the frames.

The ffmpeg of the package imageio-ffmpeg makes the video. The package's own writer does not tell
whether ffmpeg came to its end, so it is not used. A .webp is a picture that moves, for pages;
Pillow writes it.
"""

from __future__ import annotations

import hashlib
import json
import math
import subprocess
import tempfile
import threading
import time
from collections import deque
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import click
import numpy as np
from PIL import Image

from clpt.files import output_files
from clpt.render.flow.check import check

from ... import images
from ...device import share_compilers
from ...errors import ClusterError, SceneError
from ...formats import prepare
from ...render.resumable import ResumableRenderer
from ...scene import Scene
from ...scene.fingerprint import fingerprint
from ...version import VERSION
from ..display import Display, clock
from ..files import outputs, targets
from ..opening import RendererFactory, choose_devices, cluster_factories, device_factories
from ..options.applied import changed
from ..process.ending import STATUS, extra, stops
from .passes import End, render_samples
from .report import refusals
from .settings import Job, expanded, has_number, numbered, varies

POLL = 0.02  # seconds between two looks at ffmpeg
MOVING_PICTURE = ".webp"
FORMATS = (".mp4", ".mov", ".mkv", ".webm", MOVING_PICTURE)
QUALITY = {"libx264": ["-crf", "16"], "libvpx-vp9": ["-crf", "24", "-b:v", "0"]}
# Even sides, which chroma of half the size needs, and colours as screens for Rec. 709 expect.
FILTER = (
    "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv,"
    "setparams=color_primaries=bt709:color_trc=iec61966-2-1:colorspace=bt709:range=tv"
)


def check_video(path: Path) -> None:
    """Raise SceneError for a video that cannot be written, ClptError without the package."""
    if path.suffix.lower() not in FORMATS:
        raise SceneError(f"a video is one of {' '.join(FORMATS)}", file=path)
    try:
        output_files.check_writable(path)
    except OSError as error:
        raise SceneError(f"cannot be written: {error}", file=path) from error
    if path.suffix.lower() != MOVING_PICTURE:
        with extra("video", "--video"):
            import imageio_ffmpeg  # noqa: F401


def write_video(path: Path, frames: Sequence[Path], fps: float) -> None:
    """Write .png files of equal size as a video. Raises SceneError."""
    if path.suffix.lower() == MOVING_PICTURE:
        _moving_picture(path, frames, fps)
        return
    with extra("video", "--video"):
        from imageio_ffmpeg import get_ffmpeg_exe
    try:
        with output_files.replacing(path) as partial:
            _encode(get_ffmpeg_exe(), partial, frames, fps)
    except OSError as error:
        raise SceneError(f"cannot be written: {error}", file=path) from error


def _moving_picture(path: Path, frames: Sequence[Path], fps: float) -> None:
    """Write .png files of equal size as a .webp that begins again at its end. Raises SceneError."""
    first, *others = (Image.fromarray(_read(frame)) for frame in frames)
    if any(other.size != first.size for other in others):
        raise SceneError("frames of a video have one size", file=frames[0])
    ends = [round(1000 * n / fps) for n in range(len(frames) + 1)]  # [ms]
    try:
        with output_files.replacing(path) as partial:
            first.save(
                partial, "WEBP", save_all=True, append_images=others, loop=0, quality=80, method=6,
                duration=[end - begin for begin, end in pairwise(ends)],
            )  # fmt: skip
    except OSError as error:
        raise SceneError(f"cannot be written: {error}", file=path) from error


def _encode(ffmpeg: str, path: Path, frames: Sequence[Path], fps: float) -> None:
    """Let ffmpeg write a file. Raises OSError, with the message of ffmpeg, where it fails.

    A signal raises KeyboardInterrupt when ffmpeg is gone: without an owner it would write on.
    """
    height, width = _read(frames[0]).shape[:2]
    rate = str(Fraction(fps).limit_denominator())
    codec = "libvpx-vp9" if path.suffix.lower() == ".webm" else "libx264"
    command = [
        ffmpeg, "-y", "-v", "error", "-xerror", "-f", "rawvideo", "-pix_fmt", "rgb24",
        "-s", f"{width}x{height}", "-r", rate, "-i", "-", "-an", "-vcodec", codec,
        "-pix_fmt", "yuv420p", *QUALITY[codec], "-vf", FILTER, str(path),
    ]  # fmt: skip
    with (
        stops() as stopped,
        tempfile.TemporaryFile() as said,
        subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=said,
            start_new_session=True,  # Ctrl-C is for this process
        ) as process,
    ):  # fmt: skip
        _feed(process, frames, (height, width), stopped)
        while process.poll() is None and not stopped:
            time.sleep(POLL)
        if stopped:
            process.kill()
            process.wait()
            raise KeyboardInterrupt(*stopped)
        if process.returncode:
            said.seek(0)
            lines = said.read().decode("utf-8", "replace").strip().splitlines()
            raise OSError(lines[-1] if lines else f"ffmpeg ended with status {process.returncode}")


def _feed(
    process: subprocess.Popen[bytes],
    frames: Sequence[Path],
    size: tuple[int, int],
    stopped: Sequence[int],
) -> None:
    """Give ffmpeg the pixels of frames, until a signal has come; it ends if they cannot be read."""
    assert process.stdin is not None
    try:
        for frame in frames:
            pixels = _read(frame)
            if pixels.shape[:2] != size:
                raise SceneError("frames of a video have one size", file=frame)
            process.stdin.write(pixels.tobytes())
            if stopped:
                break
        process.stdin.close()
    except BrokenPipeError:  # it ended, and says why
        with suppress(OSError):
            process.stdin.close()
    except BaseException:
        process.kill()
        raise


def _read(path: Path) -> np.ndarray:
    """A .png as (h, w, 3) uint8: transparent pixels are over black."""
    values = images.read_stored(path).values
    if values.shape[2] == 4:
        values = (values[..., :3].astype(np.uint16) * values[..., 3:] // 255).astype(np.uint8)
    return np.repeat(values, 3, axis=2) if values.shape[2] == 1 else values


KEPT = (".exr", ".png")  # formats that keep a frame's fingerprint
LOOK = 0.1  # seconds between two looks at signals


@dataclass(frozen=True)
class _Frames:
    """The frames of a job; outputs: names of files with a place for the number of a frame."""

    job: Job
    numbers: range
    outputs: tuple[Path, ...]

    @classmethod
    def of(cls, job: Job) -> _Frames:
        """Return the frames of a job. Raises click.UsageError, SceneError."""
        numbers, scene = job.animation.frames or range(0), job.scene
        if not varies(job.options.loading.variables) and not has_number(scene):
            raise click.UsageError(
                "all frames would be the same: let a variable depend on them, as -D 'time={time}', "
                "or give a scene of each frame, as scene.####.json"
            )
        named = numbered(scene, numbers[0]) if has_number(scene) else scene
        outputs = job.paths or targets.default(named)
        if not job.paths and job.animation.video is None:
            outputs = outputs[:1]  # .exr
        frames = cls(job, numbers, outputs)
        if job.animation.video is not None:
            if not frames.pictures:
                raise click.UsageError("--video is made of .png: add -o NAME.png")
            check_video(job.animation.video)
        targets.checked(frames.targets(numbers[0]))
        return frames

    @property
    def pictures(self) -> list[Path]:
        """The .png files of all frames, of the first path that ends so."""
        pngs = [path for path in self.outputs if path.suffix.lower() == ".png"]
        return [numbered(path, frame) for path in pngs[:1] for frame in self.numbers]

    def file(self, frame: int) -> Path:
        """Return the scene file of a frame."""
        scene = self.job.scene
        return numbered(scene, frame) if has_number(scene) else scene

    def targets(self, frame: int) -> tuple[Path, ...]:
        """Return the files of a frame's picture."""
        return tuple(numbered(path, frame) for path in self.outputs)

    def load(self, frame: int) -> tuple[Scene, str]:
        """Return a frame's scene, and the fingerprint of all that decides its picture."""
        loading, changes = self.job.options.loading, self.job.options.changes
        values = expanded(loading.variables, frame, self.job.animation.fps)
        scene = changed(replace(loading, variables=values).read(self.file(frame)), changes)
        check(scene)
        decides = {
            "scene": fingerprint(scene).digest, "spp": self.job.until.end(scene),
            "noise": scene.noise, "time": self.job.until.limit,
            "grading": repr(self.job.graded.grading), "version": VERSION,
            "denoise": changes.denoise,
        }  # fmt: skip
        return scene, hashlib.sha256(json.dumps(decides, sort_keys=True).encode()).hexdigest()

    def is_complete(self, frame: int, digest: str) -> bool:
        """Whether a frame's files are there, and of this fingerprint."""
        paths = self.targets(frame)
        kept = [_fingerprint_of(path) for path in paths if path.suffix.lower() in KEPT]
        return bool(kept) and set(kept) == {digest} and all(path.is_file() for path in paths)


def render_frames(job: Job, shown: Display) -> int:
    """Render frames that are not complete; return the exit status."""
    frames = _Frames.of(job)
    with ExitStack() as resources, stops() as stopped:
        factories = _factories(job, len(frames.numbers), shown, resources)
        _FrameLoop(frames, factories, shown, stopped).run()
        factories[0].report()
        if stopped:
            for factory in factories:
                factory.stop()
            return STATUS + stopped[0]
    film, fps = job.animation.video, job.animation.fps
    if film is not None:
        with shown.phase(f"writing {film}"):
            write_video(film, frames.pictures, fps)
        count = len(frames.numbers)
        shown.note(f"{film}  {count} frames, {count / fps:.3g} s")
    return 0


def _factories(
    job: Job, frames: int, shown: Display, resources: ExitStack
) -> Sequence[RendererFactory]:
    """Return factories of renderers: of devices, or of the workers of a cluster."""
    if job.workers.cluster is not None:
        together = 1 if job.until.limit is not None else frames  # its time is a frame's own
        several = cluster_factories(job.workers, job.options, together, shown)
        return resources.enter_context(several)
    prepare(job.scene)
    devices = choose_devices(job.options.machine)
    share_compilers(devices, job.options.machine.threads, resources)
    return device_factories(devices, job.options, frames)


class _FrameLoop:
    """A thread for each factory, which takes frames, and a thread that reads scenes ahead."""

    def __init__(
        self,
        frames: _Frames,
        factories: Sequence[RendererFactory],
        shown: Display,
        stopped: Sequence[int],
    ):
        self.plan, self.factories, self.shown, self.stopped = frames, [*factories], shown, stopped
        self.errors: list[BaseException] = []
        self._left = deque(frames.numbers)
        self._ahead: deque[tuple[int, Future[tuple[Scene, str]]]] = deque()
        self._lock = threading.Lock()
        self._done = self._rendered = 0
        self._seconds = 0.0
        self._began = time.perf_counter()

    def run(self) -> None:
        """Render all frames. Raises what a thread raised."""
        with ThreadPoolExecutor(1) as reader:
            while (self._left or self._ahead) and not (self.errors or self.stopped):
                threads = [
                    threading.Thread(target=self._work, args=(factory, reader), daemon=True)
                    for factory in self.factories
                ]
                for thread in threads:
                    thread.start()
                for thread in threads:
                    while thread.is_alive():
                        thread.join(LOOK)
            for _, scene in self._ahead:
                scene.cancel()
        if self.errors:
            raise self.errors[0]

    def _take(self, reader: ThreadPoolExecutor) -> tuple[int, Future[tuple[Scene, str]]] | None:
        """The next frame, whose scene is being read, and none after an end."""
        with self._lock:
            if self.errors or self.stopped:
                return None
            while self._left and len(self._ahead) <= len(self.factories):
                frame = self._left.popleft()
                self._ahead.append((frame, reader.submit(self.plan.load, frame)))
            return self._ahead.popleft() if self._ahead else None

    def _work(self, factory: RendererFactory, reader: ThreadPoolExecutor) -> None:
        """Render frames with renderers of a factory, till none is left."""
        renderer: ResumableRenderer | None = None
        try:
            while (taken := self._take(reader)) is not None:
                frame, scene = taken
                try:
                    renderer = self._frame(frame, *scene.result(), factory, renderer)
                except (SceneError, ClusterError, OSError, click.ClickException):
                    raise
                except Exception as error:
                    if not self._lose(factory, error, taken):
                        raise
                    return
        except BaseException as error:
            self.errors.append(error)
        finally:
            factory.frame = math.inf
            if renderer is not None:
                renderer.close()

    def _lose(
        self,
        lost: RendererFactory,
        error: BaseException,
        taken: tuple[int, Future[tuple[Scene, str]]],
    ) -> bool:
        """Leave a factory out, give its frame to others; return whether there are others."""
        with self._lock:
            self.factories = [factory for factory in self.factories if factory is not lost]
            self._ahead.appendleft(taken)
        message = f"{lost.name} failed and is left out, others do its part: {error}"
        if self.factories:
            self.shown.note(f"clpt: warning: {message}")
        return bool(self.factories)

    def _frame(
        self,
        frame: int,
        scene: Scene,
        digest: str,
        factory: RendererFactory,
        renderer: ResumableRenderer | None,
    ) -> ResumableRenderer | None:
        """Render a frame unless it is complete; return the renderer for the next frame."""
        plan = self.plan
        if plan.is_complete(frame, digest):
            self._tell(frame, "is complete", 0.0)
            return renderer
        stale = [path for path in plan.targets(frame) if path.is_file()]
        if any(_fingerprint_of(path) not in (None, digest) for path in stale):
            self.shown.note(f"frame {frame}: the scene or an option has changed since {stale[0]}")
        factory.frame = frame
        renderer = _showing(scene, factory, renderer, self.shown)
        began, until = time.perf_counter(), plan.job.until
        end = End(until.end(scene), until.limit, scene.noise, self.stopped)
        seconds = factory.pass_seconds(scene.noise is not None)
        render_samples(renderer, end, factory.look, pass_seconds=seconds)
        if self.stopped:
            return renderer  # what it has so far is no frame
        if not renderer.counts.samples:
            message = "in so short a time there was no sample"
            raise click.BadParameter(message, param_hint="--time")
        seconds = time.perf_counter() - began
        stats = outputs.metadata(renderer, plan.file(frame), seconds)
        stats |= {"frame": frame, "fingerprint": digest}
        grading, paths = plan.job.graded.grading, plan.targets(frame)
        outputs.write_all(paths, renderer, stats, grading, Display())
        bad = "".join(f", {text}" for text in refusals(renderer))
        done = f"{paths[0]}  {stats['spp']:.4g} spp, {seconds:.1f} s{bad}"
        self._tell(frame, done, time.perf_counter() - began)
        return renderer

    def _tell(self, frame: int, event: str, seconds: float) -> None:
        """Say that a frame is done, and how long the remaining frames take."""
        with self._lock:
            self._done += 1
            self._rendered += seconds > 0.0
            left = len(self.plan.numbers) - self._done
            passed = time.perf_counter() - self._began
            remaining = f"; {clock(passed / self._rendered * left)} left" if self._rendered else ""
            number = f"{self._done} of {len(self.plan.numbers)}"
        self.shown.note(f"frame {frame} ({number}): {event}{remaining if left else ''}")


def _showing(
    scene: Scene, factory: RendererFactory, renderer: ResumableRenderer | None, shown: Display
) -> ResumableRenderer:
    """Return a renderer of a scene: the former renderer, if it can take the scene."""
    if renderer is not None:
        try:
            renderer.update(scene=scene)
            return renderer
        except SceneError:  # a film of another form
            renderer.close()
    for warning in scene.warnings:
        shown.note(f"clpt: warning: {warning}")
    return factory.make(scene, shown)


def _fingerprint_of(path: Path) -> str | None:
    """The fingerprint that a frame's file keeps; None without, or where it cannot be read."""
    try:
        if path.suffix.lower() not in KEPT or not path.is_file():
            return None
        images.read_stored(path)  # all of it: a file may be cut off
        png = path.suffix.lower() == ".png"
        kept = (images.png_text(path) if png else images.attributes(path)).get("fingerprint")
    except (SceneError, OSError, RuntimeError, ValueError, SyntaxError):
        return None
    return kept if isinstance(kept, str) else None
