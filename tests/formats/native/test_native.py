"""scene.json: what may be written, every error with its location, the round trip, the schema."""

from __future__ import annotations

import dataclasses
import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from clpt import spectra
from clpt.errors import SceneError, UnknownKindError, UnusedParameterError
from clpt.formats import load, native
from clpt.formats.native import schema
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import KINDS, Scene, cameras, integrators, lights, materials, shapes, textures

ROOT = Path(__file__).parents[3]
CAMERA = {"type": "perspective"}


@pytest.fixture
def scene(tmp_path):
    """Load a scene of a camera and what is given; text is written as it is."""
    (tmp_path / "t.ply").write_bytes(native.write._ply(triangle()))
    (tmp_path / "t.png").write_bytes(b"")
    (tmp_path / "t.spd").write_text("400 1\n700 2\n")

    def of(content=None, **more):
        path = tmp_path / "scene.json"
        if not isinstance(content, str):
            content = json.dumps({"camera": CAMERA, **(content or {}), **more}, indent=1)
        path.write_text(content, "utf-8")
        return load(path)

    return of


def triangle(**more) -> shapes.Mesh:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    return shapes.Mesh(vertices=vertices, faces=np.array([[0, 1, 2]], np.uint32), **more)


def same(a, b) -> bool:
    """Whether two scenes, kinds or values have the same content."""
    if isinstance(a, Path) or isinstance(b, Path):
        return Path(a).resolve() == Path(b).resolve()
    if isinstance(a, (int, float)) and isinstance(b, (int, float)):
        return a == b
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray):
        return a.shape == b.shape and np.allclose(a, b, rtol=0, atol=0)
    if isinstance(a, (list, tuple)):
        return len(a) == len(b) and all(map(same, a, b))
    if dataclasses.is_dataclass(a):
        return all(
            same(getattr(a, f.name), getattr(b, f.name))
            for f in dataclasses.fields(a)
            if f.name not in ("warnings", "extra", "account")
        )
    return a == b


def test_an_empty_scene_has_the_defaults(scene):
    assert same(scene(name="scene"), Scene(camera=cameras.Perspective(), name="scene"))


def test_every_part(scene):
    made = scene(
        film={
            "width": 32,
            "height": 16,
            "mode": "rgb",
            "filter": {"type": "tent", "radius": 2},
            "layers": ["depth", "uv"],
        },
        integrator={"type": "path", "max_depth": 1},
        sampler={"type": "independent"},
        spp=7,
        seed=3,
        materials={
            "red": {"type": "diffuse", "reflectance": [0.8, 0.1, 0.1]},
            "both": {"type": "two_sided", "front": "red"},
        },
        shapes=[
            {"type": "sphere", "center": [1, 2, 3], "radius": 2, "material": "both"},
            {"type": "mesh", "file": "t.ply", "to_world": {"translate": [0, 0, 5]}},
            {"type": "disk", "emission": {"type": "area", "radiance": [1, 2, 3]}},
        ],
        lights=[{"type": "envmap", "image": "t.png"}],
    )
    assert (made.film.width, made.film.mode, made.film.filter.radius) == (32, "rgb", 2.0)
    assert made.film.layers == ("depth", "uv")
    assert (made.sampler.kind, made.spp, made.seed) == ("independent", 7, 3)
    sphere, mesh, disk = made.shapes
    assert sphere.center == (1, 2, 3)
    assert sphere.material.front.reflectance == spectra.RGB(0.8, 0.1, 0.1)
    assert sphere.material.front.name == "red"
    assert mesh.to_world[2, 3] == 5
    assert disk.emission.radiance == spectra.RGBIlluminant(1, 2, 3)
    assert made.lights[0].image.name == "t.png"


def test_the_integrator_that_is_gone(scene):
    with pytest.raises(SceneError, match=r"integrator.*layers.*max_depth"):
        scene(integrator={"type": "aov", "channels": ["depth", "uv"]})


TRANSFORMS = [
    [[0, -2, 0, 1], [2, 0, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]],
    [{"rotate": {"axis": [0, 0, 1], "angle": 90}}, {"scale": 2}, {"translate": [1, 0, 0]}],
]


@pytest.mark.parametrize("given", TRANSFORMS)
def test_transforms(scene, given):
    made = scene(shapes=[{"type": "cube", "to_world": given}]).shapes[0]
    assert np.allclose(made.to_world, TRANSFORMS[0])


