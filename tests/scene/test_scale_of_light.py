"""One scale of light: the same lamp, given in any way and any format, is as bright on the film."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import spectra, transforms
from clpt.geometry.lamps import plainly_lit
from clpt.scene import Film, Scene, cameras, integrators, lights, materials, shapes
from clpt.scene.viewpoint import surrounded

CANDELA, HEIGHT = 1000.0, 2.0
LUX = CANDELA / HEIGHT**2
DOWN = transforms.look_at([0.0, 0.0, HEIGHT], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0])
ONTO_PAPER = cameras.Orthographic(
    to_world=transforms.look_at([0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    @ transforms.scale(0.01)
)
PAPER = shapes.Rectangle(material=materials.Diffuse(reflectance=1.0))
IES = "IESNA:LM-63-2002\nTILT=NONE\n1 1 1 3 1 1 2 0 0 0\n1 1 9\n0 90 180\n0\n1000 1000 1000\n"
LDT = "\n".join(
    [
        "", "1", "1", "1", "0", "3", "90", *[""] * 5, *["0"] * 9, "100", "100", "1", "0", "1",
        "1", "LED", "2000", "3000", "80", "20", *["1"] * 10, "0", "0", "90", "180", *["500"] * 3,
    ]
)  # fmt: skip
COLOURS: list[Any] = [1.0, (1.0, 0.5, 0.2), (0.05, 0.9, 0.3), "A", "F11", "sodium", "E"]
COLOURS += [spectra.LED(450.0), spectra.Blackbody(2700.0), spectra.Lines([555.35], [3.0])]
POINTS: list[dict[str, float]] = [{"candela": CANDELA}, {"lumens": 4.0 * math.pi * CANDELA}]


def on_paper(scene: Scene, mode: str, **film: Any) -> np.ndarray:
    """The mean colours, or bands, of white paper under the lights of a scene."""
    light = Scene(
        camera=ONTO_PAPER,
        shapes=[PAPER, *(shape for shape in scene.shapes if shape.emission is not None)],
        lights=scene.lights,
        film=Film(width=8, height=8, mode=mode, **film),
        integrator=integrators.Direct(),
    )
    return clpt.render(light, spp=256).mean(axis=(0, 1), dtype=np.float64)


def illuminance(scene: Scene, mode: str) -> float:
    """Illuminance of the paper [lx]: pi times the luminance of what is white."""
    return math.pi * spectra.UNIT_LUMINANCE * float(spectra.luminance(on_paper(scene, mode)))


def scene_of(light: lights.Light) -> Scene:
    return Scene(camera=ONTO_PAPER, lights=[light])


def file_of(folder: Path, light: dict[str, Any], **top: Any) -> Scene:
    """A scene file with one light, loaded."""
    (folder / "lamp.ies").write_text(IES)
    (folder / "lamp.ldt").write_text(LDT)
    made = {"camera": {"type": "perspective"}, "lights": [light], **top}
    (folder / "scene.json").write_text(json.dumps(made))
    return clpt.load(folder / "scene.json")


def gltf_of(folder: Path, light: dict[str, Any], generator: str = "") -> Scene:
    """A .gltf with one light above, loaded."""
    name = "KHR_lights_punctual"
    node = {"translation": [0.0, 0.0, HEIGHT], "extensions": {name: {"light": 0}}}
    made = {
        "asset": {"version": "2.0", "generator": generator},
        "extensionsUsed": [name],
        "extensions": {name: {"lights": [light]}},
        "nodes": [{"mesh": 0}, node],
        "scenes": [{"nodes": [0, 1]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"componentType": 5126, "count": 3, "type": "VEC3"}],
    }
    made["accessors"][0]["sparse"] = {  # type: ignore[index]
        "count": 3,
        "indices": {"bufferView": 0, "componentType": 5121},
        "values": {"bufferView": 1},
    }
    corners = np.array([[0, 0, -5], [1, 0, -5], [0, 1, -5]], "<f4").tobytes()
    (folder / "a.bin").write_bytes(bytes([0, 1, 2, 0]) + corners)
    made["buffers"] = [{"uri": "a.bin", "byteLength": 40}]
    made["bufferViews"] = [
        {"buffer": 0, "byteLength": 3},
        {"buffer": 0, "byteOffset": 4, "byteLength": 36},
    ]
    (folder / "a.gltf").write_text(json.dumps(made))
    return clpt.load(folder / "a.gltf")


@pytest.mark.parametrize("mode", ["spectral", "rgb"])
@pytest.mark.parametrize("colour", COLOURS, ids=str)
@pytest.mark.parametrize("strength", POINTS, ids=lambda given: next(iter(given)))
def test_a_lamp_of_any_spectrum(strength, colour, mode):
    """1000 cd give 250 lx two metres away, whatever the colour; 16,384 samples each."""
    lamp = lights.Point(position=(0.0, 0.0, HEIGHT), intensity=colour, **strength)
    assert illuminance(scene_of(lamp), mode) == pytest.approx(LUX, rel=0.01)


FLAT = {"cutoff": 60.0, "beam_width": 60.0}
SIZE = 0.02  # of a lamp that is as good as a point [m]


@pytest.mark.parametrize("mode", ["spectral", "rgb"])
@pytest.mark.parametrize(
    ("light", "expected"),
    [
        (lights.Spot(to_world=DOWN, candela=CANDELA, **FLAT), LUX),
        (lights.Spot(to_world=DOWN, lumens=math.pi * CANDELA, temperature=2700.0, **FLAT), LUX),
        (lights.Goniometric(to_world=DOWN, candela=CANDELA, intensity="F11"), LUX),
        (lights.Goniometric(to_world=DOWN, lumens=4.0 * math.pi * CANDELA), LUX),
        (lights.Projector(to_world=DOWN, lux=CANDELA, irradiance="A"), LUX),
        (lights.Directional(lux=LUX, irradiance="sodium"), LUX),
        (lights.Constant(nits=LUX / math.pi, temperature=4000.0), LUX),
        (lights.Area(nits=CANDELA / SIZE**2, radiance="F4"), LUX),
        (lights.Area(lumens=math.pi * CANDELA, radiance=(1.0, 0.4, 0.1)), LUX),
    ],
    ids=lambda value: value.kind if isinstance(value, lights.Light) else "",
)
def test_lamps_of_each_kind(light, expected, mode):
    scene = scene_of(light) if not isinstance(light, lights.ON_SHAPES) else None
    if scene is None:
        to_world = DOWN @ transforms.scale(SIZE / 2.0)
        scene = Scene(
            camera=ONTO_PAPER, shapes=[shapes.Rectangle(to_world=to_world, emission=light)]
        )
    assert illuminance(scene, mode) == pytest.approx(expected, rel=0.01)


def test_light_through_a_surface_is_counted_in_lux():
    lamp = lights.DirectionalArea(lux=300.0, irradiance="F11")
    lit = plainly_lit(Scene(camera=ONTO_PAPER, shapes=[shapes.Rectangle(emission=lamp)]))
    assert spectra.lumens(lit.shapes[0].emission.irradiance) == pytest.approx(300.0)


ABOVE = [{"translate": [0, 0, HEIGHT]}]


@pytest.mark.parametrize("mode", ["spectral", "rgb"])
@pytest.mark.parametrize("file", ["lamp.ies", "lamp.ldt"])
@pytest.mark.parametrize(
    ("light", "factor"),
    [
        ({}, 1.0),
        ({"intensity": 0.5}, 0.5),
        ({"intensity": 0.0}, 0.0),
        ({"intensity": [1.0, 0.5, 0.2]}, 1.0),
        ({"intensity": "sodium"}, 1.0),
        ({"temperature": 2700, "intensity": 2}, 2.0),
        ({"candela": 3.0}, 3.0),
        ({"lumens": 4.0 * math.pi * 700.0, "intensity": "F11"}, 0.7),
    ],
)
def test_files_of_lamps(tmp_path, light, factor, file, mode):
    lamp = {"type": "goniometric", "file": file, "to_world": ABOVE, **light}
    scene = file_of(tmp_path, lamp, version=2)
    assert not scene.warnings
    assert illuminance(scene, mode) == pytest.approx(factor * LUX, rel=0.01)


@pytest.mark.parametrize("mode", ["spectral", "rgb"])
def test_lights_of_gltf(tmp_path, mode):
    point = gltf_of(tmp_path, {"type": "point", "intensity": CANDELA})
    assert illuminance(point, mode) == pytest.approx(LUX, rel=0.01)
    spot = {"type": "spot", "intensity": CANDELA, "spot": {"innerConeAngle": 0.5}}
    assert illuminance(gltf_of(tmp_path, spot), mode) == pytest.approx(LUX, rel=0.01)
    sun = gltf_of(tmp_path, {"type": "directional", "intensity": LUX})
    assert illuminance(sun, mode) == pytest.approx(LUX, rel=0.01)


def test_a_sky_shows_as_its_image_does(tmp_path):
    """`--env` beside lights in candela: a 1 of its image is 1 on a screen, as in viewers."""
    clpt.write_image(tmp_path / "sky.exr", np.ones((4, 8, 3), np.float32))
    lit = gltf_of(tmp_path, {"type": "point", "intensity": CANDELA})
    sky = surrounded(lit, tmp_path / "sky.exr").lights[-1]
    assert sky.scale * 2.0**lit.film.display_exposure == pytest.approx(1.0)
    bare = surrounded(Scene.studio([PAPER]), tmp_path / "sky.exr")
    assert bare.lights[-1].scale == 1.0


def test_meshes_of_a_lit_file_glow_as_they_are(tmp_path):
    """A scene file that names a .gltf for its meshes has no use for its lights' unit."""
    gltf_of(tmp_path, {"type": "point", "intensity": CANDELA})
    made = json.loads((tmp_path / "a.gltf").read_text())
    made["materials"] = [{"emissiveFactor": [1, 1, 1]}]
    made["meshes"][0]["primitives"][0]["material"] = 0
    (tmp_path / "a.gltf").write_text(json.dumps(made))
    scene = file_of(tmp_path, {"type": "point"}, shapes=[{"type": "mesh", "file": "a.gltf"}])
    np.testing.assert_allclose(scene.shapes[0].emission.radiance.to_rgb("emission"), 1.0)
    assert scene.film.display_exposure == 0.0


