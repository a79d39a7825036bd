"""Whether a scene is made of what it should be; values are checked where each is declared."""

from __future__ import annotations

from typing import NoReturn

from clpt.errors import SceneError
from clpt.geometry import shapes
from clpt.geometry.instancing import distinct
from clpt.geometry.motion import Motions
from clpt.geometry.motion import check as check_motion
from clpt.render.analysis.bodies import check_bodies
from clpt.render.analysis.cameras import CONNECTED, dispersive_glasses
from clpt.scene import Scene
from clpt.scene import materials as mt
from clpt.scene.cameras import Camera
from clpt.scene.integrators import (
    HAVE_LAYERS,
    Film,
    Filter,
    Integrator,
    ParticleTracer,
    Sampler,
    Vcm,
)
from clpt.scene.layers import LAYERS
from clpt.scene.lights import ON_SHAPES, DirectionalArea, Light, Point
from clpt.scene.materials import Material
from clpt.scene.media import Medium
from clpt.scene.params import fields_of
from clpt.scene.shapes import Instance, Shape

WITH_AXIS = ("perspective", "thin_lens", "orthographic")
LARGEST = 1 << 26  # pixels of a film; its tiles are divided in float32, see kernels/film/film.cl


def check(scene: Scene) -> None:
    """Raise SceneError for an entry of a scene that is of the wrong kind, or a film too large."""
    for given, base, name in (
        (scene.camera, Camera, "camera"), (scene.integrator, Integrator, "integrator"),
        (scene.sampler, Sampler, "sampler"), (scene.film, Film, "film"),
    ):  # fmt: skip
        _check_kind(given, base, name)
    _check_kind(scene.film.filter, Filter, "film.filter")
    if isinstance(scene.seed, bool) or not isinstance(scene.seed, int):
        raise SceneError(f"must be a whole number, not {scene.seed!r}", where="seed")
    for i, light in enumerate(scene.lights):
        _check_kind(light, Light, f"lights[{i}]")
    for i, shape in enumerate(scene.shapes):
        _check_kind(shape, Shape, f"shapes[{i}]")
    shapes_ = list(distinct(scene.shapes))
    for shape in shapes_:
        if not isinstance(shape.emission, (*ON_SHAPES, type(None))):
            names = " or ".join(f"`{cls.kind}`" for cls in ON_SHAPES)
            raise SceneError(f"its emission must be {names}", where=shapes.where(shape))
    if scene.film.mode == "rgb":
        asks = {"sensor": scene.film.sensor != "cie1931", "bands": scene.film.bands != 0}
        for name in (name for name, asked in asks.items() if asked):
            raise SceneError("needs the mode spectral", where=f"film.{name}")
    width, height = scene.film.size
    if width * height > LARGEST:
        raise SceneError(f"{width}x{height} are more than {LARGEST >> 20} Mi pixels", where="film")
    if scene.film.layers and not isinstance(scene.integrator, HAVE_LAYERS):
        names = ", ".join(cls.kind for cls in HAVE_LAYERS)
        raise SceneError(f"only the integrators {names} have layers", where="film.layers")
    if scene.camera.kind not in WITH_AXIS:
        for name, instead in (("z", ": ask for depth"), ("motion", "")):
            if name in scene.film.layers:
                message = f"the camera {scene.camera.kind} has no axis for {name}{instead}"
                raise SceneError(message, where="film.layers")
    _check_light_layers(scene)
    _check_light_paths(scene, shapes_)
    check_motion(scene, Motions.of(scene))
    check_bodies([*shapes_, *(one for one in scene.shapes if isinstance(one, Instance))])


def _check_light_layers(scene: Scene) -> None:
    """Raise SceneError for layers of light that the integrator or the filter cannot make."""
    names = [name for name in scene.film.layers if LAYERS[name].form == "light"]
    if not names:
        return
    how = scene.integrator
    if isinstance(how, Vcm) and how.merging and "light_groups" in names:
        message = "photons do not know their group: leave light_groups out, or vcm.merging"
        raise SceneError(message, where="film.layers")
    if scene.film.filtering == "splatting":
        message = f'{names[0]} needs samples that serve one pixel: leave it out, or "importance"'
        raise SceneError(message, where="film.filtering")


def _check_light_paths(scene: Scene, shapes_: list[Shape]) -> None:
    """Raise SceneError for what only paths from lights can do, and for what they cannot."""
    if not isinstance(scene.integrator, ParticleTracer):
        for shape in shapes_:
            if isinstance(shape.emission, DirectionalArea):
                raise SceneError(
                    "only the integrator particle_tracer finds a directional_area light, "
                    f"not {scene.integrator.kind}",
                    where=shapes.where(shape),
                )
        return
    spectral = scene.film.mode == "spectral"
    if scene.camera.kind not in CONNECTED:
        names = " and ".join(CONNECTED)
        _refuse(f"the cameras {names}, not {scene.camera.kind}", "camera")
    if scene.film.alpha:
        _refuse("a film without alpha", "film.alpha")
    if spectral and dispersive_glasses(scene.camera):
        _refuse("a lens whose glass does not disperse", "camera.glass")
    for i, light in enumerate(scene.lights):
        if isinstance(light, Point) and not light.falloff:
            _refuse("a point light whose irradiance falls with distance", f"lights[{i}]")
    for shape in shapes_:
        if spectral and _has(shape.material, "fluoresces"):
            _refuse("materials that keep the wavelength", shapes.where(shape))
        inside = (shape.interior, shape.exterior)
        if spectral and any(_gives_other_light(medium) for medium in inside):
            _refuse("media that keep the wavelength", shapes.where(shape))
        if _has(shape.material, "no_back"):
            _refuse("materials that are reciprocal, which hair is not", shapes.where(shape))


def _refuse(needed: str, where: str) -> NoReturn:
    raise SceneError(f"particle_tracer needs {needed}", where=where)


def _gives_other_light(medium: Medium | None) -> bool:
    """Whether a medium gives light other wavelengths."""
    phases = () if medium is None else medium.collisions(True)
    return any(one.fluoresces for phase in phases for one in phase.leaves)


def _has(material: mt.Material, trait: str) -> bool:
    """Whether a material, or one inside it, has a trait of its class."""
    parts = fields_of(material).values()
    return getattr(material, trait, False) or any(
        _has(part, trait) for part in parts if isinstance(part, Material)
    )


def _check_kind(value: object, base: type, where: str) -> None:
    if not isinstance(value, base):
        wanted = base.__name__.lower()
        raise SceneError(f"must be of a kind of {wanted}, not {value!r}", where=where)
