"""The picture of a scene, by devices of this machine or by workers, and its files."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from clpt.render.film.layers import channels_of

from ...errors import ClusterError
from ...render.film.film_file import SavedFilm
from ...render.progress import Progress
from ...render.resumable import ResumableRenderer
from ...scene import Scene
from ..display import Display, device_names
from ..files import checkpoints, outputs
from ..files.outputs import Film
from ..opening import (
    DeviceFactory,
    RendererFactory,
    cluster_factories,
    device_factories,
    open_scene,
    read_scene,
)
from ..options.grading import Grading, for_screens
from ..process.ending import STATUS, stops
from . import report
from .passes import End, render_samples
from .report import refusals
from .settings import Job

if TYPE_CHECKING:
    from clpt.images.tev import Viewer


def render_picture(job: Job, shown: Display, began: float) -> int:
    """Render the picture of a scene and write its files; return the exit status.

    began: the command, or the scene of several [s of time.perf_counter].

    Raises errors of the render after the picture so far and the film are written.
    """
    if text := job.graded.grading.unused(job.targets):
        shown.note(f"clpt: warning: {text}")
    former = _Former.find(job, shown)
    with ExitStack() as resources:
        opened = _open(job, shown, resources)
        former.check(job, opened.scene)
        renderer = opened.factory.make(opened.scene, shown, job.until.first)
        resources.callback(renderer.close)
        shown.note(report.header(shown.name, renderer, opened.where))
        end = former.go_on(renderer, job.until.end(opened.scene), shown)
        opened.tell_before(job.verbose)
        picture = _Picture(job, renderer, former, shown, opened.factory)
        resources.callback(picture.close)
        with stops() as stopped:
            ends = End(end, job.until.limit, renderer.scene.noise, stopped)
            picture.render(ends)
            picture.finish(bool(stopped))
            shown.note(report.ending(renderer, ends, time.perf_counter() - began))
        opened.tell_after(job.verbose)
        if stopped:
            opened.factory.stop()
            return STATUS + stopped[0]
    return 0


@dataclass(frozen=True)
class _Former:
    """The film that a render goes on from, None to begin anew, and the file of its checkpoints."""

    path: Path
    film: SavedFilm | None

    @classmethod
    def find(cls, job: Job, shown: Display) -> _Former:
        """Find the checkpoint to go on from, if any. Raises SceneError."""
        path = checkpoints.path_of(job.scene, job.targets)
        return cls(path, checkpoints.find(path, job.resume, shown))

    def check(self, job: Job, scene: Scene) -> None:
        """Raise SceneError where the render cannot take its samples, or not go on."""
        checkpoints.check_range(scene, job.until.numbers)
        if self.film is not None:
            gaps = job.workers.cluster is not None and scene.noise is None
            first, end = job.until.numbers or (0, None)
            checkpoints.check(self.film, self.path, scene, first, end, gaps=gaps)

    def go_on(self, renderer: ResumableRenderer, end: int | None, shown: Display) -> int | None:
        """Give the film to a renderer; return the end of its samples, see `Until.end`."""
        if self.film is None:
            return end
        checkpoints.go_on(renderer, self.film, self.path, shown)
        taken = self.film.film.taken  # workers also take missing samples before its last
        return max(end, taken[-1][1]) if end and taken else end


@dataclass(frozen=True)
class _Opened:
    """A scene, and the factory of its renderer; devices: the same, on this machine; loading [s]."""

    scene: Scene
    factory: RendererFactory
    devices: DeviceFactory | None = None
    loading: float = 0.0

    @property
    def where(self) -> str:
        """Short names of devices or workers."""
        if self.devices is None:
            return f"workers of {self.factory.name}"
        return device_names([on.info for on in self.devices.devices])

    def tell_before(self, verbose: int) -> None:
        """Print sizes of the encoded scene on the devices."""
        if verbose and self.devices is not None:
            report.before(self.devices.renderer, self.loading)

    def tell_after(self, verbose: int) -> None:
        """Print the work of the devices."""
        if verbose and self.devices is not None:
            report.after(self.devices.renderer)


def _open(job: Job, shown: Display, resources: ExitStack) -> _Opened:
    """Return the scene and the factory of its renderer; resources: closed at the end."""
    if job.workers.cluster is not None:
        scene = read_scene(job.scene, job.options, shown)
        (workers,) = resources.enter_context(cluster_factories(job.workers, job.options, 1, shown))
        return _Opened(scene, workers)
    scene, opened, loading = open_scene(job.scene, job.options, shown, resources)
    (devices,) = device_factories(opened, job.options, 1)
    return _Opened(scene, devices, devices, loading)


class _Picture:
    """Writes the pictures and films of a render, while it goes on and at its end.

    ready: when it began [s of time.perf_counter].
    """

    def __init__(
        self,
        job: Job,
        renderer: ResumableRenderer,
        former: _Former,
        shown: Display,
        factory: RendererFactory,
    ):
        self._job, self._renderer, self._shown, self._factory = job, renderer, shown, factory
        self.ready = time.perf_counter()
        self._writer = checkpoints.Checkpoints(
            renderer, former.path, job.period, former.film is not None, job.targets, shown
        )
        self._so_far = PictureSoFar(job.every, job.targets, renderer, job.graded.grading, shown)
        self._viewer: Viewer | None = None
        if job.tev is not None:
            from clpt.images.tev import Viewer  # here: most renders show nothing

            self._viewer = Viewer(job.scene.name, *job.tev, tell=shown.note)
        adaptive = renderer.scene.noise is not None or (
            former.film is not None and bool(former.film.adaptive)
        )
        self._pass_seconds = factory.pass_seconds(adaptive, job.period, job.every)
        self._single = math.isinf(self._pass_seconds)  # a pass, whose film is whole at any time

    def close(self) -> None:
        """Leave the viewer."""
        if self._viewer is not None:
            self._viewer.close()

    def render(self, end: End) -> None:
        """Render until the end, and write now and then."""
        with self._rescuing(), self._shown.rendering():
            render_samples(
                self._renderer, end, self._show, self._after_pass, pass_seconds=self._pass_seconds
            )
        self._ended()

    def _show(self, progress: Progress) -> None:
        self._factory.look(progress)
        if self._single:
            self._after_pass()
        self._shown.show(progress)

    def _after_pass(self) -> None:
        self._writer.after_pass()
        if self._so_far.is_due and self._has_samples:
            self._so_far.write(self._stats())
        if self._viewer is not None:
            self._viewer.show(channels_so_far(self._renderer))

    def _ended(self) -> None:
        self._factory.report()
        if self._single:
            self._writer.hold()

    def finish(self, stopped: bool) -> None:
        """Write the picture, and the film if it stays. Raises ClusterError without a sample."""
        self._writer.save(stopped)
        if self._job.workers.cluster is not None and not self._has_samples:
            raise ClusterError("no worker sent anything in this time")
        share = self._write()
        self._writer.finish(stopped)
        self._warn(share)

    def _warn(self, share: float) -> None:
        """Note pixels without a sample, and samples that the film refused."""
        few = [f"only {share:.1%} of the pixels have a sample; others are black"] * (share < 1.0)
        grading, targets = self._job.graded.grading, self._job.targets
        warnings = [*few, *refusals(self._renderer)]
        if self._has_samples:
            if grading.exposure == "auto" and for_screens(targets):
                self._shown.note(f"exposure {report.exposure_found(self._renderer):+.1f} stops")
            elif for_screens(targets) and (said := report.display_exposure(self._renderer)):
                self._shown.note(said)
            warnings += report.remarks(self._renderer, grading, targets)
        for text in warnings:
            self._shown.note(f"clpt: warning: {text}")

    @property
    def _has_samples(self) -> bool:
        return self._renderer.counts.samples > 0

    def _stats(self) -> dict[str, str | int | float]:
        seconds = time.perf_counter() - self.ready
        return outputs.metadata(self._renderer, self._job.scene, seconds)

    def _write(self) -> float:
        """Write the files of the picture; return the samples of a pixel in the mean."""
        job, stats, denoiser = self._job, self._stats(), self._renderer.denoise
        with self._shown.phase(f"denoising ({denoiser})") if denoiser else nullcontext():
            outputs.write_all(job.targets, self._renderer, stats, job.graded.grading, self._shown)
        return float(stats["spp"])

    @contextmanager
    def _rescuing(self) -> Iterator[None]:
        """Write the film and the picture so far, where they can be read, if it fails inside."""
        try:
            yield
        except Exception:
            for step in self._ended, self._rescue_film, self._rescue_picture:
                try:
                    step()
                except outputs.FAILURES as error:
                    self._shown.note(f"clpt: warning: {error}")
            self._writer.finish(True)
            raise

    def _rescue_film(self) -> None:
        self._writer.save(False, failed=True)

    def _rescue_picture(self) -> None:
        if self._has_samples:
            self._warn(self._write())


class PictureSoFar:
    """Writes the picture of a render that goes on, at the ends of its passes.

    A reader sees a whole picture at any time, see clpt.files.output_files. A file that cannot be
    written is noted once, and tried again; the render goes on.

    period: seconds between pictures, None: never.
    """

    def __init__(
        self,
        period: float | None,
        targets: tuple[Path, ...],
        source: outputs.Source,
        grading: Grading,
        shown: Display,
    ):
        self._period, self._targets, self._source = period or math.inf, targets, source
        self._grading, self._shown = grading, shown
        self._due = time.monotonic() + self._period
        self._failed: set[Path] = set()

    @property
    def is_due(self) -> bool:
        """Whether the period since the last picture is over."""
        return time.monotonic() >= self._due

    def write(self, stats: dict[str, str | int | float]) -> None:
        """Write the picture; stats: its metadata."""
        for path in self._targets:
            self._write(path, stats)
        self._due = time.monotonic() + self._period  # from its end: a render is not all writing

    def _write(self, path: Path, stats: dict[str, str | int | float]) -> None:
        try:
            outputs.write(path, self._source, stats, self._grading)
        except outputs.FAILURES as error:
            if path not in self._failed:
                self._shown.note(
                    f"clpt: warning: {outputs.failure(path, error)}; the render goes on"
                )
            self._failed.add(path)
        else:
            self._failed.discard(path)


def channels_so_far(source: Film) -> dict[str, NDArray[np.float32]]:
    """Return all channels of the picture so far, (h, w) by name: colours, layers, bands."""
    picture = source.picture()
    channels = {letter: picture[..., i] for i, letter in enumerate("RGBA"[: picture.shape[2]])}
    channels |= channels_of(source.layers())
    if source.form.adaptive:
        channels["samples.X"] = source.samples_per_pixel()
    if source.form.bands:
        spectral = source.spectral_image()
        for nm, band in zip(spectral.lambdas, np.moveaxis(spectral.values, 2, 0), strict=True):
            channels[f"bands.{nm:g}nm"] = band
    return channels