def test_look_at(scene):
    look = {"look_at": {"origin": [0, 0, 0], "target": [0, 0, 1], "up": [0, 1, 0]}}
    assert np.allclose(scene(camera={**CAMERA, "to_world": look}).camera.to_world, np.eye(4))


SPECTRA = [
    (2, spectra.RGBIlluminant(2, 2, 2)),
    ({"type": "constant", "value": 2}, spectra.Constant(2)),
    ([1, 2, 3], spectra.RGBIlluminant(1, 2, 3)),
    ("A", spectra.illuminant("A")),
    ({"type": "illuminant", "name": "sodium", "scale": 4}, spectra.illuminant("sodium", 4)),
    ({"type": "blackbody", "kelvin": 3000}, spectra.Blackbody(3000)),
    (
        {"type": "blackbody", "kelvin": 3000, "normalised": True},
        spectra.Blackbody(3000, normalised=True),
    ),
    (
        {"type": "lines", "wavelengths": [436, 546.1], "powers": [1, 2], "width": 3},
        spectra.Lines((436, 546.1), (1, 2), 3),
    ),
    ({"type": "led", "peak": 470, "width": 25}, spectra.LED(470, 25)),
    ({"type": "rgb", "r": 1, "g": 0.5, "b": 0}, spectra.RGBIlluminant(1, 0.5, 0)),
    ({"file": "t.spd"}, spectra.Tabulated((400, 700), (1, 2))),
    ({"values": [[400, 1], [700, 2]]}, spectra.Tabulated((400, 700), (1, 2))),
]


@pytest.mark.parametrize(("given", "expected"), SPECTRA)
def test_spectra(scene, given, expected):
    assert scene(lights=[{"type": "constant", "radiance": given}]).lights[0].radiance == expected


def test_indices_and_metals(scene, tmp_path):
    def material(**given):
        return scene(shapes=[{"type": "cube", "material": given}]).shapes[0].material

    assert material(type="dielectric", int_ior="bk7").int_ior == "bk7"
    cauchy = material(type="dielectric", int_ior={"type": "cauchy", "a": 1.5, "b": 0.01}).int_ior
    assert cauchy == spectra.Cauchy(1.5, 0.01)
    gold = material(type="rough_conductor", metal="Au", alpha_u=0.2)
    assert (gold.eta, gold.k) == spectra.metal("Au")
    (tmp_path / "m.csv").write_text("400 0.2 3\n700 0.3 4\n")
    measured = material(type="conductor", metal={"file": "m.csv"})
    assert (measured.eta, measured.k) == (
        spectra.Tabulated((400, 700), (0.2, 0.3), "hold"),
        spectra.Tabulated((400, 700), (3, 4), "hold"),
    )
    apart = material(type="conductor", eta={"file": "m.csv"}, k={"file": "m.csv"})
    assert (apart.eta, apart.k) == (measured.eta, measured.k)


def test_absorption(scene, tmp_path):
    """A coefficient of a body; of a page of optical constants it is 4 pi k / lambda."""

    def coefficient(given):
        material = {"type": "dielectric", "absorption": given}
        return scene(shapes=[{"type": "cube", "material": material}]).shapes[0].material.absorption

    assert coefficient(2) == spectra.Constant(2.0)
    assert coefficient([1, 2, 30]) == spectra.RGBUnbounded(1, 2, 30)
    assert coefficient({"values": [[400, 1]]}) == spectra.Tabulated((400,), (1,), "hold")
    page = "DATA:\n - type: tabulated nk\n   data: |\n     0.4 1.5 1e-6\n     0.8 1.5 3e-6\n"
    (tmp_path / "page.yml").write_text(page)
    measured = coefficient({"file": "page.yml"}).sample([400.0, 800.0])
    assert np.allclose(measured, [10.0 * np.pi, 15.0 * np.pi])
    (tmp_path / "table.csv").write_text("400 3\n500 4\n")
    assert coefficient({"file": "table.csv"}).sample([450.0, 700.0]).tolist() == [3.5, 4.0]
    for wrong in (-1, [1, -1, 1], {"values": [[400, -1]]}, "bk7"):
        with pytest.raises(SceneError):
            coefficient(wrong)


