"""Scenes as glTF: what is written comes back, and what is lost is told."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import transforms
from clpt.scene import Film, Scene, cameras, lights, materials, media, phases, shapes
from clpt.scene.gltf_material import ONE_SIDE
from clpt.scene.motion import Deformation, Keys, Shutter
from clpt.scene.params import fields_of, params
from clpt.scene.textures import Bitmap, Checkerboard, Graph, MeshAttribute, Product
from clpt.spectra import RGB, RGBIlluminant, RGBUnbounded
from tests.formats.written import MATERIALS, SHAPES, TURN, assert_same_triangles

CAMERA = cameras.Perspective(
    to_world=transforms.look_at([0, 1, 5], [0, 0, 0], [0, 1, 0]), fov=40.0, fov_axis="y"
)
RNG = np.random.default_rng(5)


def again(
    scene: Scene, folder: Path, suffix: str = ".glb", **variables: Any
) -> tuple[Scene, list[str]]:
    """Return a scene after it was written and read, and what was lost."""
    file = folder / f"scene{suffix}"
    lost = clpt.save(scene, file)
    return clpt.load(file, **variables), lost


def with_shape(*placed: shapes.Shape, **parameters: Any) -> Scene:
    return Scene(camera=CAMERA, shapes=list(placed), **parameters)


def surface_of(scene: Scene) -> Any:
    material: Any = scene.shapes[0].material
    while not isinstance(material, materials.GltfSurface):
        material = getattr(material, "front", None) or material.material
    return material


def drawn(seed: int) -> dict[str, Any]:
    """Return parameters of glTF's surface at random."""
    rng = np.random.default_rng(seed)
    values: dict[str, Any] = {"ior": float(rng.uniform(1.2, 2.0)), "thin": bool(seed % 2)}
    for name, param in params(materials.GltfSurface).items():
        if param.role.name == "reflectance":
            values[name] = RGB(*rng.uniform(0.1, 0.9, 3).tolist())
        elif param.role.name == "real" and not name.startswith(("clearcoat_", "multiple")):
            low, high = max(param.low, 0.05), min(param.high, 90.0)
            values[name] = float(rng.uniform(low, high))
    return values | {"iridescence_ior": 1.4, "clearcoat_roughness": 0.2}


@pytest.mark.parametrize("seed", range(6))
def test_parameters_come_back(seed: int, tmp_path: Path) -> None:
    values = drawn(seed)
    material = materials.GltfSurface(**values)
    read, lost = again(with_shape(shapes.Rectangle(material=material)), tmp_path)
    assert lost == [] and read.warnings == []
    found = fields_of(surface_of(read))
    for name, value in values.items():
        if isinstance(value, RGB):
            assert found[name].to_rgb() == pytest.approx(value.to_rgb(), abs=1e-6), name
        elif name == "ior":
            assert found[name].sample([550.0]) == pytest.approx([value], rel=1e-6)
        else:
            assert found[name] == pytest.approx(value, rel=1e-6), name


@pytest.mark.parametrize("cls", MATERIALS, ids=lambda cls: cls.__name__)
def test_each_material_can_be_written(cls: Any, tmp_path: Path) -> None:
    read, _ = again(with_shape(shapes.Rectangle(material=cls())), tmp_path)
    assert len(read.shapes) == 1 and read.warnings == []


def test_alphas_of_stretched_facets_are_solved(tmp_path: Path) -> None:
    """Alpha along u and v: OpenPBR 1.1, and KHR_materials_anisotropy."""
    stretched = materials.Openpbr(specular_roughness=0.5, specular_roughness_anisotropy=0.6)
    read, _ = again(with_shape(shapes.Rectangle(material=stretched)), tmp_path)
    surface = surface_of(read)
    along = 0.25 * np.sqrt(2.0 / (1.0 + 0.4**2))
    across = surface.roughness**2
    assert across == pytest.approx(0.4 * along)
    assert across + (1.0 - across) * surface.anisotropy**2 == pytest.approx(along)


def test_backs_are_as_they_were(tmp_path: Path) -> None:
    plain = materials.GltfSurface()
    for back in (None, ONE_SIDE):
        wall = shapes.Rectangle(material=materials.TwoSided(front=plain, back=back))
        read, _ = again(with_shape(wall), tmp_path)
        found: Any = read.shapes[0].material
        assert isinstance(found.back, materials.Null) == (back is ONE_SIDE)


