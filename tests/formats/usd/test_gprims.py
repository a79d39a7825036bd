"""Instances, point instancers, quadrics, curves and points."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clpt import transforms
from clpt.errors import SceneError
from clpt.formats.usd import gprims
from clpt.scene.shapes import Curves, Instance, Mesh, Shape, Sphere, Spheres
from tests.formats.usd.conftest import SQUARE, SUN, Loader

pytest.importorskip("pxr")

MOVED = (
    'double3 xformOp:translate = ({}, 0, 0)\n uniform token[] xformOpOrder = ["xformOp:translate"]'
)
CLASS = f'class Xform "P" {{ def Mesh "M" {{ {SQUARE} }} def SphereLight "L" {{}} }}\n'


def placed(shape: Shape) -> np.ndarray:
    """Return the middle of a shape in the world."""
    points = shape.vertices if isinstance(shape, Mesh) else np.zeros((1, 3))
    return transforms.transform_points(np.asarray(shape.to_world), points).mean(axis=0)


def two_instances() -> str:
    return CLASS + "\n".join(
        f'def Xform "I{x}" (instanceable = true\n references = </P>) {{ {MOVED.format(x)} }}'
        for x in (10, 20)
    )


def test_few_triangles_are_copied(stage: Loader) -> None:
    scene = stage(two_instances())
    meshes = [shape for shape in scene.shapes if shape.name == "M"]
    assert sorted(placed(mesh)[0] for mesh in meshes) == pytest.approx([10.5, 20.5])
    assert meshes[0].vertices is meshes[1].vertices
    lamps = [placed(shape)[0] for shape in scene.shapes if shape.name == "L"]
    assert sorted(lamps) == pytest.approx([10.0, 20.0])


def test_many_triangles_are_instanced(stage: Loader, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gprims, "INSTANCED", 1)
    scene = stage(two_instances())
    instances = [shape for shape in scene.shapes if isinstance(shape, Instance)]
    assert sorted(placed(shape)[0] for shape in instances) == pytest.approx([10.0, 20.0])
    assert instances[0].group is instances[1].group
    assert [shape.name for shape in instances[0].group.shapes] == ["M"]


def test_instances_bind_materials_for_what_binds_none(stage: Loader) -> None:
    text = (
        two_instances()
        .replace("references = </P>)", 'references = </P>\n apiSchemas = ["MaterialBindingAPI"])')
        .replace(
            'xformOpOrder = ["xformOp:translate"] }',
            'xformOpOrder = ["xformOp:translate"]\n rel material:binding = </Red> }',
            1,
        )
    )
    red = """def Material "Red" {
        token outputs:surface.connect = </Red/S.outputs:surface>
        def Shader "S" {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (1, 0, 0)
            token outputs:surface
        }
    }"""
    meshes = [shape for shape in stage(red + text).shapes if shape.name == "M"]
    colors = {round(placed(mesh)[0], 1): mesh.material.front.base_color.r for mesh in meshes}
    assert colors == pytest.approx({10.5: 1.0, 20.5: 0.18})


def test_point_instancers_place_prototypes(stage: Loader) -> None:
    """Positions, scales and turns count, a prototype's own place too; ids may be masked."""
    text = f"""def PointInstancer "Many" {{
        {MOVED.format(100)}
        point3f[] positions = [(0, 0, 0), (1, 0, 0), (2, 0, 0)]
        quath[] orientations = [(1, 0, 0, 0), (0, 0, 0, 1), (1, 0, 0, 0)]
        float3[] scales = [(2, 2, 2), (1, 1, 1), (1, 1, 1)]
        int[] protoIndices = [0, 0, 0]
        int64[] invisibleIds = [2]
        rel prototypes = </Many/Protos/M>
        over "Protos" {{
            {MOVED.format(1000)}
            def Mesh "M" {{ {MOVED.format(5)}\n {SQUARE} }}
        }}
    }}"""
    meshes = [shape for shape in stage(text + SUN).shapes if shape.name == "M"]
    middles = np.array([placed(mesh) for mesh in meshes])
    assert np.allclose(middles, [[111.0, 1.0, 0.0], [95.5, -0.5, 0.0]], atol=1e-3)


def test_spheres_and_their_stretched_kin(stage: Loader) -> None:
    scale = 'float3 xformOp:scale = {}\n uniform token[] xformOpOrder = ["xformOp:scale"]'
    even, uneven = (
        stage(f'def Sphere "S" {{ double radius = 2\n {scale.format(s)} }} {SUN}').shapes[0]
        for s in ("(3, 3, 3)", "(3, 3, 6)")
    )
    assert isinstance(even, Sphere)
    assert even.radius == pytest.approx(2.0)
    assert isinstance(uneven, Mesh)
    world = transforms.transform_points(uneven.to_world, uneven.vertices)
    assert np.allclose(np.abs(world).max(axis=0), [6, 6, 12], rtol=1e-3)


