"""From a scene or a file to a picture in one call."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from clpt import device as dev
from clpt import formats
from clpt.arrays import Image
from clpt.errors import SceneError
from clpt.render.film_renderer import checked_samples
from clpt.render.options import RenderOptions, check_scene
from clpt.render.progress import Progress
from clpt.render.renderer import Renderer
from clpt.scene import Scene, viewpoint
from clpt.scene.cameras import Camera

if TYPE_CHECKING:
    from typing_extensions import Unpack

CameraLike = Camera | Sequence[float] | str | int
ORBIT = "(azimuth, elevation), such as (45, 20), or with a distance, in those that frame the scene"


def render(
    scene: Scene | str | os.PathLike[str],
    spp: int | None = None,
    *,
    size: tuple[int, int] | None = None,
    mode: str | None = None,
    camera: CameraLike | None = None,
    env: str | os.PathLike[str] | None = None,
    noise: float | None = None,
    device: dev.Device | str | int | None = None,
    progress: Callable[[Progress], bool | None] | None = None,
    **options: Unpack[RenderOptions],
) -> Image:
    """Render a scene: (h, w, 3) float32 linear Rec. 709; else see `Renderer.image`.

    scene: a `Scene`, or the path of a file or a folder, as `clpt.load` takes it.
    spp: samples per pixel, by default the scene's own.
    size: (width, height) of the picture [pixels], by default the scene's own.
    mode: "spectral" or "rgb", by default the scene's own.
    camera: another one: a camera; (azimuth, elevation) in degrees, or with a distance, from which
    the whole scene is seen; or, of a file with several, its name or number.
    env: an image that surrounds the scene, in place of its sky and of the light of the studio.
    noise: leave pixels as soon as they have as little noise, such as 0.02; see `Renderer.run`.
    device, progress: see `Renderer` and `Renderer.run`. options: see `RenderOptions`; with
    `denoise` the picture is denoised.

    Raises as `clpt.load` and `Renderer` do.
    """
    if isinstance(scene, (str, os.PathLike)):
        chosen = {"camera": camera} if isinstance(camera, (str, int)) else {}
        scene = formats.load(scene, **chosen)
        camera = None if chosen else camera
    check_scene(scene)
    if env is not None:
        scene = viewpoint.surrounded(scene, os.fspath(env))
    changes: dict[str, Any] = {"film": _film(scene, size, mode)}
    if camera is not None:
        changes["camera"] = _camera(scene, camera)
    if noise is not None:
        changes["noise"] = noise
    changes["spp"] = spp = checked_samples(scene.spp if spp is None else spp)
    scene = dataclasses.replace(scene, **changes)
    renderer = Renderer(scene, device, **options)
    renderer.run(spp, progress, noise=scene.noise)
    return renderer.image() if renderer.denoise is None else renderer.denoised()


def _film(scene: Scene, size: tuple[int, int] | None, mode: str | None) -> Any:
    """Return the film of a scene with another size or mode; a crop may not fit another size."""
    changes: dict[str, Any] = {} if mode is None else {"mode": mode}
    if size is not None:
        try:
            width, height = size
        except (TypeError, ValueError):
            raise SceneError(f"must be (width, height), not {size!r}", where="size") from None
        changes |= {"width": width, "height": height, "crop": None}
    return dataclasses.replace(scene.film, **changes) if changes else scene.film


def _camera(scene: Scene, camera: CameraLike) -> Camera:
    """Return the camera that is meant. Raises SceneError."""
    if isinstance(camera, Camera):
        return camera
    numbers = () if isinstance(camera, (str, int)) else tuple(camera)
    if not 2 <= len(numbers) <= 3 or not all(isinstance(n, (int, float)) for n in numbers):
        of_file = "; a name or a number is for files with several cameras"
        message = f"must be a camera or {ORBIT}, not {camera!r}{of_file}"
        raise SceneError(message, where="camera")
    return viewpoint.orbiting(scene, *numbers)
