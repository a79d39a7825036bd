"""The "power" of pbrt's area lights: each shape that pbrt makes of a directive has all of it."""

from __future__ import annotations

import numpy as np
import pytest

import clpt
from clpt import images
from clpt.scene.textures import Product
from tests.pictures.support import with_film, with_path

POWER = 100.0
SQUARE = "[-1 -1 0 1 -1 0 -1 1 0 1 1 0]"  # of a patch: its rows run along u
TRIANGLES = '"point3 P" [0 0 0 4 0 0 4 2 0 0 2 0 0 3 0] "integer indices" '
PATCHES = '"point3 P" [0 0 0 1 0 0 0 1 0 1 1 0 4 0 0 4 1 0] "integer indices" '
PLY = """ply
format ascii 1.0
element vertex 6
property float x
property float y
property float z
element face %d
property list uchar int vertex_indices
end_header
0 0 0
2 0 0
2 2 0
0 2 0
5 0 0
5 2 0
"""
QUAD, TALL, TRIANGLE = "4 0 1 2 3\n", "4 1 4 5 2\n", "3 0 1 3\n"


@pytest.fixture
def emitter(tmp_path):
    """The one shape of a file, with a light of POWER."""
    names = {"quad": [QUAD], "quads": [QUAD, TALL], "mixed": [QUAD, TRIANGLE]}
    for name, faces in names.items():
        (tmp_path / f"{name}.ply").write_text(PLY % len(faces) + "".join(faces))
    images.write(tmp_path / "glow.pfm", np.full((2, 4, 3), (2.0, 2.0, 2.0), np.float32))

    def of(shape: str, light: str = '"rgb L" [1 1 1]', before: str = ""):
        path = tmp_path / "a.pbrt"
        given = f'AreaLightSource "diffuse" {light} "float power" {POWER}\n{before}Shape {shape}'
        path.write_text(f"WorldBegin\n{given}")
        (made,) = clpt.load(path).shapes
        return made

    return of


def radiances(shape) -> np.ndarray:
    """What each face of a shape emits, in grey."""
    value, factor = shape.emission.radiance, 1.0
    if isinstance(value, Product):
        value, factor = value.first, shape.attributes[value.second.name][:, 0]
    shown = value.image.mean() if hasattr(value, "image") else value.to_rgb("emission")
    return np.mean(shown) * np.atleast_1d(factor)


@pytest.mark.parametrize(
    ("shape", "area"),
    [
        ('"sphere" "float radius" 2', 16 * np.pi),
        ('"sphere" "float radius" 2 "float zmin" -1 "float zmax" 1.5', 10 * np.pi),
        ('"sphere" "float phimax" 90', np.pi),
        ('"disk" "float radius" 2', 4 * np.pi),
        ('"disk" "float radius" .5 "float innerradius" .2', 0.21 * np.pi),
        ('"disk" "float phimax" 90', np.pi / 4),
        ('"cylinder" "float radius" 2 "float zmin" 0 "float zmax" 3', 12 * np.pi),
        ('"cylinder" "float phimax" 180 "float zmin" 0 "float zmax" 3', 3 * np.pi),
        (f'"bilinearmesh" "point3 P" {SQUARE}', 4.0),
        (f'"bilinearmesh" {PATCHES} [0 1 2 3]', 1.0),
        (f'"bilinearmesh" {PATCHES} [0 1 2 3 0 1 2 3]', 1.0),  # two lights of one size
        (f'"trianglemesh" {TRIANGLES} [0 1 2 0 2 3]', 4.0),
        (f'"trianglemesh" {TRIANGLES} [0 1 2]', 4.0),
        ('"plymesh" "string filename" "quad.ply"', 4.0),
        ('"curve" "point3 P" [0 0 0 1 0 0 2 0 0 3 0 0] "float width" .1', 0.3 / 8),
        ('"curve" "point3 P" [0 0 0 1 0 0 2 0 0 3 0 0] "float width" .1 "integer splitdepth" 1',
         0.3 / 2),
        ('"curve" "string type" "ribbon" "point3 P" [0 0 0 1 0 0 2 0 0 3 0 0] "float width" .1'
         ' "normal N" [0 0 1 0 0 1]', 0.3 / 8),
    ],
)  # fmt: skip
def test_power_over_pi_and_area(emitter, shape, area):
    for light, factor in (
        ('"rgb L" [1 1 1]', 1.0),
        ('"rgb L" [3 3 3] "float scale" 2', 6.0),  # the numbers of an rgb count, as in pbrt
        ('"bool twosided" true', 0.5),
        ('"string filename" "glow.pfm"', 1.0),  # its mean is taken into account
    ):
        made = emitter(shape, light)
        assert radiances(made) == pytest.approx(factor * POWER / (np.pi * area), rel=1e-3)


@pytest.mark.parametrize(
    ("shape", "areas"),
    [
        (f'"trianglemesh" {TRIANGLES} [0 1 2 0 2 4]', [4.0, 6.0]),
        (f'"bilinearmesh" {PATCHES} [0 1 2 3 1 4 3 5]', [1.0, 1.0, 3.0, 3.0]),
        ('"plymesh" "string filename" "quads.ply"', [4.0, 4.0, 6.0, 6.0]),
        ('"plymesh" "string filename" "mixed.ply"', [4.0, 4.0, 2.0]),
    ],
)
def test_each_piece_has_the_whole_power(emitter, shape, areas):
    for light in ('"rgb L" [1 1 1]', '"string filename" "glow.pfm"'):
        expected = POWER / (np.pi * np.array(areas))
        assert radiances(emitter(shape, light)) == pytest.approx(expected, rel=1e-5)


def test_the_area_is_that_in_the_world(emitter):
    shape = '"disk" "float radius" 1 "float innerradius" .5'
    made = emitter(shape, before="Scale 2 3 1\n")
    assert radiances(made) == pytest.approx(POWER / (np.pi * 6 * 0.75 * np.pi), rel=1e-3)


def test_pieces_of_several_sizes_shine_as_they_are_seen(tmp_path):
    """Two triangles side by side, one twice the other, in a picture of two pixels."""
    (tmp_path / "a.pbrt").write_text(
        "LookAt 0 0 5 0 0 0 0 1 0\n"
        'Camera "orthographic" "float screenwindow" [-1 1 -.5 .5]\n'
        'Film "rgb" "integer xresolution" 2 "integer yresolution" 1\nPixelFilter "box"\n'
        "WorldBegin\n"
        f'AreaLightSource "diffuse" "float power" {POWER}\n'
        'Shape "trianglemesh" "point3 P" [-9 -9 0 0 -9 0 0 9 0 -9 9 0 18 -9 0 18 9 0]'
        ' "integer indices" [0 1 2 0 2 3 1 4 5 1 5 2]\n'
    )
    scene = with_film(with_path(clpt.load(tmp_path / "a.pbrt"), light_paths=0), mode="rgb")
    with clpt.Renderer(scene) as renderer:
        renderer.run(4)
        seen = renderer.image()[0].mean(axis=1)
    assert np.sort(seen)[::-1] == pytest.approx(POWER / np.pi / np.array([81.0, 162.0]), rel=2e-3)


def test_an_interface_has_no_light(tmp_path):
    """pbrt leaves out the light of a shape that is none."""
    path = tmp_path / "a.pbrt"
    path.write_text('WorldBegin\nMaterial "interface"\nAreaLightSource "diffuse"\nShape "sphere"\n')
    scene = clpt.load(path)
    assert scene.shapes[0].emission is None
    assert any("its light is left out" in warning for warning in scene.warnings)
