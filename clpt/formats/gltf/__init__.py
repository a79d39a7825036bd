"""glTF 2.0: `load(path)` returns the Scene of a .gltf or .glb; `save` writes it."""

from __future__ import annotations

import dataclasses
import math
from contextlib import suppress
from pathlib import Path
from typing import Any

from clpt.choices import Missing
from clpt.errors import SceneError, nearest
from clpt.formats import framing
from clpt.formats.gltf import (
    animation,
    cameras_lights,
    checks,
    export,
    geometry,
    materials,
    meshes,
    meshopt,
    nodes,
)
from clpt.formats.gltf.document import Document, Scale
from clpt.formats.meshes.mesh import MeshFile
from clpt.scene import Scene
from clpt.scene.shapes import Mesh

VARIABLES = (
    "time", "animation", "camera", "scene", "shutter", "variant", "lumens", "multiple_scattering",
)  # fmt: skip
SUPPORTED = (
    geometry.DRACO, *meshopt.EXTENSIONS, "KHR_mesh_quantization", "KHR_texture_transform",
    "EXT_texture_webp", cameras_lights.LIGHTS, meshes.INSTANCING, *materials.EXTENSIONS,
    animation.POINTER,
    "FB_ngon_encoding",  # says which triangles make a polygon: the picture is the same
)  # fmt: skip
VARIANTS = materials.VARIANTS
save = export.save

__all__ = ["load", "read_mesh", "save"]


def load(path: Path, missing: Missing = "error", /, **variables: Any) -> Scene:
    """Read a glTF file; a missing camera or light is added, as for a bare mesh.

    variables: `time` [s] of an animation (the first, or the `animation` of that number or name);
    without it nodes have their own transforms, and materials, lights and cameras their own numbers.
    `camera` and `scene` choose by number or name.
    `shutter` [s] is how long light comes to the film from `time` on, while nodes move.
    `variant` chooses among material variants. `lumens`: of a watt, see cameras_lights.py.
    `multiple_scattering`: 1 keeps the light that facets reflect to each other.
    missing: see clpt.load. Raises SceneError with the JSON path of the wrong value.
    """
    if "shutter" in variables:
        length = _seconds(path, variables.pop("shutter"), "shutter")
        if not 0.0 <= length < float("inf"):
            raise SceneError(f"the shutter {length:g} s must be from zero", file=path)
        time = _seconds(path, variables.pop("time", 0.0))
        if length > 0.0:
            return animation.scene_over_shutter(
                lambda t: _load(path, missing, {**variables, "time": t}), time, length
            )
        variables["time"] = time
    return _load(path, missing, variables)


def _load(path: Path, missing: Missing, variables: dict[str, Any]) -> Scene:
    document, graph = _open(path, variables, missing)
    chosen = cameras_lights.chosen_camera(graph, _text(variables.get("camera")))
    shapes = meshes.shapes(graph)
    if not shapes:
        document.warn("holds no triangles")
    scene = framing.show(
        shapes,
        camera=chosen[0] if chosen else None,
        own_lights=cameras_lights.lights_of(graph),
        file=path,
        lit=export.is_lit(document.root.value),
    )
    scene.warnings = document.warnings
    scene.extra["cameras"] = cameras_lights.camera_descriptions(graph)
    scene.extra["animations"] = animation.descriptions(document)
    scene.extra |= _provenance(document)
    film = dataclasses.replace(scene.film, display_exposure=document.scale.stops)
    if chosen:
        width, height = chosen[1]
        film = dataclasses.replace(film, width=width, height=height)
    scene.film = film
    return scene


def _provenance(document: Document) -> dict[str, Any]:
    """Return the names of several scenes, and who made the file, for people."""
    scenes = document.root.children("scenes")
    provenance: dict[str, Any] = {"scenes": [], "asset": {}}
    with suppress(SceneError):  # texts that are none harm no picture
        if len(scenes) > 1:
            provenance["scenes"] = [scene.text("name", str(i)) for i, scene in enumerate(scenes)]
    for key in ("generator", "copyright"):
        with suppress(SceneError):
            provenance["asset"] |= {key: document.root.needed("asset").text(key)}
    return provenance


def read_mesh(path: Path) -> MeshFile:
    """Return the meshes of a file as its scene shows them. Raises SceneError if there are none."""
    document, graph = _open(path, {})
    document.scale = Scale()  # the scene that shows the meshes has lights of its own
    shapes = meshes.shapes(graph, instances=False)
    if not shapes:
        raise SceneError("holds no triangles", file=path)
    return MeshFile([part for part in shapes if isinstance(part, Mesh)], document.warnings)


def _open(
    path: Path, variables: dict[str, Any], missing: Missing = "error"
) -> tuple[Document, nodes.Graph]:
    document = Document(path, missing)
    unknown = sorted(set(variables) - set(VARIABLES))
    if unknown:
        advice = nearest(unknown[0], VARIABLES)
        raise SceneError(f"glTF has no variable {unknown[0]!r}{advice}", file=path)
    document.multiple_scattering = _number(path, variables, "multiple_scattering", 0.0, 0.0, 1.0)
    document.variant = materials.chosen_variant(document, _text(variables.get("variant")))
    _check_extensions(document)
    checks.check(document)
    pose: nodes.Pose = {}
    if "time" in variables or "animation" in variables:
        chosen = _text(variables.get("animation"))
        pose = animation.pose(document, chosen, _seconds(path, variables.get("time", 0.0)))
    graph = nodes.graph(document, _text(variables.get("scene")), pose)
    lumens = cameras_lights.lumens_of(document)
    if "lumens" in variables:
        lumens = _number(path, variables, "lumens", 1.0, 1e-6, 1e6)
    document.scale = cameras_lights.scale_of(graph, lumens)
    return document, graph


def _check_extensions(document: Document) -> None:
    """Refuse unknown extensions that are required; warn of the others."""
    required = document.root.texts("extensionsRequired")
    for number, name in enumerate(required):
        if name not in (*SUPPORTED, VARIANTS):
            message = f"needs the extension {name}, which is not supported"
            raise document.root.error(message, f"extensionsRequired[{number}]")
    for name in [*document.root.texts("extensionsUsed"), *required]:
        if name == VARIANTS:
            if document.variant is None and (names := materials.variant_names(document)):
                known = ", ".join(map(str, names))
                document.warn(f"the default materials are shown; -D variant=NAME chooses: {known}")
        elif name not in SUPPORTED:
            document.warn(f"extension {name} is not supported and left out")


def _text(value: object) -> str | None:
    return None if value is None else str(value)


def _number(
    path: Path, variables: dict[str, Any], name: str, usual: float, low: float, high: float
) -> float:
    """A variable as a number within its limits. Raises SceneError."""
    value = variables.get(name, usual)
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not low <= number <= high:
        message = f"{name} must be a number from {low:g} to {high:g}, not {value!r}"
        raise SceneError(message, file=path)
    return number


def _seconds(path: Path, value: Any, name: str = "time") -> float:
    try:
        return float(value)
    except ValueError:
        raise SceneError(f"the {name} {value!r} is no number", file=path) from None
