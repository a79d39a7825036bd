# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of a 3D viewport: changes go to a process, and the pictures that come are drawn."""

from __future__ import annotations

import tempfile
import traceback
import weakref
from pathlib import Path
from typing import Any, ClassVar

import bpy
import numpy as np

from . import cameras, preferences, process, scenes
from .graphs import Json

LISTENS_EVERY = 0.02  # [s]
Key = tuple[int, ...]  # of an object, its evaluated geometry, and what its materials read


class LiveWriter(scenes.Writer):
    """Describes the scene again and again; only geometry and images that changed are written."""

    def __init__(self, depsgraph: bpy.types.Depsgraph, folder: Path):
        super().__init__(depsgraph, folder, 1, 1, lambda *_, **__: None)
        self.kept: dict[Key, dict[int, str]] = {}
        self.used: set[Key] = set()
        self.space: bpy.types.SpaceView3D | None = None

    def again(self, depsgraph: bpy.types.Depsgraph, space: Any) -> Json:
        """Return the description of the scene as it is now, in a 3D view with its local view."""
        self.depsgraph = depsgraph
        self.space = space if isinstance(space, bpy.types.SpaceView3D) else None
        self.materials, self.named, self.groups, self.media = {}, {}, {}, {}
        self.used = set()
        changed = set()
        for update in depsgraph.updates:
            source = update.id.original
            if update.is_updated_geometry and isinstance(source, bpy.types.Object):
                changed.add(source.session_uid)
            elif isinstance(source, bpy.types.Image):
                self.images.clear()
        self._drop({key for key in self.kept if key[0] in changed})
        described = self.describe()
        self._drop(self.kept.keys() - self.used)
        return described

    def forget(self) -> None:
        """Let all be written anew: after an undo any data may be other data."""
        self._drop(set(self.kept))
        self.images.clear()

    def _drop(self, keys: set[Key]) -> None:
        for key in keys:
            for file in self.kept.pop(key).values():
                (self.folder / file).unlink(missing_ok=True)

    def shows(self, instance: bpy.types.DepsgraphObjectInstance) -> bool:
        source = instance.parent or instance.object
        local = self.space is None or source.original.visible_in_viewport_get(self.space)
        return local and super().shows(instance)

    def _files(self, number: int, source: Any) -> dict[int, str]:
        key = (source.original.session_uid, source.data.as_pointer(), *self.wanted(source))
        if key not in self.kept:
            self.kept[key] = super()._files(next(self.numbers), source)
        self.used.add(key)
        return self.kept[key]

    def _poses(self, parts: Any) -> list[scenes.Pose]:
        return []  # to set the frame would change what is shown

    def _camera(self) -> Json:
        return {}  # the viewport has one of its own


