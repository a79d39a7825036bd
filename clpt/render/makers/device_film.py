"""A film on a device: its scene there, what it is of, and other scenes in place of that."""

from __future__ import annotations

import hashlib
import itertools
import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import device as dev
from clpt.arrays import Floats
from clpt.denoise import needs
from clpt.errors import DeviceError, SceneError
from clpt.geometry import shapes
from clpt.render.edit import parameter_patch, rebuild
from clpt.render.edit.blurring import between
from clpt.render.edit.moving import Moving
from clpt.render.edit.scene_edit import (
    MaterialKey,
    Replacements,
    ShapeKey,
    Successors,
    edit_scene,
    match_replacements,
    resolve_device_arrays,
)
from clpt.render.film.developed import Developed
from clpt.render.film.layers import white_paper
from clpt.render.film.pictures import PictureForm
from clpt.render.film.saved_film import Origin
from clpt.render.film.state import DIMENSIONS, FilmState, Ranges
from clpt.render.flow.scene_to_tables import Lowered, lower
from clpt.render.geometry.surroundings import bodies_around, media_around
from clpt.render.media.bodies import matter_of
from clpt.render.options import RenderOptions
from clpt.render.records import custom_materials
from clpt.render.textures.image_files import ImageFiles
from clpt.render.trials.trial import Ground, decided
from clpt.render.wavefront.denoised_noise import DenoisedNoise
from clpt.render.wavefront.strategy import Tuning
from clpt.render.wavefront.tracer import use_all_pixels
from clpt.render.wavefront.wavefront import Wavefront
from clpt.scene import Scene
from clpt.scene.cameras import Camera
from clpt.scene.fingerprint import Fingerprint, Plain, fingerprint
from clpt.scene.integrators import PIXELWISE, Integrator
from clpt.scene.lights import Light
from clpt.scene.materials import Material
from clpt.scene.params import fields_of, params
from clpt.version import VERSION

log = logging.getLogger("clpt.render.renderer")  # which the documentation names

TEXTURE_SHARE = 0.5  # of a device's free memory, for bitmaps
WAY = tuple(f"chosen.{name}" for name in ("integrator", "light_paths", "guide_paths", "splatting"))
TO_OUTPUT = ("to_first", "to_second", "to_third")

Apply = Callable[..., None]  # takes what writes a change, see `FilmRenderer._apply`
Measure = Callable[[NDArray[np.bool_]], Floats]
Share = Callable[[object, Callable[[], Any]], Any]


@dataclass(frozen=True, eq=False)
class Changes:
    """Changes of a scene, see `Renderer.update`."""

    camera: Camera | None = None
    materials: Mapping[MaterialKey, Material] | None = None
    transforms: Mapping[ShapeKey, Any] | None = None
    vertices: Mapping[ShapeKey, Any] | None = None
    scene: Scene | None = None
    motion: bool = False

    @property
    def by_key(self) -> dict[str, Mapping[Any, Any]]:
        """The changes of parts of the scene that are not empty, by name."""
        parts = {
            "materials": self.materials, "transforms": self.transforms, "vertices": self.vertices
        }  # fmt: skip
        return {name: changes for name, changes in parts.items() if changes}