@pytest.mark.parametrize(
    ("prim", "extent"),
    [
        ('Cube "S" { double size = 4', [4, 4, 4]),
        (
            'Cylinder "S" { double radius = 1; double height = 6; uniform token axis = "X"',
            [6, 2, 2],
        ),
        ('Cone "S" { double radius = 1; double height = 6; uniform token axis = "Y"', [2, 6, 2]),
        ('Capsule "S" { double radius = 1; double height = 6; uniform token axis = "Z"', [2, 2, 8]),
        ('Plane "S" { double width = 3; double length = 5; uniform token axis = "Z"', [3, 5, 0]),
        ('Plane "S" { double width = 3; double length = 5; uniform token axis = "Y"', [3, 0, 5]),
        ('Plane "S" { double width = 3; double length = 5; uniform token axis = "X"', [0, 5, 3]),
    ],
)
def test_quadrics_face_outward(stage: Loader, prim: str, extent: Any) -> None:
    mesh = stage(f"def {prim} }} {SUN}").shapes[0]
    assert np.allclose(np.ptp(mesh.vertices, axis=0), extent, atol=1e-5)
    a, b, c = (mesh.vertices[mesh.faces[:, i]].astype(float) for i in range(3))
    facing = np.cross(b - a, c - a)
    if "Plane" in prim:
        axis = extent.index(0)
        assert (facing[:, axis] > 0.0).all()
        return
    assert (np.einsum("ij,ij->i", facing, a + b + c) > 0.0).all()
    if mesh.normals is not None:
        assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-6)
        assert (np.einsum("ij,ij->i", facing, mesh.normals[mesh.faces[:, 0]]) > 0.0).all()


CURVES = """def BasisCurves "C" {{
    uniform token type = "{}"
    uniform token basis = "{}"
    uniform token wrap = "{}"
    point3f[] points = {}
    int[] curveVertexCounts = {}
    float[] widths = {} (interpolation = "{}")
}}
"""
FIVE = "[(0, 0, 0), (1, 1, 0), (2, 0, 0), (3, 1, 0), (4, 0, 0)]"
P = np.array([[0, 0, 0], [1, 1, 0], [2, 0, 0], [3, 1, 0], [4, 0, 0]], float)


def curve(stage: Loader, *parts: object) -> Curves:
    return stage(CURVES.format(*parts) + SUN).shapes[0]


def test_catmull_rom_goes_through_its_points(stage: Loader) -> None:
    open_ = curve(stage, "cubic", "catmullRom", "nonperiodic", FIVE, "[5]", "[0.2]", "constant")
    assert (open_.basis, open_.lengths) == ("bezier", (7,))
    assert np.allclose(open_.points[::3, :3], P[1:4])
    assert np.allclose(open_.points[1, :3], P[1] + (P[2] - P[0]) / 6.0)
    assert np.allclose(open_.points[:, 3], 0.1)
    pinned = curve(stage, "cubic", "catmullRom", "pinned", FIVE, "[5]", "[0.2]", "constant")
    assert np.allclose(pinned.points[::3, :3], P)
    ring = curve(stage, "cubic", "catmullRom", "periodic", FIVE, "[5]", "[0.2]", "constant")
    assert np.allclose(ring.points[::3, :3], [*P, P[0]])


def test_b_splines_are_beziers(stage: Loader) -> None:
    open_ = curve(
        stage, "cubic", "bspline", "nonperiodic", FIVE, "[5]", "[1, 2, 3, 4, 5]", "vertex"
    )
    assert np.allclose(
        open_.points[::3, :3], [(P[i] + 4 * P[i + 1] + P[i + 2]) / 6 for i in range(3)]
    )
    assert np.allclose(open_.points[1, :3], (2 * P[1] + P[2]) / 3)
    assert np.allclose(open_.points[::3, 3], [1.0, 1.5, 2.0])
    pinned = curve(stage, "cubic", "bspline", "pinned", FIVE, "[5]", "[1]", "constant")
    assert np.allclose(pinned.points[[0, -1], :3], P[[0, 4]])
    assert len(pinned.points) == 13


def test_lines_and_beziers_are_as_they_are(stage: Loader) -> None:
    lines = curve(stage, "linear", "bezier", "nonperiodic", FIVE, "[2, 3]", "[2, 4]", "uniform")
    assert (lines.basis, lines.lengths) == ("linear", (2, 3))
    assert np.allclose(lines.points, np.column_stack([P, [1, 1, 2, 2, 2]]))
    ring = curve(stage, "linear", "bezier", "periodic", FIVE, "[5]", "[2]", "constant")
    assert np.allclose(ring.points[:, :3], [*P, P[0]])
    bezier = curve(stage, "cubic", "bezier", "nonperiodic", FIVE, "[4, 1]", "[1, 2]", "varying")
    assert (bezier.basis, bezier.lengths) == ("bezier", (4,))
    assert np.allclose(bezier.points[:, 3], np.linspace(0.5, 1.0, 4))


def test_counts_of_curves_must_fit(stage: Loader) -> None:
    with pytest.raises(SceneError, match=r"/C.*curveVertexCounts add up to 7, there are 5 points"):
        curve(stage, "linear", "bezier", "nonperiodic", FIVE, "[3, 4]", "[1]", "constant")


def test_points_are_balls(stage: Loader) -> None:
    text = """def Points "P" {
        point3f[] points = [(0, 0, 0), (1, 0, 0)]
        float[] widths = [2, 4]
        color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0)] (interpolation = "vertex")
    }"""
    balls = stage(text + SUN).shapes[0]
    assert isinstance(balls, Spheres)
    assert np.allclose(balls.radii, [1, 2])
    assert np.allclose(balls.attributes["vertex_displayColor"], [[1, 0, 0], [0, 1, 0]])


def test_curves_have_one_color(stage: Loader) -> None:
    colors = '[(1, 0, 0), (0, 1, 0)] (interpolation = "uniform")'
    text = CURVES.format("linear", "bezier", "nonperiodic", FIVE, "[2, 3]", "[1]", "constant")
    text = text[:-2] + f"\n color3f[] primvars:displayColor = {colors} }}"
    scene = stage(text + SUN)
    shown = scene.shapes[0].material.front.base_color
    assert (shown.r, shown.g, shown.b) == pytest.approx((0.5, 0.5, 0.0))
    assert scene.warnings == ["/C: the mean of primvar 'displayColor' stands for its values"]
