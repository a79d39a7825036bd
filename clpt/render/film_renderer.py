"""The base of renderers on a device, on several, and on a cluster.

It asks a maker for samples, and the film that they make is developed and denoised.
"""

from __future__ import annotations

import dataclasses
import logging
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clpt import device as dev
from clpt import images
from clpt.arrays import Image, is_whole, whole
from clpt.choices import MOST_SAMPLES, Exposure
from clpt.denoise import needs
from clpt.errors import LONGEST_WARNING, ClptError, DeviceError, SceneError, one_line
from clpt.images.colour import View
from clpt.render.edit.plans import Plan
from clpt.render.edit.scene_edit import MaterialKey, ShapeKey
from clpt.render.film.developed import Developed
from clpt.render.film.film_file import (
    classes_text,
    other_devices,
)
from clpt.render.film.layers import write_picture
from clpt.render.film.pictures import DenoisedPicture, PictureForm, Pictures
from clpt.render.film.state import join_ranges
from clpt.render.makers.contents import (
    Change,
    Contents,
    FilmOwner,
    Settle,
    Stop,
    healing,
    synchronized,
)
from clpt.render.makers.maker import Call, Discarded, Maker
from clpt.render.makers.planning import Changes
from clpt.render.options import check_changes, check_scene
from clpt.render.progress import Progress
from clpt.render.stats import RenderStats, collect
from clpt.render.wavefront import adaptive
from clpt.render.wavefront.wavefront import Counts, Wavefront
from clpt.scene import Scene, checked_seed
from clpt.scene.cameras import Camera
from clpt.scene.materials import Material

if TYPE_CHECKING:
    import pyopencl as cl
    from typing_extensions import Self


log = logging.getLogger(__name__)

OnProgress = Callable[[Progress], bool | None]


