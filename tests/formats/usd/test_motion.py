"""Times, shutters, variants, render settings, subdivision, and what is missing."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.scene.shapes import Mesh
from tests.formats.usd.conftest import SQUARE, SUN, Loader

pytest.importorskip("pxr")
scenes = pytest.importorskip("clpt.formats.usd.scenes")

TIMES = "startTimeCode = 1\n endTimeCode = 5\n timeCodesPerSecond = 10"
MOVING = f"""def Mesh "M" {{
    {SQUARE}
    double3 xformOp:translate.timeSamples = {{ 1: (0, 0, 0), 5: (8, 0, 0) }}
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
"""


def only_mesh(scene: object) -> Mesh:
    (mesh,) = (shape for shape in scene.shapes if shape.name == "M")
    return mesh


def test_time_codes(stage: Loader) -> None:
    assert only_mesh(stage(MOVING + SUN, TIMES)).to_world[0, 3] == 0.0
    assert only_mesh(stage(MOVING + SUN, TIMES, time=3)).to_world[0, 3] == pytest.approx(4.0)
    with pytest.raises(SceneError, match="time must be a number"):
        stage(MOVING + SUN, TIMES, time="noon")
    with pytest.raises(SceneError, match="USD has no variable 'tiem'; did you mean 'time'"):
        stage(MOVING + SUN, TIMES, tiem=3)


def test_a_camera_opens_its_shutter(stage: Loader) -> None:
    """Keys are in seconds; they go from the time plus when it opens, to when it closes."""
    view = 'def Camera "V" { double shutter:open = -0.5; double shutter:close = 0.5 }\n'
    scene = stage(MOVING + SUN + view, TIMES, time=3)
    keys = only_mesh(scene).motion
    assert (keys.times[0], keys.times[-1]) == pytest.approx((0.25, 0.35))
    assert (keys.transforms[0][0, 3], keys.transforms[-1][0, 3]) == pytest.approx((3.0, 5.0))
    assert (scene.camera.shutter.open, scene.camera.shutter.close) == pytest.approx((0.25, 0.35))
    assert only_mesh(stage(MOVING + SUN + view, TIMES, time=3, shutter=0)).motion is None


def test_what_shines_and_is_stretched_as_it_moves_is_dark(stage: Loader) -> None:
    text = f"""
    def Material "Glow" {{
        token outputs:surface.connect = </Glow/S.outputs:surface>
        def Shader "S" {{
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:emissiveColor = (1, 1, 1)
            token outputs:surface
        }}
    }}
    def Mesh "M" (apiSchemas = ["MaterialBindingAPI"]) {{
        {SQUARE}
        rel material:binding = </Glow>
        float3 xformOp:scale.timeSamples = {{ 1: (1, 1, 1), 5: (1, %s, %s) }}
        uniform token[] xformOpOrder = ["xformOp:scale"]
    }}
    """
    scene = stage(text % (2, 1) + SUN, TIMES, shutter=2)
    assert only_mesh(scene).emission is None and "its motion stretches it" in scene.warnings[0]
    evenly = text.replace("5: (1,", "5: (2,") % (2, 2)
    assert only_mesh(stage(evenly + SUN, TIMES, shutter=2)).emission is not None


def test_a_single_sample_is_no_motion(stage: Loader, monkeypatch: pytest.MonkeyPatch) -> None:
    still = MOVING.replace(", 5: (8, 0, 0)", "")
    monkeypatch.setattr(scenes.animation, "scene_over_shutter", None)  # the scene is read once
    mesh = only_mesh(stage(still + SUN, TIMES, shutter=1))
    assert mesh.motion is None and mesh.to_world[0, 3] == 0.0


def test_vertices_move(stage: Loader) -> None:
    text = SQUARE.replace(
        "point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]",
        """point3f[] points.timeSamples = {
            1: [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)],
            5: [(0, 0, 4), (1, 0, 4), (1, 1, 4), (0, 1, 4)],
        }""",
    )
    scene = stage(f'def Mesh "M" {{ {text} }} {SUN}', TIMES, time=1, shutter=2)
    keys = only_mesh(scene).deformation
    assert np.allclose(keys.points[0][:, 2], 0.0)
    assert np.allclose(keys.points[-1][:, 2], 2.0)
    assert (keys.times[0], keys.times[-1]) == pytest.approx((0.1, 0.3))


VARIED = f"""def Xform "A" (
    variants = {{ string size = "small" }}
    prepend variantSets = "size"
) {{
    variantSet "size" = {{
        "small" {{ def Mesh "M" {{ {SQUARE} }} }}
        "large" {{ def Mesh "M" {{ {SQUARE.replace("1", "7")} }} }}
    }}
}}
"""


def test_variants(stage: Loader) -> None:
    assert only_mesh(stage(VARIED + SUN)).vertices.max() == 1.0
    text = VARIED.replace("[0, 7, 2, 3]", "[0, 1, 2, 3]")
    assert only_mesh(stage(text + SUN, variant="size=large")).vertices.max() == 7.0
    with pytest.raises(SceneError, match="no variant 'size=huge'; it has size=large, size=small"):
        stage(VARIED + SUN, variant="size=huge")
    with pytest.raises(SceneError, match="a variant is SET=NAME, not 'large'"):
        stage(VARIED + SUN, variant="large")


def test_render_settings(stage: Loader) -> None:
    text = """
    def Camera "A" {}
    def Camera "B" {
        float focalLength = 10
        float horizontalAperture = 20
        float verticalAperture = 20
    }
    def RenderSettings "S" {
        uniform int2 resolution = (400, 200)
        rel camera = </B>
        %s
    }
    """
    mesh = f'def Mesh "M" {{ {SQUARE} }} {SUN}'
    scene = stage(mesh + text % "")
    assert (scene.film.width, scene.film.height) == (400, 200)
    assert scene.camera.fov == pytest.approx(2 * np.degrees(np.arctan(2.0)))  # twice as wide
    cropped = stage(mesh + text % 'uniform token aspectRatioConformPolicy = "cropAperture"')
    assert cropped.camera.fov == pytest.approx(90.0)
    assert stage(mesh + text % "", camera="A").camera.fov < 40.0
    lost = stage((mesh + text % "").replace("rel camera = </B>", "rel camera = </Gone>"))
    assert lost.camera.fov == stage(mesh + text % "", camera="A").camera.fov
    assert lost.warnings == ["render settings: its camera /Gone is not there; /A replaces it"]


def test_variables_become_layers(stage: Loader) -> None:
    def variable(prim: str, source: str) -> str:
        return f'def RenderVar "{prim}" {{ uniform string sourceName = "{source}" }}\n'

    text = f"""
    def Mesh "M" {{ {SQUARE} }}
    {SUN}
    {variable("C", "Ci")} {variable("N", "ri:Nn")} {variable("D", "cameraDepth")}
    {variable("D2", "depth")} {variable("X", "wetness")}
    def RenderProduct "P" {{ rel orderedVars = [</C>, </N>, </D>, </D2>, </X>] }}
    def RenderSettings "S" {{ rel products = </P> }}
    """
    scene = stage(text)
    assert scene.film.layers == ("shading_normal", "z")
    assert scene.warnings == ["/X: the variable 'wetness' is left out"]


def test_what_is_missing_is_told_by_prim(stage: Loader) -> None:
    text = f"""
    def Mesh "M" {{ {SQUARE} }}
    def "A" (references = @gone.usda@</X>) {{ }}
    def "B" (payload = @gone.usd@) {{ }}
    def "C" (references = </C>) {{ }}
    {SUN}"""
    scene = stage(text)
    assert only_mesh(scene) is not None
    assert sorted(scene.warnings) == [
        "/A: Could not open asset @gone.usda@ for reference",
        "/B: Could not open asset @gone.usd@ for payload",
        "/C: Cycle detected:",
    ]


CAGE = """def Mesh "M" {
    point3f[] points = [(-1, -1, -1), (1, -1, -1), (-1, 1, -1), (1, 1, -1),
                        (-1, -1, 1), (1, -1, 1), (-1, 1, 1), (1, 1, 1)]
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4,
                               2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5]
    %s
}
"""


@pytest.mark.parametrize("levels", [1, 2])
def test_subdivision_surfaces(stage: Loader, levels: int) -> None:
    colors = ", ".join(["(1, 0, 0)"] * 5 + ["(0, 1, 0)"])
    color = f'color3f[] primvars:displayColor = [{colors}] (interpolation = "uniform")'
    mesh = only_mesh(stage(CAGE % color + SUN, subdivision=levels))
    assert len(mesh.faces) == 2 * 6 * 4**levels
    assert mesh.vertices.max() == pytest.approx(0.8395062)
    assert np.abs(np.abs(mesh.vertices).min(axis=1) - 0.5).min() < 1e-6
    green = mesh.attributes["vertex_displayColor"][mesh.faces][:, :, 1].mean(axis=1) > 0.5
    assert green.sum() == len(mesh.faces) / 6
    assert (mesh.vertices[mesh.faces[green]].mean(axis=1)[:, 0] > 0.4).all()
    outward = np.einsum("ij,ij->i", mesh.normals, mesh.vertices)
    assert (outward > 0.0).all()


def test_creases_keep_a_cube(stage: Loader) -> None:
    creases = """int[] creaseIndices = [0, 1, 3, 2, 0, 4, 5, 7, 6, 4, 0, 4, 1, 5, 2, 6, 3, 7]
    int[] creaseLengths = [5, 5, 2, 2, 2, 2]
    float[] creaseSharpnesses = [10, 10, 10, 10, 10, 10]"""
    mesh = only_mesh(stage(CAGE % creases + SUN))
    assert np.allclose(np.abs(mesh.vertices).max(axis=1), 1.0)
    assert np.allclose(np.abs(mesh.normals).max(axis=1), 1.0)
    whole = only_mesh(stage(CAGE % "int[] holeIndices = [5]" + SUN))
    assert len(whole.faces) == 5 * 16 * 2


def test_coordinates_are_refined_by_their_rule(stage: Loader) -> None:
    """Of one square: linear inside and at its edge with `all`; a curve at the edge otherwise."""
    text = f"""
    def Material "T" {{
        token outputs:surface.connect = </T/S.outputs:surface>
        def Shader "S" {{
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor.connect = </T/R.outputs:result>
            token outputs:surface
        }}
        def Shader "R" {{
            uniform token info:id = "UsdPrimvarReader_float3"
            string inputs:varname = "c"
            float3 outputs:result
        }}
    }}
    def Mesh "M" (apiSchemas = ["MaterialBindingAPI"]) {{
        {SQUARE.replace('"none"', '"catmullClark"')}
        uniform token faceVaryingLinearInterpolation = "%s"
        rel material:binding = </T>
        float3[] primvars:c = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)] (
            interpolation = "faceVarying"
        )
    }} {SUN}"""
    straight = only_mesh(stage(text % "all"))
    values = straight.attributes["vertex_c"]
    assert {tuple(v) for v in (values * 4).round(4).tolist()} == {
        (float(i), float(j), 0.0) for i in range(5) for j in range(5)
    }
    assert only_mesh(stage(text % "none")).attributes["vertex_c"][:, :2].min() > 0.01
