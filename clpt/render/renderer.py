"""A renderer: a scene on a device, exposed step by step."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import logging
import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import pyopencl as cl

from clpt import device as dev
from clpt.denoise import needs
from clpt.errors import DeviceError, MemoryBudgetError, SceneError
from clpt.geometry import shapes
from clpt.render.analysis.bodies import matter_of
from clpt.render.analysis.surroundings import bodies_around, media_around
from clpt.render.contents import Change, Contents
from clpt.render.contract.features import Features
from clpt.render.editing import parameter_patch, rebuild
from clpt.render.editing.blurring import between
from clpt.render.editing.moving import Moving
from clpt.render.editing.scene_edit import (
    MaterialKey,
    Replacements,
    ShapeKey,
    Successors,
    edit_scene,
    match_replacements,
    resolve_device_arrays,
)
from clpt.render.film.saved_film import Origin
from clpt.render.film_renderer import Watch, checked_number, next_range
from clpt.render.locking import healing, synchronized
from clpt.render.lowering.scene import Lowered, lower
from clpt.render.options import RenderOptions, check_changes, check_options, check_scene
from clpt.render.progress import Progress
from clpt.render.resumable import Resumable
from clpt.render.stats import RenderStats, collect
from clpt.render.trials.trial import Ground, decided
from clpt.render.wavefront import adaptive
from clpt.render.wavefront.film_state import FilmState, join_ranges
from clpt.render.wavefront.strategy import Tuning
from clpt.render.wavefront.tracer import Tracer, use_all_pixels
from clpt.render.wavefront.wavefront import Counts, Wavefront
from clpt.scene import Scene
from clpt.scene.cameras import Camera
from clpt.scene.integrators import Integrator
from clpt.scene.lights import Light
from clpt.scene.materials import Material
from clpt.scene.params import fields_of, params

if TYPE_CHECKING:
    from typing_extensions import Unpack

log = logging.getLogger(__name__)

TEXTURE_SHARE = 0.5  # of a device's free memory, for bitmaps


class _Discarded(Exception):
    """A run ends at once, and its film is of no use."""


class Renderer(Resumable):
    """Renders a scene; its picture so far is available at any time.

    device: where to render, a name or index (see clpt.device.choose), or a clpt.device.Device.
    progress: called when a step has ended, in a thread of the driver. options: see `RenderOptions`.

    It may be used from several threads: one method runs at a time. With `with`, `close`, or when it
    is dropped, it gives the device's memory back.

    Raises TypeError for what is no scene, queue or option; SceneError for a scene or an option that
    makes no sense; DeviceError, MemoryBudgetError, KernelBuildError.
    """

    _shows_meanwhile = True

    def __init__(
        self,
        scene: Scene,
        device: dev.Device | str | int | None = None,
        *,
        progress: Callable[[Progress], Any] | None = None,
        **options: Unpack[RenderOptions],
    ):
        super().__init__()
        check_scene(scene)
        check_options(scene, options)
        self._discards = False
        self.denoise = options.get("denoise")
        self.scene = scene = needs.prepared(scene, self.denoise)
        self.device = device = _opened(device, options)
        self._start = time.perf_counter()
        before = device.builds.programs, device.builds.cached
        texture_budget = options.get("texture_budget")
        if texture_budget is None:
            texture_budget = texture_budget_of(device)
        self._texture_budget, self._successors = texture_budget, Successors()
        looped = options.get("looped", None if options.get("queue") is None else True)
        tuning = Tuning(options.get("layout"), options.get("queued"), options.get("cancel_seconds"))
        self._ground = Ground(device, tuning, looped)
        self._create = functools.partial(
            Wavefront.create,
            device,
            tuning=tuning,
            slots=options.get("slots"),
            looped=looped,
            tree_quality=options.get("tree_quality", "high"),
            halves=options.get("halves", False) or needs.halves(scene, self.denoise),
        )
        lowered = self._lower(scene)
        self._seconds["lower"] = time.perf_counter() - self._start
        self._opened: Wavefront | None = None
        self._opened = first = self._create(lowered)
        first.prepare()
        self._built = device.builds.programs - before[0], device.builds.cached - before[1]
        self._seconds["programs"] = first.program_seconds
        self._seconds["trees"] = first.scene.trees.seconds
        self._seconds["ready"] = time.perf_counter() - self._start
        self.warnings = list(lowered.warnings)
        self._first_sample = checked_number(options.get("first_sample", 0))
        self._progress = progress
        if self.denoise is not None:
            splats = first.features.film.filter.reach > 0
            weighed = scene.noise is not None and first.features.transport.weighed
            self.warnings += needs.remarks(lowered.integrator, scene.sampler, splats, weighed)
        self._moving: Moving | None = None
        self._blurred = False  # by keys that `scene` does not have
        log.info("ready in %.2f s", self._seconds["ready"])

    @synchronized
    def prepare(self) -> None:
        """Run every kernel of `run` once with nothing to do, and wait.

        Many drivers compile a kernel to its end when it runs for the first time. The film and the
        number of the next sample stay.
        """
        now = self._settled
        with self._adding("prepare", now):
            self._wavefront.render_samples(self.samples, self.samples)
            self._contents = now

    @property
    def _wavefront(self) -> Wavefront:
        """The wavefront that renders on the device. Raises DeviceError after `close`."""
        wavefront = self._opened
        if wavefront is None:
            raise self._closed_error()
        return wavefront

    @synchronized
    def step(self, samples: int = 1, wait_for: dev.Events = None) -> cl.Event:
        """Enqueue `samples` more of every pixel; `self.samples` is then the next one's number.

        Nothing is waited for or read: when the event that is returned has ended, `film` holds the
        picture. wait_for: events of the caller that come first. On an in-order queue whatever the
        caller enqueues next finds the picture.

        Raises SceneError for a number that is none, DeviceError if the driver refuses.
        """
        first, end = next_range(self.samples, samples)
        stream = self._wavefront.stream
        stream.after(wait_for)
        more = self._with(first, end)
        with self._adding("step", more, plain=True):
            self._wavefront.enqueue(first, end)
            stream.flush()
            if more.adaptive is not None:
                more.adaptive.skip(end)
            self._contents = more
        event = stream.last
        if self._progress is not None:
            self._report_later(event, self._progress)
        return event

    def _report_later(self, event: cl.Event, progress: Callable[[Progress], Any]) -> None:
        """Call `progress` once the event has ended.

        What the caller then raises is logged: in a thread of the driver nobody could catch it.
        """
        samples, start = self.samples, self._start
        pixels = self._wavefront.paths.pixels

        def report(_: int) -> None:
            seconds = time.perf_counter() - start
            try:
                progress(Progress(samples, samples, samples * pixels, 0, seconds))
            except Exception:
                log.exception("the progress callback failed at %d samples", samples)

        event.set_callback(cl.command_execution_status.COMPLETE, report)

    @property
    def _features(self) -> Features:
        return self._wavefront.features

    @property
    def _pixels(self) -> int:
        return self._wavefront.paths.pixels

    def _add_samples(self, first: int, end: int, noise: float | None, watch: Watch) -> bool:
        """Add samples to all pixels, or to those with noise; return whether all were added."""

        def on_batch(_: object) -> bool:
            if self._stop.is_set() and self._discards:
                raise _Discarded
            return watch()

        if noise is not None and self._settled.adaptive is None:
            begun = self._adaptively(None, self.denoise, {})
            begun.skip(first)
            self._contents = dataclasses.replace(self._settled, adaptive=begun)
        more = self._with(first, end)
        self._wavefront.leave.lower()  # that a `cancel` raised which came too late for another run
        with self._adding("run", more, plain=noise is None):
            try:
                finished = self._render_samples(more.adaptive, first, end, noise, on_batch)
            except _Discarded:
                self._contents = self._emptied()
                return False
            self._contents = more
        return finished

    def _render_samples(
        self,
        chosen: adaptive.Adaptive | None,
        first: int,
        end: int,
        noise: float | None,
        on_batch: Callable[[Any], bool],
    ) -> bool:
        """Add samples to all pixels, or to those with noise; return whether all were added."""
        if noise is not None and chosen is not None:
            return chosen.run(end, noise, on_batch)
        finished = self._wavefront.render_samples(first, end, on_batch)
        if chosen is not None:
            chosen.skip(end)  # after a stop too: numbers are not used again
        return finished

    def _with(self, first: int, end: int) -> Contents:
        """Return the contents of the film with the samples from `first` to `end` added."""
        now = self._settled
        return dataclasses.replace(now, taken=join_ranges(now.taken, ((first, end),)))

    def _adding(self, what: str, more: Contents, *, plain: bool = False) -> Change:
        """Return the change of a film that samples are added to.

        more: what it then holds; plain: whether all pixels get as many. After an error at any line
        it holds that too, though some pixels may lack some of these samples; or what it held, if
        none has begun. An error of the device makes nothing whole.
        """
        now, wavefront = self._settled, self._wavefront
        wavefront.begun = False

        def finish(error: BaseException) -> Contents:
            begun = wavefront.begun
            if isinstance(error, DeviceError) and not isinstance(error, MemoryBudgetError):
                if begun:
                    raise error
                return now
            wavefront.finish()
            if more.adaptive is not None:
                more.adaptive.finish()
                if plain and begun:
                    more.adaptive.skip(more.taken[-1][1])
            wavefront.refresh()
            return more if begun else now

        return self._change(what, finish)

    def _tracer(self) -> Tracer:
        """Return what adds selections of samples to the film."""
        return Tracer(self._wavefront)

    @property
    def devices(self) -> tuple[dev.Device, ...]:
        """The devices that render: only its own."""
        return (self.device,)

    @property
    def counts(self) -> Counts:
        """Counts of samples and rays so far, and of those that the film refused."""
        return self._wavefront.counts

    def cancel(self, *, discard: bool = False) -> None:
        """Let the `run` of another thread, or else the next one, stop soon and return False.

        discard: see `FilmRenderer.cancel`.
        """
        if discard and self._opened is not None:  # who sees the flag finds the reason soon
            self._opened.leave.raise_()
            self._discards = True
        super().cancel()

    def _rest(self) -> None:
        self._discards = False
        super()._rest()

    @healing
    def reset(
        self,
        wait_for: dev.Events = None,
        *,
        seed: int | None = None,
        first_sample: int | None = None,
    ) -> cl.Event:
        """Enqueue that the film is emptied; the next sample is the first one again.

        wait_for: events of the caller that come first. first_sample: its number from now on, by
        default as before. seed: of the samples from now
        on, which `self.scene` then has; by default as before. Raises SceneError for a seed that is
        no whole number, and for a number that is too large.

        A renderer that says it is broken is whole again then, unless it says otherwise.
        """
        if first_sample is not None:
            first_sample = checked_number(first_sample)
        if seed is not None and (isinstance(seed, bool) or not isinstance(seed, int)):
            raise SceneError(f"must be a whole number, not {seed!r}", where="seed")
        broken = isinstance(self._contents, Change)
        self._wavefront.stream.after(wait_for)
        with self._healing("reset", lambda _: self._emptied(recover=True)):
            if seed is not None:
                self.scene = dataclasses.replace(self.scene, seed=seed)
            if first_sample is not None:
                self._first_sample = first_sample
            self._contents = self._emptied(recover=broken)
        return self._last

    @property
    def _last(self) -> cl.Event:
        event = self._wavefront.stream.last
        assert event is not None, "something was enqueued"
        return event

    def _emptied(self, *, recover: bool = False) -> Contents:
        """Enqueue that the film is empty; return what it then holds; recover: from an error at any
        line."""
        wavefront = self._wavefront
        if recover:
            wavefront.stream.rejoin()
            use_all_pixels(wavefront)
        wavefront.paths.set_seed(self.scene.seed)
        wavefront.clear()
        self._held, self._seconds_rendered = None, 0.0
        wavefront.stream.flush()
        return Contents()

    @synchronized
    def merge(self, state: FilmState) -> None:
        """Add the samples of another film of the same scene to this one, and wait.

        The picture is then that of one renderer that took them all, to the bit. To go on where a
        state was taken, merge it into a new renderer. `self.samples` is then after the last one.

        Raises SceneError if the film has another form, or a sample is in both: nothing has changed.
        """
        merged = self.film_state().merged(state)
        after = dataclasses.replace(self._settled, taken=merged.taken, adaptive=None)
        self._hold_words("merge", merged, after)

    @synchronized
    def _set_words(self, state: FilmState) -> None:
        """Let the film hold the words of another one of its form; `samples` stays."""
        self._hold_words("set_words", state, self._settled)

    def _hold_words(self, what: str, state: FilmState, after: Contents) -> None:
        """Let the film hold these words; after: what it then holds."""

        def put(_: BaseException | None = None) -> Contents:
            self._put(state)
            return after

        with self._change(what, put):
            self._contents = put()

    def close(self) -> None:
        """Give the device's memory back; the renderer is of no use afterwards.

        It waits for a `run` of another thread, not for what was enqueued. An array that the caller
        still holds, such as `film`, keeps its memory. Dropping a renderer does the same.
        """
        with self._lock:
            self._closed = True
            self._opened = None
            self._contents = Contents()
            self._moving = self._resolve = None

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

        camera: another one. materials: by the material of the scene that they replace, or by a
        shape's key. transforms: (4, 4) by shape; vertices: (n, 3) float32 by shape, of numpy or on
        the device; of `Spheres` their centres, perhaps (n, 4) with the radii. The key of a shape is
        the shape, its name, or its index in `scene.shapes`. A shape or material that the renderer
        had at first remains the key of whatever has replaced it. scene: another scene of the same
        film, for any other change; arrays and images that it shares with the present one are taken
        to be unchanged, and what is "auto" is chosen anew, as edits alone do not. motion: what
        changes place, of shapes, lights and the camera, moves from where it was to where it is, and
        so do vertices, while the shutter of the camera is open; the next update goes on from there.
        wait_for: events of the caller that come first. The scene is lowered again then, and once
        more after.

        The first of three ways that is possible is taken:

        1. Shapes that only move do so on the device, where trees are refitted to them; nothing is
           waited for. See clpt.render.editing.moving.
        2. A camera of the same kind, and values of materials, take a few written words.
        3. Else the scene is lowered again: tables are written where they differ, trees are built
           where triangles do, kernels where others are needed.

        `self.scene` is then the new scene, and the picture will be that of a new renderer. At level
        DEBUG the logger `clpt.render.renderer` says why a quicker way was not taken.

        Raises SceneError for what is not in the scene, or makes no sense in it, and for a film of
        another size, TypeError for a scene that is none; nothing has changed then. Raises
        MemoryBudgetError and KernelBuildError where the device cannot do what the new scene needs.
        """
        if scene is not None:
            check_scene(scene)
            scene = needs.prepared(scene, self.denoise)
        check_changes(camera, materials=materials, transforms=transforms, vertices=vertices)
        events = list(wait_for or ())
        self._wavefront.stream.after(events)
        quick = scene is None and not (motion or self._blurred)
        moves = quick and bool(transforms or vertices)
        if moves and self._move(transforms or {}, vertices or {}):
            transforms = vertices = None
            if materials is None and camera is None:
                return self._last
        new, replaced = self._edited(scene, camera, materials, transforms, vertices)
        write = self._patch(new) if quick and not transforms and not vertices else None
        warnings = self.warnings
        if write is None:
            write, warnings = self._rebuild(new, events, whole=scene is not None, motion=motion)
        self._take(write, new, replaced, warnings, motion=motion)
        return self._last

    def _edited(
        self,
        scene: Scene | None,
        camera: Camera | None,
        materials: Mapping[MaterialKey, Material] | None,
        transforms: Mapping[ShapeKey, Any] | None,
        vertices: Mapping[ShapeKey, Any] | None,
    ) -> tuple[Scene, Replacements]:
        """Return the scene, or another one, with changes of `update`, and what stands for what."""
        new = self.scene if scene is None else scene
        replaced = {} if scene is None else match_replacements(self.scene, new)
        if materials or transforms or vertices:
            new, more = self._edit(new, materials, transforms, vertices)
            replaced |= more
        return new if camera is None else dataclasses.replace(new, camera=camera), replaced

    def _take(
        self,
        write: Callable[[], None],
        scene: Scene,
        replaced: Replacements,
        warnings: list[str],
        *,
        motion: bool,
    ) -> None:
        """Render another scene from now on; write: brings it to the device, twice if it must."""

        def put(_: BaseException | None = None) -> Contents:
            write()
            self.scene, self.warnings, self._blurred = scene, warnings, motion
            self._successors.note(replaced)
            return self._emptied()

        with self._change("update", put, heals=False):
            self._contents = put()

    def _lower(self, scene: Scene, former: Lowered | None = None, *, anew: bool = False) -> Lowered:
        """Return the tables of a scene, for the way that is best; former: of the scene before it.

        anew: choose the way anew. A trial may decide, but not for pictures that people steer: they
        want to see something soon, and what is chosen stays.
        """
        steered = self._ground.tuning.cancel_seconds is not None
        readable, budget = resolve_device_arrays(scene, self.device.queue), self._texture_budget
        lowered = lower(readable, budget, former, anew=anew and not steered)
        if not lowered.candidates or steered:
            return lowered

        def lower_as(way: Integrator) -> Lowered:
            return lower(dataclasses.replace(readable, integrator=way), budget, lowered)

        return decided(self._ground, lowered, lower_as)

    def _edit(
        self,
        scene: Scene,
        materials: Mapping[MaterialKey, Material] | None,
        transforms: Mapping[ShapeKey, Any] | None,
        vertices: Mapping[ShapeKey, Any] | None,
    ) -> tuple[Scene, Replacements]:
        """Return a scene with these changes, and what stands for what; see `edit_scene`."""
        return edit_scene(scene, self._successors, materials, transforms, vertices)

    def _move(self, transforms: Mapping[ShapeKey, Any], vertices: Mapping[ShapeKey, Any]) -> bool:
        """Move shapes on the device, and begin at sample 0; return whether they could."""
        if self._moving is None:
            self._moving = Moving(self._wavefront.scene, self.scene)
        moved, replaced = self._edit(self.scene, None, transforms, vertices)
        if self._enters_a_medium(moved):
            return False
        with self._change("update", heals=False) as change:
            refusal = self._moving.move(self.scene, replaced, change.begin)
            if refusal is not None:
                log.debug("shapes cannot move on the device: %s", refusal)
                return False
            self.scene = moved
            self._successors.note(replaced)
            self._contents = self._emptied()
        return True

    def _patch(self, scene: Scene) -> Callable[[], None] | None:
        """Return what writes the words of parameters that differ, None if more does."""
        if self._enters_a_medium(scene):
            return None
        found = parameter_patch.patch(self._wavefront.scene, self.scene, scene)
        if isinstance(found, str):
            log.debug("words alone do not change the scene: %s", found)
            return None
        return found

    def _enters_a_medium(self, scene: Scene) -> bool:
        """Whether the camera or a light of a changed scene may be in other media than before."""
        lowered = self._wavefront.scene.lowered
        if not lowered.features.media.present:
            return False
        if lowered.features.light_media and _lights_moved(self.scene, scene):
            return True
        readable = resolve_device_arrays(scene, self.device.queue)
        if not lowered.features.media.bodies:
            return media_around(readable, lowered.cache) != lowered.around
        return bodies_around(readable, matter_of, lowered.cache) != lowered.around

    def _rebuild(
        self, scene: Scene, events: list[cl.Event], *, whole: bool, motion: bool
    ) -> tuple[Callable[[], None], list[str]]:
        """Lower a scene; return what lets it be rendered, see `rebuild.prepare`, and its warnings.

        events: that arrays on the device wait for, which may be read. whole: it is another scene
        rather than an edited one. motion: things move to it from where they are in the present one.
        """
        for event in events:
            dev.wait(event)
        shown, remarks = between(self.scene, scene) if motion else (scene, [])
        first = self._wavefront
        former = first.scene.lowered
        lowered = self._lower(shown, former, anew=whole)
        if rebuild.has_other_paths(former, lowered):
            take = self._exchanged(lowered)
        else:
            take = rebuild.prepare(first, lowered, refit=not whole)

        def write() -> None:
            take()
            self._moving = None

        return write, [*lowered.warnings, *remarks]

    @synchronized
    def _follow(self, origin: Origin) -> None:
        """See `FilmRenderer._follow`."""
        way = self._other_way(origin)
        if way is None:
            return
        former = self._wavefront.scene.lowered
        lowered = self._lower(self.scene, dataclasses.replace(former, integrator=way))
        if rebuild.has_other_paths(former, lowered):
            self._take(self._exchanged(lowered), self.scene, {}, self.warnings, motion=False)

    def _other_way(self, origin: Origin) -> Integrator | None:
        """Return the integrator that made a film of the scene, if another one was chosen here."""
        own = self._origin()
        if not self.scene.integrator.leaves_choice or own.settings == origin.settings:
            return None
        return None if own.scene.differences(origin.scene) else origin.way

    def _exchanged(self, lowered: Lowered) -> Callable[[], None]:
        """Return what puts a wavefront whose film has another form in the place of this one.

        The memory of the picture stays. Raises as `Wavefront.create`, and SceneError for a film
        of another size; nothing has changed then.
        """
        first = self._wavefront
        refused = rebuild.refusal(first.scene.lowered, lowered)
        if refused is not None:
            raise refused
        second = self._create(lowered)
        second.prepare()

        def take() -> None:
            second.show_in(first.film.picture)
            self._opened, self._resolve = second, None

        return take

    @property
    @synchronized
    def stats(self) -> RenderStats:
        """Figures of the render so far: numbers of things, bytes by table and tree, seconds."""
        return collect(self._wavefront, *self._built, dict(self._seconds))