class FilmRenderer(FilmOwner, Pictures):
    """Base of renderers: a film, whose samples come from a maker.

    maker: takes the samples; denoise: the denoiser that the film is for; first_sample: the number
    of the first sample.
    """

    def __init__(self, maker: Maker, denoise: str | None = None, first_sample: int = 0):
        super().__init__()
        self._maker, self.denoise = maker, denoise
        self._stop = Stop()
        self._first_sample = checked_number(first_sample)
        self._seconds: dict[str, float] = {}  # to the first sample
        self._seconds_rendered = 0.0  # since the film was empty, or gone on with
        self._telling = False  # of progress, while samples are taken
        self._told: list[str] = []  # warnings of earlier sessions on other devices

    # ---- what there is

    @property
    def scene(self) -> Scene:
        """The scene that is rendered."""
        return self._maker.scene

    @property
    def warnings(self) -> list[str]:
        """Warnings of the scene, and of devices and workers, for people."""
        return [one_line(text, LONGEST_WARNING) for text in (*self._maker.warnings, *self._told)]

    @property
    def device(self) -> dev.Device:
        """The device that has `film`."""
        return self._maker.home.device

    @property
    def devices(self) -> tuple[dev.Device, ...]:
        """The devices of this machine that take part."""
        return self._maker.devices

    @property
    def _device_text(self) -> str:
        """Names of the devices that take the samples, for people."""
        return " and ".join(on.info.label for on in self.devices)

    @property
    def counts(self) -> Counts:
        """Counts of samples and rays so far, and of samples that the film refused."""
        if self._closed:
            raise self._closed_error()
        return self._maker.counts

    @property
    @synchronized
    def stats(self) -> RenderStats:
        """Figures of the render so far: numbers of things, bytes by table and tree, seconds."""
        home = self._maker.home
        return collect(home.wavefront, *home.built, {**home.seconds, **self._seconds})

    @property
    def samples(self) -> int:
        """The number of the next sample: of all so far, where they began at number 0."""
        taken = self._known.taken
        if self._maker.adds_films:
            return self._first_sample + sum(end - first for first, end in taken)
        return taken[-1][1] if taken else self._first_sample

    @property
    def first_sample(self) -> int:
        """The number of the first sample of the film, or of the next if the film is empty."""
        taken = self._known.taken
        return taken[0][0] if taken and not self._maker.adds_films else self._first_sample

    @property
    def active(self) -> float:
        """The share of the pixels that would get more samples, 1 but for `run` with `noise`."""
        chosen = self._known.adaptive
        return 1.0 if chosen is None else chosen.active

    @property
    def _former_seconds(self) -> float:
        """The rendering time of earlier sessions of the film [s]."""
        return sum(session.seconds for session in self._known.sessions)

    @property
    @synchronized
    def _wavefront(self) -> Wavefront:
        """The wavefront whose film holds the picture."""
        return self._brought().shown().wavefront

    def _check_open(self) -> None:
        super()._check_open()
        changes = isinstance(self._contents, Change)
        if self._telling and changes and not self._maker.shows_meanwhile:
            raise DeviceError("devices are at work; the picture is there when the run has ended")

    def _warn_of_others(self) -> None:
        """Warn where samples were taken by other classes of devices than now."""
        sessions = self._known.sessions
        for device in self._maker.classes if sessions else ():
            others = other_devices(sessions, device)
            if others and classes_text(others) not in self._told:
                self._told.append(classes_text(others))
                log.warning("%s", self._told[-1])

    # ---- samples

    @synchronized
    def prepare(self) -> None:
        """Run every kernel of `run` once with nothing to do, and wait.

        Many drivers compile a kernel to its end when it runs for the first time. The film and the
        number of the next sample stay.
        """
        change, settle = self._adding("prepare", Call(self.samples, self.samples))
        with change:
            self._maker.prepare()
            self._contents = settle(None)

    @synchronized
    def run(
        self, samples: int, progress: OnProgress | None = None, *, noise: float | None = None
    ) -> bool:
        """Add samples to every pixel and wait; `self.samples` is then the number of the next.

        noise: a limit of the relative noise around pixels that get more samples, such as 0.02;
        `samples` is then the most that a pixel gets, see clpt.render.wavefront.adaptive. A renderer
        with `denoise` measures the noise after denoising. progress: called every few milliseconds
        to seconds; if it returns a false value other than None, the run stops soon, as after
        `cancel`. Returns whether the run was completed. An error of progress, or Ctrl+C at any
        line, is raised when the paths in flight have ended. The film is whole after a stop too: its
        pixels have fewer samples, and numbers of omitted samples are not used again.

        Raises SceneError for noise that makes no sense with the scene, and for more than 2^31 - 1
        samples.
        """
        first, end = next_range(self.samples, samples)
        if self._stop.is_set():  # before it began: nothing is taken
            self._rest()
            return False
        if noise is not None:
            noise = adaptive.checked(noise, self._maker.home.wavefront.features)
        watch = Watch(self, progress, end)
        finished = False
        try:
            finished = self._add_samples(Call(first, end, noise), watch)
        except ClptError:
            if watch.raised is None:
                raise
        finally:
            self._seconds_rendered += watch.seconds
            self._rest()
        if watch.raised is not None:
            raise watch.raised
        return finished

    def _add_samples(self, call: Call, watch: Watch) -> bool:
        """Add samples to all pixels, or to noisy pixels; return whether all were added.

        watch: called all the while.
        """
        maker, now = self._maker, self._settled
        if call.noise is not None and now.adaptive is None:
            now = self._with_noise()
        if maker.adds_films and now.adaptive is None:
            return self._add_films(call, watch)
        change, settle = self._adding("run", call)
        with change:
            try:
                finished = maker.run(call, now.adaptive, watch)
            except Discarded:
                self._contents = self._emptied()
                return False
            self._contents = settle(None)
        self._warn_of_others()
        return finished

    def _with_noise(self) -> Contents:
        """Begin adaptive sampling; return what the film then holds."""
        taken = self._settled.taken
        if self._maker.adds_films and len(taken) > 1:
            message = "samples are missing before the last one; add them first, without noise"
            raise SceneError(message, where="noise")
        first = taken[-1][1] if taken else self._first_sample
        begun = self._brought().adaptively({}, first)
        self._contents = now = dataclasses.replace(self._settled, adaptive=begun)
        return now

    def _add_films(self, call: Call, watch: Watch) -> bool:
        """Add samples to a film that is whole at any time, so that it can be saved meanwhile."""
        settle = self._maker.begin(call, self._settled, self._settled)

        def tick() -> bool:
            self._contents = settle(None)
            self._warn_of_others()
            return watch()

        try:
            return self._maker.run(call, None, tick)
        finally:
            self._contents = settle(None)

    def _adding(self, name: str, call: Call) -> tuple[Change, Settle]:
        """Return the change that adds samples to the film, and the function that ends it."""
        now = self._settled
        taken = join_ranges(now.taken, ((call.first, call.end),))
        settle = self._maker.begin(call, now, dataclasses.replace(now, taken=taken))
        return self._change(name, settle), settle

    def _so_far(self, end: int, seconds: float) -> Progress:
        """Return how far a run is after some seconds; end: the number after its last sample."""
        counts, chosen = self.counts, self._known.adaptive
        noise = None if chosen is None else chosen.level
        if self._maker.adds_films and chosen is None:
            mean = float(self.samples - self._first_sample)
        else:
            mean = counts.samples / self._maker.home.wavefront.paths.pixels
        return Progress(mean, end, counts.samples, counts.rays, seconds, self.active, noise)

    def cancel(self, *, discard: bool = False) -> None:
        """Let the `run` of another thread, or else the next `run`, stop soon and return False.

        discard: the film is not needed any more. A single device then abandons paths in flight,
        which stops sooner, and the film is empty as after `reset`. A step is not stopped. `cancel`
        may be called from anywhere, also from a signal's handler, and waits for nothing.
        """
        if discard:
            self._maker.leave(True)
        self._stop.set()

    def _rest(self) -> None:
        """Note that no run is under way, and withdraw requests to stop."""
        self._telling = False
        self._maker.leave(False)
        self._stop.clear()

    @healing
    def reset(
        self,
        wait_for: dev.Events = None,
        *,
        seed: int | None = None,
        first_sample: int | None = None,
    ) -> cl.Event:
        """Enqueue that the film is emptied; the next sample is the first sample again.

        wait_for: events of the caller that come first. first_sample: its number from now on, from
        0 to 2^31 - 1, by default as before. seed: of the samples from now on, from 0 to 2^32 - 1,
        which `self.scene` then has; by default as before. Raises SceneError for other numbers.

        A renderer that says it is broken is whole again then, unless it says otherwise.
        """
        if first_sample is not None:
            first_sample = checked_number(first_sample)
        if seed is not None:
            seed = checked_seed(seed)
        broken = isinstance(self._contents, Change)
        self._maker.after(wait_for)
        with self._healing("reset", lambda _: self._emptied(recover=True)):
            if first_sample is not None:
                self._first_sample = first_sample
            self._contents = self._emptied(seed=seed, recover=broken)
        return self._maker.last

    def _emptied(self, *, seed: int | None = None, recover: bool = False) -> Contents:
        """Let the film be empty; return what it then holds; see `Maker.empty`."""
        self._maker.empty(seed=seed, recover=recover)
        self._seconds_rendered = 0.0
        return Contents()

    @synchronized
    def update(
        self,
        *,
        camera: Camera | None = None,
        materials: Mapping[MaterialKey, Material] | None = None,
        transforms: Mapping[ShapeKey, Any] | None = None,
        vertices: Mapping[ShapeKey, Any] | None = None,
        scene: Scene | None = None,
        motion: bool = False,
        wait_for: dev.Events = None,
    ) -> cl.Event:
        """Bring what changed to the device, and begin again at sample 0.

        camera: another camera. materials: by the material of the scene that they replace, or by a
        shape's key. transforms: (4, 4) by shape; vertices: (n, 3) float32 by shape, of numpy or on
        the device; of `Spheres` their centres, perhaps (n, 4) with the radii. The key of a shape is
        the shape, its name, or its index in `scene.shapes`. A shape or material that the renderer
        had at first remains the key of whatever has replaced it. scene: another scene of the same
        film, for any other change; arrays and images that it shares with the present scene are
        taken to be unchanged, and what is "auto" is chosen anew, as edits alone do not. motion:
        what changes place, of shapes, lights and the camera, moves from where it was to where it
        is, and so do vertices, while the shutter of the camera is open; the next update goes on
        from there. wait_for: events of the caller that come first. The scene is lowered again then,
        and once more after.

        The first of three ways that is possible is taken:

        1. Shapes that only move do so on the device, where trees are refitted to them; nothing is
           waited for. See clpt.render.edit.moving.
        2. A camera of the same kind, and values of materials, take a few written words.
        3. Else the scene is lowered again: tables are written where they differ, trees are built
           where triangles do, kernels where others are needed.

        Several devices take arrays of numpy. A cluster takes a camera or a scene. Both return None:
        all is done.

        `self.scene` is then the new scene, and the picture will be that of a new renderer. At level
        DEBUG the logger `clpt.render.renderer` says why a quicker way was not taken.

        Raises SceneError for keys that are not in the scene, for invalid values, and for a film of
        another size, TypeError for a `scene` of another type; nothing has changed then. Raises
        MemoryBudgetError and KernelBuildError where the device cannot do what the new scene needs.
        """
        if scene is not None:
            check_scene(scene)
            scene = needs.prepared(scene, self.denoise)
        check_changes(camera, materials=materials, transforms=transforms, vertices=vertices)
        events = list(wait_for or ())
        changes = Changes(camera, materials, transforms, vertices, scene, motion)
        self._maker.after(events)
        self._write(self._maker.plan(changes, events), "update")
        return self._maker.last

    def _write(self, plan: Plan | None, name: str) -> None:
        """Change the scene, and begin at the first sample; name: of the change, for people."""
        if plan is None:
            return

        def put(_: BaseException | None = None) -> Contents:
            plan.write()
            return self._emptied()

        change = self._change(name, put if plan.repeatable else None, heals=False)
        with change, change.beginning_unless(*plan.refusals):
            self._contents = put()

    # ---- the film and its pictures

    def _brought(self) -> Maker:
        """Return the maker, whose film is together."""
        maker = self._maker
        if not maker.is_scattered or isinstance(self._contents, Change):  # of who asks
            return maker
        now = self._settled

        def finish(error: BaseException | None) -> Contents:
            if error is None or isinstance(error, Exception):
                return now  # the last device has failed
            raise error  # samples may be in two films, or in none

        with self._change("gathering of films", finish):
            maker.gather()
            self._contents = now
        return maker

    @synchronized
    def developed(self, *words: str) -> Developed:
        """Wait for the film; return its present pictures; see `Pictures.developed`."""
        return Developed(self._brought().words(*words), self.form)

    @property
    @synchronized
    def form(self) -> PictureForm:  # type: ignore[override]
        """The form of the picture."""
        form = self._maker.home.form
        with_noise = form.adaptive or self._known.adaptive is not None
        return dataclasses.replace(form, adaptive=with_noise)

    def denoised(self, method: str | None = None) -> Image:
        """The picture so far without most of its noise, as `image` returns it.

        method: oidn or statistical, by default the renderer's option `denoise`, else oidn. With
        this option the film has the layers that the denoiser needs. See `clpt.DenoisedPicture`,
        also for the errors that it raises.
        """
        return DenoisedPicture(self, method).image()

    def save(
        self,
        path: str | Path,
        *,
        exposure: Exposure = 0.0,
        tone: str = "none",
        view: View | None = None,
    ) -> None:
        """Write the picture so far to a file, in the format of the path's suffix; wait for it.

        An .exr has the film's layers and bands, and as its data window the place of a crop. A
        renderer with `denoise` writes the denoised picture. A film with alpha: see
        `clpt.write_image`. exposure [stops] over the film's `display_exposure`, tone, view: of
        files for screens, see `clpt.write_image`.

        Raises SceneError for an unknown suffix, and for a file that cannot be written.
        """
        path = images.check_output(path)
        source = self if self.denoise is None else DenoisedPicture(self)
        write_picture(path, source, exposure=exposure, tone=tone, view=view)

    # ---- the end

    def close(self) -> None:
        """Give the device's memory back; the renderer is of no use afterwards.

        It waits for a `run` of another thread, not for enqueued commands. An array that the caller
        still holds, such as `film`, keeps its memory. Dropping a renderer does the same.
        """
        with self._lock:
            self._closed = True
            self._contents = Contents()
            self._maker.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


