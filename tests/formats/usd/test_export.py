"""Scenes as stages: what is written comes back, and what is lost is told."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import clpt
from clpt import transforms
from clpt.cli import cli
from clpt.geometry import triangles
from clpt.scene import Film, Scene, cameras, lights, materials, media, phases, shapes
from clpt.scene.motion import Keys, Shutter
from clpt.scene.params import params
from clpt.scene.roles import REFLECTANCE
from clpt.scene.textures import Bitmap, Checkerboard, Product
from clpt.scene.values import is_texture
from clpt.spectra import RGB, RGBIlluminant, RGBUnbounded
from tests.formats.written import MATERIALS, SHAPES, TURN, assert_same_triangles

pytest.importorskip("pxr")

CAMERA = cameras.Perspective(to_world=transforms.look_at([0, 1, 5], [0, 0, 0], [0, 1, 0]), fov=40.0)


def again(scene: Scene, folder: Path, suffix: str = ".usda") -> tuple[Scene, list[str]]:
    """Return a scene after it was written and read, and what was lost."""
    file = folder / f"scene{suffix}"
    lost = clpt.save(scene, file)
    return clpt.load(file), lost


def with_shape(*placed: shapes.Shape, **parameters: Any) -> Scene:
    return Scene(camera=CAMERA, shapes=list(placed), **parameters)


def openpbr_of(scene: Scene) -> materials.Openpbr:
    material: Any = scene.shapes[0].material
    while not isinstance(material, materials.Openpbr):
        material = getattr(material, "front", None) or material.material
    return material


def drawn(seed: int) -> materials.Openpbr:
    """Return OpenPBR with parameters at random."""
    rng = np.random.default_rng(seed)
    values: dict[str, Any] = {}
    for name, param in params(materials.Openpbr).items():
        if param.role.name in ("reflectance",):
            values[name] = RGB(*rng.uniform(0.1, 0.9, 3).tolist())
        elif param.role.name == "real" and name != "anisotropy_rotation":
            low, high = max(param.low, 0.05), min(param.high, 2.0)
            low = max(low, 1.05) if name.endswith("ior") else low
            values[name] = float(rng.uniform(low, high))
    values["subsurface_weight"] = 0.0  # which becomes a walk
    return materials.Openpbr(specular_ior=float(rng.uniform(1.2, 2.0)), **values)


@pytest.mark.parametrize("seed", range(8))
def test_parameters_of_openpbr_come_back(seed: int, tmp_path: Path) -> None:
    material = drawn(seed)
    read, lost = again(with_shape(shapes.Rectangle(material=material)), tmp_path)
    assert lost == [] and read.warnings == []
    for name, param in params(materials.Openpbr).items():
        if name == "name":
            continue
        wanted, found = getattr(material, name), getattr(openpbr_of(read), name)
        if param.role.name == "reflectance":
            wanted, found = wanted.to_rgb(), found.to_rgb()
        if param.role.name in ("index", "coefficient"):
            wanted, found = wanted.sample([550.0]), found.sample([550.0])
        assert found == pytest.approx(wanted, abs=1e-6), name


@pytest.mark.parametrize("cls", MATERIALS, ids=lambda cls: cls.__name__)
def test_each_material_can_be_written(cls: Any, tmp_path: Path) -> None:
    read, _ = again(with_shape(shapes.Rectangle(material=cls())), tmp_path)
    assert len(read.shapes) == 1 and read.warnings == []


def test_metals_keep_their_colors(tmp_path: Path) -> None:
    eta, k = clpt.spectra.metal("Au")
    gold = materials.RoughConductor(eta=eta, k=k, alpha_u=0.09, alpha_v=0.09)
    read, lost = again(with_shape(shapes.Rectangle(material=gold)), tmp_path)
    surface = openpbr_of(read)
    assert lost == [] and surface.base_metalness == 1.0
    assert surface.specular_roughness == pytest.approx(0.3)
    assert surface.base_color.to_rgb() == pytest.approx([1.0, 0.78, 0.34], abs=0.06)


def test_glass_keeps_index_dispersion_and_absorption(tmp_path: Path) -> None:
    glass = materials.Dielectric(int_ior="bk7", absorption=RGBUnbounded(3.0, 0.5, 0.1))
    read, lost = again(with_shape(shapes.Sphere(material=glass)), tmp_path)
    surface = openpbr_of(read)
    index, air = clpt.spectra.index("bk7"), clpt.spectra.index("air")
    lines = [486.1, 587.6, 656.3]
    wanted = index.sample(lines) / air.sample(lines)
    assert lost == [] and surface.transmission_weight == 1.0
    assert surface.specular_ior.sample(lines) == pytest.approx(wanted, abs=3e-4)
    assert surface.absorption.to_rgb("unbounded") == pytest.approx([3.0, 0.5, 0.1], rel=1e-4)


def test_a_saturated_coat_keeps_its_brightness(tmp_path: Path) -> None:
    """At F = .5963 within an index of 1.5, .8 of the base leaves as .8 .4037 / (1 - .8 .5963)."""
    image = np.full((2, 2, 3), (0.8, 0.4, 0.0), np.float32)
    for color in (RGB(0.8, 0.4, 0.0), Bitmap(image=image, raw=True)):
        coated = materials.Plastic(
            diffuse_reflectance=color, int_ior=1.5, ext_ior=1.0, nonlinear=True
        )
        base = openpbr_of(again(with_shape(shapes.Rectangle(material=coated)), tmp_path)[0])
        found = base.base_color
        rgb = found.pixels(REFLECTANCE)[0, 0] if isinstance(found, Bitmap) else found.to_rgb()
        assert rgb == pytest.approx([0.61769, 0.21207, 0.0], abs=5e-3)


def test_milk_in_a_glass_comes_back(tmp_path: Path) -> None:
    milk = media.Homogeneous(
        sigma_a=RGBUnbounded(0.1, 0.2, 0.4), sigma_s=RGBUnbounded(5.0, 4.0, 3.0),
        phase=phases.HenyeyGreenstein(g=0.4),
    )  # fmt: skip
    body = shapes.Sphere(material=materials.Dielectric(int_ior=1.33), interior=milk)
    read, lost = again(with_shape(body), tmp_path)
    inside: Any = read.shapes[0].interior
    assert lost == []
    assert inside.sigma_s.to_rgb("unbounded") == pytest.approx([5.0, 4.0, 3.0], rel=1e-4)
    assert inside.sigma_a.to_rgb("unbounded") == pytest.approx([0.1, 0.2, 0.4], rel=1e-3)


@pytest.mark.parametrize("name", SHAPES)
def test_triangles_come_back(name: str, tmp_path: Path) -> None:
    image = Bitmap(image=np.ones((2, 2, 3), np.float32))
    shape = dataclasses.replace(SHAPES[name], material=materials.Diffuse(reflectance=image))
    read, lost = again(with_shape(shape), tmp_path)
    assert lost == []
    assert_same_triangles(shape, read.shapes[0])


def test_spheres_stay_spheres_and_a_disk_has_its_area(tmp_path: Path) -> None:
    ball = shapes.Sphere(center=(1.0, 2.0, 3.0), radius=0.5, to_world=TURN)
    read, _ = again(with_shape(ball, shapes.Disk()), tmp_path)
    sphere, disk = read.shapes
    assert isinstance(sphere, shapes.Sphere)
    center = np.asarray(sphere.to_world) @ [*sphere.center, 1.0]
    assert np.allclose(center, TURN @ [1.0, 2.0, 3.0, 1.0], atol=1e-6)
    vertices, faces, _, _ = triangles.triangulate(disk)
    assert triangles.triangle_areas(vertices, faces).sum() == pytest.approx(np.pi, rel=1e-5)


def test_many_instances_share_a_group(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    mesh = shapes.Mesh(
        vertices=rng.normal(size=(3000, 3)).astype(np.float32),
        faces=np.arange(3000, dtype=np.uint32).reshape(1000, 3),
    )
    group = shapes.Group(shapes=(mesh,), name="tree")
    places = [transforms.translate(*row) for row in rng.normal(size=(40, 3))]
    placed = [shapes.Instance(group=group, to_world=place) for place in places]
    read, lost = again(with_shape(*placed), tmp_path)
    assert lost == [] and len(read.shapes) == 40
    assert len({id(shape.group) for shape in read.shapes}) == 1
    found = sorted(tuple(np.asarray(shape.to_world)[:3, 3].round(5)) for shape in read.shapes)
    assert found == sorted(tuple(place[:3, 3].round(5)) for place in places)


def test_strands_come_back(tmp_path: Path) -> None:
    points = np.random.default_rng(2).uniform(0.1, 1.0, (11, 4)).astype(np.float32)
    hair = shapes.Curves(points=points, lengths=(4, 7), basis="bezier")
    read, lost = again(with_shape(hair), tmp_path)
    assert lost == [] and read.shapes[0].basis == "bezier"
    assert np.allclose(read.shapes[0].points, points, atol=1e-6)


def test_lights_come_back(tmp_path: Path) -> None:
    image = np.random.default_rng(3).uniform(0.1, 1.0, (8, 16, 3)).astype(np.float32)
    before = [
        lights.Point(position=(1.0, 2.0, 3.0), intensity=RGBIlluminant(4.0, 2.0, 1.0)),
        lights.Spot(to_world=TURN, cutoff=30.0, beam_width=10.0, edge="smooth"),
        lights.Directional(direction=(1.0, -2.0, 0.5), irradiance=RGBIlluminant(3.0, 3.0, 1.5)),
        lights.Envmap(image=image, scale=2.0, to_world=transforms.rotate([0, 1, 0], 70.0)),
    ]
    glowing = shapes.Rectangle(emission=lights.Area(radiance=RGBIlluminant(5.0, 4.0, 3.0)))
    read, lost = again(with_shape(glowing, lights=before), tmp_path)
    point, spot, distant, around = read.lights
    assert lost == []
    assert np.allclose(point.position, (1.0, 2.0, 3.0))
    assert point.intensity.to_rgb() == pytest.approx([4.0, 2.0, 1.0], rel=1e-5)
    assert np.allclose(np.asarray(spot.to_world)[:3, 2], TURN[:3, 2], atol=1e-6)
    assert (spot.cutoff, spot.beam_width) == pytest.approx((30.0, 10.0), rel=1e-5)
    assert spot.intensity.to_rgb() == pytest.approx([1.0] * 3, rel=1e-5)
    unit = np.array([1.0, -2.0, 0.5]) / np.linalg.norm([1.0, -2.0, 0.5])
    assert np.allclose(np.asarray(distant.direction) / np.linalg.norm(distant.direction), unit)
    assert distant.irradiance.to_rgb() == pytest.approx([3.0, 3.0, 1.5], rel=1e-5)
    assert around.scale == pytest.approx(2.0) and np.allclose(around.to_world, before[3].to_world)
    assert np.allclose(around.image, image, rtol=1e-3)
    emission: Any = read.shapes[0].emission
    assert emission.radiance.to_rgb() == pytest.approx([5.0, 4.0, 3.0], rel=1e-5)
    assert not emission.two_sided


def test_the_camera_comes_back(tmp_path: Path) -> None:
    camera = cameras.ThinLens(
        to_world=TURN, fov=33.0, fov_axis="y", aperture_radius=0.05, focus_distance=3.0,
        offset_x=0.1, offset_y=-0.2, near=0.2, far=50.0,
    )  # fmt: skip
    scene = Scene(camera=camera, shapes=[shapes.Cube()], film=Film(width=64, height=48))
    read, lost = again(scene, tmp_path)
    found: Any = read.camera
    assert lost == [] and (read.film.width, read.film.height) == (64, 48)
    assert np.allclose(found.to_world, TURN, atol=1e-6)
    assert np.allclose(found.extent(64, 48), camera.extent(64, 48), rtol=1e-5)
    numbers = ("aperture_radius", "focus_distance", "offset_x", "offset_y", "near", "far")
    for name in numbers:
        assert getattr(found, name) == pytest.approx(getattr(camera, name), rel=1e-4), name


def test_motion_comes_back(tmp_path: Path) -> None:
    turning = Keys([0.0, 0.5], [np.eye(4), transforms.rotate([0, 0, 1], 90.0)])
    camera = dataclasses.replace(CAMERA, shutter=Shutter(0.0, 0.5))
    cube = shapes.Cube(to_world=transforms.translate(2.0, 0.0, 0.0), motion=turning)
    read, lost = again(Scene(camera=camera, shapes=[cube]), tmp_path)
    assert lost == []
    shape = read.shapes[0]
    shutter = read.camera.shutter
    for share in (0.0, 0.3, 1.0):
        time = shutter.open + share * (shutter.close - shutter.open)
        place = shape.motion.at(time) @ np.asarray(shape.to_world)
        wanted = turning.at(0.5 * share) @ cube.to_world
        assert np.allclose(place, wanted, atol=0.01)


def test_images_are_packed(tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    image = rng.uniform(0.0, 1.0, (4, 4, 3)).astype(np.float32)
    to_uv = np.array([[2.0, 0.5, 0.25], [0.0, 3.0, 0.5], [0.0, 0.0, 1.0]])
    color = Bitmap(image=image, raw=True, wrap="mirror", wrap_v="clamp", to_uv=to_uv)
    tinted = Product(first=color, second=(0.5, 1.0, 0.25), rgb=True)
    for reflectance in (color, tinted, Checkerboard(color0=0.2, color1=0.7)):
        wall = shapes.Rectangle(material=materials.Diffuse(reflectance=reflectance))
        read, lost = again(with_shape(wall), tmp_path, ".usdz")
        assert lost == [] and read.warnings == []
        texture = openpbr_of(read).base_color
        assert is_texture(texture)
        if reflectance is color:
            assert np.allclose(texture.image, image, rtol=1e-3)
            assert texture.wraps == ("mirror", "clamp")
            assert np.allclose(texture.to_uv, to_uv, atol=1e-5)
    assert [path.name for path in tmp_path.iterdir()] == ["scene.usdz"]


def test_the_command_tells_what_is_lost_and_renders_skies(tmp_path: Path) -> None:
    sky = lights.Sky(sun_elevation=30.0, sun_scale=0.0)
    scene = Scene(
        camera=CAMERA, lights=[sky],
        shapes=[shapes.Cube(material=materials.Fluorescent())], film=Film(width=16, height=12),
    )  # fmt: skip
    clpt.save(scene, tmp_path / "a.json")
    file = tmp_path / "b.usda"
    outcome = CliRunner().invoke(cli, ["convert", str(tmp_path / "a.json"), str(file)])
    assert outcome.exit_code == 0, outcome.output
    assert "not in the file: the fluorescence of materials" in " ".join(outcome.output.split())
    read = clpt.load(file)
    around: Any = read.lights[0]
    assert isinstance(around, lights.Envmap)
    rows = np.asarray(around.image).mean(axis=(1, 2))
    assert rows[: len(rows) // 2].mean() > 1.3 * rows[len(rows) // 2 + 8 :].mean() > 0.0


@pytest.mark.parametrize("suffix", [".usda", ".usdz"])
def test_a_folder_that_is_not_there(suffix: str, tmp_path: Path) -> None:
    with pytest.raises(clpt.SceneError, match="cannot be written"):
        clpt.save(with_shape(shapes.Cube()), tmp_path / "none" / f"a{suffix}")