class Viewport:
    """What a viewport shows. engine: Blender's, of this viewport."""

    known: ClassVar[weakref.WeakSet[Viewport]] = weakref.WeakSet()

    def __init__(self, engine: Any):
        self.engine = engine
        folder = tempfile.TemporaryDirectory(prefix="clpt_")
        self.folder = Path(folder.name)
        self.process: process.Process | None = None
        self.writer: LiveWriter | None = None
        self.scene: Json | None = None  # which the process does not have yet
        self.view: Json = {}
        self.serial = 0  # of the last change
        self.picture: np.ndarray | None = None  # (h, w, 4) float32, the bottom row first
        self.corner = (0.0, 0.0)  # its lower left one, and
        self.extent = (1.0, 1.0)  # how much of the region it covers, as shares of it
        self.shown = 0  # the change that it shows
        self.samples = 0  # of each of its pixels, 0 while it is coarse
        self.texture: Any = None
        self.end = weakref.finalize(self, folder.cleanup)
        self.known.add(self)

    def update(self, context: Any, depsgraph: bpy.types.Depsgraph) -> None:
        """Take what has changed in Blender's scene."""
        if self.process is None:
            self._start()  # it loads clpt while the scene is read
        if self.writer is None:
            self.writer = LiveWriter(depsgraph, self.folder)
        settings = depsgraph.scene.clpt
        try:
            self.scene = self.writer.again(depsgraph, context.space_data)
        except Exception as error:  # a fault of the add-on is a line, and Blender goes on
            traceback.print_exc()
            self._tell(f"{type(error).__name__}: {error}")
            return
        self.scene["settings"] = {
            "mode": settings.mode, "samples": settings.viewport_samples,
            "denoise": settings.viewport_denoise,
        }  # fmt: skip

    def draw(self, context: Any, depsgraph: bpy.types.Depsgraph) -> None:
        """Send the view if it is another one, and draw the last picture that has come."""
        changes: Json = {}
        view = {
            "camera": cameras.view(context), "crop": cameras.view_border(context, depsgraph),
            "size": [context.region.width, context.region.height],
        }  # fmt: skip
        if self.scene is not None:
            changes["scene"] = self.scene
        changes |= {name: value for name, value in view.items() if self.view.get(name) != value}
        if changes and self.process is not None:
            self._send(changes)
            self.scene, self.view = None, view
        self.listen()
        if self.picture is not None:
            self._draw(context)

    def listen(self) -> float | None:
        """Take what the process has sent; return [s] until the next time, None if it is over."""
        try:
            _ = self.engine.is_preview
        except ReferenceError:  # Blender has closed the viewport
            self.close()
            return None
        try:
            while self.process is not None:
                received = self.process.receive(0.0)
                if received is None:
                    break
                self._take(*received)
        except process.ProcessError as error:
            self._fail(str(error))
        return LISTENS_EVERY

    def forget(self) -> None:
        """Let all geometry be sent anew at the next update."""
        if self.writer is not None:
            self.writer.forget()

    def close(self) -> None:
        """End the process."""
        if self.process is not None:
            self.process.stop()
        self.process, self.picture, self.texture = None, None, None
        self.end()

    def _start(self) -> None:
        self.view = {}
        self.engine.update_stats("clpt", "prepares the picture")
        try:
            self.process = process.take(preferences.python())
            self.process.send({"live": {"folder": str(self.folder)}})
            bpy.app.timers.register(_listening(self), first_interval=LISTENS_EVERY)
        except process.ProcessError as error:
            self._fail(str(error))

    def _send(self, changes: Json) -> None:
        self.serial += 1
        try:
            assert self.process is not None
            self.process.send({**changes, "serial": self.serial})
        except process.ProcessError as error:
            self._fail(str(error))

    def _take(self, message: Json, pictures: list[bytes]) -> None:
        if "fault" in message:
            self.engine.update_stats("clpt", message["fault"])
        for pixels in pictures:
            width, height = message["size"]
            self.picture = np.frombuffer(pixels, np.float32).reshape(height, width, 4)
            self.texture = None
            self.corner, self.extent = message["corner"], message["extent"]
            self.shown, self.samples = message["serial"], message["samples"]
            if self.process is not None:
                self.process.send({"seen": True})
            self.engine.update_stats("clpt", f"sample {self.samples}" if self.samples else "")
            self.engine.tag_redraw()

    def _fail(self, text: str) -> None:
        """Tell what is wrong; the next change of the scene starts another process."""
        if self.process is not None:
            self.process.stop()
        self.process = None
        self._tell(text)

    def _tell(self, text: str) -> None:
        self.engine.update_stats("clpt", text)
        self.engine.report({"ERROR"}, f"clpt: {text}")

    def _draw(self, context: Any) -> None:
        """Draw linear values: Blender then applies the view transform of the scene."""
        import gpu  # not there without a window
        from gpu_extras.presets import draw_texture_2d

        assert self.picture is not None
        height, width = self.picture.shape[:2]
        if self.texture is None:
            values = gpu.types.Buffer("FLOAT", self.picture.size, self.picture.ravel())
            self.texture = gpu.types.GPUTexture((width, height), format="RGBA16F", data=values)
        gpu.state.blend_set("ALPHA_PREMULT")
        self.engine.bind_display_space_shader(context.scene)
        whole = np.array([context.region.width, context.region.height])
        draw_texture_2d(self.texture, tuple(whole * self.corner), *(whole * self.extent))
        self.engine.unbind_display_space_shader()
        gpu.state.blend_set("NONE")


def _listening(viewport: Viewport) -> Any:
    """Return a timer's function, which keeps no viewport alive."""
    there = weakref.ref(viewport)

    def listen() -> float | None:
        present = there()
        return None if present is None or present.process is None else present.listen()

    return listen


@bpy.app.handlers.persistent
def forget(*_: Any) -> None:
    """Let all viewports write their geometry anew."""
    for viewport in Viewport.known:
        viewport.forget()


HANDLERS = ("undo_post", "redo_post", "load_post")


def register() -> None:
    """Hear of undo, redo and other files."""
    for name in HANDLERS:
        getattr(bpy.app.handlers, name).append(forget)


def unregister() -> None:
    """Undo `register`, and end all viewports."""
    for name in HANDLERS:
        getattr(bpy.app.handlers, name).remove(forget)
    for viewport in list(Viewport.known):
        viewport.close()