def test_milk_in_a_glass_comes_back(tmp_path: Path) -> None:
    milk = media.Homogeneous(
        sigma_a=RGBUnbounded(0.1, 0.2, 0.4), sigma_s=RGBUnbounded(5.0, 4.0, 3.0),
        phase=phases.HenyeyGreenstein(g=0.4),
    )  # fmt: skip
    body = shapes.Cube(material=materials.Dielectric(int_ior="bk7"), interior=milk)
    read, lost = again(with_shape(body), tmp_path)
    inside: Any = read.shapes[0].interior
    assert lost == []
    absorbed, scattered = (c.to_rgb("unbounded") for c in inside.coefficients(spectral=False))
    assert scattered == pytest.approx([5.0, 4.0, 3.0], rel=0.01)
    assert absorbed == pytest.approx([0.1, 0.2, 0.4], rel=0.1)
    index, air = clpt.spectra.index("bk7"), clpt.spectra.index("air")
    lines = [486.1, 587.6, 656.3]
    wanted = index.sample(lines) / air.sample(lines)
    assert surface_of(read).ior.sample(lines) == pytest.approx(wanted, abs=3e-4)


@pytest.mark.parametrize("name", SHAPES)
def test_triangles_come_back(name: str, tmp_path: Path) -> None:
    image = Bitmap(image=np.ones((2, 2, 3), np.float32))
    shape = dataclasses.replace(SHAPES[name], material=materials.Diffuse(reflectance=image))
    read, lost = again(with_shape(shape), tmp_path)
    assert lost == []
    assert_same_triangles(shape, read.shapes[0])


def test_groups_and_balls_are_nodes(tmp_path: Path) -> None:
    group = shapes.Group((shapes.Cube(), shapes.Cylinder(radius=0.2)))
    places = [transforms.translate(*RNG.uniform(-3, 3, 3)) for _ in range(5)]
    placed = [shapes.Instance(group=group, to_world=place) for place in places]
    balls = shapes.Spheres(centers=RNG.uniform(-1, 1, (4, 4)).astype(np.float32) ** 2)
    read, lost = again(with_shape(*placed, balls), tmp_path)
    assert lost == [] and len(read.shapes) == 14
    moved = sorted(tuple(np.asarray(s.to_world)[:3, 3].round(5)) for s in read.shapes)
    centers = [(*c[:3],) for c in balls.centers.tolist()]
    wanted = [*(tuple(p[:3, 3]) for p in places * 2), *centers]
    assert np.allclose(moved, sorted(tuple(np.round(w, 5)) for w in wanted), atol=2e-5)


def test_lights_and_the_camera_come_back(tmp_path: Path) -> None:
    """The picture's 1 is the file's cd/m^2; the film has photometric units then."""
    before = [
        lights.Point(position=(1.0, 2.0, 3.0), intensity=RGBIlluminant(4.0, 2.0, 1.0)),
        lights.Spot(to_world=TURN, cutoff=30.0, beam_width=10.0),
        lights.Directional(direction=(1.0, -2.0, 0.5), irradiance=RGBIlluminant(3.0, 3.0, 1.5)),
    ]
    film = Film(width=64, height=48, exposure=2.0, display_exposure=1.0)
    read, lost = again(with_shape(shapes.Cube(), lights=before, film=film), tmp_path)
    point, spot, distant = (light for light in read.lights)
    scale = 2.0**read.film.display_exposure / 4.0
    assert lost == []
    assert np.allclose(point.position, (1.0, 2.0, 3.0))
    assert scale * point.intensity.to_rgb() == pytest.approx([4.0, 2.0, 1.0], rel=1e-5)
    assert np.allclose(np.asarray(spot.to_world)[:3, 2], TURN[:3, 2], atol=1e-6)
    assert (spot.cutoff, spot.beam_width) == pytest.approx((30.0, 10.0), rel=1e-5)
    unit = np.array([1.0, -2.0, 0.5]) / np.linalg.norm([1.0, -2.0, 0.5])
    assert np.allclose(np.asarray(distant.direction), unit)
    assert scale * distant.irradiance.to_rgb() == pytest.approx([3.0, 3.0, 1.5], rel=1e-5)
    camera: Any = read.camera
    assert np.allclose(camera.to_world, CAMERA.to_world, atol=1e-6)
    assert camera.fov == pytest.approx(40.0) and read.film.width * 48 == read.film.height * 64


