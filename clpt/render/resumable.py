"""Renderers whose film can be saved, and gone on with in another process."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import device as dev
from clpt.errors import SceneError
from clpt.render.contents import Contents
from clpt.render.contract import custom_materials
from clpt.render.editing.scene_edit import resolve_device_arrays
from clpt.render.film.denoised_noise import DenoisedNoise
from clpt.render.film.developed import Developed
from clpt.render.film.layers import white_paper
from clpt.render.film.picture_form import PictureForm
from clpt.render.film.saved_film import Origin, SavedFilm
from clpt.render.locking import synchronized
from clpt.render.pictures import DevicePictures
from clpt.render.wavefront.adaptive import Adaptive
from clpt.render.wavefront.film_state import DIMENSIONS, FilmState, Ranges
from clpt.render.wavefront.tracer import Tracer
from clpt.render.wavefront.wavefront import Counts
from clpt.scene import Scene
from clpt.scene.fingerprint import Fingerprint, Plain, fingerprint
from clpt.scene.integrators import PIXELWISE
from clpt.version import VERSION

TO_OUTPUT = ("to_first", "to_second", "to_third")


class Resumable(DevicePictures):
    """Base of renderers on a device: their film is saved, and gone on with."""

    def __init__(self) -> None:
        super().__init__()
        self._scene_read: tuple[Scene, Fingerprint] | None = None
        self._held: dict[str, Any] | None = None

    @synchronized
    def film_state(self) -> FilmState:
        """Return what the film holds, as whole numbers on the host; wait for it."""
        return self._words(self._settled.taken, held=False)

    @synchronized
    def _developed(self, *words: str) -> Developed:
        """Return the pictures of the film as it is now, which then stay; see `Pictures`."""
        return Developed(self._words((), held=False, names=words), self._form)

    def _words(self, taken: Ranges, *, held: bool, names: tuple[str, ...] = ()) -> FilmState:
        """Return what the film holds, or held, as `film_state` does, of samples that are taken.

        names: of the arrays that are wanted, all by default.
        """
        first = self._wavefront
        scale = float(first.paths.settings["film_scale"])
        arrays = first.film.words(*(names or DIMENSIONS), held=held)
        return FilmState(taken=taken, scale=scale, **arrays)

    @synchronized
    def _hold(self) -> None:
        """Keep a copy of the film on the device, as it is now, for `_saved_film`.

        So a render that is stopped in the middle of a `run` can be saved as it was before: without
        samples that some pixels have and others have not. Raises MemoryBudgetError.
        """
        so_far, self._held = self._progress_so_far(self._device_class()), None
        self._wavefront.film.hold()
        self._held = so_far

    @synchronized
    def _saved_film(self, *, held: bool = False) -> SavedFilm:
        """Return the film with all that it takes to go on with it; wait for the device.

        held: as it was at the last `_hold`. Raises SceneError for a scene that cannot be read, and
        without a `_hold`.
        """
        if held and self._held is None:
            raise SceneError("no film is held")
        if held and self._held is not None:
            so_far = dict(self._held)
        else:
            so_far = self._progress_so_far(self._device_class())
        state = self._words(so_far.pop("taken"), held=held)
        return SavedFilm(state, self._origin(), self._form, **so_far)

    @synchronized
    def _origin(self) -> Origin:
        """Return what the samples are of. Raises SceneError for a scene that cannot be read."""
        if self._scene_read is None or self._scene_read[0] is not self.scene:
            readable = resolve_device_arrays(self.scene, self._wavefront.stream.queue)
            self._scene_read = self.scene, fingerprint(readable)
        first = self._wavefront
        lowered, features = first.scene.lowered, first.features
        settings: dict[str, Plain] = {
            "chosen.integrator": lowered.integrator.kind,
            "chosen.light_paths": float(lowered.settings["light_paths"]),
            "chosen.guiding": bool(features.transport.guided),
            "chosen.splatting": features.film.filter.reach > 0,
            "chosen.texels": int(lowered.tables["texels"].size),
            "halves": first.film.halves == 2,
        }
        if type(self.scene.sampler) not in PIXELWISE:  # their points are for some number of samples
            settings["sampler.points"] = 1 << int(lowered.settings["sample_bits"])
        outside = [cls for cls in features.materials.leaves if cls.source is not None]
        texts = [custom_materials.text(cls).text for cls in outside]
        digest = hashlib.sha256("\0".join([kernels_digest(), *texts]).encode()).hexdigest()
        return Origin(self._scene_read[1], settings, digest, VERSION)

    @synchronized
    def _device_class(self) -> dict[str, Plain]:
        """Return what decides the last bits of samples: equal classes give equal films."""
        first, info = self._wavefront, self.device.info
        return {
            "device": info.label,
            "driver": f"{info.version} {info.driver}",
            "lanes": first.lanes,
            "layout": first.scene.strategy.layout,
            "tree_quality": first.scene.tree_quality,
        }

    def _adaptively(
        self, tracer: Tracer | None, denoise: str | None, arrays: Mapping[str, NDArray[Any]]
    ) -> Adaptive:
        """Return adaptive sampling of this film, which begins, or goes on from a state.

        tracer: adds the samples; denoise: a denoiser: noise is then what it leaves. Light paths
        have their noise before. arrays: the state, empty at the beginning. Raises SceneError where
        halves are wanted and not kept, and for a state of another film.
        """
        first, measure = self._wavefront, None
        if denoise is not None and not first.features.transport.weighed:
            if first.film.halves != 2:
                raise SceneError(
                    "what is left after denoising is told by even and odd samples apart; give the "
                    "scene `noise`, or halves=True",
                    where="noise",
                )
            measure = DenoisedNoise(self, self.device, denoise).measure
        begun = Adaptive(first, tracer, measure)
        if arrays:
            try:
                begun.restore(arrays)
            except (KeyError, ValueError) as error:
                message = f"the state of adaptive sampling does not fit: {error}"
                raise SceneError(message) from error
        return begun

    @synchronized
    def _restore(self, saved: SavedFilm) -> None:
        """Go on from a saved film, as `load_state` does. Raises SceneError."""
        self._follow(saved.origin)
        saved.check_fits(self._origin(), self.film_state())
        adaptive = None
        if saved.adaptive:
            adaptive = self._adaptively(None, self.denoise, saved.adaptive)
        restored = Contents(saved.film.taken, adaptive, saved.sessions)

        def put(_: BaseException | None = None) -> Contents:
            self._held, self._seconds_rendered = None, 0.0
            self._wavefront.counts = Counts(**saved.counts)
            self._put(saved.film)
            return restored

        with self._change("load_state", put):
            self._contents = put()
        self._warn_of_others(saved.sessions, self._device_class())

    def _put(self, state: FilmState) -> None:
        """Enqueue that the film holds the words of another one of its form."""
        self._wavefront.set_words(state.arrays)

    @property
    @synchronized
    def _form(self) -> PictureForm:  # type: ignore[override]
        """The way from the film's words to a picture."""
        first, film = self._wavefront, self.scene.film
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
            layers=features.film.layers.names,
            paper=tuple(map(tuple, white_paper(film, features.spectra.mode).tolist())),
            names=first.scene.lowered.layer_names,
            adaptive=self.scene.noise is not None or self._known.adaptive is not None,
            octaves=self.scene.sampler.octaves * ("variance" in features.film.layers.names),
        )


@cache
def kernels_digest() -> str:
    """Return the SHA-256 of all kernels' texts."""
    folder, hashed = dev.kernels_folder(), hashlib.sha256()
    for path in sorted(folder.rglob("*.cl")):
        hashed.update(path.relative_to(folder).as_posix().encode() + b"\0" + path.read_bytes())
    return hashed.hexdigest()
