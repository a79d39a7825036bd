"""`clpt.render`: from a scene or a file to a picture."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from clpt import device as dev
from clpt import formats
from clpt.arrays import Image, is_number, is_whole, plain
from clpt.errors import SceneError
from clpt.render.film_renderer import OnProgress, checked_samples
from clpt.render.options import RenderOptions, check_names, check_scene
from clpt.render.renderer import Renderer
from clpt.scene import Film, Scene, viewpoint
from clpt.scene.cameras import Camera

if TYPE_CHECKING:
    from typing_extensions import Unpack

CameraLike = Camera | Sequence[float] | NDArray[Any] | str | int
SHOWN, SHOWN_SAMPLES = 400, 32  # pixels a side and samples of a scene's picture in notebooks
ORBIT = "(azimuth, elevation), such as (45, 20), or with a distance, in those that frame the scene"


class PictureOptions(RenderOptions, total=False):
    """Named arguments of `clpt.render`: those of `RenderOptions`, and changes of the scene.

    size: (width, height) of the picture [pixels].
    mode: "spectral" or "rgb".
    camera: a camera; (azimuth, elevation) in degrees, or with a distance, of a camera that frames
    the whole scene; or the name or number of a camera in a file with several.
    env: an image that surrounds the scene, in place of its sky and of the light of the studio.

    What is left out, or None, is as the scene has it.
    """

    size: tuple[int, int] | None
    mode: str | None
    camera: CameraLike | None
    env: str | os.PathLike[str] | None


# `spp` and others are arguments of `render` itself; they stand here for messages.
OPTIONS = (*PictureOptions.__annotations__, "spp", "noise", "device", "progress")


def render(
    scene: Scene | str | os.PathLike[str],
    spp: int | None = None,
    *,
    noise: float | None = None,
    device: dev.Device | str | int | None = None,
    progress: OnProgress | None = None,
    **options: Unpack[PictureOptions],
) -> Image:
    """Render a scene or a file: (h, w, 3) float32 linear Rec. 709; else see `Renderer.image`.

    scene: a `Scene`, or the path of a file or a folder, as `clpt.load` takes it.
    spp: samples per pixel, by default the scene's own.
    noise: leave pixels as soon as they have as little noise, such as 0.02; see `Renderer.run`.
    device, progress: see `Renderer` and `Renderer.run`.
    options: size=(width, height), mode, camera, env: see `PictureOptions`; and `RenderOptions`;
    with `denoise` the picture is denoised.

    Raises as `clpt.load` and `Renderer` do.
    """
    if isinstance(scene, (str, os.PathLike)):
        scene = _loaded(Path(scene), options)
    check_scene(scene)
    check_names(scene, options, OPTIONS)
    size, mode = options.pop("size", None), options.pop("mode", None)
    camera, env = options.pop("camera", None), options.pop("env", None)
    if env is not None:
        scene = viewpoint.surrounded(scene, os.fspath(formats.brought(env)))
    spp = checked_samples(scene.spp if spp is None else spp)
    scene = dataclasses.replace(
        scene,
        camera=scene.camera if camera is None else _camera(scene, camera),
        film=_film(scene.film, size, mode),
        spp=spp,
        noise=scene.noise if noise is None else noise,
    )
    renderer = Renderer(scene, device, **cast("RenderOptions", options))
    renderer.run(spp, progress, noise=scene.noise)
    return renderer.image() if renderer.denoise is None else renderer.denoised()


def _loaded(file: Path, options: PictureOptions) -> Scene:
    """Return the scene of a file, with the camera whose name or number is taken from options."""
    camera = options.get("camera")
    if not isinstance(camera, str) and not is_whole(camera):
        return formats.load(file)
    del options["camera"]
    return formats.load(file, camera=plain(camera))


def small_picture(scene: Scene) -> bytes:
    """Return a picture of a scene as PNG, of at most SHOWN pixels a side and few samples.

    Raises as `Renderer` does.
    """
    width, height = scene.film.size
    shrunk = max(1.0, max(width, height) / SHOWN)
    size = max(round(width / shrunk), 1), max(round(height / shrunk), 1)
    film = dataclasses.replace(
        scene.film,
        width=size[0],
        height=size[1],
        crop=None,
        bands=0,
        time_bins=0,
        layers=(),
        alpha=False,
    )
    shown = dataclasses.replace(scene, film=film, noise=None)
    with Renderer(shown) as renderer:
        renderer.run(min(scene.spp, SHOWN_SAMPLES))
        return renderer._repr_png_()


def _film(film: Film, size: tuple[int, int] | None, mode: str | None) -> Film:
    """Return a film with another size or mode; a crop may not fit another size."""
    film = film if mode is None else dataclasses.replace(film, mode=mode)
    if size is None:
        return film
    asked = Film(size=size)
    return dataclasses.replace(film, width=asked.width, height=asked.height, crop=None)


def _camera(scene: Scene, camera: CameraLike) -> Camera:
    """Return the camera that is meant. Raises SceneError."""
    if isinstance(camera, Camera):
        return camera
    listed = isinstance(camera, (list, tuple)) or (isinstance(camera, np.ndarray) and camera.ndim)
    numbers = tuple(map(plain, camera)) if listed else ()  # type: ignore[arg-type]
    if not 2 <= len(numbers) <= 3 or not all(map(is_number, numbers)):
        of_file = "; a name or a number is for files with several cameras"
        message = f"must be a camera or {ORBIT}, not {camera!r}{of_file}"
        raise SceneError(message, where="camera")
    return viewpoint.orbiting(scene, *numbers)
