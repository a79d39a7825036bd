"""Lights of UsdLux: what they send out, where, and in which colors."""

from __future__ import annotations

import math
from pathlib import Path as File

import numpy as np
import pytest

import clpt
from clpt import transforms
from clpt.images import write
from clpt.scene import Film, Scene
from clpt.scene.cameras import Orthographic
from clpt.scene.integrators import Path
from clpt.scene.lights import Area, Constant, Directional, Envmap, Goniometric, Point, Spot
from clpt.scene.materials import Diffuse, Null
from clpt.scene.shapes import Rectangle, Shape
from tests.formats.usd.conftest import SQUARE, Loader

pytest.importorskip("pxr")

MESH = f'def Mesh "M" {{ {SQUARE} }}\n'
SCALED = 'double3 xformOp:scale = (2, 2, 2)\n uniform token[] xformOpOrder = ["xformOp:scale"]'


def rgb(emitted: object) -> tuple[float, float, float]:
    return emitted.r, emitted.g, emitted.b


def lamp(scene: Scene) -> Shape:
    return next(shape for shape in scene.shapes if shape.emission is not None)


@pytest.mark.parametrize(
    ("kind", "attributes", "area"),
    [
        ("RectLight", "float inputs:width = 2\n float inputs:height = 3", 6.0),
        ("DiskLight", "float inputs:radius = 2", 4.0 * math.pi),
        ("SphereLight", "float inputs:radius = 2", 16.0 * math.pi),
        ("CylinderLight", "float inputs:radius = 2\n float inputs:length = 3", 12.0 * math.pi),
    ],
)
def test_areas_divide_what_is_normalized(
    stage: Loader, kind: str, attributes: str, area: float
) -> None:
    brightness = "float inputs:intensity = 5\n float inputs:exposure = 1"
    text = f'{MESH} def {kind} "L" {{ {attributes}\n {brightness}\n %s }}'
    plain = lamp(stage(text % "color3f inputs:color = (1, 0.5, 0)"))
    assert rgb(plain.emission.radiance) == pytest.approx((10.0, 5.0, 0.0))
    norm = lamp(stage(text % f"bool inputs:normalize = 1\n{SCALED}", "metersPerUnit = 0.01"))
    assert rgb(norm.emission.radiance) == pytest.approx((10.0 / (4.0 * area),) * 3)


def test_a_rectangle_shines_along_minus_z(stage: Loader) -> None:
    shape = lamp(
        stage(MESH + 'def RectLight "L" { float inputs:width = 2\n float inputs:height = 3 }')
    )
    corner = shape.to_world @ [1.0, 1.0, 0.0, 1.0]
    assert np.allclose(corner, [-1.0, 1.5, 0.0, 1.0])
    assert np.allclose(shape.to_world[:3, 2], [0, 0, -1])


def test_suns_of_blender(stage: Loader) -> None:
    """Blender 5.0 writes half of a sun's angle and a quarter of its strength."""
    sun = """def DistantLight "L" {
    float inputs:intensity = 0.375
    float inputs:angle = 0.25
    bool inputs:normalize = 1 }"""
    read = stage(MESH + sun, 'doc = "Blender v5.0.1"').lights[0]
    assert (read.irradiance.g, read.angle) == pytest.approx((1.5, 0.5))
    read = stage(MESH + sun).lights[0]
    assert (read.irradiance.g, read.angle) == pytest.approx((0.375, 0.25))


def test_distant_lights_by_their_angle(stage: Loader) -> None:
    light = 'def DistantLight "L" { float inputs:intensity = 100\n float inputs:angle = 1\n %s }'
    scene = stage(MESH + light % "")
    assert isinstance(scene.lights[0], Directional)
    assert np.allclose(scene.lights[0].direction, [0, 0, -1])
    expected = 100.0 * math.pi * math.sin(math.radians(0.5)) ** 2
    assert rgb(scene.lights[0].irradiance) == pytest.approx((expected,) * 3)
    assert scene.lights[0].angle == 1.0
    scene = stage(MESH + light % "bool inputs:normalize = 1")
    assert rgb(scene.lights[0].irradiance) == pytest.approx((100.0,) * 3)
    usual = stage(MESH + 'def DistantLight "L" {}').lights[0]
    assert rgb(usual.irradiance)[0] == pytest.approx(
        50000.0 * math.pi * math.sin(math.radians(0.265)) ** 2
    )