class DeviceFilm:
    """A film on a device, with its scene.

    scene: as it is rendered; denoise: the denoiser for the film; warnings: of the lowered scene;
    start: of its construction [s of time.perf_counter]; built: numbers of programs that were built,
    and of programs from clpt's cache; seconds: of each part of the construction. options: see
    `RenderOptions`. share: calls a function once for several devices, by a key; without it the
    scene may have arrays in the memory of the device. former: a similar lowered scene.

    Raises as `Renderer` does.
    """

    def __init__(
        self,
        scene: Scene,
        device: dev.Device,
        options: RenderOptions,
        share: Share | None = None,
        former: Lowered | None = None,
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
        self._texture_budget, self._successors = texture_budget, Successors()
        looped = options.get("looped", None if options.get("queue") is None else True)
        tuning = Tuning(options.get("layout"), options.get("queued"), options.get("cancel_seconds"))
        self._ground = Ground(device, tuning, looped)
        self._create = partial(
            Wavefront.create,
            device,
            tuning=tuning,
            slots=options.get("slots"),
            looped=looped,
            trees=options.get("tree_quality", "high"),
            halves=options.get("halves", False) or needs.halves(scene, denoise),
        )
        self._opened: Wavefront | None = None
        lowered = self._lower(scene, share, former, anew=True)
        self.seconds["lower"] = time.perf_counter() - start
        self._opened = first = self._create(lowered)
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
        self._moving: Moving | None = None
        self._blurred = False  # by keys that `scene` does not have
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

    def denoised_noise(self, words: Callable[..., FilmState]) -> Measure | None:
        """Return a function that measures the noise after denoising; None with light paths.

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
        return DenoisedNoise(lambda: Developed(words(), form), self.device, self.denoise).measure

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
        self._opened = self._moving = None

    # ---- another scene

    def update(
        self, changes: Changes, events: dev.Events, apply: Apply, share: Share | None = None
    ) -> None:
        """Render another scene from now on, in the first way that is possible; see `Renderer`.

        events: to wait for before arrays of the changes are read. apply: calls the function that
        writes a change, see `FilmRenderer._apply`. share: see the class.
        """
        moves = bool(changes.transforms or changes.vertices)
        quick = changes.scene is None and not (changes.motion or self._blurred)
        if quick and moves and self._move(changes, apply, share):
            changes = replace(changes, transforms=None, vertices=None)
            moves = False
            if changes.materials is None and changes.camera is None:
                return
        new, replaced = self._edited(changes, share)
        write, warnings = self._patch(new) if quick and not moves else None, self.warnings
        if write is None:
            write, warnings = self._rebuild(new, events, changes, share)

        def take() -> None:
            write()
            self.scene, self.warnings, self._blurred = new, warnings, changes.motion
            self._successors.note(replaced)

        apply(take, again=True)

    def _lower(
        self, scene: Scene, share: Share | None, former: Lowered | None = None, *,
        anew: bool = False,
    ) -> Lowered:  # fmt: skip
        """Return the tables of a scene for the best integrator; former: of the former scene.

        anew: choose the integrator anew. A trial may decide, but not for interactive pictures,
        which must come soon and keep their integrator.
        """
        steered = self._ground.tuning.cancel_seconds is not None
        chooses = anew and not (steered and self.is_open)

        def make() -> Lowered:
            readable, budget = resolve_device_arrays(scene, self.device.queue), self._texture_budget
            lowered = lower(readable, budget, former, anew=chooses)
            if not lowered.candidates or steered:
                return lowered

            def lower_as(way: Integrator) -> Lowered:
                return lower(readable, budget, replace(lowered, integrator=way))

            return decided(self._ground, lowered, lower_as)

        if share is None:
            return make()
        lowered: Lowered = share("lowered", make)
        if lowered.zero_copy:
            raise SceneError("arrays in the memory of one device are not there for the others")
        return lowered

    def _edited(self, changes: Changes, share: Share | None) -> tuple[Scene, Replacements]:
        """Return the changed scene, and the replacements of its parts."""
        new = self.scene if changes.scene is None else changes.scene
        replaced = {} if changes.scene is None else match_replacements(self.scene, new)
        if changes.by_key:
            by_key = changes.materials, changes.transforms, changes.vertices
            edit = partial(edit_scene, new, self._successors, *by_key)
            key = "edited", *changes.by_key
            new, more = edit() if share is None else share(key, edit)
            replaced |= more
        if changes.camera is not None:
            new = replace(new, camera=changes.camera)
        return new, replaced

    def _move(self, changes: Changes, apply: Apply, share: Share | None) -> bool:
        """Move shapes on the device; return whether they could."""
        if self._moving is None:
            self._moving = Moving(self.wavefront.scene, self.scene)
        places = Changes(transforms=changes.transforms or {}, vertices=changes.vertices or {})
        moved, replaced = self._edited(places, share)
        if self._enters_a_medium(moved):
            return False
        move = self._moving.plan(self.scene, replaced)
        if isinstance(move, str):
            log.debug("shapes cannot move on the device: %s", move)
            return False

        def take() -> None:
            move()
            self.scene = moved
            self._successors.note(replaced)

        apply(take)
        return True

    def _patch(self, scene: Scene) -> Callable[[], None] | None:
        """Return a function that writes differing words of parameters; None if more differs."""
        if self._enters_a_medium(scene):
            return None
        patch = parameter_patch.patch(self.wavefront.scene, self.scene, scene)
        if isinstance(patch, str):
            log.debug("words alone do not change the scene: %s", patch)
            return None
        return patch

    def _enters_a_medium(self, scene: Scene) -> bool:
        """Return whether the camera or a light of a changed scene may be in other media."""
        lowered = self.wavefront.scene.lowered
        if not lowered.features.media.present:
            return scene.camera.medium is not self.scene.camera.medium
        if lowered.features.light_media and _lights_moved(self.scene, scene):
            return True
        readable = resolve_device_arrays(scene, self.device.queue)
        if not lowered.features.media.bodies:
            return media_around(readable, lowered.cache) != lowered.around
        return bodies_around(readable, matter_of, lowered.cache) != lowered.around

    def _rebuild(
        self, scene: Scene, events: dev.Events, changes: Changes, share: Share | None
    ) -> tuple[Callable[[], None], list[str]]:
        """Lower a scene; return the function from `rebuild.prepare`, and warnings.

        events: to wait for before arrays on the device are read. With motion, shapes, lights and
        the camera move from the present scene to this scene.
        """
        for event in events or ():
            dev.wait(event)
        shown, remarks = between(self.scene, scene) if changes.motion else (scene, [])
        first, whole = self.wavefront, changes.scene is not None
        former = first.scene.lowered
        lowered = self._lower(shown, share, former, anew=whole)
        if rebuild.has_other_paths(former, lowered):
            take = self._exchanged(lowered)
        else:
            take = rebuild.prepare(first, lowered, refit=not whole)

        def write() -> None:
            take()
            self._moving = None

        return write, [*lowered.warnings, *remarks]

    def other_way(self, origin: Origin) -> Integrator | None:
        """Return the integrator of a film of the scene; None if anything else differs."""
        present = self.origin()
        if not self.scene.integrator.leaves_choice or present.settings == origin.settings:
            return None
        chosen = {name: origin.settings.get(name) for name in WAY}
        alike = replace(present, settings={**present.settings, **chosen})
        return None if alike.differences(origin) else origin.chosen_integrator

    def follow(self, way: Integrator, apply: Apply, share: Share | None = None) -> None:
        """Render with another integrator if its film has another form; see `update`."""
        former = self.wavefront.scene.lowered
        lowered = self._lower(self.scene, share, replace(former, integrator=way))
        if rebuild.has_other_paths(former, lowered):
            apply(self._exchanged(lowered), again=True)

    def _exchanged(self, lowered: Lowered) -> Callable[[], None]:
        """Return a function that replaces the wavefront by another, whose film has another form.

        The memory of the picture stays. Raises as `Wavefront.create` does, and SceneError for a
        film of another size; nothing has changed then.
        """
        first = self.wavefront
        refused = rebuild.refusal(first.scene.lowered, lowered)
        if refused is not None:
            raise refused
        second = self._create(lowered)
        second.prepare()

        def take() -> None:
            second.show_in(first.film.picture)
            self._opened, self._moving = second, None

        return take

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
            "chosen.splatting": features.film.filter.reach > 0,
            "chosen.texels": int(lowered.tables["texels"].size),
            "halves": first.film.halves == 2,
        }
        if type(self.scene.sampler) not in PIXELWISE:  # their points depend on its size
            settings["sampler.points"] = 1 << int(lowered.settings["sample_bits"])
        outside = [cls for cls in features.materials.leaves if cls.source is not None]
        texts = [custom_materials.text(cls).text for cls in outside]
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


def _lights_moved(former: Scene, scene: Scene) -> bool:
    """Return whether lights, or boundaries of their media, may have moved."""
    places = [
        [*map(shapes.geometry, each.shapes), *map(_placement, each.lights)]
        for each in (former, scene)
    ]
    return len(places[0]) != len(places[1]) or any(
        old is not new
        for olds, news in zip(*places, strict=True)
        for old, new in itertools.zip_longest(olds, news)
    )


def _placement(light: Light) -> tuple[Any, ...]:
    """Return the parameters of a light that place it."""
    values = fields_of(light)
    return tuple(values[n] for n, p in params(type(light)).items() if p.role.place == "host")


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
