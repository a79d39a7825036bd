"""Small scenes that isolate one feature of Mitsuba's XML, rendered by Mitsuba and here."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import images
from tests.pictures.support import exposures, layers_of, with_film

mi = pytest.importorskip("mitsuba", reason="the renderer that we compare with is not installed")
pytestmark = pytest.mark.peers

FILM = (
    '<film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/>'
    '<rfilter type="box"/></film>'
)
CAMERA = (
    '<sensor type="perspective"><transform name="to_world">'
    f'<lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>{FILM}</sensor>'
)

ROW = (  # of three squares of 3 m, from the left
    '<sensor type="orthographic"><transform name="to_world"><scale x="4.5" y="4.5"/>'
    '<lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>'
    f"{FILM.replace('16', '48', 1)}</sensor>"
)


@pytest.fixture
def write(tmp_path: Path):
    """Write a scene file of these elements and a camera."""

    def of(body: str, camera: str = CAMERA) -> Path:
        path = tmp_path / "scene.xml"
        path.write_text(f'<scene version="3.0.0">{body}{camera}</scene>', "utf-8")
        return path

    return of


def mitsuba_mean(path: Path, mode: str, spp: int) -> np.ndarray:
    """Mean of Mitsuba's picture over its middle half, float64 per channel."""
    mi.set_variant(f"scalar_{mode}")
    image = np.array(mi.render(mi.load_file(str(path), optimize=False), spp=spp), np.float64)
    return image[4:12, 4:12].mean(axis=(0, 1))


def our_mean(path: Path, mode: str, spp: int) -> np.ndarray:
    """The same of ours."""
    image = exposures(with_film(clpt.load(path), mode=mode), 1, spp)[0]
    return image[4:12, 4:12].mean(axis=(0, 1))


def test_primitives_of_spheres_count_from_zero(write):
    sphere = '<shape type="sphere"><float name="radius" value="{}"/></shape>'
    path = write(
        '<integrator type="aov"><string name="aovs" value="i:prim_index"/></integrator>'
        + '<shape type="cube"><transform name="to_world"><translate x="9"/></transform></shape>'
        + sphere.format(0.5)
        + sphere.format(3.0)
    )
    assert mitsuba_mean(path, "rgb", 2)[-1] == 0.0
    scene = with_film(clpt.load(path), mode="rgb")
    assert not layers_of(scene, 2)["primitive_id"][4:12, 4:12].any()


@pytest.mark.parametrize("integrator", ["path", "direct"])
def test_camera_sees_through_hidden_lights(write, integrator):
    """Significance of the bound: the spread of 64 pixels of 256 samples is below 0.3%."""
    hide = '<boolean name="hide_emitters" value="true"/>'
    path = write(
        f'<integrator type="{integrator}">{hide}</integrator>'
        '<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="180"/>'
        '<translate z="1.5"/></transform><emitter type="area"/></shape>'
        '<shape type="rectangle"><transform name="to_world"><scale value="3"/></transform></shape>'
    )
    theirs, ours = (mean(path, "rgb", 256) for mean in (mitsuba_mean, our_mean))
    assert theirs.min() > 0.1
    np.testing.assert_allclose(ours, theirs, rtol=0.02)


def checks(name: str, low: float, high: float) -> str:
    return (
        f'<texture type="checkerboard" name="{name}"><float name="color0" value="{low}"/>'
        f'<float name="color1" value="{high}"/>'
        '<transform name="to_uv"><scale x="3" y="2"/></transform></texture>'
    )


PLAIN = '<bsdf type="diffuse"><rgb name="reflectance" value="0.2,0.5,0.8"/></bsdf>'
MIXED = {
    "alpha": f'<bsdf type="roughconductor">{checks("alpha", 0.2, 0.5)}</bsdf>',
    "opacity": f'<bsdf type="mask">{checks("opacity", 0.1, 0.8)}{PLAIN}</bsdf>',
    "weight": f'<bsdf type="blendbsdf">{checks("weight", 0.1, 0.8)}{PLAIN}'
    '<bsdf type="diffuse"/></bsdf>',
}


