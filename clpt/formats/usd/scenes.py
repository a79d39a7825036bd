"""Stages as scenes."""

from __future__ import annotations

import dataclasses
import math
import os
import re
from contextlib import suppress
from pathlib import Path
from typing import Any

from pxr import Ar, Gf, Sdf, Tf, Usd, UsdSkel, UsdUtils, Vt  # noqa: F401  all are loaded at one time

from clpt.errors import SceneError, nearest
from clpt.files import budget, input_files
from clpt.formats import framing
from clpt.formats.gltf import animation
from clpt.formats.usd import cameras, gprims, lights, materials
from clpt.formats.usd.document import Document
from clpt.scene import Scene
from clpt.scene.lights import Light

VARIABLES = ("camera", "time", "shutter", "variant", "subdivision")
MOST_LEVELS = 6  # of subdivision
PLACED = re.compile(r"In <(.*?)>: (.*?)(?: introduced by | \(|\n|$)", re.DOTALL)


def load(path: Path, /, **variables: Any) -> Scene:
    """Read a stage; a camera or light that it lacks is added, as for a bare mesh.

    variables: `camera` is the name, the prim path or the number of one of several. `time` is a time
    code, by default the stage's first. `shutter`: time codes from `time` on for which light comes
    to the film, by default as the camera says. `variant`: SET=NAME, several with commas between.
    `subdivision`: levels of subdivision surfaces. Raises SceneError with the prim path of what is
    wrong.
    """
    unknown = sorted(set(variables) - set(VARIABLES))
    if unknown:
        advice = nearest(unknown[0], VARIABLES)
        raise SceneError(f"USD has no variable {unknown[0]!r}{advice}", file=path)
    delegate = UsdUtils.CoalescingDiagnosticDelegate()  # OpenUSD's own messages go here
    stage = _opened(path)
    _select(path, stage, str(variables.get("variant", "")))
    level = variables.get("subdivision")
    document = Document(
        path,
        stage,
        _first_time(stage) if "time" not in variables else _number(path, variables, "time"),
        None if level is None else int(_number(path, variables, "subdivision", 0, MOST_LEVELS)),
    )
    scene = _over_shutter(document, variables)
    for entry in delegate.TakeUncoalescedDiagnostics():
        placed = PLACED.match(entry.commentary)
        text = placed[2] if placed else entry.commentary.splitlines()[0]
        document.warn(text, placed[1] if placed else "OpenUSD")
    scene.warnings = document.warnings() + scene.warnings
    return scene


def _number(
    path: Path, variables: dict[str, Any], name: str, low: float = -1e9, high: float = 1e9
) -> float:
    """Return a variable that is a number within its limits. Raises SceneError for another."""
    try:
        number = float(variables[name])
    except (TypeError, ValueError):
        number = math.nan
    if not low <= number <= high:
        message = f"{name} must be a number from {low:g} to {high:g}, not {variables[name]!r}"
        raise SceneError(message, file=path)
    return number


def _first_time(stage: Usd.Stage) -> float:
    """Return the first time code of a stage, or that of its first sample."""
    if stage.HasAuthoredTimeCodeRange():
        return float(stage.GetStartTimeCode())
    samples = [layer.ListAllTimeSamples() for layer in stage.GetUsedLayers()]
    return float(min((times[0] for times in samples if times), default=0.0))


def _over_shutter(document: Document, variables: dict[str, Any]) -> Scene:
    """Return the scene, whose prims move while the shutter is open."""
    stage, time = document.stage, document.code
    scene = _scene(document, variables)
    opening, length = scene.extra.pop("shutter")
    if "shutter" in variables:
        opening, length = 0.0, _number(document.file, variables, "shutter", 0.0)
    if not length > 0.0 or not _moves(stage):
        return scene
    rate = stage.GetTimeCodesPerSecond()

    def at(seconds: float) -> Scene:
        document.set_time(seconds * rate)
        posed = _scene(document, variables)
        del posed.extra["shutter"]
        return posed

    return animation.scene_over_shutter(at, (time + opening) / rate, length / rate)


def _moves(stage: Usd.Stage) -> bool:
    """Whether a layer has samples of several times; a value of one sample never changes."""
    return any(len(layer.ListAllTimeSamples()) > 1 for layer in stage.GetUsedLayers())


def _select(path: Path, stage: Usd.Stage, variants: str) -> None:
    """Select variants on all prims that have them. Raises SceneError for those of no prim."""
    for choice in filter(None, variants.split(",")):
        name, equals, wanted = choice.strip().partition("=")
        if not equals:
            message = f"a variant is SET=NAME, not {choice!r}; the stage has {_variants(stage)}"
            raise SceneError(message, file=path)
        known = False
        for prim in stage.TraverseAll():
            selection = prim.GetVariantSets().GetVariantSet(name)
            if wanted in selection.GetVariantNames():
                known = True
                with Usd.EditContext(stage, stage.GetSessionLayer()):
                    selection.SetVariantSelection(wanted)
        if not known:
            message = f"has no variant {choice.strip()!r}; it has {_variants(stage)}"
            raise SceneError(message, file=path)


