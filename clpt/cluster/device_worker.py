"""A device that works on a picture with others: its renderer, and what only its own film holds."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from clpt.cluster.threads import on_all
from clpt.device import Device
from clpt.errors import SceneError
from clpt.render.contents import Contents
from clpt.render.editing.scene_edit import MaterialKey, Replacements, ShapeKey
from clpt.render.lowering.scene import Lowered
from clpt.render.renderer import Renderer
from clpt.render.wavefront.film_state import FilmState, Ranges, join_ranges
from clpt.render.wavefront.tracer import OnBatch, Selection
from clpt.render.wavefront.wavefront import Counts, Wavefront
from clpt.scene import Scene
from clpt.scene.materials import Material

_Made = TypeVar("_Made")


class Once:
    """Things that several devices share: each is made for the first that asks, and kept."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._made: dict[Any, Any] = {}

    def __call__(self, key: object, make: Callable[[], _Made]) -> _Made:
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

    def _emptied(self, *, recover: bool = False) -> Contents:
        """As for `Renderer`; the crew uses its film without a change, so it may need to recover."""
        return super()._emptied(recover=True)

    def _lower(self, scene: Scene, former: Lowered | None = None, *, anew: bool = False) -> Lowered:
        lower = super()._lower
        lowered = self.shared("lowered", lambda: lower(scene, former, anew=anew))
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

    name: for people; unsaved: the selections and ranges of samples that its film holds, and nothing
    else does; shows: whether its film holds the whole picture, rather than these; paths: that it
    traced; rate: of paths [1/s], 0 when not known.
    """

    def __init__(self, name: str, renderer: SharingRenderer):
        self.name, self.renderer = name, renderer
        self.unsaved: list[tuple[Selection, int, int]] = []
        self.unsaved_seconds = 0.0
        self.shows = False
        self.paths, self.rate = 0, 0.0
        self.past = Counts()  # before the film was emptied
        self._selected: tuple[Selection, Wavefront] | None = None

    @property
    def counts(self) -> Counts:
        """Counts of what the device has rendered so far."""
        return added(self.past, self.renderer.counts)

    @property
    def ranges(self) -> Ranges:
        """The samples that only its film holds."""
        ranges: Ranges = ()
        for _, first, end in self.unsaved:
            ranges = join_ranges(ranges, ((first, end),))
        return ranges

    def do(self, selection: Selection, first: int, end: int, on_batch: OnBatch) -> bool:
        """Add samples first to end - 1 to the film; return whether it was not stopped."""
        wavefront = self.renderer._wavefront
        former, by = self._selected or (None, None)
        if selection is not former or by is not wavefront:
            selection.prepare(wavefront)
        self._selected = selection, wavefront
        return selection.add(wavefront, first, end, on_batch)

    def take(self) -> FilmState:
        """Return the film, and empty it."""
        state = self.renderer.film_state()
        self.clear()
        return state

    def hold(self) -> None:
        """Keep a copy of the film on the device, for `held`. Raises MemoryBudgetError."""
        self.renderer._wavefront.film.hold()

    def held(self) -> FilmState:
        """Return what the film was at the last `hold`."""
        return self.renderer._words((), held=True)

    def clear(self) -> None:
        """Empty the film."""
        self.past = self.counts
        self.renderer._wavefront.clear()
        self.unsaved, self.unsaved_seconds, self.shows = [], 0.0, False

    def show(self, state: FilmState) -> None:
        """Let the film hold a whole picture."""
        self.renderer._set_words(state)
        self.shows = True


def added(a: Counts, b: Counts) -> Counts:
    """Return the sums of what happened."""
    return Counts(**{name: value + vars(b)[name] for name, value in vars(a).items()})


def device_names(devices: list[Device]) -> list[str]:
    """Return what devices are called: those with one label get a number."""
    labels = [device.info.label for device in devices]
    return [
        f"{label} #{labels[: i + 1].count(label)}" if labels.count(label) > 1 else label
        for i, label in enumerate(labels)
    ]


def where_it_works(action: Callable[[Any], Any], items: list[Any]) -> list[Any]:
    """Do something with every item at once; return the results, for some of them exceptions.

    Raises what was raised for the first item, if it is bad input or if all failed.
    """
    results = on_all(action, items)
    errors = [result for result in results if isinstance(result, BaseException)]
    for error in errors:
        if isinstance(error, (SceneError, TypeError)):
            raise error
    if len(errors) == len(items):
        raise errors[0]
    return results