def test_numbers_from_textures(write):
    """Of three balls side by side, one of each.

    By `direct`: Mitsuba's `path` takes the light on a mask times its opacity twice.
    """
    balls = "".join(
        '<shape type="sphere"><transform name="to_world"><rotate x="1" angle="40"/>'
        f'<translate x="{3 * i - 3}"/></transform>{bsdf}</shape>'
        for i, bsdf in enumerate(MIXED.values())
    )
    path = write(
        '<integrator type="direct"/>'
        '<emitter type="point"><point name="position" x="1" y="2" z="4"/>'
        f'<rgb name="intensity" value="20"/></emitter>{balls}',
        ROW,
    )
    mi.set_variant("scalar_rgb")
    theirs = np.array(mi.render(mi.load_file(str(path), optimize=False), spp=256), np.float64)
    ours = exposures(with_film(clpt.load(path), mode="rgb"), 1, 256)[0]
    for i, name in enumerate(MIXED):
        middle = slice(5, 11), slice(16 * i + 5, 16 * i + 11)
        means = [image[middle].mean(axis=(0, 1)) for image in (ours, theirs)]
        assert means[1].min() > 0.02
        np.testing.assert_allclose(*means, rtol=0.02, err_msg=name)


def test_a_texture_on_a_grid_of_distances(write, tmp_path):
    """It has one value, that at uv (0, 0), which is 0.8 here; the other half would be 0.2."""
    z, y, x = np.meshgrid(*[np.linspace(-0.5, 0.5, 12)] * 3, indexing="ij")
    ball = (np.sqrt(x * x + y * y + z * z) - 0.45).astype("<f4")
    header = struct.pack("<3sB5i6f", b"VOL", 3, 1, 12, 12, 12, 1, 0, 0, 0, 1, 1, 1)
    (tmp_path / "ball.vol").write_bytes(header + ball.tobytes())
    path = write(
        '<integrator type="direct"/><emitter type="constant"/><shape type="sdfgrid">'
        '<string name="filename" value="ball.vol"/><transform name="to_world">'
        '<translate x="-.5" y="-.5" z="-.5"/><scale value="4"/></transform>'
        f'<bsdf type="diffuse">{checks("reflectance", 0.8, 0.2)}</bsdf></shape>'
    )
    theirs, ours = (mean(path, "rgb", 256) for mean in (mitsuba_mean, our_mean))
    np.testing.assert_allclose(ours, theirs, rtol=0.01)


DARK = np.array([[[70, 50, 40], [50, 30, 22]], [[90, 70, 52], [30, 24, 20]]], np.uint8)


def test_dark_bitmaps_in_spectral_mode(write, tmp_path):
    """The colours are those of Mitsuba's RGB mode; its spectral mode is 0.5 % darker.

    Each point sees the same light from everywhere, so that wavelengths are all that is random.
    """
    images.write_stored(tmp_path / "dark.png", DARK)
    path = write(
        '<integrator type="direct"/><emitter type="constant"/><shape type="rectangle"><transform '
        'name="to_world"><scale value="2"/></transform><bsdf type="diffuse"><texture type="bitmap" '
        'name="reflectance"><string name="filename" value="dark.png"/></texture></bsdf></shape>'
    )
    theirs, ours = mitsuba_mean(path, "rgb", 256), our_mean(path, "spectral", 512)
    np.testing.assert_allclose(ours, theirs, rtol=2e-3)


@pytest.mark.parametrize("name", ["eta", "k"])
def test_spectra_of_metals_in_rgb(write, name):
    """Pairs of a file are numbers under D65 in both; Mitsuba's metals by name are not balanced."""
    pairs = "360:0.4, 500:2.5, 600:1.2, 830:3.1"
    mi.set_variant("scalar_rgb")
    path = write(
        f'<shape type="sphere"><bsdf type="conductor" id="m"><spectrum name="{name}" '
        f'value="{pairs}"/></bsdf></shape>'
    )
    parameters = dict(mi.traverse(mi.load_file(str(path), optimize=False)))
    theirs = next(parameters[key] for key in parameters if key.endswith(f".{name}.value"))
    ours = getattr(clpt.load(path).shapes[0].material, name).to_rgb("unbounded")
    np.testing.assert_allclose(ours, np.array(theirs).ravel(), rtol=3e-3)
