"""Meshes that skeletons and blend shapes move, beside linear blend skinning by hand."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.scene import Scene
from clpt.scene.shapes import Mesh
from tests.formats.usd.conftest import SUN, Loader

pytest.importorskip("pxr")

TIMES = "startTimeCode = 0\n endTimeCode = 10\n timeCodesPerSecond = 10"
ONE = "((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))"
UP = "((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,1,0,1))"
BINDS = '(prepend apiSchemas = ["SkelBindingAPI"])'


def posed(weights: str = "1, 0, 0, 1", bound: str = "</Root/Skel>", mesh: str = "") -> str:
    """A strip of two bones, 1 long; the upper one turns by a quarter about z until time 10."""
    return f"""def SkelRoot "Root" {BINDS} {{
    def Skeleton "Skel" {BINDS} {{
        uniform token[] joints = ["A", "A/B"]
        uniform matrix4d[] bindTransforms = [{ONE}, {UP}]
        uniform matrix4d[] restTransforms = [{ONE}, {UP}]
        rel skel:animationSource = </Root/Anim>
        double3 xformOp:translate = (0, 0, 7)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
    def SkelAnimation "Anim" {{
        uniform token[] joints = ["A", "A/B"]
        float3[] translations = [(0,0,0), (0,1,0)]
        half3[] scales = [(1,1,1), (1,1,1)]
        quatf[] rotations.timeSamples = {{
            0: [(1,0,0,0), (1,0,0,0)], 10: [(1,0,0,0), (0.70710678,0,0,0.70710678)]
        }}
        uniform token[] blendShapes = ["wide"]
        float[] blendShapeWeights.timeSamples = {{ 0: [0], 10: [0.5] }}
    }}
    def Mesh "M" {BINDS} {{
        point3f[] points = [(0, 1, 2), (1, 1, 2), (1, 2, 2), (0, 2, 2)]
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        uniform token subdivisionScheme = "none"
        rel skel:skeleton = {bound}
        int[] primvars:skel:jointIndices = [0, 1, 0, 1, 0, 1, 0, 1] (
            interpolation = "vertex"
            elementSize = 2
        )
        float[] primvars:skel:jointWeights = [{weights}, 0, 1, 0.5, 0.5] (
            interpolation = "vertex"
            elementSize = 2
        )
        double3 xformOp:translate = (0, 0, 3)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        {mesh}
    }}
}}
{SUN}"""


def mesh_of(scene: Scene) -> Mesh:
    (mesh,) = (shape for shape in scene.shapes if shape.name == "M")
    return mesh


def test_joints_move_points(stage: Loader) -> None:
    """A quarter about (0, 1) takes x, y to 1 - y, 1 + x; the last point is the mean of both.

    The skeleton stands 4 above the mesh: points of the mesh's space are taken into its own.
    """
    still = mesh_of(stage(posed(), TIMES)).vertices
    assert np.allclose(still, [(0, 1, 6), (1, 1, 6), (1, 2, 6), (0, 2, 6)])
    turned = mesh_of(stage(posed(), TIMES, time=10))
    assert np.allclose(
        turned.vertices, [(0, 1, 6), (0, 2, 6), (-1, 2, 6), (-0.5, 1.5, 6)], atol=1e-5
    )
    assert turned.to_world[2, 3] == 3.0


def test_normals_turn_with_their_points(stage: Loader) -> None:
    """By the inverse transpose: at the last point half a turn is lost, and lengths are one."""
    normals = "normal3f[] normals = [(1, 0, 0), (1, 0, 0), (0.6, 0, 0.8), (1, 0, 0)]"
    flat = mesh_of(stage(posed(mesh=normals), TIMES, time=10)).normals
    root = np.sqrt(0.5)
    expected = [(1, 0, 0), (0, 1, 0), (0, 0.6, 0.8), (root, root, 0)]
    assert np.allclose(flat, expected, atol=1e-4)


def test_blend_shapes_come_before_joints(stage: Loader) -> None:
    wide = """uniform token[] skel:blendShapes = ["wide"]
        rel skel:blendShapeTargets = </Root/M/wide>
        def BlendShape "wide" {
            uniform vector3f[] offsets = [(2, 0, 0)]
            uniform int[] pointIndices = [1]
        }"""
    points = mesh_of(stage(posed(mesh=wide), TIMES, time=10)).vertices
    assert np.allclose(points[:3], [(0, 1, 6), (0, 3, 6), (-1, 2, 6)], atol=1e-5)


def test_a_shutter_bends(stage: Loader) -> None:
    keys = mesh_of(stage(posed(), TIMES, time=0, shutter=10)).deformation
    assert (keys.times[0], keys.times[-1]) == pytest.approx((0.0, 1.0))
    assert np.allclose(keys.points[0][1], (1, 1, 6), atol=1e-5)
    middle = keys.points[len(keys.points) // 2][1]
    root = np.sqrt(0.5)
    assert np.allclose(middle, (root, 1.0 + root, 6.0), atol=1e-4)  # at half of the turn
    assert np.allclose(keys.points[-1][1], (0, 2, 6), atol=1e-5)


@pytest.mark.parametrize(
    ("change", "message"),
    [({"bound": "</Root/None>"}, "skeleton is not there"), ({"weights": "1, 0, 0"}, "do not fit")],
)
def test_a_mesh_without_its_bones_is_at_rest(
    stage: Loader, change: dict[str, str], message: str
) -> None:
    scene = stage(posed(**change), TIMES, time=10)
    assert np.allclose(mesh_of(scene).vertices[2], (1, 2, 2))
    assert any(message in warning for warning in scene.warnings), scene.warnings