def _opened(device: dev.Device | str | int | None, options: RenderOptions) -> dev.Device:
    """The device to render on. Raises DeviceError for options that contradict each other."""
    queue, threads = options.get("queue"), options.get("threads")
    if threads is not None and (queue is not None or isinstance(device, dev.Device)):
        raise DeviceError("threads are of a device that is chosen here; give its name or index")
    if queue is not None:
        if device is not None:
            raise DeviceError("give a device or a queue; a queue has its device")
        return dev.Device.adopt(queue)
    if isinstance(device, dev.Device):
        return device
    return dev.choose(device, profiling=options.get("profiling", False), threads=threads)


def _lights_moved(former: Scene, scene: Scene) -> bool:
    """Whether lights, or boundaries of their media, may have other places."""
    places = [
        [*map(shapes.geometry, one.shapes), *map(_placement, one.lights)] for one in (former, scene)
    ]
    return len(places[0]) != len(places[1]) or any(
        old is not new
        for olds, news in zip(*places, strict=True)
        for old, new in itertools.zip_longest(olds, news)
    )


def _placement(light: Light) -> tuple[Any, ...]:
    """Return the parameters of a light that say where it is."""
    values = fields_of(light)
    return tuple(values[n] for n, p in params(type(light)).items() if p.role.place == "host")


def texture_budget_of(device: dev.Device) -> int:
    """Return what bitmaps may take on a device [bytes]: half of what is free, in one buffer."""
    return min(int(TEXTURE_SHARE * device.free_memory()), device.info.max_alloc)
