"""Pictures against Mitsuba 3: the same small scenes, in the same run, in RGB and spectral.

Both render many times with different seeds. Blocks of 4x4 pixels are compared by Welch's t-test,
corrected for their number, at the significance of tests/pictures/support.py; the mean radiance too,
and that also within a bound.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import clpt
from bench import varied
from tests.pictures.support import assert_agree, blocks, exposures, with_film, with_path

mi = pytest.importorskip("mitsuba", reason="the renderer that we compare with is not installed")
pytestmark = pytest.mark.peers

SCENES = (
    "bent", "cornell", "delta_lights", "envmap", "glass_metal", "instances", "light_tracing",
    "orthographic", "plastic", "principled", "principled_thin", "spectra", "textures", "thin_lens",
    "thrown_images",
)  # fmt: skip
# Mitsuba's envmap is up to a quarter off its own RGB picture in spectral mode, where texels are
# saturated; tests/pictures/spectra/test_spectral.py holds ours to the RGB picture instead.
CASES = [(name, mode) for name in SCENES for mode in ("rgb", "spectral")]
CASES.remove(("envmap", "spectral"))
CASES.remove(("thrown_images", "spectral"))  # of a projector Mitsuba does not take D65 for white
CASES.remove(("bent", "spectral"))  # of which Mitsuba refuses colours by <vector>
CASES.remove(("spectra", "rgb"))  # of black bodies Mitsuba has no colour
# The rest is left to the sweep of many samples.
LEFT = [(name, "rgb") for name in ("plastic", "textures", "orthographic", "principled_thin")]
LEFT += [("principled", "rgb")]  # tests/kernels/test_bsdf_mitsuba.py compares the material
LEFT += [(name, "spectral") for name in ("plastic", "instances", "principled", "principled_thin")]
LEFT += [(name, "spectral") for name in ("glass_metal", "thin_lens", "light_tracing")]
LEFT += [(name, "rgb") for name in ("light_tracing", "thrown_images", "thin_lens")]
LEFT += [(name, "rgb") for name in ("envmap", "bent")]
LEFT += [(name, "spectral") for name in ("orthographic", "delta_lights", "cornell")]
QUICK = [case for case in CASES if case not in LEFT]
MEAN_WITHIN = 0.015  # relative; at a quick test's number of samples most of it is noise
METAL = '<string name="material" value="Al"/>'
COLOURS = 2e-3  # relative; the steps of the two programs' colour tables differ


def mitsuba_exposures(path: Path, mode: str, count: int, spp: int, **defaults: int) -> np.ndarray:
    """Render `count` times with Mitsuba: (count, h, w, 3) float64; `defaults` fill in $names."""
    mi.set_variant(f"scalar_{mode}")  # of its variants the ones that need no LLVM
    scene = mi.load_file(str(path), **{name: str(value) for name, value in defaults.items()})
    images = [np.array(mi.render(scene, spp=spp, seed=seed))[:, :, :3] for seed in range(count)]
    return np.array(images, np.float64)


def compare(path: Path, mode: str, count: int, spp: int, within: float) -> None:
    """Compare the pictures of a scene file, block by block and in the mean."""
    reference = mitsuba_exposures(path, mode, count, spp)
    ours = exposures(with_film(clpt.load(path), mode=mode), 2 * count, spp)
    ratio = ours.mean() / reference.mean()
    assert_agree(blocks(ours), blocks(reference), f"blocks of {path.stem}, {mode}", COLOURS)
    means = [a.mean(axis=(1, 2), keepdims=True) for a in (ours, reference)]
    assert_agree(*means, f"mean of {path.stem}, {mode}", COLOURS)
    assert abs(ratio - 1.0) < within, f"mean radiance is {ratio:.4f} of Mitsuba's"


@pytest.mark.parametrize(("name", "mode"), QUICK)
def test_pictures(scenes: Path, name: str, mode: str) -> None:
    compare(scenes / f"{name}.xml", mode, 24, 8, MEAN_WITHIN)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "mode"), CASES)
def test_pictures_of_many_samples(scenes: Path, name: str, mode: str) -> None:
    compare(scenes / f"{name}.xml", mode, 64, 64, 0.003)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("name", ["materials", "textures", "instances", "outdoors", "lamps"])
def test_scenes_of_other_shapes(tmp_path: Path, name: str, mode: str) -> None:
    """Small forms of those that are timed: 324 materials of seven kinds, 100 lamps, a sun."""
    if (name, mode) == ("outdoors", "spectral"):
        pytest.skip("Mitsuba's envmap is off its own RGB picture in spectral mode")
    small = {"materials": 18, "textures": 64, "instances": 60, "outdoors": 60, "lamps": 10}
    path = varied.SCENES[name](tmp_path, small[name])
    reference = mitsuba_exposures(path, mode, 16, 16, res=64)
    ours = exposures(with_film(clpt.load(path, res=64), mode=mode), 32, 16)
    assert_agree(blocks(ours, 8), blocks(reference, 8), f"blocks of {name}, {mode}", COLOURS)
    means = [a.mean(axis=(1, 2), keepdims=True) for a in (ours, reference)]
    assert_agree(*means, f"mean of {name}, {mode}", COLOURS)


@pytest.mark.parametrize("depth", [1, 2, 3])
def test_depths(scenes: Path, depth: int) -> None:
    """A path of depth 1 sees lights only, 2 adds direct light, 3 one reflection more."""
    path = scenes / "cornell.xml"
    reference = mitsuba_exposures(path, "rgb", 16, 4, max_depth=depth)
    scene = with_path(with_film(clpt.load(path), mode="rgb"), max_depth=depth)
    assert_agree(blocks(exposures(scene, 32, 4)), blocks(reference), allowed=COLOURS)


def lift_tiles(path: Path) -> None:
    """Replace a link to the tire's floor by the floor with each tile 0.001 above the one before.

    Its 120 tiles of four vertices (x, y, z, u, v) overlap, up to eight in a place, in planes less
    than a step of float32 apart: rounding would decide which one's texture coordinates are seen.
    """
    data = path.read_bytes()
    start = data.index(b"end_header\n") + len(b"end_header\n")
    rows = np.frombuffer(data, "<f4", 120 * 4 * 5, start).reshape(120, 4, 5).copy()
    rows[:, :, 1] += 0.001 * np.arange(120)[:, None]
    path.unlink()
    path.write_bytes(data[:start] + rows.tobytes() + data[start + rows.nbytes :])


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("name", ["tire", "ashtray"])
def test_principled_scenes_of_others(assets: Path, tmp_path: Path, name: str, mode: str) -> None:
    """Every mesh flat: Mitsuba lights by a lamp's smooth normals, and sees backs by them."""
    if (name, mode) == ("ashtray", "spectral"):
        pytest.skip("Mitsuba refuses its `raw` texture of three channels as a number")
    source, path = assets / "mitsuba" / name, tmp_path / "scene.xml"
    text = source.joinpath("scene.xml").read_text("utf-8")
    text = text.replace("</film>", '<rfilter type="box"/></film>')
    text = re.sub(r'<boolean name="face_normals" value="true"/>', "", text)
    text = text.replace(
        '<shape type="ply">', '<shape type="ply"><boolean name="face_normals" value="true"/>'
    )
    path.write_text(text.replace('value="65"', 'value="4"'), "utf-8")
    (tmp_path / "textures").symlink_to(source / "textures")
    (tmp_path / "meshes").mkdir()
    for mesh in source.glob("meshes/*.ply"):
        (tmp_path / "meshes" / mesh.name).symlink_to(mesh)
    if name == "tire":
        lift_tiles(tmp_path / "meshes" / "Material2_006.ply")
    size = {"resx": "64", "resy": "64", "integrator": "path"}
    mi.set_variant(f"scalar_{mode}")
    scene = mi.load_file(str(path), **size)
    images = [np.array(mi.render(scene, spp=16, seed=seed))[:, :, :3] for seed in range(24)]
    ours = exposures(with_film(clpt.load(path, **size), mode=mode), 48, 16)
    assert_agree(blocks(ours, 16), blocks(images, 16), f"blocks of {name}, {mode}", 0.01)
    ratio = ours.mean() / np.mean(images)
    assert abs(ratio - 1.0) < 0.015, f"mean radiance is {ratio:.4f} of Mitsuba's"


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_a_room_lit_through_a_door(assets: Path, tmp_path: Path, mode: str) -> None:
    """383 thousand triangles; most of the light arrives after several reflections."""
    source, path = assets / "mitsuba" / "veach-ajar", tmp_path / "scene.xml"
    text = source.joinpath("scene.xml").read_text("utf-8")
    # Its metal is aluminium; of indices in <rgb> Mitsuba makes at most 1 in spectral mode.
    text = re.sub(r'<rgb name="eta"[^>]*>\s*<rgb name="k"[^>]*>', METAL, text)
    path.write_text(text.replace('type="tent"', 'type="box"'), "utf-8")
    for folder in filter(Path.is_dir, source.iterdir()):
        (tmp_path / folder.name).symlink_to(folder)
    size = {"resx": "54", "resy": "27"}
    mi.set_variant(f"scalar_{mode}")
    scene = mi.load_file(str(path), **size)
    images = [np.array(mi.render(scene, spp=64, seed=seed))[:, :, :3] for seed in range(12)]
    ours = exposures(with_film(clpt.load(path, **size), mode=mode), 16, 32)
    assert_agree(blocks(ours, 9), blocks(images, 9), f"blocks of veach-ajar, {mode}", 0.01)
    means = [np.mean(a, axis=(1, 2), keepdims=True) for a in (ours, images)]
    assert_agree(*means, f"mean of veach-ajar, {mode}", 0.01)


@pytest.mark.slow
def test_light_of_a_texture_under_d65(scenes: Path, tmp_path: Path) -> None:
    """In spectral mode: without D65 Mitsuba's textures of light are no multiples of it."""
    image = f'<string name="filename" value="{(scenes / "tiles.png").as_posix()}"/>'
    texture = f'<texture type="bitmap" name="nested">{image}</texture>'
    path = tmp_path / "lit.xml"
    path.write_text(
        f"""<scene version="3.0.0"><integrator type="path"/>
        <sensor type="perspective"><float name="fov" value="40"/>
          <transform name="to_world">
            <lookat origin="0, 1, 4" target="0, 0.5, 0" up="0, 1, 0"/>
          </transform>
          <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="24"/>
            <rfilter type="box"/></film></sensor>
        <shape type="rectangle"><transform name="to_world"><translate y="1"/></transform>
          <emitter type="area"><spectrum type="d65" name="radiance">{texture}</spectrum></emitter>
        </shape>
        <shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-90"/>
          <scale value="2"/></transform></shape></scene>""",
        "utf-8",
    )
    compare(path, "spectral", 24, 16, MEAN_WITHIN)