def test_a_texture_where_one_may_stand(scene):
    bitmap = {"type": "bitmap", "image": "t.png", "to_uv": {"scale": [2, 3, 1]}}
    material = {"type": "rough_conductor", "alpha_u": bitmap}
    made = scene(shapes=[{"type": "cube", "material": material}]).shapes[0].material.alpha_u
    assert isinstance(made, textures.Bitmap)
    assert np.allclose(made.to_uv, np.diag([2, 3, 1]))


CUBE = {"type": "cube"}
ERRORS = [
    ({"shapes": [CUBE, {"type": "cub"}]}, "shapes[1].type", "unknown shape 'cub'; did you mean"),
    ({"shapes": [{}]}, "shapes[0]", "needs the key 'type'"),
    ({"shapes": [{**CUBE, "radius": 1}]}, "shapes[0].radius", "cube has no parameter 'radius'"),
    ({"shapes": [{**CUBE, "material": "red"}]}, "shapes[0].material", "unknown material name"),
    ({"shapes": [{**CUBE, "emission": {"type": "point"}}]}, "shapes[0].emission", "only an area"),
    ({"shapes": [{**CUBE, "to_world": {"scale": 0}}]}, "shapes[0].to_world", "cannot be inverted"),
    ({"shapes": {}}, "shapes", "must be a list, not an object"),
    ({"lights": [{"type": "area"}]}, "lights[0]", "stands in a shape's 'emission'"),
    ({"spp": 0}, "spp", "above zero"),
    ({"spp": 1.5}, "spp", "whole number"),
    ({"seed": "x"}, "seed", "must be a number, not a string"),
    ({"film": {"width": 0}}, "film.width", "must be a whole number from 1 to 65536"),
    ({"film": {"width": 1e12}}, "film.width", "below 2^31"),
    ({"film": {"mode": "cmyk"}}, "film.mode", "is none of spectral, rgb"),
    ({"camera": {**CAMERA, "fov": float("nan")}}, "camera.fov", "finite"),
    ({"camera": {**CAMERA, "fov": True}}, "camera.fov", "not true or false"),
    ({"camera": {**CAMERA, "to_world": [[1]]}}, "camera.to_world", "4 entries"),
    ({"camera": {**CAMERA, "to_world": {"skew": 1}}}, "camera.to_world.skew", "unknown transform"),
    ({"camera": {**CAMERA, "to_world": {"rotate": [1, 0, 0], "angle": 90}}},
     "camera.to_world", "'angle' stands inside of 'rotate', as {\"rotate\": {\"axis\": [1, 0, 0]"),
    ({"camera": {**CAMERA, "to_world": [{"look_at": [0, 0, 1], "target": [0, 0, 0]}]}},
     "camera.to_world[0]", "'target' stands inside of 'look_at'"),
    ({"camera": {**CAMERA, "to_world": {"rotate": [1, 0, 0]}}},
     "camera.to_world.rotate", "must be an object, as {\"rotate\": {\"axis\""),
    ({"camera": {**CAMERA, "to_world": {"translate": [0, 1, 0], "scale": 2}}},
     "camera.to_world", "several steps are a list"),
    ({"camera": {**CAMERA, "to_world": {"translate": [0, 1, 0], "x": 2}}},
     "camera.to_world", "a step is one of translate, scale, rotate, look_at, alone"),
    ({"camera": {**CAMERA, "to_world": [{"rotate": {"axis": [0, 0, 0], "angle": 1}}]}},
     "camera.to_world[0].rotate", "no length"),
    ({"shapes": [{"type": "mesh", "file": "no.ply"}]}, "shapes[0].file", "no file 'no.ply'"),
    ({"shapes": [{"type": "mesh"}]}, "shapes[0]", "needs a 'file'"),
    ({"shapes": [{"type": "mesh", "vertices": [[0, 0, 0]], "faces": [[0, 1, 2]]}]},
     "shapes[0].faces", "a face names vertex 2, there are 1"),
    ({"shapes": [{"type": "mesh", "vertices": [[0, 0]], "faces": []}]},
     "shapes[0].vertices", "rows of 3 numbers"),
    ({"materials": {"a": {"type": "two_sided", "front": "a"}}},
     "materials.a.front", "refers to itself"),
    ({"materials": {"a": {"type": "diffuse", "reflectance": 2}}},
     "materials.a.reflectance", "outside [0, 1]"),
    ({"materials": {"a": {"type": "dielectric", "int_ior": "bk8"}}},
     "materials.a.int_ior", "unknown glass"),
    ({"materials": {"a": {"type": "conductor", "metal": "Xx"}}},
     "materials.a.metal", "unknown metal"),
    ({"lights": [{"type": "point", "position": [1, 2]}]}, "lights[0].position", "3 entries"),
    ({"lights": [{"type": "constant", "radiance": {"type": "blackbody"}}]},
     "lights[0].radiance", "needs the parameter 'kelvin'"),
    ({"lights": [{"type": "constant", "radiance": {"values": [[700, 1], [400, 2]]}}]},
     "lights[0].radiance", "must ascend"),
    ({"materials": {"a": {"type": "grating", "efficiencies": [1, 2]}}},
     "materials.a.efficiencies", "odd count"),
    ({"lights": [{"type": "constant", "radiance": "D56"}]}, "lights[0].radiance", "'D50'"),
    ({"lights": [{"type": "constant", "radiance": {"type": "illuminant", "name": "sodum"}}]},
     "lights[0].radiance", "did you mean 'sodium'"),
    ({"lights": [{"type": "constant", "radiance":
      {"type": "blackbody", "kelvin": 9, "normalised": 1}}]},
     "lights[0].radiance.normalised", "must be true or false"),
    ({"materials": {"a": {"type": "conductor", "metal": {"name": "Au"}}}},
     "materials.a.metal", "the key 'file' alone"),
    ({"shapes": [{"type": "mesh", "file": "t.ply", "attributes": {}}]},
     "shapes[0].attributes", "in the 'file' already"),
    ({"materials": {"a": {"type": "diffuse", "reflectance":
      {"type": "bitmap", "image": ["t.png"] * 6}}}},
     "materials.a.reflectance.image", "must be a string"),
    ({"gravity": 1}, "gravity", "a scene has no parameter 'gravity'"),
]  # fmt: skip