def test_points_are_spheres_from_afar(stage: Loader) -> None:
    """A sphere's radiance times the disk that one sees of it, in square metres."""
    text = MESH + 'def SphereLight "L" { bool treatAsPoint = 1\n float inputs:radius = %s\n %s }'
    point = stage(text % (3, ""), "metersPerUnit = 0.01").lights[0]
    assert isinstance(point, Point)
    assert rgb(point.intensity)[0] == pytest.approx(9.0 * math.pi * 1e-4)
    point = stage(text % (0, "float inputs:intensity = 8\n bool inputs:normalize = 1")).lights[0]
    assert rgb(point.intensity)[0] == pytest.approx(2.0)


def test_cones_and_profiles(stage: Loader) -> None:
    text = (
        MESH
        + """def SphereLight "L" (prepend apiSchemas = ["ShapingAPI"]) {
        bool treatAsPoint = 1
        bool inputs:normalize = 1
        float inputs:shaping:cone:angle = 30
        float inputs:shaping:cone:softness = 0.5
        %s
    }"""
    )
    spot = stage(text % "").lights[0]
    assert isinstance(spot, Spot)
    assert (spot.cutoff, spot.beam_width) == pytest.approx((30.0, 15.0))
    assert np.allclose(spot.to_world[:3, 2], [0, 0, -1])
    focused = stage(text % "float inputs:shaping:focus = 2").lights[0]
    assert isinstance(focused, Goniometric)
    image = np.asarray(focused.image.image)
    row = len(image) - 1 - 20  # 10 degrees off the axis, where the cone is whole
    assert image[row, 0, 0] == pytest.approx(math.cos(math.radians(10.25)) ** 2, rel=1e-3)
    assert image[len(image) - 1 - 61].max() == 0.0
    nadir = focused.to_world @ [0.0, -1.0, 0.0, 0.0]
    assert np.allclose(nadir, [0, 0, -1, 0])


SIDE = 200  # steps of an integral over a surface
SURFACES = {  # a lamp's attributes; its points and normals (n, 3), which share its area evenly
    "RectLight": "float inputs:width = 1\n float inputs:height = 0.5",
    "DiskLight": "float inputs:radius = 0.5",
    "SphereLight": "float inputs:radius = 0.5",
    "CylinderLight": "float inputs:radius = 0.2\n float inputs:length = 1",
}


def surface_of(kind: str) -> tuple[np.ndarray, np.ndarray, float]:
    """Return points and normals (n, 3) of a lamp of SURFACES, and its area."""
    u, v = (x.ravel() for x in np.meshgrid(*[(np.arange(SIDE) + 0.5) / SIDE] * 2))
    turn = 2.0 * np.pi * u
    flat = np.stack([0 * u, 0 * u, 0 * u - 1.0], 1)
    if kind == "RectLight":
        return np.stack([u - 0.5, 0.5 * v - 0.25, 0 * u], 1), flat, 0.5
    if kind == "DiskLight":
        r = 0.5 * np.sqrt(v)
        return np.stack([r * np.cos(turn), r * np.sin(turn), 0 * u], 1), flat, 0.25 * np.pi
    if kind == "SphereLight":
        z, r = 2.0 * v - 1.0, np.sqrt(1.0 - (2.0 * v - 1.0) ** 2)
        n = np.stack([r * np.cos(turn), r * np.sin(turn), z], 1)
        return 0.5 * n, n, np.pi
    n = np.stack([0 * u, np.cos(turn), np.sin(turn)], 1)
    return 0.2 * n + np.stack([v - 0.5, 0 * u, 0 * u], 1), n, 0.4 * np.pi


