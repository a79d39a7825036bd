"""The contents of a pixel: its first hit, and its spectrum with the remaining error.

A probe has renderers of a film of a single pixel, and a separate thread and queue: it works while
the picture goes on. Its camera sees that pixel alone.
"""

from __future__ import annotations

import dataclasses
import threading
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.device import Device
from clpt.render.renderer import Renderer
from clpt.scene import Scene
from clpt.scene.integrators import Box, Integrator, Path, shared
from clpt.view.beginning import bare, each
from clpt.view.messages import Reply, answering

BANDS = 47  # of 10 nm, of all light
BATCH = 256  # samples
BATCHES = (4, 8, 16, 32, 64)  # after which a spectrum is told, each time with less error
LAYERS = ("depth", "position", "shading_normal", "uv", "albedo", "shape_id", "primitive_id")
NARROW = 0.01  # pixels around the centre that a hit is looked for in


def pixel_of(scene: Scene, x: int, y: int, bands: int, integrator: Integrator) -> Scene:
    """Return a scene that shows the pixel (x, y) of `scene` alone."""
    camera = scene.camera.pixel_camera(scene.film.width, scene.film.height, x, y)
    size: dict[str, Any] = {"width": 1, "height": 1, "crop": None}
    if camera is None:
        camera, size = scene.camera, {"crop": (x, y, 1, 1)}
    film = dataclasses.replace(scene.film, **size, bands=bands, alpha=False, filtering="importance")
    return dataclasses.replace(scene, camera=camera, film=film, integrator=integrator, noise=None)


def plain(integrator: Integrator) -> tuple[Integrator, str]:
    """Return an integrator that renders a single pixel well, and a remark if it is another."""
    starts_at_lights = integrator.light_paths != 0 or integrator.from_lights_alone
    if not (starts_at_lights or integrator.asks_photons):
        return integrator, ""
    path = Path(light_paths=0)
    path = dataclasses.replace(path, **shared(integrator, path))
    return path, "by paths from the camera alone"


def _differ_by_camera(former: Scene, scene: Scene) -> bool:
    """Whether all but the cameras of two scenes are the same objects."""
    parts = [
        (each.shapes, each.lights, each.film, each.integrator, each.sampler, each.seed)
        for each in (former, scene)
    ]
    return all(old is new for old, new in zip(*parts, strict=True))


class Follower:
    """A renderer of a single pixel, of the scene that it is asked for next."""

    def __init__(self, device: Device):
        self.device = device
        self.renderer: Renderer | None = None
        self._former: Scene | None = None

    def follow(self, whole: Scene, pixel: Scene) -> Renderer:
        """Return the renderer, with an empty film, of a pixel of a whole scene."""
        former, self._former = self._former, whole
        try:
            if self.renderer is None or _frame(self.renderer.scene) != _frame(pixel):
                self.close()
                self.renderer = Renderer(pixel, self.device)
            elif former is not None and _differ_by_camera(former, whole):
                self.renderer.update(camera=pixel.camera)
            else:
                self.renderer.update(scene=pixel)
        except BaseException:
            self.close()
            raise
        return self.renderer

    def close(self) -> None:
        """Give the device's memory back."""
        if self.renderer is not None:
            self.renderer.close()
            self.renderer = None


def _frame(scene: Scene) -> tuple[Any, ...]:
    """Return the settings that a renderer cannot change: its film's form and its integrator."""
    film = scene.film
    return film.width, film.height, film.crop, film.bands, film.mode, type(scene.integrator)


@dataclasses.dataclass(frozen=True)
class Question:
    """A question about a pixel of a scene; then: gets the first hit, if it is given."""

    scene: Scene
    x: int
    y: int
    reply: Reply
    spectrum: bool = True
    then: Reply | None = None


