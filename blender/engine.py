# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine: it writes Blender's scene, has it rendered, and shows the picture."""

from __future__ import annotations

import tempfile
import traceback
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from . import cameras, passes, preferences, scenes
from .process import ProcessError, give_back, take
from .viewport import Viewport

ENGINE = "CLPT"
PREVIEW_SAMPLES = 32
WAIT = 0.2  # [s] until the engine looks for a press of Escape


class ClptEngine(bpy.types.RenderEngine):
    """Spectral and RGB path tracing by clpt."""

    bl_idname = ENGINE
    bl_label = "clpt"
    bl_use_preview = True
    bl_use_postprocess = True
    bl_use_shading_nodes_custom = False
    viewport: Viewport | None = None

    def update_render_passes(self, scene: Any, renderlayer: Any) -> None:
        """Tell Blender which passes the compositor gets."""
        for each in passes.of_layer(renderlayer, scene.clpt):
            letters = each.channels
            self.register_pass(scene, renderlayer, each.name, len(letters), letters, each.kind)

    def view_update(self, context: Any, depsgraph: bpy.types.Depsgraph) -> None:
        """Take what has changed in the scene that a viewport shows."""
        if self.viewport is None:
            self.viewport = Viewport(self)
        self.viewport.update(context, depsgraph)

    def view_draw(self, context: Any, depsgraph: bpy.types.Depsgraph) -> None:
        """Draw the picture of a viewport."""
        if self.viewport is not None:
            self.viewport.draw(context, depsgraph)

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Render the frame that Blender asks for. An error becomes a line of Blender's."""
        with tempfile.TemporaryDirectory(prefix="clpt_") as folder:
            try:
                self._write_and_run(depsgraph, Path(folder))
            except ProcessError as error:
                self.tell(str(error), "ERROR")
            except Exception as error:  # a fault of the add-on is a line, and Blender goes on
                traceback.print_exc()
                self.tell(f"{type(error).__name__}: {error}", "ERROR")

    def is_cancelled(self) -> bool:
        """Return whether somebody wants no more of this picture."""
        return self.test_break()

    def tell(self, line: str, kind: str = "WARNING") -> None:
        """Tell people a line."""
        self.report({kind}, f"clpt: {line}")

    def _write_and_run(self, depsgraph: bpy.types.Depsgraph, folder: Path) -> None:
        scene, shown = depsgraph.scene, depsgraph.view_layer
        scale = scene.render.resolution_percentage / 100.0
        width = max(int(scene.render.resolution_x * scale), 1)
        height = max(int(scene.render.resolution_y * scale), 1)
        self.update_stats("", "clpt: the scene is read")
        writer = scenes.Writer(depsgraph, folder, width, height, self.frame_set)
        order = {"file": str(writer.write()), "width": width, "height": height}
        for line in writer.told:
            self.tell(line)
        settings = scene.clpt
        wanted = [] if self.is_preview else passes.of_layer(shown, settings)
        for each in wanted:
            self.add_pass(each.name, len(each.channels), each.channels, layer=shown.name)
        if self.is_preview:
            order |= {"mode": "rgb", "samples": PREVIEW_SAMPLES}
        else:
            order |= {
                "mode": settings.mode, "samples": settings.samples, "noise": settings.noise,
                "denoise": settings.denoise,
            }  # fmt: skip
        if scene.render.use_border and not self.is_preview:
            order["crop"] = cameras.border(scene.render, width, height)
        if any(each.layer == "bands" for each in wanted):
            order |= {"bands": settings.bands, "lambdas": passes.ends(settings)}
        order["layers"] = list({each.layer: None for each in wanted})
        self._run(order, wanted, shown.name)

    def _run(self, order: dict[str, Any], wanted: list[passes.Pass], layer: str) -> None:
        """Have a picture made, and show it as it comes."""
        process, done = take(preferences.python()), False
        size = order["crop"][2:] if "crop" in order else (order["width"], order["height"])
        try:
            process.send(order)
            asked = False
            while not done:
                if not asked and self.is_cancelled():
                    process.send({"stop": True})
                    asked = True
                received = process.receive(WAIT)
                if received is None:
                    continue
                message, pictures = received
                samples = message["samples"]
                self.update_progress(samples / order["samples"])
                self.update_stats("", f"clpt: sample {samples} of {order['samples']}")
                for line in message.get("warnings", ()):
                    self.tell(line)
                if pictures:
                    layers = dict(zip(("", *order["layers"]), pictures, strict=False))
                    self._show(layers, size, wanted if len(pictures) > 1 else [], layer)
                done = message.get("done", False)
        finally:
            if done:
                give_back(process)
            else:
                process.stop()

    def _show(
        self,
        layers: dict[str, bytes],
        size: tuple[int, int],
        wanted: list[passes.Pass],
        layer: str,
    ) -> None:
        """Show the picture, and its passes where they are there: they come with the last one."""
        result = self.begin_result(0, 0, *size, layer=layer)
        there = result.layers[0].passes
        there["Combined"].rect.foreach_set(np.frombuffer(layers[""], np.float32))
        for each in wanted:
            there[each.name].rect.foreach_set(each.values(layers, size[0] * size[1]))
        self.end_result(result)


# Panels of Eevee that show what any engine reads of lamps, materials and cameras.
SHARED = (
    "DATA_PT_EEVEE_light", "DATA_PT_camera_dof", "DATA_PT_camera_dof_aperture",
    "EEVEE_MATERIAL_PT_context_material", "EEVEE_MATERIAL_PT_surface", "EEVEE_MATERIAL_PT_volume",
    "MATERIAL_PT_preview",
)  # fmt: skip


def _shared_panels() -> list[type]:
    """Return Blender's own panels that mean the same for this engine."""
    left_out = ("VIEWLAYER_PT_filter", "VIEWLAYER_PT_layer_passes")
    return [
        panel
        for panel in bpy.types.Panel.__subclasses__()
        if panel.__name__ in SHARED
        or (
            "BLENDER_RENDER" in getattr(panel, "COMPAT_ENGINES", ())
            and panel.__name__ not in left_out
        )
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
