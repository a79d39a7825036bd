# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine: it writes Blender's scene, has it rendered, and shows the picture."""

from __future__ import annotations

import tempfile
import traceback
from pathlib import Path

import bpy
import numpy as np

from . import scenes
from .process import Process, ProcessError

ENGINE = "CLPT"
WAIT = 0.2  # [s] until the engine looks for a press of Escape


class ClptEngine(bpy.types.RenderEngine):
    """Spectral and RGB path tracing by clpt."""

    bl_idname = ENGINE
    bl_label = "clpt"
    bl_use_preview = False
    bl_use_postprocess = True
    bl_use_shading_nodes_custom = False

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Render the frame that Blender asks for. An error becomes a line of Blender's."""
        settings = depsgraph.scene.clpt
        scale = depsgraph.scene.render.resolution_percentage / 100.0
        width = max(int(depsgraph.scene.render.resolution_x * scale), 1)
        height = max(int(depsgraph.scene.render.resolution_y * scale), 1)
        with tempfile.TemporaryDirectory(prefix="clpt_") as folder:
            try:
                self.update_stats("", "clpt: the scene is read")
                writer = scenes.Writer(depsgraph, Path(folder), width, height)
                file = writer.write()
                for line in writer.told:
                    self.report({"WARNING"}, f"clpt: {line}")
                self._run(file, settings, width, height)
            except ProcessError as error:
                self.report({"ERROR"}, f"clpt: {error}")
            except Exception as error:  # a fault of the add-on is a line, and Blender goes on
                traceback.print_exc()
                self.report({"ERROR"}, f"clpt: {type(error).__name__}: {error}")

    def _run(self, file: Path, settings: bpy.types.PropertyGroup, width: int, height: int) -> None:
        process = Process(python=settings.python)
        try:
            process.send(
                {
                    "file": str(file), "width": width, "height": height, "mode": settings.mode,
                    "samples": settings.samples, "denoise": settings.denoise,
                }
            )  # fmt: skip
            done = asked = False
            while not done:
                if self.test_break() and not asked:
                    process.send({"stop": True})
                    asked = True
                received = process.receive(WAIT)
                if received is None:
                    continue
                message, pixels = received
                samples = message["samples"]
                self.update_progress(samples / settings.samples)
                self.update_stats("", f"clpt: sample {samples} of {settings.samples}")
                for line in message.get("warnings", ()):
                    self.report({"WARNING"}, f"clpt: {line}")
                if pixels:
                    self._show(pixels, width, height)
                done = message.get("done", False)
        finally:
            process.stop()

    def _show(self, pixels: bytes, width: int, height: int) -> None:
        result = self.begin_result(0, 0, width, height)
        combined = result.layers[0].passes["Combined"]
        combined.rect.foreach_set(np.frombuffer(pixels, np.float32))
        self.end_result(result)


def _shared_panels() -> list[type]:
    """Return Blender's own panels that mean the same for this engine."""
    left_out = ("VIEWLAYER_PT_filter", "VIEWLAYER_PT_layer_passes")
    return [
        panel
        for panel in bpy.types.Panel.__subclasses__()
        if "BLENDER_RENDER" in getattr(panel, "COMPAT_ENGINES", ())
        and panel.__name__ not in left_out
    ]


def register() -> None:
    """Register the engine, and itself with the panels that it shares."""
    bpy.utils.register_class(ClptEngine)
    for panel in _shared_panels():
        panel.COMPAT_ENGINES.add(ENGINE)


def unregister() -> None:
    """Undo `register`."""
    bpy.utils.unregister_class(ClptEngine)
    for panel in _shared_panels():
        panel.COMPAT_ENGINES.discard(ENGINE)
