"""A picture of one scene, by devices of this machine or by workers, and all files of it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path

from ...errors import ClusterError
from ...render.film.saved_film import SavedFilm
from ...render.progress import Progress
from ...render.resumable import ResumableRenderer
from ...scene import Scene
from ..files import checkpoints, outputs
from ..opening.factories import DeviceFactory, RendererFactory, cluster_factories, device_factories
from ..opening.scenes import open_scene, read_scene
from ..options.grading import for_screens
from ..printing.display import Display
from ..printing.names import device_names
from ..process.stopping import STATUS, stops
from . import brightness, report
from .passes import End, render_samples
from .refused import refusals
from .settings import Job
from .so_far import PictureSoFar
from .tev_viewer import showing


def render_picture(job: Job, shown: Display, began: float) -> int:
    """Render the picture of a scene and write its files; return the exit status.

    began: the command, or the scene of several [s of time.perf_counter].

    Raises what the render raises, after the picture so far and the film are written.
    """
    if text := job.graded.grading.unused(job.targets):
        shown.note(f"clpt: warning: {text}")
    former = _Former.find(job, shown.note)
    with ExitStack() as resources:
        opened = _open(job, former, shown, resources)
        renderer = opened.factory.make(opened.scene, shown, job.until.first)
        resources.callback(renderer.close)
        shown.note(report.header(shown.name, renderer, opened.where))
        end = former.go_on(renderer, job.until.end(opened.scene), shown.note)
        opened.tell_before(job.verbose)
        picture = _Picture(job, renderer, former, shown)
        viewer = showing(job.tev, job.scene.name, renderer, shown.note)
        with stops() as stopped, viewer as show_picture:
            ends = End(end, job.until.limit, renderer.scene.noise, stopped)
            picture.render(opened.factory, ends, show_picture)
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
    def find(cls, job: Job, note: Callable[[str], None]) -> _Former:
        """Return what there is of a picture, and is not to be left alone. Raises SceneError."""
        path = checkpoints.path_of(job.scene, job.targets)
        return cls(path, checkpoints.find(path, job.resuming.resume, note))

    def check(self, job: Job, scene: Scene) -> None:
        """Raise SceneError where the render cannot take its samples, or not go on."""
        checkpoints.check_range(scene, job.until.numbers)
        if self.film is not None:
            gaps = job.workers.cluster is not None and scene.noise is None
            first, end = job.until.numbers or (0, None)
            checkpoints.check(self.film, self.path, scene, first, end, gaps=gaps)

    def go_on(
        self, renderer: ResumableRenderer, end: int | None, note: Callable[[str], None]
    ) -> int | None:
        """Give the film to a renderer; return the end of its samples, see `Until.end`."""
        if self.film is None:
            return end
        checkpoints.go_on(renderer, self.film, self.path, note)
        taken = self.film.film.taken  # workers take what is missing before its last sample too
        return max(end, taken[-1][1]) if end and taken else end


@dataclass(frozen=True)
class _Opened:
    """A scene, and what makes its renderer; devices: the same, on this machine; loading [s]."""

    scene: Scene
    factory: RendererFactory
    devices: DeviceFactory | None = None
    loading: float = 0.0

    @property
    def where(self) -> str:
        """Who renders, in short."""
        if self.devices is None:
            return f"workers of {self.factory.name}"
        return device_names([on.info for on in self.devices.devices])

    def tell_before(self, verbose: int) -> None:
        """Print what the devices have made of the scene."""
        if verbose and self.devices is not None:
            report.before(self.devices.renderer, self.loading)

    def tell_after(self, verbose: int) -> None:
        """Print what the devices have done."""
        if verbose and self.devices is not None:
            report.after(self.devices.renderer)


def _open(job: Job, former: _Former, shown: Display, resources: ExitStack) -> _Opened:
    """Return the scene, checked, and what renders it; resources: get what is to be closed."""

    def accept(scene: Scene) -> None:
        former.check(job, scene)

    if job.workers.cluster is not None:
        scene = read_scene(job.scene, job.options, shown, accept)
        (workers,) = resources.enter_context(cluster_factories(job.workers, job.options, 1, shown))
        return _Opened(scene, workers)
    found = open_scene(job.scene, job.options, shown, resources, accept)
    (devices,) = device_factories(found.devices, job.options, 1)
    return _Opened(found.scene, devices, devices, found.loading)


class _Picture:
    """Writes the pictures and films of a render, while it goes on and at its end.

    ready: when it began [s of time.perf_counter].
    """

    def __init__(self, job: Job, renderer: ResumableRenderer, former: _Former, shown: Display):
        self._job, self._renderer, self._shown = job, renderer, shown
        self.ready = time.perf_counter()
        period, every, note = job.resuming.period, job.output.every, shown.note
        going_on, grading = former.film is not None, job.graded.grading
        self._writer = checkpoints.Checkpoints(
            renderer, former.path, period, going_on, job.targets, note
        )
        self._so_far = PictureSoFar(every, job.targets, renderer, self._stats, grading, note)
        self._adaptive = renderer.scene.noise is not None or (
            former.film is not None and bool(former.film.adaptive)
        )

    def render(self, factory: RendererFactory, end: End, show_picture: Callable[[], None]) -> None:
        """Render until the end, and write now and then; show_picture: called after each pass."""
        seconds = factory.pass_seconds(
            self._adaptive, self._job.resuming.period, self._job.output.every
        )
        single = math.isinf(seconds)  # a pass, whose film is whole at any time

        def after_pass() -> None:
            self._after_pass()
            show_picture()

        def show(progress: Progress) -> None:
            factory.look(progress)
            if single:
                after_pass()
            self._shown.show(progress)

        def ended() -> None:
            factory.report()
            if single:
                self._writer.hold()

        with self._rescuing(ended), self._shown.rendering():
            render_samples(self._renderer, end, show, after_pass, pass_seconds=seconds)
        ended()

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
        told = [*few, *refusals(self._renderer)]
        if self._has_samples:
            if grading.exposure == "auto" and for_screens(targets):
                self._shown.note(f"exposure {brightness.exposure_found(self._renderer):+.1f} stops")
            elif for_screens(targets) and (said := brightness.display_exposure(self._renderer)):
                self._shown.note(said)
            told += brightness.remarks(self._renderer, grading, targets)
        for text in told:
            self._shown.note(f"clpt: warning: {text}")

    @property
    def _has_samples(self) -> bool:
        return self._renderer.counts.samples > 0

    def _stats(self) -> dict[str, str | int | float]:
        seconds = time.perf_counter() - self.ready
        return outputs.metadata(self._renderer, self._job.scene, seconds)

    def _after_pass(self) -> None:
        self._writer.after_pass()
        if self._has_samples:
            self._so_far.after_pass()

    def _write(self) -> float:
        """Write the files of the picture; return the samples of a pixel in the mean."""
        job, stats, denoiser = self._job, self._stats(), self._renderer.denoise
        with self._shown.phase(f"denoising ({denoiser})") if denoiser else nullcontext():
            outputs.write_all(
                job.targets, self._renderer, stats, job.graded.grading, self._shown.note
            )
        return float(stats["spp"])

    @contextmanager
    def _rescuing(self, ended: Callable[[], None]) -> Iterator[None]:
        """Write the film and the picture so far, where they can be read, if it fails inside."""

        def write_film() -> None:
            self._writer.save(False, failed=True)

        def write_picture() -> None:
            if self._has_samples:
                self._warn(self._write())

        try:
            yield
        except Exception:
            for step in ended, write_film, write_picture:
                try:
                    step()
                except outputs.FAILURES as error:
                    self._shown.note(f"clpt: warning: {error}")
            self._writer.finish(True)
            raise
