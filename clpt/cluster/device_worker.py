"""A device that works on a picture with others: its renderer, and what only its own film holds."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from clpt.device import Device
from clpt.errors import SceneError
from clpt.render.editing.scene_edit import MaterialKey, Replacements, ShapeKey
from clpt.render.lowering.scene import Lowered
from clpt.render.renderer import Renderer
from clpt.render.wavefront.film_state import FilmState, Ranges, join_ranges
from clpt.render.wavefront.wavefront import Counts, Wavefront
from clpt.scene import Scene
from clpt.scene.materials import Material

OnBatch = Callable[[Any], bool]
_Made = TypeVar("_Made")


@dataclass(frozen=True, eq=False)
class Job:
    """Samples that any device may add to its film.

    do: called with each wavefront of a renderer, the first sample's number, the end, and what
    `Wavefront.render_samples` calls; returns whether it was not stopped. prepare: called once with
    a wavefront before. paths: of a sample, as many as pixels.
    """

    do: Callable[[Wavefront, int, int, OnBatch], bool]
    paths: int
    prepare: Callable[[Wavefront], None] | None = None


class Once:
    """What several devices need alike: made for the first that asks, and kept for the others."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._made: dict[Any, Any] = {}

    def __call__(self, key: Any, make: Callable[[], _Made]) -> _Made:
        """Return what was made for a key. Raises what `make` raised."""
        with self._lock:
            if key not in self._made:
                try:
                    self._made[key] = make()
                except SceneError as error:
                    self._made[key] = error
            if isinstance(self._made[key], SceneError):
                raise self._made[key]
            return self._made[key]


class SharingRenderer(Renderer):
    """A renderer whose scene is lowered and edited once for several devices.

    shared: of all of them, another one for each change of the scene.
    """

    def __init__(self, scene: Scene, device: Device, shared: Once, **options: Any):
        self.shared = shared
        super().__init__(scene, device, **options)

    def _lower(self, scene: Scene, former: Lowered | None = None) -> Lowered:
        lower = super()._lower
        lowered = self.shared("lowered", lambda: lower(scene, former))
        if lowered.zero_copy:
            raise SceneError("arrays in the memory of one device are not there for the others")
        return lowered

    def _edit(
        self,
        scene: Scene,
        materials: Mapping[MaterialKey, Material] | None,
        transforms: Mapping[ShapeKey, Any] | None,
        vertices: Mapping[ShapeKey, Any] | None,
    ) -> tuple[Scene, Replacements]:
        edit = super()._edit
        key = "edited", bool(materials), bool(transforms), bool(vertices)
        return self.shared(key, lambda: edit(scene, materials, transforms, vertices))


class DeviceWorker:
    """A device with its renderer.

    name: for people; unsaved: the jobs and ranges of samples that its film holds, and nothing else
    does; shows: whether its film holds the whole picture, rather than these; paths: that it traced;
    rate: of paths [1/s], 0 when not known.
    """

    def __init__(self, name: str, renderer: SharingRenderer):
        self.name, self.renderer = name, renderer
        self.unsaved: list[tuple[Job, int, int]] = []
        self.unsaved_seconds = 0.0
        self.shows = False
        self.paths, self.rate = 0, 0.0
        self.past = [Counts() for _ in renderer.wavefronts]  # before the film was emptied
        self._job: Job | None = None

    @property
    def counts(self) -> list[Counts]:
        """What has happened so far, of each film."""
        return [added(*pair) for pair in zip(self.past, self.renderer.counts, strict=True)]

    @property
    def ranges(self) -> Ranges:
        """The samples that only its film holds."""
        ranges: Ranges = ()
        for _, first, end in self.unsaved:
            ranges = join_ranges(ranges, ((first, end),))
        return ranges

    def do(self, job: Job, first: int, end: int, on_batch: OnBatch) -> bool:
        """Add samples first to end - 1 of a job to the film; return whether it was not stopped."""
        wavefronts = self.renderer.wavefronts
        if job is not self._job and job.prepare is not None:
            for wavefront in wavefronts:
                job.prepare(wavefront)
        self._job = job
        return all(job.do(wavefront, first, end, on_batch) for wavefront in wavefronts)

    def take(self) -> FilmState:
        """Return the film, and empty it."""
        state = self.renderer.film_state()
        self.clear()
        return state

    def clear(self) -> None:
        """Empty the film."""
        self.past = self.counts
        for wavefront in self.renderer.wavefronts:
            wavefront.clear()
        self.unsaved, self.unsaved_seconds, self.shows = [], 0.0, False

    def show(self, state: FilmState) -> None:
        """Let the film hold a whole picture."""
        for wavefront, words in zip(self.renderer.wavefronts, state.words, strict=True):
            wavefront.set_words(words, state.bands, state.layers)
        self.shows = True


def added(a: Counts, b: Counts) -> Counts:
    """Return the sums of what happened."""
    return Counts(**{name: value + getattr(b, name) for name, value in vars(a).items()})
