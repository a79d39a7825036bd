"""The beginning of a session: a renderer is built, while the scene is shown in plain colours.

A path that ends at the first surface finds the colour and the normal there, and a lamp beside the
camera lights it. Its few kernels are the same for most scenes.
"""

from __future__ import annotations

import dataclasses
import logging
import operator
import threading
import time
from collections.abc import Callable, Iterable
from concurrent.futures import CancelledError, Future
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import images
from clpt.arrays import Bytes, Floats
from clpt.device import Device
from clpt.render.renderer import Renderer
from clpt.scene import Film, Scene
from clpt.scene.integrators import Path
from clpt.scene.materials import Diffuse, Material
from clpt.scene.params import fields_of, params
from clpt.scene.roles import REFLECTANCE
from clpt.scene.shapes import Group, Instance, Mesh, Shape
from clpt.scene.textures import Bitmap
from clpt.scene.values import is_texture
from clpt.spectra import Spectrum
from clpt.view.target import Change, Make, Target, Variant

PLAIN: dict[str, Any] = {"emission": None, "interior": None, "exterior": None, "priority": 0}
SAMPLES = 4  # of a pixel
LAYERS = ("albedo", "shading_normal")
LAMP = np.array([0.35, 0.5, -0.8])  # where it is in the camera's space: left, up, behind
SHADE = 0.3  # what is left where the lamp does not reach
BEHIND = 0.06  # radiance where there is no surface
SHINES, OTHER = 1.0, 0.5  # albedo of lamps, and of surfaces without a colour
SIDE = 64  # texels of an image along a side that its mean is of, about


def bare(shape: Shape, **more: object) -> Shape:
    """Return a shape without light and media; more: further fields to set."""
    fields = fields_of(shape)
    wanted = PLAIN | more
    changed = {name: value for name, value in wanted.items() if fields[name] is not value}
    return dataclasses.replace(shape, **changed) if changed else shape


def each(shapes: Iterable[Shape], change: Callable[[Shape], Shape | None]) -> list[Shape]:
    """Return the shapes as `change` returns them, without shapes that it returns None for.

    A group of several instances is changed once.
    """
    groups: dict[int, Group] = {}
    changed: list[Shape | None] = []
    for shape in shapes:
        if isinstance(shape, Instance):
            group = shape.group
            if id(group) not in groups:
                kept = tuple(inner for inner in map(change, group.shapes) if inner is not None)
                same = all(map(operator.is_, kept, group.shapes)) and len(kept) == len(group.shapes)
                groups[id(group)] = group if same else Group(shapes=kept, name=group.name)
            new = groups[id(group)]
            changed.append(shape if new is group else dataclasses.replace(shape, group=new))
        else:
            changed.append(change(shape))
    return [shape for shape in changed if shape is not None]


def solid(scene: Scene) -> Scene:
    """Return a scene with the shapes and the camera of `scene`, in plain colours.

    Null surfaces, as around a medium, are left out.
    """
    colours: dict[int, Diffuse] = {}
    lamp = _painted(np.full(3, SHINES))

    def paint(shape: Shape) -> Shape | None:
        material = shape.material
        if material.is_null:
            return None
        if shape.emission is None and id(material) not in colours:
            colours[id(material)] = _painted(colour(material))
        painted = colours[id(material)] if shape.emission is None else lamp
        return bare(shape, material=painted, **_without(shape))

    film = Film(
        width=scene.film.width, height=scene.film.height, crop=scene.film.crop, mode="rgb",
        layers=LAYERS,
    )  # fmt: skip
    return Scene(
        camera=dataclasses.replace(scene.camera, medium=None),
        shapes=each(scene.shapes, paint),
        film=film,
        integrator=Path(max_depth=1, light_paths=0),
        spp=SAMPLES,
    )


def shaded(renderer: Renderer) -> Bytes:
    """Return the picture of a solid scene for a screen, (h, w, 3) uint8."""
    layers = renderer.layers()
    albedo, normals = (layers[name].astype(np.float64) for name in LAYERS)
    turn = np.asarray(renderer.scene.camera.to_world, np.float64)[:3, :3]
    towards = turn @ LAMP
    towards /= np.linalg.norm(towards)
    lit = SHADE + (1.0 - SHADE) * np.abs(normals @ towards)[..., None]
    covered = np.linalg.norm(normals, axis=2, keepdims=True).clip(0.0, 1.0)
    return images.to_srgb8((albedo * lit + BEHIND * (1.0 - covered)).astype(np.float32))


def colour(part: Material) -> Floats:
    """Return the mean of the colours in a material, linear (3,)."""
    means = [_mean(value) for value in _colours(part)]
    return np.mean(means, axis=0) if means else np.full(3, OTHER)


def _colours(part: Material) -> list[Any]:
    """Return the first colour of each material in a material."""
    inner = part.shared_parts.values()
    if inner:
        return [part_colour for material in inner for part_colour in _colours(material)]
    fields = fields_of(part)
    reflectances = [
        fields[name] for name, param in params(type(part)).items() if param.role is REFLECTANCE
    ]
    return reflectances[:1]