@pytest.mark.parametrize(("content", "where", "message"), ERRORS)
def test_errors_name_the_location(scene, content, where, message):
    with pytest.raises(SceneError) as caught:
        scene(content)
    error = caught.value
    assert (error.file.name, error.where) == ("scene.json", where)
    assert message in str(error) and "\n" not in str(error)
    # The line is the one on which the innermost key, or the element of a list, stands.
    key = where.split(".")[-1]
    if "[" not in key:
        assert f'"{key}"' in error.file.read_text().splitlines()[error.line - 1]


def test_error_types(scene):
    with pytest.raises(UnknownKindError):
        scene(integrator={"type": "bdpt"})
    with pytest.raises(UnusedParameterError):
        scene(integrator={"type": "path", "depth": 3})


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{", '{"camera": ', "nul", "[" * 100_000, '{"spp": ' + "9" * 5000 + "}", "\x00"],
)
def test_what_is_not_json(scene, text):
    with pytest.raises(SceneError, match=r"scene\.json"):
        scene(text)


def test_a_key_given_twice(scene):
    with pytest.raises(
        SceneError, match=r"scene.json:2: shapes\[0\]: the key 'type' is given twice"
    ):
        scene('{"camera": {"type": "perspective"},\n "shapes": [{"type": "cube", "type": "disk"}]}')


def test_triangles_without_area_wait_for_lowering(scene):
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    made = scene(shapes=[{"type": "mesh", "vertices": vertices, "faces": [[0, 1, 2], [0, 1, 1]]}])
    assert made.shapes[0].faces.tolist() == [[0, 1, 2], [0, 1, 1]]
    assert any("1 of 2 triangles have no area" in line for line in lower(made).warnings)


