"""Mitsuba's textures that hold others or are read from meshes."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.formats import load
from clpt.scene import shapes
from clpt.scene.textures import Bitmap, Checkerboard, MeshAttribute, Product

PLY = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
property float r
property float g
property float b
property float heat_0
element face 1
property list uchar int vertex_indices
end_header
0 0 0 0.1 0.2 0.3 5
1 0 0 0.4 0.5 0.6 6
0 1 0 0.7 0.8 0.9 7
3 0 1 2
"""


@pytest.fixture
def diffuse(tmp_path):
    """The mesh of a scene whose reflectance is described by `body`."""
    (tmp_path / "a.ply").write_text(PLY)
    (tmp_path / "a b.png").write_bytes(b"")

    def of(body: str) -> shapes.Mesh:
        path = tmp_path / "scene.xml"
        bsdf = f'<bsdf type="diffuse">{body}</bsdf>'
        shape = f'<shape type="ply"><string name="filename" value="a.ply"/>{bsdf}</shape>'
        sensor = '<sensor type="perspective"/>'
        path.write_text(f'<scene version="3.0.0">{shape}{sensor}</scene>', "utf-8")
        return load(path).shapes[0]

    return of


def _attribute(name, more=""):
    text = f'<texture type="mesh_attribute" name="reflectance"><string name="name" value="{name}"/>'
    return f"{text}{more}</texture>"


def test_mesh_attribute(diffuse):
    mesh = diffuse(_attribute("vertex_color"))
    assert isinstance(mesh.material.reflectance, MeshAttribute)
    colours = np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6], [0.7, 0.8, 0.9]], np.float32)
    np.testing.assert_array_equal(mesh.attributes["vertex_color"], colours)
    np.testing.assert_array_equal(mesh.attributes["vertex_heat"], [[5.0], [6.0], [7.0]])
    scaled = diffuse(_attribute("vertex_heat", '<float name="scale" value="0.1"/>'))
    made = scaled.material.reflectance
    assert isinstance(made, Product) and made.first.name == "vertex_heat"
    assert made.second.value == pytest.approx(0.1)
    with pytest.raises(SceneError, match=r"scene\.xml:1.*vertex_ or face_, not 'color'"):
        diffuse(_attribute("color"))


def test_nested_checkerboard(diffuse):
    bitmap = (
        '<texture type="bitmap" name="color0"><string name="filename" value="a b.png"/></texture>'
    )
    inner = (
        '<texture type="checkerboard" name="color1"><rgb name="color0" value="1, 0, 0"/></texture>'
    )
    outer = f'<texture type="checkerboard" name="reflectance">{bitmap}{inner}</texture>'
    made = diffuse(outer).material.reflectance
    assert isinstance(made.color0, Bitmap) and made.color0.image.name == "a b.png"
    assert isinstance(made.color1, Checkerboard)
    assert made.color1.color0.to_rgb() == pytest.approx([1.0, 0.0, 0.0])