@pytest.mark.parametrize("mode", ["spectral", "rgb"])
@pytest.mark.parametrize("lumens", [683.0, 1.0], ids=["Standard", "Unitless"])
def test_watts_of_blender_are_those_of_power(tmp_path, lumens, mode):
    """Its exporter makes lumens / (4 pi) candela of a watt, and lux of W/m^2."""
    power = 1200.0 if lumens == 1.0 else 20.0  # "Unitless" is known by the small numbers
    own = lights.Point(position=(0.0, 0.0, HEIGHT), power=power)
    candela = power * lumens / (4.0 * math.pi)
    theirs = gltf_of(
        tmp_path, {"type": "point", "intensity": candela}, "Khronos glTF Blender I/O v4.2.60"
    )
    assert illuminance(theirs, mode) == pytest.approx(illuminance(scene_of(own), mode), rel=0.01)


@pytest.mark.parametrize("colour", [1.0, "F11", (1.0, 0.5, 0.2), spectra.Lines([555.0], [1.0])])
def test_irradiance_and_illuminance_of_20_watts(colour):
    """W/m^2 are pi times the bands times their width, lux 683 lm/W times their integral with V."""
    lamp = lights.Point(position=(0.0, 0.0, HEIGHT), power=20.0, intensity=colour)
    expected = 20.0 / (4.0 * math.pi * HEIGHT**2)
    bands = on_paper(scene_of(lamp), "spectral", bands=47)
    assert math.pi * 10.0 * bands.sum() == pytest.approx(expected, rel=0.01)
    emitted = plainly_lit(scene_of(lamp)).lights[0].intensity
    lux = spectra.lumens(emitted) / HEIGHT**2
    for mode in ("spectral", "rgb"):
        assert illuminance(scene_of(lamp), mode) == pytest.approx(lux, rel=0.01)
    seen = spectra.LUMENS * math.pi * spectra.CIE_Y_INTEGRAL
    assert seen * on_paper(scene_of(lamp), "rgb") @ spectra.REC709_TO_XYZ[1] == pytest.approx(
        lux, rel=0.01
    )


