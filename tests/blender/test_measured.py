"""What only clpt has, as the panels say it: each becomes what clpt reads, and shows."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clpt
from clpt.formats.native import read
from clpt.spectra import cie, dispersion, emission

bpy: Any = pytest.importorskip("bpy")
blender: Any = pytest.importorskip("blender")
measured: Any = pytest.importorskip("blender.measured")
panels: Any = pytest.importorskip("blender.panels")
scenes: Any = pytest.importorskip("blender.scenes")

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def box(monkeypatch: pytest.MonkeyPatch) -> Any:
    """A box of a material, a lamp and a camera; returns the material."""
    monkeypatch.setenv("CLPT_PYTHON", sys.executable)
    blender.register()
    bpy.ops.wm.read_factory_settings()
    bpy.context.scene.render.engine = "CLPT"
    yield bpy.data.objects["Cube"].active_material
    blender.unregister()


def scene(folder: Path) -> tuple[Any, dict[str, None]]:
    """Return Blender's scene as clpt reads it, and what was told."""
    graph = bpy.context.evaluated_depsgraph_get()
    writer = scenes.Writer(graph, folder, 16, 12, lambda *_, **__: None)
    return read.load(writer.write()), writer.told


def shown(made: Any) -> np.ndarray:
    with clpt.Renderer(made) as renderer:
        renderer.run(8)
        return np.asarray(renderer.image())


def test_the_names_that_are_offered_are_known() -> None:
    for name in measured.GLASSES:
        dispersion.glass(name)
    for name in measured.METALS:
        dispersion.metal(name)
    known = {*emission.illuminants(), "2700 K", "4000 K"}
    assert set(measured.LAMPS) <= known


@pytest.mark.parametrize("kind", [row[0] for row in panels.SURFACES])
def test_surfaces(kind: str, box: Any, tmp_path: Path) -> None:
    box.clpt.kind, box.clpt.spectrum = kind, "400:0.1 500:0.2 700:0.6"
    box.clpt.absorption, box.clpt.film_thickness = "400:3 700:0.1", 300.0
    if kind == "MEASURED":
        box.clpt.file = str(tmp_path / "none.bsdf")
        pytest.skip("a measured file is tested with clpt's own")
    made, told = scene(tmp_path)
    assert not told
    assert shown(made)[..., :3].max() > 0.0
    assert {*panels.of_material(box.clpt)} <= {*box.clpt.bl_rna.properties.keys()}


def test_drops_inside(box: Any, tmp_path: Path) -> None:
    """Fog of drops of 8 micrometres: most of its light goes on forward."""
    box.clpt.kind, box.clpt.use_drops, box.clpt.share = "GLASS", True, 0.1
    made, told = scene(tmp_path)
    medium = next(s.interior for s in made.shapes if s.interior is not None)
    assert not told and type(medium.phase).__name__ == "Tabulated"
    box.clpt.drops = "butter"
    _, told = scene(tmp_path)
    assert any("butter" in line for line in told)


@pytest.mark.parametrize("text", ["F11", "LED-B1", "3000 K", "450:1 460:2 550:0.5", "file"])
def test_lamps_have_the_luminance_of_their_color(text: str, tmp_path: Path) -> None:
    """Within 2 % of the lamp's own: the extension's observer is a fit."""
    if text == "file":
        text = str(tmp_path / "lamp.csv")
        Path(text).write_text("wavelength, power\n450, 1\n460, 2\n550, .5\n", "utf-8")
    lamp = bpy.data.objects["Light"].data
    lamp.shadow_soft_size = 0.0
    before = [light for light in scene(tmp_path)[0].lights if type(light).__name__ == "Point"]
    lamp.clpt.spectrum = text
    made, told = scene(tmp_path)
    assert not told

    def luminance(light: Any) -> float:
        return float(cie.spectrum_to_xyz(light.intensity.sample(cie.GRID))[1])

    (after,) = (light for light in made.lights if type(light).__name__ == "Point")
    assert luminance(after) == pytest.approx(luminance(before[-1]), rel=0.02)


def test_what_cannot_be_read_is_a_line_in_the_panel(box: Any, tmp_path: Path) -> None:
    box.clpt.kind, box.clpt.spectrum = "SPECTRUM", "reddish"
    _, told = scene(tmp_path)
    assert any("reddish" in line for line in told)
    assert any("reddish" in line for line in panels.told[box.name_full])


def test_a_real_lens_and_a_sensor(tmp_path: Path) -> None:
    camera, settings = bpy.context.scene.camera.data, bpy.context.scene.clpt
    camera.clpt.lens = "planar"
    settings.sensor, settings.white_balance = "cie1964", "A"
    made, told = scene(tmp_path)
    assert not told and type(made.camera).__name__ == "Lens"
    assert made.film.sensor == "cie1964" and made.film.white_balance == "A"
    assert shown(made)[..., :3].max() > 0.0


def test_turbidity_is_haze() -> None:
    world = bpy.data.worlds["World"].clpt
    world.turbidity = 4.0
    assert world.turbidity == pytest.approx(4.0, abs=1e-4)
    assert world.haze == pytest.approx((0.04608 * 4.0 - 0.04586) * 0.55**-1.3, rel=1e-4)