class Probe:
    """Answers questions in a separate thread; a new question ends the work on an older question."""

    def __init__(self, device: Device):
        self._device = device
        self._hits: Follower | None = None
        self._spectra: Follower | None = None
        self._waiting: dict[bool, Question] = {}  # by whether somebody acts on the hit
        self._wake = threading.Condition()
        self._closing = False
        self._thread = threading.Thread(target=self._main, name="clpt view probe", daemon=True)
        self._thread.start()

    def ask(self, question: Question) -> None:
        """Queue a question; it replaces a queued question of the same sort."""
        with self._wake:
            self._waiting[question.then is not None] = question
            self._wake.notify_all()

    def close(self) -> None:
        """Stop, and give the device's memory back."""
        with self._wake:
            self._closing = True
            self._wake.notify_all()
        self._thread.join()

    def _main(self) -> None:
        while True:
            with self._wake:
                while not self._waiting and not self._closing:
                    self._wake.wait()
                if self._closing:
                    break
                question = self._waiting.pop(True, None) or self._waiting.pop(False)
            with answering(question.reply, "the pixel: "):
                try:
                    self._answer(question)
                except BaseException:
                    self._close_followers()
                    raise
        self._close_followers()

    def _close_followers(self) -> None:
        for follower in (self._hits, self._spectra):
            if follower is not None:
                follower.close()

    def _answer(self, question: Question) -> None:
        if self._hits is None:
            device = Device.open(self._device.info, context=self._device.context)
            device.compilers = (
                self._device.compilers
            )  # else the picture waits for the driver's lock
            self._hits, self._spectra = Follower(device), Follower(device)
        scene, x, y = question.scene, question.x, question.y
        hit = first_hit(self._hits, scene, x, y)
        if question.then is not None:
            question.then(hit)
            return
        at = {"x": x, "y": y}
        question.reply({"type": "hit", **at, **hit})
        if not question.spectrum or scene.film.mode != "spectral":
            return
        integrator, note = plain(scene.integrator)
        assert self._spectra is not None
        renderer = self._spectra.follow(scene, pixel_of(scene, x, y, BANDS, integrator))
        centres = renderer.scene.film.band_centres.round(2).tolist()
        means: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []
        before: Any = (0.0, 0.0)
        for batch in range(1, BATCHES[-1] + 1):
            if self._waiting or self._closing:
                return
            renderer.run(BATCH)
            total = tuple(
                np.asarray(picture, float).ravel() * batch
                for picture in (renderer.image(), renderer.colours())
            )
            means.append((total[0] - before[0], total[1] - before[1]))
            before = total
            if batch in BATCHES:
                question.reply(
                    {
                        "type": "spectrum", **at, "lambdas": centres, "note": note,
                        "samples": batch * BATCH, "last": batch == BATCHES[-1],
                        **_estimate("", [m[0] for m in means]),
                        **_estimate("rgb_", [m[1] for m in means]),
                    }
                )  # fmt: skip


def first_hit(follower: Follower, scene: Scene, x: int, y: int) -> dict[str, Any]:
    """Return what a pixel's centre meets: depth and position [m], normal, uv, albedo, numbers."""
    renderer = follower.follow(scene, surfaces_of(scene, x, y))
    renderer.run(1)
    layers = {name: values[0, 0].tolist() for name, values in renderer.layers().items()}
    shape = round(layers.pop("shape_id")[0])
    primitive = round(layers.pop("primitive_id")[0])
    if shape < 0:
        return {"shape": None}
    layers["depth"] = layers["depth"][0]
    return {"shape": shape, "primitive": primitive, **layers}


def surfaces_of(scene: Scene, x: int, y: int) -> Scene:
    """Return a scene that shows the surface at a pixel's centre, with neither light nor media."""
    pixel = pixel_of(scene, x, y, 0, Path(max_depth=1, light_paths=0))
    middle = Box(radius=NARROW)
    film = dataclasses.replace(
        pixel.film, mode="rgb", sensor="cie1931", filter=middle, layers=LAYERS
    )
    camera = dataclasses.replace(pixel.camera, medium=None)
    return dataclasses.replace(
        pixel, camera=camera, shapes=each(scene.shapes, bare), lights=[], film=film
    )


def _estimate(name: str, batches: list[NDArray[np.float64]]) -> dict[str, list[float]]:
    """Return the mean of batches and its standard error, by their differences."""
    values = np.stack(batches)
    error = values.std(axis=0, ddof=1) / np.sqrt(len(values))
    return {f"{name}mean": values.mean(axis=0).tolist(), f"{name}error": error.tolist()}