@pytest.mark.parametrize("kind", SURFACES)
def test_lamps_with_an_area_are_shaped(kind: str, stage: Loader) -> None:
    """The light on a floor: UsdLux's cone and focus about the lamp's axis, by an integral."""
    turn = transforms.translate(0.2, 2.0, 0.1) @ transforms.rotate([1.0, 0.0, 0.0], -70.0)
    rows = ", ".join(str(tuple(row)) for row in turn.T.tolist())
    text = f"""{MESH} def {kind} "L" (prepend apiSchemas = ["ShapingAPI"]) {{
        {SURFACES[kind]}
        float inputs:intensity = 100
        float inputs:shaping:cone:angle = 50
        float inputs:shaping:cone:softness = 0.5
        float inputs:shaping:focus = 3
        matrix4d xformOp:transform = ({rows})
        uniform token[] xformOpOrder = ["xformOp:transform"]
    }}"""
    read = stage(text)
    assert not read.warnings and lamp(read).emission.directed
    floor = Rectangle(to_world=transforms.rotate([1, 0, 0], -90.0), material=Diffuse())
    view = transforms.look_at([0, 1, 0], [0, 0, 0], [0, 0, 1]) @ transforms.scale([0.1, 0.1, 1.0])
    scene = Scene(
        camera=Orthographic(to_world=view), shapes=[lamp(read), floor],
        film=Film(width=8, height=8, mode="rgb"), integrator=Path(max_depth=2),
    )  # fmt: skip
    with clpt.Renderer(scene) as renderer:
        renderer.run(256)
        found = np.asarray(renderer.image())[..., :3].mean()
    points, normals, area = surface_of(kind)
    points, normals = transforms.transform_points(turn, points), normals @ turn[:3, :3].T
    distance = np.linalg.norm(points, axis=1)
    d = -points / distance[:, None]  # to the origin
    cosine = d @ (turn[:3, :3] @ [0.0, 0.0, -1.0])
    past = np.clip((np.degrees(np.arccos(cosine)) / 50.0 - 0.5) / 0.5, 0.0, 1.0)
    share = (1.0 - past * past * (3.0 - 2.0 * past)) * np.abs(cosine) ** 3
    facing = np.maximum((d * normals).sum(axis=1), 0.0) * -d[:, 1]
    irradiance = 100.0 * area * (share * facing / distance**2).mean()
    assert found == pytest.approx(irradiance * 0.5 / np.pi, rel=0.01)


def test_a_directed_lamp_has_no_power() -> None:
    with pytest.raises(clpt.SceneError, match="no power"):
        Area(directed=True, power=1.0)


def test_colors_of_temperatures(stage: Loader) -> None:
    text = (
        MESH
        + """def RectLight "L" {
        bool inputs:enableColorTemperature = 1
        float inputs:colorTemperature = %s
    }"""
    )
    warm = rgb(lamp(stage(text % 2700)).emission.radiance)
    assert warm[0] > warm[1] > warm[2]
    assert np.dot(warm, [0.2126, 0.7152, 0.0722]) == pytest.approx(1.0, rel=1e-3)


def test_domes(stage: Loader) -> None:
    text = (
        MESH + 'def DomeLight "L" { float inputs:intensity = 2\n color3f inputs:color = (1, 2, 3) }'
    )
    dome = stage(text).lights[0]
    assert isinstance(dome, Constant)
    assert rgb(dome.radiance) == pytest.approx((2.0, 4.0, 6.0))


def test_what_lights_cannot_do_is_told(stage: Loader) -> None:
    text = (
        MESH
        + """
    def RectLight "A" {
        float inputs:specular = 0
        rel collection:lightLink:excludes = </M>
    }
    def PortalLight "P" {}"""
    )
    assert stage(text).warnings == [
        "/A: lightLink is left out: the light shines on everything",
        "/A: inputs:specular is left out",
        "/P: PortalLight is left out",
    ]


@pytest.mark.parametrize("form", ["latlong", "mirroredBall", "angular"])
def test_domes_of_other_formats(stage: Loader, tmp_path: File, form: str) -> None:
    """Of an image that is red in its middle, red comes from +z of the dome."""
    pixels = np.zeros((65, 65 if form != "latlong" else 130, 3), np.float32)
    middle = pixels.shape[1] // 2
    pixels[28:37, middle - 4 : middle + 5] = [1, 0, 0]
    pixels[20:28, middle - 4 : middle + 5] = [0, 1, 0]  # above it
    write(tmp_path / "sky.exr", pixels)
    text = f"""def DomeLight "L" {{
        asset inputs:texture:file = @./sky.exr@
        token inputs:texture:format = "{form}"
        float inputs:intensity = 3
    }}"""
    dome = stage(MESH + text).lights[0]
    assert isinstance(dome, Envmap)
    assert dome.scale == 3.0
    image = np.asarray(dome.image)
    height, width = image.shape[:2]
    assert np.allclose(image[height // 2, width // 2], [1, 0, 0], atol=0.1)
    up = image[: height // 2 - 2, width // 2 - 2 : width // 2 + 2].sum(axis=(0, 1))
    assert up[1] > up[0]
    assert np.allclose(dome.to_world, np.eye(4))


def test_the_pole_of_a_dome(stage: Loader, tmp_path: File) -> None:
    """Up on a stage whose up axis is z, turned there by its author or not."""
    text = """def DomeLight{} "L" {{
        asset inputs:texture:file = @./sky.exr@
        {}
    }}"""
    write(tmp_path / "sky.exr", np.ones((4, 8, 3), np.float32))
    turned = 'float xformOp:rotateX = 90; uniform token[] xformOpOrder = ["xformOp:rotateX"]'
    for kind, attributes in (
        ("", ""),
        ("", turned),
        ("_1", ""),
        ("_1", 'uniform token poleAxis = "Z"'),
    ):
        dome = stage(MESH + text.format(kind, attributes), 'upAxis = "Z"').lights[0]
        assert np.allclose(dome.to_world[:3, 1], [0, 0, 1])
    lying = stage(MESH + text.format("_1", 'uniform token poleAxis = "Y"'), 'upAxis = "Z"').lights[
        0
    ]
    assert np.allclose(lying.to_world[:3, 1], [0, 1, 0])


def test_a_dome_of_blender_has_its_middle_at_x(stage: Loader, tmp_path: File) -> None:
    """To version 5.0 Blender writes no turn; its Cycles shows the middle of the image at +x."""
    write(tmp_path / "sky.exr", np.ones((4, 8, 3), np.float32))
    dome = 'def DomeLight "L" { asset inputs:texture:file = @./sky.exr@ }'
    made = stage(MESH + dome, 'upAxis = "Z"\ndoc = "Blender v5.0.1"').lights[0]
    assert np.allclose(made.to_world[:3, :3], np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]]))


