"""Stages as scenes."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any

from pxr import Gf, Tf, Usd, UsdUtils, Vt  # noqa: F401  all are loaded at one time

from clpt.errors import SceneError, nearest
from clpt.files import input_files
from clpt.formats import framing
from clpt.formats.usd import cameras, gprims, lights
from clpt.formats.usd.document import Document
from clpt.scene import Scene
from clpt.scene.lights import Constant, Light

VARIABLES = ("camera",)
DARK = Constant(radiance=0.0)  # in place of the studio's lights where shapes alone shine


def load(path: Path, /, **variables: Any) -> Scene:
    """Read a stage; a camera or light that it lacks is added, as for a bare mesh.

    variables: `camera` is the name, the prim path or the number of one of several. Raises
    SceneError with the prim path of what is wrong.
    """
    unknown = sorted(set(variables) - set(VARIABLES))
    if unknown:
        advice = nearest(unknown[0], VARIABLES)
        raise SceneError(f"USD has no variable {unknown[0]!r}{advice}", file=path)
    delegate = UsdUtils.CoalescingDiagnosticDelegate()  # OpenUSD's own messages go here
    stage = _opened(path)
    start = stage.GetStartTimeCode()
    time = Usd.TimeCode(start) if stage.HasAuthoredTimeCodeRange() else Usd.TimeCode.EarliestTime()
    document = Document(path, stage, time)
    scene = _scene(document, variables)
    for entry in delegate.TakeUncoalescedDiagnostics():
        document.warn(entry.commentary.splitlines()[0], "OpenUSD")
    scene.warnings = document.warnings()
    return scene


def _opened(path: Path) -> Usd.Stage:
    """Return a file's stage. Raises SceneError."""
    input_files.checked(path)
    try:
        stage = Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        raise SceneError(
            f"is no USD file that can be read{_reason(error, path)}", file=path
        ) from None
    return stage


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
    chosen = _chosen(document, world.cameras, variables.get("camera"))
    if not shapes:
        document.warn("holds no shapes", "/")
    view = None if chosen is None else cameras.camera(document, chosen, None)
    glowing = [] if own_lights else [shape for shape in shapes if shape.emission is not None]
    known = own_lights or ([DARK] if glowing else [])
    scene = framing.show(shapes, file=document.file, camera=view, own_lights=known, up=document.up)
    scene.lights = [light for light in scene.lights if light is not DARK]
    scene.extra["cameras"] = [str(prim.GetPath()) for prim in world.cameras]
    if chosen is not None:
        width, height = cameras.picture_size(document, chosen)
        stops = cameras.exposure(document, chosen)
        scene.film = dataclasses.replace(
            scene.film, width=width, height=height, display_exposure=stops
        )
    return scene


def _chosen(document: Document, shown: list[Usd.Prim], name: object) -> Usd.Prim | None:
    """Return the camera of a name, path or number; the first one where none is asked for."""
    if name is None:
        return shown[0] if shown else None
    for number, prim in enumerate(shown):
        if str(name) in (str(number), prim.GetName(), str(prim.GetPath())):
            return prim
    names = ", ".join(str(prim.GetPath()) for prim in shown) or "none"
    raise SceneError(f"shows no camera {name!r}; it shows: {names}", file=document.file)