def test_versions_of_scene_files(tmp_path):
    """Without a version it is told once; 1 keeps numbers as they were; what is saved has 2."""
    lamp = {"type": "goniometric", "file": "lamp.ies", "intensity": 0.5}
    untold = file_of(tmp_path, lamp)
    twice = file_of(tmp_path, lamp, lights=[lamp, lamp])
    assert len(untold.warnings) == 1 == len(twice.warnings) and '"version": 2' in untold.warnings[0]
    former = file_of(tmp_path, lamp, version=1)
    assert not former.warnings and former.lights[0].intensity.r == 0.5
    assert former.lights[0].candela is None and former.lights[0].image.image.max() == 1000.0
    for scene in (untold, former):
        clpt.save(scene, tmp_path / "again.json")
        assert json.loads((tmp_path / "again.json").read_text())["version"] == 2
        again = clpt.load(tmp_path / "again.json")
        assert not again.warnings
        strength = [
            float(spectra.lumens(plainly_lit(one).lights[0].intensity)) for one in (scene, again)
        ]
        assert strength[0] == pytest.approx(strength[1])
    plain = file_of(tmp_path, {"type": "point", "lumens": 5})
    assert not plain.warnings
    for wrong in (0, 3, "2"):
        with pytest.raises(clpt.SceneError, match="version"):
            file_of(tmp_path, lamp, version=wrong)


def test_exposure_acts_on_the_way_out(tmp_path):
    """Screens are brightened by the film's stops; an .exr keeps the light, and tells the stops."""
    lamp = lights.Point(position=(0.0, 0.0, HEIGHT), candela=2.0)
    pictures = {}
    for stops in (0.0, 16.0):
        scene = scene_of(lamp)
        scene.shapes = [PAPER]
        scene.film = Film(width=8, height=8, mode="rgb", display_exposure=stops)
        renderer = clpt.Renderer(scene)
        renderer.run(4)
        for name in ("a.png", "b.exr"):
            renderer.save(tmp_path / name)
        renderer.save(tmp_path / "c.png", exposure=-stops)
        pictures[stops] = [clpt.read_image(tmp_path / n) for n in ("a.png", "b.exr", "c.png")]
        shown = renderer.resolve().get()[..., :3].max()
        assert (shown > 50) == (stops > 0.0)
    dark, bright = pictures[0.0], pictures[16.0]
    np.testing.assert_array_equal(dark[1], bright[1])
    np.testing.assert_array_equal(dark[0], bright[2])
    light = dark[1].mean() * 2.0**16
    assert bright[0].mean() == pytest.approx(light, rel=0.02)
