"""Stages as scenes: geometry, cameras, packages, and what is told."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from clpt.errors import SceneError
from clpt.formats import load
from clpt.scene.cameras import Orthographic, ThinLens
from clpt.scene.shapes import Mesh
from tests.formats.usd.conftest import SQUARE, SUN, Loader, usda

pytest.importorskip("pxr")
from pxr import UsdUtils

CAMERA = """
def Camera "View" {
    float focalLength = 50
    float horizontalAperture = 20
    float verticalAperture = 10
    float2 clippingRange = (1, 1000)
    double3 xformOp:translate = (1, 2, 3)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    %s
}
"""


def only_mesh(scene: object) -> Mesh:
    meshes = [shape for shape in scene.shapes if isinstance(shape, Mesh) and shape.name == "M"]
    assert len(meshes) == 1
    return meshes[0]


def test_a_square_in_centimetres(stage: Loader) -> None:
    """Transforms of parents count, and positions become metres."""
    text = """def Xform "A" {
        double3 xformOp:translate = (100, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def Mesh "M" { %s }
    }"""
    scene = stage(text % SQUARE + SUN, 'metersPerUnit = 0.01\nupAxis = "Z"')
    mesh = only_mesh(scene)
    world = mesh.vertices @ mesh.to_world[:3, :3].T + mesh.to_world[:3, 3]
    assert np.allclose(
        sorted(world.tolist()), [[1, 0, 0], [1, 0.01, 0], [1.01, 0, 0], [1.01, 0.01, 0]]
    )
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert mesh.normals is None
    assert scene.extra["studio"]["up"] == "z"
    assert scene.warnings == []


@pytest.mark.parametrize(
    ("interpolation", "values", "rows"),
    [
        ("constant", "[(1, 0, 0)]", [[1, 0, 0]] * 4),
        (
            "vertex",
            "[(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)]",
            np.vstack([np.eye(3), np.ones(3)]),
        ),
        ("uniform", "[(0, 1, 0)]", [[0, 1, 0]] * 4),
        (
            "faceVarying",
            "[(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)]",
            np.vstack([np.eye(3), np.ones(3)]),
        ),
    ],
)
def test_display_colors_of_every_interpolation(
    stage: Loader, interpolation: str, values: str, rows: object
) -> None:
    color = f'color3f[] primvars:displayColor = {values} (interpolation = "{interpolation}")'
    mesh = only_mesh(stage(f'def Mesh "M" {{ {SQUARE}\n {color} }} {SUN}'))
    assert np.allclose(mesh.attributes["vertex_displayColor"], rows)
    assert len(mesh.vertices) == 4


def test_corners_that_differ_are_apart(stage: Loader) -> None:
    """Two triangles share an edge: its vertices have two colors each, the others one."""
    text = """def Mesh "M" {
        point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
        int[] faceVertexCounts = [3, 3]
        int[] faceVertexIndices = [0, 1, 2, 0, 2, 3]
        uniform token subdivisionScheme = "none"
        uniform token orientation = "leftHanded"
        color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0)] (interpolation = "faceVarying")
        int[] primvars:displayColor:indices = [0, 0, 0, 1, 1, 1]
    }"""
    mesh = only_mesh(stage(text + SUN))
    assert len(mesh.vertices) == 6
    colors = mesh.attributes["vertex_displayColor"][mesh.faces]
    assert np.allclose(colors, [[[1, 0, 0]] * 3, [[0, 1, 0]] * 3])
    corners = mesh.vertices[mesh.faces[0]]
    assert np.cross(corners[1] - corners[0], corners[2] - corners[0])[2] < 0.0


def test_primvars_that_do_not_fit_are_told(stage: Loader) -> None:
    color = 'color3f[] primvars:displayColor = [(1, 0, 0)] (interpolation = "vertex")'
    scene = stage(f'def Mesh "M" {{ {SQUARE}\n {color} }} {SUN}')
    assert np.allclose(only_mesh(scene).attributes["vertex_displayColor"], 0.18)
    assert scene.warnings == [
        "/M: primvar 'displayColor' is left out, as it has too few values to be vertex"
    ]


def test_subsets_have_their_materials(stage: Loader) -> None:
    text = """
    def Material "Red" {
        token outputs:surface.connect = </Red/S.outputs:surface>
        def Shader "S" {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (1, 0, 0)
            token outputs:surface
        }
    }
    def Mesh "M" (prepend apiSchemas = ["MaterialBindingAPI"]) {
        point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
        int[] faceVertexCounts = [3, 3]
        int[] faceVertexIndices = [0, 1, 2, 0, 2, 3]
        uniform token subdivisionScheme = "none"
        def GeomSubset "Part" (prepend apiSchemas = ["MaterialBindingAPI"]) {
            uniform token elementType = "face"
            uniform token familyName = "materialBind"
            int[] indices = [1]
            rel material:binding = </Red>
        }
    }"""
    scene = stage(text + SUN)
    first, second = (shape for shape in scene.shapes if shape.name == "M")
    colors = [shape.material.front.base_color for shape in (first, second)]
    assert np.allclose([(c.r, c.g) for c in colors], [(1.0, 0.0), (0.18, 0.18)])
    assert np.allclose(first.vertices.mean(axis=0), [1 / 3, 2 / 3, 0])


def test_cameras(stage: Loader) -> None:
    scene = stage(CAMERA % "float fStop = 2; float focusDistance = 400", "metersPerUnit = 0.01")
    camera = scene.camera
    assert isinstance(camera, ThinLens)
    assert camera.fov == pytest.approx(2.0 * math.degrees(math.atan(0.2)))
    assert camera.aperture_radius == pytest.approx(0.5 * 0.05 / 2.0)
    assert (camera.focus_distance, camera.near, camera.far) == pytest.approx((4.0, 0.01, 10.0))
    assert np.allclose(camera.to_world[:3, 3], [0.01, 0.02, 0.03])
    assert np.allclose(camera.to_world[:3, 2], [0, 0, -1])
    assert np.allclose(camera.to_world[:3, 1], [0, 1, 0])
    assert scene.film.width == 2 * scene.film.height
    flat = stage(CAMERA % 'token projection = "orthographic"').camera
    assert isinstance(flat, Orthographic)
    assert np.linalg.norm(flat.to_world[:3, 0]) == pytest.approx(1.0)


def test_a_camera_is_chosen_by_name_or_path(stage: Loader) -> None:
    two = (
        f'def Mesh "M" {{ {SQUARE} }}'
        + CAMERA % ""
        + 'def Camera "Other" { float focalLength = 10 }'
    )
    assert stage(two, camera="Other").camera.fov > stage(two, camera="/View").camera.fov
    with pytest.raises(SceneError, match="shows no camera 'Third'; it shows: /View, /Other"):
        stage(two, camera="Third")


def test_hidden_prims_are_not_shown(stage: Loader) -> None:
    hidden = (
        'token visibility = "invisible"',
        'uniform token purpose = "guide"',
        'uniform token purpose = "proxy"',
    )
    for i, attribute in enumerate(hidden):
        scene = stage(
            f'def Xform "A{i}" {{ {attribute}\n def Mesh "M" {{ {SQUARE} }} }} {CAMERA % ""}'
        )
        assert not [shape for shape in scene.shapes if shape.name == "M"]
    shown = stage(
        f'def Xform "A" {{ uniform token purpose = "render"\n def Mesh "M" {{ {SQUARE} }} }} {SUN}'
    )
    assert only_mesh(shown) is not None


def test_packages_hold_their_images(tmp_path: Path) -> None:
    Image.new("RGB", (2, 2), (255, 0, 0)).save(tmp_path / "red.png")
    text = f"""
    def Material "Red" {{
        token outputs:surface.connect = </Red/S.outputs:surface>
        def Shader "S" {{
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor.connect = </Red/T.outputs:rgb>
            token outputs:surface
        }}
        def Shader "T" {{
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @./red.png@
            float3 outputs:rgb
        }}
    }}
    def Mesh "M" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
        {SQUARE}
        texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")
        rel material:binding = </Red>
    }}
    {SUN}"""
    (tmp_path / "red.usda").write_text(usda(text), encoding="utf-8")
    assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "red.usda"), str(tmp_path / "red.usdz"))
    (tmp_path / "red.png").unlink()
    scene = load(tmp_path / "red.usdz")
    bitmap = only_mesh(scene).material.front.base_color
    assert bitmap.image.tolist() == [[[255, 0, 0]] * 2] * 2
    assert not bitmap.raw
    assert only_mesh(scene).uvs.tolist() == [[0, 0], [1, 0], [1, 1], [0, 1]]
    loose = load(tmp_path / "red.usda")  # of which the image is gone
    black = only_mesh(loose).material.front.base_color
    assert (black.r, black.g, black.b) == (0.0, 0.0, 0.0)
    assert loose.warnings == [
        "/Red/T: image './red.png': there is no file './red.png'; its fallback stands for it"
    ]


@pytest.mark.parametrize("name", ["a.usda", "a.usdc", "a.usd", "a.usdz"])
def test_what_is_no_stage_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"#usda 1.0\n def Mesh {" if name == "a.usda" else b"nothing")
    with pytest.raises(SceneError, match="is no USD file that can be read") as caught:
        load(tmp_path / name)
    assert len(str(caught.value)) <= 300


def test_meshes_that_do_not_fit_name_their_prim(stage: Loader) -> None:
    text = """def Mesh "M" {
        point3f[] points = [(0, 0, 0)]
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [%s]
    }"""
    with pytest.raises(SceneError, match=r"/M.*name a vertex beyond the 1 that there are"):
        stage(text % "0, 0, 7")
    with pytest.raises(SceneError, match=r"/M.*add up to 3, there are 2 corners"):
        stage(text % "0, 0")


def test_without_the_package_the_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.usda").write_text("#usda 1.0\n", encoding="utf-8")
    monkeypatch.setitem(sys.modules, "pxr", None)
    for name in [name for name in sys.modules if name.startswith("clpt.formats.usd.")]:
        monkeypatch.delitem(sys.modules, name)
    with pytest.raises(SceneError, match=r"pip install 'clpt\[usd\]'"):
        load(tmp_path / "a.usda")