GLOWING = """def Material "Glow" {
    token outputs:surface.connect = </Glow/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:emissiveColor = (0.5, 1, 2)
        token outputs:surface }
}
"""


def shining(attributes: str, bound: str = "rel material:binding = </Glow>") -> str:
    square = SQUARE.replace("1, 1, 0", "1, 2, 0").replace("0, 1, 0", "0, 2, 0")
    schemas = '(prepend apiSchemas = ["MeshLightAPI", "MaterialBindingAPI"])'
    return f'{GLOWING} def Mesh "M" {schemas} {{ {square}\n {bound}\n {attributes} }}'


def test_a_mesh_shines(stage: Loader) -> None:
    """As its material glows, tinted; or by itself alone, with or without its material."""
    strength = "float inputs:intensity = 3\n color3f inputs:color = (1, 0.5, 0)"
    plain = lamp(stage(shining(strength, bound="")))
    assert rgb(plain.emission.radiance) == (3.0, 1.5, 0.0)
    assert not plain.emission.two_sided and not isinstance(plain.material, Null)
    tinted = lamp(stage(shining(strength))).emission.radiance
    assert rgb(tinted) == (1.5, 1.5, 0.0)
    mode = f"{strength}\n uniform token light:materialSyncMode = "
    alone = lamp(stage(shining(mode + '"independent"\n uniform bool doubleSided = 1')))
    assert rgb(alone.emission.radiance) == (3.0, 1.5, 0.0) and alone.emission.two_sided
    assert not isinstance(alone.material, Null)
    bare = lamp(stage(shining(mode + '"noMaterialResponse"')))
    assert isinstance(bare.material, Null) and rgb(bare.emission.radiance) == (3.0, 1.5, 0.0)


def test_a_normalized_mesh_divides_by_its_area(stage: Loader) -> None:
    scene = stage(shining(f"bool inputs:normalize = 1\n{SCALED}", bound=""), "metersPerUnit = 10")
    assert rgb(lamp(scene).emission.radiance) == pytest.approx((1.0 / 8.0,) * 3)


def test_an_image_that_glows_is_tinted(stage: Loader, tmp_path: File) -> None:
    """The picture of the mesh is its image times the light, in each color."""
    write(tmp_path / "glow.exr", np.full((2, 2, 3), (0.5, 1.0, 2.0), np.float32))
    view = """def Camera "V" {
        token projection = "orthographic"
        float horizontalAperture = 5
        float verticalAperture = 5
        double3 xformOp:translate = (0.5, 1, 4)
        uniform token[] xformOpOrder = ["xformOp:translate"] }"""
    text = shining("float inputs:intensity = 3\n color3f inputs:color = (1, 0.5, 0)").replace(
        "color3f inputs:emissiveColor = (0.5, 1, 2)",
        "color3f inputs:emissiveColor.connect = </Glow/T.outputs:rgb>",
    )
    texture = """def Shader "T" {
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @glow.exr@
            token inputs:wrapS = "clamp"
            token inputs:wrapT = "clamp"
            float3 outputs:rgb }
        token outputs:surface.connect"""
    scene = stage(text.replace("token outputs:surface.connect", texture, 1) + view)
    scene.film = Film(width=2, height=2)
    scene.integrator = Path(max_depth=1)
    mean = clpt.render(scene, mode="rgb", spp=4).mean(axis=(0, 1))
    assert mean == pytest.approx((1.5, 1.5, 0.0), abs=3e-3)