class Watch:
    """A callback of a run: it reports the progress, and returns whether the run goes on.

    end: the number after the last sample. raised: what `progress` raised.
    """

    def __init__(self, renderer: FilmRenderer, progress: OnProgress | None, end: int):
        self._renderer, self._progress, self._end = renderer, progress, end
        self._began = time.perf_counter()
        self.raised: BaseException | None = None

    @property
    def seconds(self) -> float:
        """Seconds that the run has taken."""
        return time.perf_counter() - self._began

    def __call__(self, _: object = None) -> bool:
        renderer = self._renderer
        if renderer.counts.samples:
            taken = time.perf_counter() - renderer._maker.start
            renderer._seconds.setdefault("first_sample", taken)
        if renderer._stop.is_set() or self._progress is None:
            return not renderer._stop.is_set()
        renderer._telling = True
        try:
            answer = self._progress(renderer._so_far(self._end, self.seconds))
            if answer is not None and not answer:
                renderer._stop.set()
        except BaseException as error:
            self.raised = error
            renderer._stop.set()
        finally:
            renderer._telling = False
        return not renderer._stop.is_set()


def maker_of(renderer: FilmRenderer) -> Maker:
    """Return the maker of a renderer, for other parts of clpt."""
    return renderer._maker


def next_range(first: int, samples: int) -> tuple[int, int]:
    """Return the range of so many samples from the first. Raises SceneError."""
    return first, checked_number(first + checked_samples(samples))


def checked_number(number: int) -> int:
    """Return a sample's number. Raises SceneError for a number below 0, and for a large number."""
    number = whole(number, 0, where="first_sample")
    if number > MOST_SAMPLES:
        raise SceneError(f"a pixel cannot have more than {MOST_SAMPLES} samples", where="samples")
    return number


def checked_samples(samples: int) -> int:
    """Return a number of samples. Raises SceneError unless it is whole and above 0."""
    if not is_whole(samples) or samples < 1:
        raise SceneError(f"samples per pixel must be a whole number above zero, not {samples!r}")
    return int(samples)
