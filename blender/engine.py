# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine: it writes Blender's scene, has it rendered, and shows the picture."""

from __future__ import annotations

import tempfile
import traceback
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from . import scenes
from .process import Process, ProcessError

ENGINE = "CLPT"
# Passes of Blender: the layer, the option of the view layer, channels, what they mean.
PASSES = {
    "Depth": ("z", "use_pass_z", "Z", "VALUE"),
    "Normal": ("shading_normal", "use_pass_normal", "XYZ", "VECTOR"),
    "Position": ("position", "use_pass_position", "XYZ", "VECTOR"),
    "UV": ("uv", "use_pass_uv", "UVA", "VECTOR"),
    "Diffuse Color": ("albedo", "use_pass_diffuse_color", "RGB", "COLOR"),
}
FAR = 1e10  # depth where nothing is seen, as in Blender
WAIT = 0.2  # [s] until the engine looks for a press of Escape


class ClptEngine(bpy.types.RenderEngine):
    """Spectral and RGB path tracing by clpt."""

    bl_idname = ENGINE
    bl_label = "clpt"
    bl_use_preview = False
    bl_use_postprocess = True
    bl_use_shading_nodes_custom = False

    def update_render_passes(self, scene: Any, renderlayer: Any) -> None:
        """Tell Blender which passes the compositor gets."""
        for name, (_, option, channels, kind) in PASSES.items():
            if getattr(renderlayer, option):
                self.register_pass(scene, renderlayer, name, len(channels), channels, kind)

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Render the frame that Blender asks for. An error becomes a line of Blender's."""
        settings = depsgraph.scene.clpt
        scale = depsgraph.scene.render.resolution_percentage / 100.0
        width = max(int(depsgraph.scene.render.resolution_x * scale), 1)
        height = max(int(depsgraph.scene.render.resolution_y * scale), 1)
        with tempfile.TemporaryDirectory(prefix="clpt_") as folder:
            try:
                self.update_stats("", "clpt: the scene is read")
                writer = scenes.Writer(depsgraph, Path(folder), width, height, self.frame_set)
                file = writer.write()
                for line in writer.told:
                    self.report({"WARNING"}, f"clpt: {line}")
                shown = depsgraph.view_layer
                passes = [name for name, row in PASSES.items() if getattr(shown, row[1])]
                for name in passes:
                    channels = PASSES[name][2]
                    self.add_pass(name, len(channels), channels, layer=shown.name)
                self._run(file, settings, (width, height), passes)
            except ProcessError as error:
                self.report({"ERROR"}, f"clpt: {error}")
            except Exception as error:  # a fault of the add-on is a line, and Blender goes on
                traceback.print_exc()
                self.report({"ERROR"}, f"clpt: {type(error).__name__}: {error}")

    def _run(self, file: Path, settings: Any, size: tuple[int, int], passes: list[str]) -> None:
        process = Process(python=settings.python)
        try:
            process.send(
                {
                    "file": str(file), "width": size[0], "height": size[1], "mode": settings.mode,
                    "layers": [PASSES[name][0] for name in passes],
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
                message, pictures = received
                samples = message["samples"]
                self.update_progress(samples / settings.samples)
                self.update_stats("", f"clpt: sample {samples} of {settings.samples}")
                for line in message.get("warnings", ()):
                    self.report({"WARNING"}, f"clpt: {line}")
                if pictures:
                    self._show(pictures, size, passes)
                done = message.get("done", False)
        finally:
            process.stop()

    def _show(self, pictures: list[bytes], size: tuple[int, int], passes: list[str]) -> None:
        """Show the picture, and its passes where they are there: they come with the last one."""
        result = self.begin_result(0, 0, *size)
        for name, pixels in zip(("Combined", *passes), pictures, strict=False):
            values = np.frombuffer(pixels, np.float32)
            if name == "Depth":
                values = np.where(values > 0.0, values, np.float32(FAR))
            result.layers[0].passes[name].rect.foreach_set(values)
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