def rich_scene() -> Scene:
    shared = materials.Diffuse(name="shared", reflectance=(0.1, 0.2, 0.3))
    base = triangle(
        normals=np.array([[0, 0, 1]] * 3, np.float32),
        uvs=np.array([[0, 0], [0.1, 0.3], [1 / 3, 1]], np.float32),
        name="one",
    )
    texels = np.random.default_rng(0).random((3, 5, 3)).astype(np.float32)
    checker = textures.Checkerboard(color0=spectra.Constant(0.3))
    return Scene(
        camera=cameras.ThinLens(fov=33.0, aperture_radius=0.3, to_world=np.diag([1.0, 2, 3, 1])),
        film=integrators.Film(width=10, height=20, filter=integrators.Mitchell()),
        integrator=integrators.Whitted(ambient=(0.1, 0.2, 0.3)),
        shapes=[
            base,
            dataclasses.replace(base, to_world=np.diag([2.0, 2, 2, 1]), material=shared),
            shapes.Cube(material=shared, emission=lights.Area(radiance=spectra.Blackbody(3000))),
            shapes.Disk(material=materials.Diffuse(reflectance=textures.Bitmap(image=texels))),
            shapes.Disk(
                material=materials.Blend(
                    first=materials.RoughConductor(
                        eta=spectra.metal("Au")[0], k=spectra.RGBUnbounded(1, 2, 3)
                    ),
                    second=materials.Dielectric(int_ior="diamond"),
                    weight=checker,
                )
            ),
        ],
        lights=[lights.Constant(radiance=spectra.Sellmeier((1.0,), (0.1,))), lights.Spot()],
        spp=3,
        seed=9,
        name="rich",
    )


def test_save_and_load_keep_the_content(tmp_path):
    made = rich_scene()
    native.save(made, tmp_path / "scene.json")
    again = load(tmp_path)
    image = again.shapes[3].material.reflectance.image
    assert np.array_equal(np.load(image), made.shapes[3].material.reflectance.image)
    object.__setattr__(made.shapes[3].material.reflectance, "image", image)
    assert same(again, made)
    assert again.shapes[1].material is again.shapes[2].material
    assert len(list(tmp_path.glob("*.ply"))) == 1


def test_save_and_load_of_the_mitsuba_scenes(scenes, tmp_path):
    for path in sorted(scenes.glob("*.xml")):
        made = load(path)
        native.save(made, tmp_path / f"{path.stem}.json")
        assert same(load(tmp_path / f"{path.stem}.json"), made), path


def test_every_kind_is_written_and_read(tmp_path):
    made = rich_scene()
    made.shapes = [shapes.Sphere(material=cls()) for cls in KINDS["material"]]
    made.lights = [cls() for cls in KINDS["light"] if cls not in lights.ON_SHAPES]
    for light in made.lights:
        if getattr(light, "image", 0) is None:
            object.__setattr__(light, "image", tmp_path / "sky.exr")
    (tmp_path / "sky.exr").write_bytes(b"")
    for cls in KINDS["camera"]:
        made.camera = cls()
        native.save(made, tmp_path / "scene.json")
        assert same(load(tmp_path), made)


def test_saving_where_nothing_can_be_written(tmp_path):
    with pytest.raises(SceneError, match="cannot be written"):
        native.save(Scene(camera=cameras.Perspective()), tmp_path / "no" / "scene.json")


def test_the_published_schema_is_up_to_date():
    assert (ROOT / "scenes" / "schema.json").read_text("utf-8") == schema.text(), (
        "run python -m clpt.formats.native.schema"
    )


@cache
def validator():
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.Draft202012Validator.check_schema(schema.schema())
    return jsonschema.Draft202012Validator(schema.schema())


def test_the_schema_takes_what_is_saved(tmp_path, scenes):
    check = validator()
    native.save(rich_scene(), tmp_path / "rich.json")
    for path in scenes.glob("*.xml"):
        native.save(load(path), tmp_path / f"{path.stem}.json")
    for path in tmp_path.glob("*.json"):
        assert [e.message for e in check.iter_errors(json.loads(path.read_text()))] == []


@pytest.mark.parametrize(
    "path", sorted(ROOT.glob("scenes/*/scene.json")), ids=lambda p: p.parent.name
)
def test_the_schema_takes_the_scenes(path):
    assert [e.message for e in validator().iter_errors(json.loads(path.read_text()))] == []


@pytest.mark.parametrize(
    ("content", "where"),
    [
        ({"shapes": [{"type": "cub"}]}, "shapes"),
        ({"shapes": [{"type": "cube", "radius": 1}]}, "shapes"),
        ({"materials": {"a": {"type": "diffuse", "reflectance": 2}}}, "materials"),
        ({"spp": 0}, "spp"),
        ({"gravity": 1}, None),
    ],
)
def test_the_schema_refuses_what_the_loader_refuses(scene, content, where):
    errors = list(validator().iter_errors({"camera": CAMERA, **content}))
    assert errors and (where is None or errors[0].absolute_path[0] == where)
    with pytest.raises(SceneError):
        scene(content)
