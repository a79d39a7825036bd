"""A film on a device: its scene there, its words, its form, and the origin of its samples."""

from __future__ import annotations

import hashlib
import logging
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from typing import Any, TypeVar

import numpy as np

from clpt import device as dev
from clpt.denoise import needs
from clpt.errors import DeviceError, SceneError
from clpt.render.edit.moving import Moving
from clpt.render.edit.plans import kinds_of_paths
from clpt.render.edit.scene_edit import (
    Successors,
    resolve_device_arrays,
)
from clpt.render.film.developed import Developed
from clpt.render.film.film_file import Origin
from clpt.render.film.layers import white_paper
from clpt.render.film.pictures import PictureForm
from clpt.render.film.state import DIMENSIONS, FilmState, Ranges
from clpt.render.flow.scene_to_tables import Lowered, lower
from clpt.render.options import RenderOptions
from clpt.render.records import materials
from clpt.render.textures.texels import ImageFiles
from clpt.render.trials import decided
from clpt.render.wavefront.noise import DenoisedNoise
from clpt.render.wavefront.strategy import Tuning
from clpt.render.wavefront.tracer import use_all_pixels
from clpt.render.wavefront.wavefront import Wavefront
from clpt.scene import Scene
from clpt.scene.fingerprint import Fingerprint, Plain, fingerprint
from clpt.scene.integrators import PIXELWISE, Integrator
from clpt.version import VERSION

log = logging.getLogger("clpt.render.renderer")  # which the documentation names

MOST_SPARE = 2  # replaced wavefronts that are kept
TEXTURE_SHARE = 0.5  # of a device's free memory, for bitmaps
WAY = tuple(
    f"chosen.{name}" for name in ("integrator", "light_paths", "guide_paths", "reuse", "splatting")
)
TO_OUTPUT = ("to_first", "to_second", "to_third")

Value = TypeVar("Value")