def test_motion_comes_back(tmp_path: Path) -> None:
    turning = Keys([-0.5, 0.5], [np.eye(4), transforms.rotate([0, 0, 1], 90.0)])
    camera = dataclasses.replace(CAMERA, shutter=Shutter(-0.5, 0.5))
    stretch = transforms.translate(2.0, 0.0, 0.0) @ transforms.scale([1.0, 2.0, 3.0])
    points = RNG.normal(size=(3, 4, 3)).astype(np.float32)
    faces = np.array([[0, 1, 2], [1, 2, 3]], np.uint32)
    flag = shapes.Mesh(
        vertices=points[0], faces=faces, deformation=Deformation((-0.5, 0.0, 0.5), points)
    )
    scene = Scene(camera=camera, shapes=[shapes.Cube(to_world=stretch, motion=turning), flag])
    read, lost = again(scene, tmp_path, time=0.0, shutter=1.0)
    assert lost == ["when the shutter is open: render it with -D time=0 -D shutter=1"]
    cube, waving = read.shapes
    for time in (0.0, 0.25, 1.0):
        place = cube.motion.at(time) @ np.asarray(cube.to_world)
        assert np.allclose(place, turning.at(time - 0.5) @ stretch, atol=1e-5)
        assert np.allclose(
            waving.deformation.at(time)[0], flag.deformation.at(time - 0.5)[0], atol=1e-5
        )


@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
def test_images_come_back(suffix: str, tmp_path: Path) -> None:
    image = RNG.integers(0, 256, (4, 4, 3)).astype(np.uint8)
    turn = transforms.rotate([0, 0, 1], 30.0)[:3, :3] @ np.diag([2.0, 3.0, 1.0])
    turn[:2, 2] = 0.25, 0.5
    color = Bitmap(image=image, wrap="mirror", wrap_v="clamp", to_uv=turn, filter="nearest")
    number = dataclasses.replace(color, raw=True, channel="g")
    material = materials.GltfSurface(
        base_color=Product(first=color, second=(0.5, 1.0, 0.25), rgb=True),
        roughness=number, metallic=dataclasses.replace(number, channel="r"),
    )  # fmt: skip
    bent = materials.NormalMap(material=material, map=number, scale=0.5, along_v=True)
    thin = materials.Mask(material=bent, opacity=dataclasses.replace(number, channel="b"))
    read, lost = again(with_shape(shapes.Rectangle(material=thin)), tmp_path, suffix)
    found: Any = surface_of(read)
    assert lost == [] and read.warnings == []
    base = found.base_color.first
    assert np.array_equal(np.asarray(base.image)[..., :3], image)
    assert base.wraps == ("mirror", "clamp") and base.filter == "nearest"
    assert np.allclose(base.to_uv, turn, atol=1e-6)
    for name, channel in (("metallic", "r"), ("roughness", "g")):
        pixels = np.asarray(fields_of(found)[name].image)[
            ..., "rgb".index(fields_of(found)[name].channel)
        ]
        assert np.array_equal(pixels, image[..., "rgb".index(channel)])
    outer: Any = read.shapes[0].material
    mask = outer.front if isinstance(outer, materials.TwoSided) else outer
    assert np.array_equal(np.asarray(mask.opacity.image).squeeze(), image[..., 2])
    assert mask.material.scale == 0.5 and mask.material.along_v


def test_patterns_become_images_and_colors_of_vertices_stay(tmp_path: Path) -> None:
    ramp = Graph(
        nodes={"ramp": {"type": "ramplr", "valuel": [1.0, 0.0, 0.0], "valuer": [0.0, 0.0, 1.0]}}
    )
    read, lost = again(
        with_shape(shapes.Rectangle(material=materials.Diffuse(reflectance=ramp))), tmp_path
    )
    pixels = surface_of(read).base_color.pixels(params(materials.GltfSurface)["base_color"].role)
    middle = (np.arange(512) + 0.5) / 512
    assert lost == ["a graph becomes an image of 512 x 512"]
    assert np.allclose(pixels[0, :, 2], middle, atol=0.01)
    assert np.allclose(pixels[-1, :, 0], 1.0 - middle, atol=0.01)
    squares = Checkerboard(color0=0.2, color1=0.7)
    read, lost = again(
        with_shape(shapes.Rectangle(material=materials.Diffuse(reflectance=squares))), tmp_path
    )
    assert lost == [] and np.asarray(surface_of(read).base_color.image).shape[:2] == (2, 2)
    colors = RNG.uniform(0, 1, (3, 3)).astype(np.float32)
    mesh = shapes.Mesh(
        vertices=RNG.normal(size=(3, 3)).astype(np.float32), faces=np.array([[0, 1, 2]], np.uint32),
        attributes={"vertex_color": colors},
        material=materials.Diffuse(reflectance=MeshAttribute()),
    )  # fmt: skip
    read, lost = again(with_shape(mesh), tmp_path)
    assert lost == [] and np.allclose(read.shapes[0].attributes["vertex_color"], colors)


@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
def test_a_folder_that_is_not_there(suffix: str, tmp_path: Path) -> None:
    with pytest.raises(clpt.SceneError, match="cannot be written"):
        clpt.save(with_shape(shapes.Cube()), tmp_path / "none" / f"a{suffix}")
