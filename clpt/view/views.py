"""Views: a camera and how its picture is shown, as JSON that is saved, copied and opened again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, cast

from clpt.errors import SceneError, UnknownKindError
from clpt.files import text
from clpt.scene import Scene, kinds
from clpt.scene.cameras import Camera
from clpt.scene.params import fields_of, params
from clpt.view import panels
from clpt.view.commands import COMMANDS, CommandError, Request
from clpt.view.pictures import Display


def written(scene: Scene, display: Display) -> dict[str, Any]:
    """Return a view: its camera as scene.json has it, exposure and tone curve."""
    shown = {"exposure": display.exposure, "tone": display.tone}
    return {"camera": panels.written(scene.camera), "display": shown}


def camera_of(document: object, present: Camera | None = None) -> Camera:
    """Return the camera that a view has. Raises CommandError.

    present: gives what no view holds: a lens, the medium around, motion and shutter.
    """
    if not isinstance(document, dict):
        raise CommandError("the camera of a view is an object, as in scene.json")
    known, values = kinds("camera"), dict(document)
    kind = values.pop("type", None)
    if not isinstance(kind, str) or kind not in known:
        raise CommandError(str(UnknownKindError("camera", str(kind), known)))
    declared = params(known[kind])
    held = {name: param for name, param in declared.items() if panels.is_plain(param)}
    for name in values:
        if name not in held:
            raise CommandError(f"a view of a camera {kind} has no {name!r}")
    read = {name: panels.read(name, value, held[name]) for name, value in values.items()}
    had = {} if present is None else fields_of(present)
    kept = {name: had[name] for name in declared if name in had and name not in held}
    try:
        return cast(Camera, known[kind](**kept, **read))
    except SceneError as error:
        raise CommandError(str(error)) from None


def request(document: object) -> Request:
    """Return the command that opens a view. Raises CommandError."""
    if not isinstance(document, dict) or "camera" not in document:
        raise CommandError("this is no view: it has no camera")
    display = document.get("display")
    given = {"exposure": 0.0, "tone": "none", **(display if isinstance(display, dict) else {})}
    kinds_of = COMMANDS["open_view"].parameters
    values = {"camera": document["camera"], **given}
    checked = {name: kind.check(values[name]) for name, kind in kinds_of.items()}
    camera_of(checked["camera"])
    return Request("open_view", checked)


def load(path: Path) -> Request:
    """Return the command that opens the view of a file. Raises SceneError."""
    content = text.read(path)
    try:
        return request(json.loads(content))
    except (ValueError, CommandError) as error:
        raise SceneError(f"is no view: {error}", file=path) from error