def _mean(value: object) -> Floats:
    """Return the mean colour of a spectrum or a texture."""
    if isinstance(value, Spectrum):
        return np.asarray(value.to_rgb("reflectance"), np.float64)
    if isinstance(value, Bitmap):
        mean = value.pixels(REFLECTANCE, side=SIDE).mean(axis=(0, 1), dtype=np.float64)
        return np.broadcast_to(mean, 3)
    fields = fields_of(value).values() if is_texture(value) else ()
    inner = [part for part in fields if isinstance(part, Spectrum) or is_texture(part)]
    return np.mean([_mean(part) for part in inner], axis=0) if inner else np.full(3, OTHER)


def _painted(rgb: NDArray[Any]) -> Diffuse:
    return Diffuse(reflectance=tuple(np.clip(rgb, 0.0, 1.0).tolist()))


def _without(shape: Shape) -> dict[str, Any]:
    """Return the fields of a mesh that only textures need, as they are without them."""
    if not isinstance(shape, Mesh) or shape.displacement is not None:
        return {}
    return {"uvs": None, "tangents": None, "attributes": {}}


log = logging.getLogger(__name__)

PATIENCE = 0.4  # [s]


class Making:
    """Makes a renderer in a separate thread, which waits before it compiles anything new.

    device: of the renderer; make: returns it.
    """

    def __init__(self, device: Device, make: Callable[[], Renderer]):
        self._builds, self._make = device.builds, make
        self._news = threading.Condition()
        self._is_new = self._goes_on = self._is_given_up = False
        self._result: Future[Renderer] = Future()
        self._result.add_done_callback(lambda _: self._tell())
        self._builds.on_new = self._wait_to_compile
        threading.Thread(target=self._main, name="clpt view programs", daemon=True).start()

    @property
    def is_done(self) -> bool:
        """Whether the renderer is made, or cannot be."""
        return self._result.done()

    @property
    def is_new(self) -> bool:
        """Whether there is something to compile that no cache has."""
        return self._is_new

    def wait(self, seconds: float) -> None:
        """Wait until it is done, or waits itself, but no longer than this."""
        with self._news:
            self._news.wait_for(
                lambda: self.is_done or (self._is_new and not self._goes_on), seconds
            )

    def go_on(self) -> None:
        """Let the thread compile."""
        with self._news:
            self._goes_on = True
            self._news.notify_all()

    def renderer(self) -> Renderer:
        """Return the renderer; wait for it. Raises what making it has raised."""
        self.go_on()
        return self._result.result()

    def give_up(self) -> None:
        """Let the thread end soon, wait for that, and close its renderer."""
        self._is_given_up = True
        self.go_on()
        if self._result.exception() is None:
            self._result.result().close()

    def _main(self) -> None:
        try:
            renderer = self._make()
        except BaseException as error:
            self._end()
            self._result.set_exception(error)
        else:
            self._end()
            self._result.set_result(renderer)

    def _end(self) -> None:
        self._builds.on_new = lambda: None

    def _tell(self) -> None:
        with self._news:
            self._news.notify_all()

    def _wait_to_compile(self) -> None:
        """Wait in a thread that would compile. Raises CancelledError once it is given up."""
        with self._news:
            self._is_new = True
            self._news.notify_all()
            self._news.wait_for(lambda: self._goes_on)
        if self._is_given_up:
            raise CancelledError


class Beginning:
    """Makes the first renderer of a session, and pictures of a solid scene until it is there.

    make: makes the renderer of `variant` of the scene, on the device. There are pictures of the
    solid scene where programs are in no cache, or where the scene takes longer than PATIENCE.
    """

    def __init__(self, device: Device, make: Make, variant: Variant, scene: Scene):
        self.variant = variant
        # Nobody waits for these programs.
        unhurried = Device.open(device.info, context=device.context)
        unhurried.compilers, unhurried.hurries = device.compilers, True
        small = partial(Renderer, device=unhurried, tree_quality="fast")
        self._solid = Target(small, lambda scene: solid(variant(scene)))
        self._making = Making(device, lambda: make(variant(scene)))
        self._fails, self._began = False, time.monotonic()

    def note(self, change: Change) -> None:
        """Note that the scene has changed; no camera of a solid scene is in a medium."""
        camera = change.camera and dataclasses.replace(change.camera, medium=None)
        self._solid.note(dataclasses.replace(change, camera=camera))

    @property
    def is_over(self) -> bool:
        """Whether the renderer is made, or cannot be."""
        return self._making.is_done

    def wait(self, seconds: float) -> None:
        """Wait until there is something to do, but no longer than this."""
        self._making.wait(seconds)

    def show(self, scene: Scene, offer: Callable[[Bytes], None]) -> None:
        """Offer a picture of the solid scene if the real picture takes long.

        Kernels are compiled only after the first picture.
        """
        soon = not self._making.is_new and time.monotonic() - self._began < PATIENCE
        if soon or self._fails:
            return
        try:
            renderer = self._solid.follow(scene)
            renderer.reset()
            renderer.run(SAMPLES)
            if not self.is_over:
                offer(shaded(renderer))
        except Exception:  # the scene's own renderer tells what is wrong
            log.debug("the scene is not shown in plain colours", exc_info=True)
            self._fails = True
        self._making.go_on()

    def renderer(self) -> Renderer:
        """Return the renderer; wait for it. Raises what making it has raised."""
        self._solid.close()
        return self._making.renderer()

    def close(self) -> None:
        """Give up, and give the device's memory back."""
        self._making.give_up()
        self._solid.close()