class Once:
    """Values that several devices share: the first request for a key computes its value."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._values: dict[Any, Any] = {}

    def __call__(self, key: object, make: Callable[[], Value]) -> Value:
        """Return the value of a key. Repeats a SceneError of `make`."""
        with self._lock:
            if key not in self._values:
                try:
                    self._values[key] = make()
                except SceneError as error:
                    self._values[key] = error
            if isinstance(self._values[key], SceneError):
                raise self._values[key]
            return self._values[key]


def _tuning(options: RenderOptions) -> Tuning:
    """The wishes of options."""
    return Tuning(
        layout=options.get("layout"),
        queued=options.get("queued"),
        looped=options.get("looped", None if options.get("queue") is None else True),
        cancel_seconds=options.get("cancel_seconds"),
        sorted_rays=options.get("sorted_rays"),
    )


class DeviceFilm:
    """A film on a device, with its scene; see clpt.render.makers.planning for another scene.

    scene: as it is rendered; denoise: the denoiser for the film; warnings: of the lowered scene;
    start: of its construction [s of time.perf_counter]; built: numbers of programs that were built,
    and of programs from clpt's cache; seconds: of each part of the construction. options: see
    `RenderOptions`. share: values of several devices; without it the
    scene may have arrays in the memory of the device. former: a similar lowered scene. moving: the
    shapes that have moved on the device; blurred: whether the tables have keys of motion that
    `scene` does not have; successors: of the shapes and materials of the first scene. beside,
    in_turn: see `Renderer`; beside stays None unless films get scenes in turn.

    Raises as `Renderer` does.
    """

    def __init__(
        self,
        scene: Scene,
        device: dev.Device,
        options: RenderOptions,
        share: Once | None = None,
        former: Lowered | None = None,
        beside: DeviceFilm | None = None,
        in_turn: bool = False,
    ):
        self.start = start = time.perf_counter()
        self.seconds: dict[str, float] = {}
        self.denoise = denoise = options.get("denoise")
        self.scene = scene = needs.prepared(scene, denoise)
        self.device = device
        before = device.builds.programs, device.builds.cached
        texture_budget = options.get("texture_budget")
        if texture_budget is None:
            texture_budget = texture_budget_of(device)
        self._texture_budget, self.successors = texture_budget, Successors()
        self._shared = options.get("programs") == "shared"
        self._tuning = _tuning(options)
        self.create = partial(
            Wavefront.create,
            device,
            tuning=self._tuning,
            slots=options.get("slots"),
            trees=options.get("tree_quality", "high"),
            halves=options.get("halves", False) or needs.halves(denoise, scene.noise),
        )
        self._opened: Wavefront | None = None
        self.beside = beside if in_turn else None
        self._spare = OrderedDict[tuple[float, ...], Wavefront]() if in_turn else None
        lowered = self.lower(scene, share, former, anew=True)
        self.seconds["lower"] = time.perf_counter() - start
        self._opened = first = self.create(lowered)
        first.prepare()
        self.built = device.builds.programs - before[0], device.builds.cached - before[1]
        self.seconds["programs"] = first.program_seconds
        self.seconds["trees"] = first.scene.trees.seconds
        self.seconds["ready"] = time.perf_counter() - start
        self.warnings = list(lowered.warnings)
        if denoise is not None:
            splats = first.features.film.filter.reach > 0
            weighed = scene.noise is not None and first.features.transport.weighed
            self.warnings += needs.remarks(lowered.integrator, scene.sampler, splats, weighed)
        self._scene_read: tuple[Scene, ImageFiles, Fingerprint] | None = None
        self.moving: Moving | None = None
        self.blurred = False
        log.info("ready in %.2f s", self.seconds["ready"])

    @property
    def wavefront(self) -> Wavefront:
        """The wavefront on the device. Raises DeviceError after `close`."""
        if self._opened is None:
            raise DeviceError("this Renderer is closed; make another one")
        return self._opened

    @property
    def is_open(self) -> bool:
        """Whether it has not been closed."""
        return self._opened is not None

    # ---- the film

    def denoised_noise(self, words: Callable[..., FilmState]) -> DenoisedNoise | None:
        """Return the meter of noise after denoising; None with light paths.

        words: returns the film. Raises SceneError if the film has no halves.
        """
        if self.denoise is None or self.wavefront.features.transport.weighed:
            return None
        if self.wavefront.film.halves != 2:
            raise SceneError(
                "what is left after denoising is told by even and odd samples apart; give the "
                "scene `noise`, or halves=True",
                where="noise",
            )
        form = self.form
        return DenoisedNoise(lambda: Developed(words(), form), self.device, self.denoise)

    def words(self, *names: str, held: bool = False, taken: Ranges = ()) -> FilmState:
        """Wait for the film or, if `held`, for its copy; return it on the host.

        names: of the arrays to read, by default all; taken: its samples.
        """
        scale = float(self.wavefront.paths.settings["film_scale"])
        arrays: Any = self.wavefront.film.words(*(names or DIMENSIONS), held=held)
        return FilmState(taken=taken, scale=scale, **arrays)

    @property
    def no_words(self) -> FilmState:
        """A film of this form without samples."""
        film = self.words()
        arrays: Any = {name: np.zeros_like(array) for name, array in film.arrays.items()}
        return replace(film, **arrays)

    def put(self, state: FilmState) -> None:
        """Enqueue the words of another film of the same form."""
        self.wavefront.set_words(state.arrays)

    def empty(self, *, seed: int | None = None, recover: bool = False) -> None:
        """Enqueue the emptying of the film; seed: of later samples; recover: from any error."""
        wavefront = self.wavefront
        if seed is not None:
            self.scene = replace(self.scene, seed=seed)
        if recover:
            wavefront.stream.rejoin()
            use_all_pixels(wavefront)
        wavefront.paths.set_seed(self.scene.seed)
        wavefront.clear()
        wavefront.stream.flush()

    def close(self) -> None:
        """Give the device's memory back."""
        self._opened = self.moving = self._spare = None

    # ---- another scene

    def lower(
        self, scene: Scene, share: Once | None, former: Lowered | None = None, *,
        anew: bool = False,
    ) -> Lowered:  # fmt: skip
        """Return the tables of a scene for the best integrator; former: of the former scene.

        anew: choose the integrator anew. A trial may decide, but not for interactive pictures,
        which must come soon and keep their integrator.
        """
        steered = self._tuning.cancel_seconds is not None
        chooses = anew and not (steered and self.is_open)

        def make() -> Lowered:
            readable, budget = resolve_device_arrays(scene, self.device.queue), self._texture_budget
            shared, near = self._shared, self.beside
            beside = near.wavefront.scene.lowered if near is not None else None
            lowered = lower(readable, budget, former, anew=chooses, shared=shared, beside=beside)
            if not lowered.candidates or steered:
                return lowered
            return decided(self.device, self._tuning, readable, lowered, budget, shared=shared)

        if share is None:
            return make()
        lowered: Lowered = share("lowered", make)
        if lowered.zero_copy:
            raise SceneError("arrays in the memory of one device are not there for the others")
        return lowered

    def other_integrator(self, origin: Origin) -> Integrator | None:
        """Return the integrator of a film of the scene; None if anything else differs."""
        present = self.origin()
        if not self.scene.integrator.leaves_choice or present.settings == origin.settings:
            return None
        chosen = {name: origin.settings.get(name) for name in WAY}
        alike = replace(present, settings={**present.settings, **chosen})
        return None if alike.differences(origin) else origin.chosen_integrator

    def spare(self, lowered: Lowered) -> Wavefront | None:
        """Return a replaced wavefront whose kinds of paths are those of a lowered scene, or None.

        Its picture is in the memory of the present picture.
        """
        return None if self._spare is None else self._spare.get(kinds_of_paths(lowered))

    def exchange(self, wavefront: Wavefront) -> None:
        """Replace the wavefront, whose film has another form; the memory of the picture stays."""
        former = self.wavefront
        if wavefront.film.picture is not former.film.picture:
            wavefront.show_in(former.film.picture)
        self._opened, self.moving = wavefront, None
        if self._spare is not None:
            self._spare[kinds_of_paths(former.scene.lowered)] = former
            while len(self._spare) > MOST_SPARE:
                self._spare.popitem(last=False)

    # ---- origin and form

    def origin(self) -> Origin:
        """Return the origin of the samples. Raises SceneError for a scene that cannot be read."""
        first = self.wavefront
        lowered, features = first.scene.lowered, first.features
        read = self._scene_read
        if read is None or read[0] is not self.scene or read[1] is not lowered.files:
            readable = resolve_device_arrays(self.scene, self.device.queue)
            read = self.scene, lowered.files, fingerprint(readable, lowered.files.digests)
            self._scene_read = read
        settings: dict[str, Plain] = {
            "chosen.integrator": lowered.integrator.kind,
            "chosen.light_paths": float(lowered.settings["light_paths"]),
            "chosen.guide_paths": int(lowered.settings["guide_paths"]),
            "chosen.reuse": lowered.integrator.reuse,
            "chosen.splatting": features.film.filter.reach > 0,
            "chosen.texels": int(lowered.tables["texels"].size),
            "halves": first.film.halves == 2,
        }
        if type(self.scene.sampler) not in PIXELWISE:  # their points depend on its size
            settings["sampler.points"] = 1 << int(lowered.settings["sample_bits"])
        outside = [cls for cls in features.materials.leaves if cls.source is not None]
        texts = [materials.text(cls).text for cls in outside]
        digest = hashlib.sha256("\0".join([kernels_digest(), *texts]).encode()).hexdigest()
        return Origin(read[2], settings, digest, VERSION)

    def device_class(self) -> dict[str, Plain]:
        """Return the class of the device; equal classes give films equal to the bit."""
        first, info = self.wavefront, self.device.info
        return {
            "device": info.label,
            "driver": f"{info.version} {info.driver}",
            "lanes": first.lanes,
            "layout": first.scene.strategy.layout,
            "tree_quality": first.scene.tree_quality,
        }

    @property
    def form(self) -> PictureForm:
        """The form of the picture."""
        first, film = self.wavefront, self.scene.film
        settings, features = first.paths.settings, first.features
        return PictureForm(
            tuple(tuple(float(v) for v in np.ravel(settings[name])[:3]) for name in TO_OUTPUT),
            light_paths=features.transport.light_paths,
            weighed=features.transport.weighed,
            weights=features.film_weights,
            alpha=features.film.alpha,
            bands=first.film.band_count,
            lambda_min=film.lambda_min,
            lambda_max=film.lambda_max,
            time_bins=features.film.layers.time_bins,
            time_min=film.time_min,
            time_max=film.time_max,
            output_space=film.output_space,
            exposure=film.exposure,
            display_exposure=film.display_exposure,
            layers=features.film.layers.names,
            paper=tuple(map(tuple, white_paper(film, features.spectra.mode).tolist())),
            names=first.scene.lowered.layer_names,
            adaptive=self.scene.noise is not None,
            octaves=self.scene.sampler.octaves if settings["octaves"] == 2 else 0.0,
            place=film.crop and (*film.crop[:2], film.width, film.height),
        )


@cache
def kernels_digest() -> str:
    """Return the SHA-256 of all kernels' texts."""
    folder, hashed = dev.kernels_folder(), hashlib.sha256()
    for path in sorted(folder.rglob("*.cl")):
        hashed.update(path.relative_to(folder).as_posix().encode() + b"\0" + path.read_bytes())
    return hashed.hexdigest()


def texture_budget_of(device: dev.Device) -> int:
    """Return the budget of bitmaps on a device [bytes]: half of the free memory, in a buffer."""
    return min(int(TEXTURE_SHARE * device.free_memory()), device.info.max_alloc)


def open_device(device: dev.Device | str | int | None, options: RenderOptions) -> dev.Device:
    """Return the device to render on. Raises DeviceError for options that contradict each other."""
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