def _variants(stage: Usd.Stage) -> str:
    """Return the variants of a stage, for people."""
    known = {
        f"{name}={variant}"
        for prim in stage.TraverseAll()
        if prim.HasVariantSets()
        for name in prim.GetVariantSets().GetNames()
        for variant in prim.GetVariantSet(name).GetVariantNames()
    }
    return ", ".join(sorted(known)) or "none"


def _opened(path: Path) -> Usd.Stage:
    """Return a file's stage. Raises SceneError."""
    input_files.checked(path)
    try:
        layers = _layers(path)
        stage = Usd.Stage.Open(layers[0])
    except Tf.ErrorException as error:
        message = f"is no USD file that can be read{_reason(error, path)}"
        raise SceneError(message, file=path) from None
    return stage


def _layers(path: Path) -> list[Sdf.Layer]:
    """Return the layers of a stage, its root first, read anew; and those for MaterialX's documents.

    A stage would wait for ever for a pipe that a layer names, so all are asked for before. Raises
    SceneError for what is no regular file, and OpenUSD's own error for a root that is broken.
    """
    layers = [Sdf.Layer.FindOrOpen(str(path))]
    if layers[0] is None:
        raise SceneError("is no USD file that can be read", file=path)
    known, stands = {str(path)}, list[Sdf.Layer]()
    for layer in layers:
        layer.Reload()  # if its file has changed since this process has read it
        budget.check_time(path)
        for name in layer.GetCompositionAssetDependencies():
            inner = layer.ComputeAbsolutePath(name)
            if inner in known or Ar.IsPackageRelativePath(inner) or not os.path.exists(inner):
                continue
            known.add(inner)
            file = input_files.checked(input_files.named("usd", path.parent, Path(inner)))
            if file.suffix.lower() == ".mtlx":
                with suppress(SceneError):  # the stage tells, too
                    stands.append(materials.stand_in(file))
                    layer.UpdateCompositionAssetDependency(name, stands[-1].identifier)
                continue
            with suppress(Tf.ErrorException):  # the stage tells which prim names it
                layers += filter(None, [Sdf.Layer.FindOrOpen(inner)])
    return layers + stands


def _reason(error: Exception, path: Path) -> str:
    """Return the first of OpenUSD's messages, which names the line, without the file's path."""
    quoted = re.findall(r" : '(.*?)\n?'(?=\n|$)", str(error), re.DOTALL)
    return f": {quoted[0].replace(str(path), 'line')}" if quoted else ""


def _scene(document: Document, variables: dict[str, Any]) -> Scene:
    world = gprims.content(document, document.stage.GetPseudoRoot())
    shapes, own_lights = gprims.placed(document, world), list[Light]()
    for prim, matrix in world.flat_lights():
        lit = lights.light(document, prim, matrix)
        own_lights += lit.lights
        shapes += lit.shapes
    for prim in world.volumes:
        shapes += gprims.volume(document, prim, document.placement(prim))
    settings = cameras.settings(document, world.settings)
    chosen = _chosen(document, world.cameras, variables.get("camera"), settings.camera)
    if not shapes:
        document.warn("holds no shapes", "/")
    view = None if chosen is None else cameras.camera(document, chosen, settings)
    scene = framing.show(
        shapes, file=document.file, camera=view, own_lights=own_lights, up=document.up,
        lit=any(shape.emission is not None for shape in shapes),
    )  # fmt: skip
    scene.extra["cameras"] = [str(prim.GetPath()) for prim in world.cameras]
    scene.extra["shutter"] = (0.0, 0.0)
    size = settings.size
    if chosen is not None:
        size = size or cameras.picture_size(document, chosen)
        stops = cameras.exposure(document, chosen)
        scene.film = dataclasses.replace(scene.film, display_exposure=stops)
        opening, closing = (
            document.number(chosen, f"shutter:{side}", 0.0) for side in ("open", "close")
        )
        if not settings.still:
            scene.extra["shutter"] = (opening, closing - opening)
    if size is not None:
        scene.film = dataclasses.replace(scene.film, width=size[0], height=size[1])
    if settings.layers:
        scene.film = dataclasses.replace(scene.film, layers=settings.layers)
    return scene


def _chosen(
    document: Document, shown: list[Usd.Prim], name: object, usual: str | None
) -> Usd.Prim | None:
    """Return the camera of a name, path or number, else the usual camera, else the first."""
    for number, prim in enumerate(shown):
        called = (str(number), prim.GetName(), str(prim.GetPath()))
        if (usual if name is None else str(name)) in called:
            return prim
    if name is None:
        if usual is not None and shown:
            message = f"its camera {usual} is not there; {shown[0].GetPath()} replaces it"
            document.warn(message, "render settings")
        return shown[0] if shown else None
    names = ", ".join(str(prim.GetPath()) for prim in shown) or "none"
    raise SceneError(f"shows no camera {name!r}; it shows: {names}", file=document.file)
