"""Scenes in the XML of Mitsuba 2 and 3, in that of Mitsuba 0.3 to 0.6, and in that of Nori.

The version of the file decides: below 2 the words and defaults of Mitsuba 0.x hold. An unsupported
element or an unknown parameter is an error that names the element, the file and the line. In files
of Mitsuba 0.x, which nobody corrects, an unknown parameter or integrator gives a warning.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from clpt.choices import Missing
from clpt.files.disk_cache import OfFiles
from clpt.formats.mitsuba import dicts, nori, old_words, sensors
from clpt.formats.mitsuba.bsdfs import bsdf
from clpt.formats.mitsuba.emitters import emitter
from clpt.formats.mitsuba.grids import Bounds
from clpt.formats.mitsuba.properties import Context, Properties
from clpt.formats.mitsuba.sensors import sensor
from clpt.formats.mitsuba.shapes import MESH_CODE, shapes_of
from clpt.formats.mitsuba.spectra import texture
from clpt.formats.mitsuba.xml import Document, Element, parse
from clpt.formats.reading import attempt
from clpt.scene import Scene, integrators
from clpt.scene.integrators import Film, Integrator
from clpt.scene.lights import Light
from clpt.scene.media import Medium
from clpt.scene.shapes import Instance, Shape
from clpt.scene.studio import framing_camera, world_bounds

__all__ = ["load", "load_dict"]

# What may stand in the scene itself only for others to refer to.
REFERENCED = ("spectrum", "volume", "film", "sampler", "rfilter", "medium", "phase")


def load(path: Path, missing: Missing = "error", /, **variables: object) -> Scene:
    """Read a Mitsuba scene; `variables` stand for its `$names`; missing: see clpt.load.

    The variable `camera` chooses among several sensors by number or id, unless the file has a
    $camera of its own. Raises SceneError with file, line and element for anything broken or not
    supported.
    """
    document = parse(path, variables)
    if nori.is_nori(document.root):
        nori.rename(document.root)
        document.makes_normals = False
    if document.is_old:
        document.renamed = old_words.rename(document.root)
    document.meshes = OfFiles(MESH_CODE, f"meshes of {path.resolve()}")
    scene = _from_document(path, document, missing)
    document.meshes.store()
    return scene


def load_dict(scene: Mapping[str, Any], folder: Path, missing: Missing, /) -> Scene:
    """Make a scene of Mitsuba 3's dictionary; `folder`: of its file names; missing: see clpt.load.

    Raises SceneError with the names of the entry for anything broken or not supported.
    """
    root = dicts.tree(scene, folder)
    if root.tag != "scene":
        raise root.error("the outermost 'type' must be 'scene'")
    return _from_document(Path("dict"), Document(root, [folder]), missing)


def _from_document(path: Path, document: Document, missing: Missing) -> Scene:
    context = Context(document, missing)
    scene = _scene(path, document, context)
    if not context.endless:
        return scene
    rooms = {key: _room(medium, scene) for key, medium in context.endless.items()}
    return _scene(path, document, Context(document, missing, rooms))


def _room(medium: Medium, scene: Scene) -> Bounds:
    """The box that a medium fills: that of the shapes it is in, or of all if it is around them."""
    camera: Any = scene.camera
    around = camera.medium is medium or any(_is_around(item, medium) for item in scene.shapes)
    return world_bounds(
        [item for item in scene.shapes if around or any(p.interior is medium for p in _parts(item))]
    )


def _is_around(shape: Shape, medium: Medium) -> bool:
    return any(part.exterior is medium for part in _parts(shape))


def _parts(shape: Shape) -> tuple[Shape, ...]:
    return shape.group.shapes if isinstance(shape, Instance) else (shape,)


def _with_layers(film: Film, how: Integrator, props: Properties, context: Context) -> Film:
    """A film with the layers of the file's aovs, if the integrator can have any."""
    if context.layers and isinstance(how, integrators.HAVE_LAYERS):
        return replace(film, layers=(*context.layers,))
    if context.layers:
        context.warn(props.element, f"the integrator {how.kind} has no layers: aovs are left out")
    return film


def _scene(path: Path, document: Document, context: Context) -> Scene:
    props = Properties(document.root, context)
    shapes = shapes_of(props.objects("shape"), context)
    lights = _lights(props, context)
    for element in props.objects("bsdf"):
        bsdf(element, context)
    for element in _textures(props):
        texture(element, props)
    for tag in REFERENCED:
        props.objects(tag)
    integrator = props.object("integrator")
    all_sensors = _sensors(props, context)
    number = _chosen(all_sensors, document)
    first = None if number is None else all_sensors[number]
    if document.camera is None and len(all_sensors) > 1:
        names = ", ".join(item.name or str(i) for i, item in enumerate(all_sensors))
        context.warn(props.element, f"the first of several cameras is used; there are: {names}")
    props.finish()
    camera = framing_camera(shapes) if first is None else first.camera
    how = _integrator(integrator, context)
    film = sensors.default_film() if first is None else first.film
    return Scene(
        camera=camera,
        shapes=shapes,
        lights=lights,
        integrator=how,
        sampler=integrators.Sobol(),
        film=_with_layers(film, how, props, context),
        spp=4 if first is None else first.spp,
        seed=0 if first is None else first.seed,
        name=path.stem,
        warnings=[*context.warnings, *context.grouped()],
        extra={
            "format": "mitsuba",
            "variables": dict(document.variables),
            "cameras": [f"{item.camera.kind} {item.name}".strip() for item in all_sensors],
            "sampler": sensors.DEFAULT_SAMPLER if first is None else first.sampler,
        },
    )


def _lights(props: Properties, context: Context) -> list[Light]:
    lamps = [attempt(partial(emitter, e, context), None) for e in props.objects("emitter")]
    return [lamp for lamp in lamps if lamp is not None]


def _integrator(element: Element | None, context: Context) -> integrators.Integrator:
    default: Integrator = integrators.Path(max_depth=-1)
    if element is None:
        return default
    return attempt(lambda: sensors.integrator(element, context), default)


def _textures(props: Properties) -> list[Element]:
    """Take the textures that stand in the scene itself, for references."""
    named = [name for name, child in props.named.items() if child.tag == "texture"]
    return [child for name in named if (child := props.take(name)) is not None] + props.objects(
        "texture"
    )


def _sensors(props: Properties, context: Context) -> list[sensors.Sensor]:
    all_sensors: list[sensors.Sensor] = []
    for element in props.objects("sensor"):
        is_batch = element.type == "batch"
        if is_batch:
            all_sensors += attempt(partial(sensors.batch, element, context), [])
        else:
            all_sensors += attempt(partial(_one_sensor, element, context), [])
    if not all_sensors:
        context.warn(props.element, "has no sensor; a camera that sees everything is used")
    return all_sensors


def _one_sensor(element: Element, context: Context) -> list[sensors.Sensor]:
    return [sensor(element, context)]


def _chosen(all_sensors: Sequence[sensors.Sensor], document: Document) -> int | None:
    """Return the index of the sensor that is asked for, None where there is none.

    Raises SceneError where none has that number or id.
    """
    wanted = document.camera
    if wanted is None:
        return 0 if all_sensors else None
    for number, item in enumerate(all_sensors):
        if wanted in (str(number), item.name):
            return number
    names = ", ".join(item.name or str(i) for i, item in enumerate(all_sensors)) or "none"
    raise document.root.error(f"has no camera {wanted!r}; it has: {names}")
