"""Lowering: scenes become tables, features and settings; what makes no sense is refused."""

from __future__ import annotations

import sys

import numpy as np
import pytest

import clpt
from clpt.errors import SceneError
from clpt.records import SETTINGS, SHAPE, SHAPE_BITS, TABLES
from clpt.render.flow.scene_to_tables import TREE_FROM, lower
from clpt.render.flow.settings import DEEPEST
from clpt.render.geometry import find as geometry
from clpt.render.materials.encode import gloss_word
from clpt.render.records.materials import MIXTURE, NORMAL_MAP_WORDS
from clpt.scene import Film, Scene
from clpt.scene import materials as m
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Direct, Path
from clpt.scene.lights import Area, Constant, Directional, Point
from clpt.scene.shapes import Cube, Mesh, Rectangle, Shape, Sphere
from clpt.scene.textures import Bitmap

CORNERS = np.eye(3, dtype=np.float32)
FACE = np.array([[0, 1, 2]], np.uint32)


def scene(*shapes: Shape, **given: object) -> Scene:
    """A scene of these shapes on a small film."""
    return Scene(camera=Perspective(), shapes=list(shapes), film=Film(width=9, height=6), **given)


def rows(lowered) -> np.ndarray:
    """The table of shapes as records."""
    return lowered.tables["shapes"].view(SHAPE.dtype)


def test_tables_have_their_types() -> None:
    tables = lower(scene(Rectangle())).tables
    assert set(tables) == set(TABLES)
    for name, (element, _) in TABLES.items():
        assert tables[name].dtype == (np.float32 if element == "float" else np.uint32)
        assert tables[name].size > 0


def test_settings() -> None:
    settings = lower(scene(Rectangle(), integrator=Path(max_depth=-1, rr_depth=3), seed=7)).settings
    assert settings.dtype == SETTINGS.dtype
    assert (settings["width"], settings["height"], settings["tiles_x"]) == (9, 6, 3)
    assert settings["padded_pixels"] == 16 * 3 * 2
    assert (settings["max_depth"], settings["rr_depth"], settings["seed"]) == (DEEPEST, 3, 7)
    assert lower(scene(Rectangle(), integrator=Direct())).settings["max_depth"] == 2


def test_triangles_of_all_shapes_are_joined() -> None:
    mesh = Mesh(vertices=CORNERS, faces=FACE, normals=CORNERS, uvs=CORNERS[:, :2])
    made = lower(scene(Rectangle(), Sphere(), mesh, Cube()))
    assert len(made.faces) == 2 + 1 + 12
    assert made.tags.tolist() == [0] * 2 + [1] + [2] * 12  # analytic shapes come last
    assert made.faces.max() == len(made.vertices) - 1
    table = rows(made)
    assert table["prim"].tolist()[:3] == [0, 2, 3]
    assert table["flags"][1] & SHAPE_BITS["normals"] and table["flags"][1] & SHAPE_BITS["uvs"]
    assert not table["flags"][0] & SHAPE_BITS["normals"]
    assert table["kind"].tolist() == [0, 0, 0, 1]
    assert len(made.boxes) == 1
    assert table["number"].tolist() == [0, 2, 3, 1]  # which shape of the scene it was


def test_materials_are_put_in_once() -> None:
    red, blue = m.Diffuse(reflectance=(1, 0, 0)), m.Diffuse(reflectance=(0, 0, 1))
    table = rows(lower(scene(*(Rectangle(material=x) for x in (red, blue, red)))))
    assert table["front"][0] == table["front"][2] != table["front"][1]


def test_sides() -> None:
    red, blue = m.Diffuse(reflectance=(1, 0, 0)), m.Diffuse(reflectance=(0, 0, 1))
    made = rows(lower(scene(Rectangle(material=m.TwoSided(front=red, back=blue)))))
    assert made["flags"][0] & SHAPE_BITS["two_sided"]
    assert made["front"][0] != made["back"][0]
    same = rows(lower(scene(Rectangle(material=m.TwoSided(front=red)))))
    assert same["front"][0] == same["back"][0]


def test_mixtures_name_their_parts() -> None:
    made = lower(scene(Rectangle(material=m.Mask(opacity=0.25))))
    word = int(rows(made).view(np.uint32).reshape(-1, SHAPE.words)[0][1])
    assert word >> 24 == MIXTURE
    rule = made.tables["mixtures"][word & 0xFFFFFF :][:4]
    assert rule[:1].view(np.float32)[0] == 0.25
    kinds = [made.features.materials.kinds[w >> 24] for w in rule[2:].tolist()]
    assert kinds == ["null", "diffuse"]


def test_lights_of_shapes_know_their_rows() -> None:
    shining = Cube(emission=Area())
    made = lower(scene(Rectangle(), shining, lights=[Constant()]))
    assert made.settings["infinite_count"] == 1
    assert made.settings["light_count"] == 1 + 12
    assert rows(made)["light"].tolist() == [-1, 1]


def test_an_empty_scene_is_black() -> None:
    image = clpt.render(scene(), 2)
    assert image.shape == (6, 9, 3) and not image.any()


def test_an_empty_sky_with_a_light() -> None:
    made = scene(lights=[Constant(radiance=(0.5, 0.5, 0.5))])
    np.testing.assert_allclose(clpt.render(made, 64).mean(axis=(0, 1)), 0.5, rtol=0.03)


def test_what_is_no_material_is_refused() -> None:
    with pytest.raises(clpt.SceneError, match=r"'door'\.material: must be a material"):
        Rectangle(material="steel", name="door")
    glass = m.Blend(first=m.TwoSided(), second=m.Dielectric())
    with pytest.raises(clpt.SceneError, match="rectangle 'door': dielectric lets light"):
        lower(scene(Rectangle(material=glass, name="door")))


def test_principled_is_what_its_parameters_say() -> None:
    """Two-sided while it is opaque; with tangents where it is stretched."""
    opaque = lower(scene(Rectangle(material=m.TwoSided(front=m.Principled())))).features
    assert not opaque.geometry.tangents and not opaque.dispersion
    for stretched in (m.Principled(anisotropic=0.5), m.PrincipledThin(anisotropic=0.5)):
        assert lower(scene(Rectangle(material=stretched))).features.geometry.tangents
    for passes in (m.Principled(spec_trans=0.1), m.PrincipledThin(), m.DiffuseTransmission()):
        with pytest.raises(clpt.SceneError, match="lets light through"):
            lower(scene(Rectangle(material=m.TwoSided(front=passes))))


def test_few_lights_are_chosen_from_a_tree_where_they_stand_apart() -> None:
    points = [Point(position=(float(i), 0.0, 1.0)) for i in range(3)]
    far = [Constant(), Directional(direction=(0.0, 0.0, -1.0))]
    cube = Cube(emission=Area())  # twelve rows, one as good as another

    def tree(*shapes: Shape, lights: list) -> bool:
        return lower(scene(*shapes, lights=lights)).features.lights.tree

    assert tree(lights=points) and tree(lights=far + points)
    assert not tree(lights=points[:2]) and not tree(lights=far + points[:2])
    assert not tree(cube, lights=points[:1])
    assert tree(cube, lights=points[:2])


def test_shapes_cost_the_same_however_many() -> None:
    """Calls of functions, which a busy machine does not change: twice as many of twice as many."""

    def calls(count: int) -> int:
        colours = np.linspace(0.1, 0.9, count)
        shapes = [Cube(material=m.Diffuse(reflectance=float(c))) for c in colours]
        whole, made = scene(*shapes, lights=[Constant(radiance=1.0)]), 0

        def count_one(_: object, event: str, __: object) -> None:
            nonlocal made
            made += event == "call"

        sys.setprofile(count_one)
        try:
            lower(whole)
        finally:
            sys.setprofile(None)
        return made

    calls(1)  # what is kept for all
    few, many = calls(100), calls(300)
    assert (many - few) / 200 < 1.1 * few / 100 < 320  # 33 of them look at the time of the load


def test_more_triangles_than_kernels_count(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(geometry, "MOST", 12)
    assert len(lower(scene(Rectangle())).faces) == 2
    with pytest.raises(SceneError, match="use instances"):
        lower(scene(Cube(), Rectangle()))


def test_gloss_stands_before_rows_where_a_tree_asks_for_it() -> None:
    lamps = [Point(position=(i, 5.0, 0.0), intensity=1.0) for i in range(TREE_FROM)]
    rough, dull = m.RoughConductor(alpha_u=0.1, alpha_v=0.4), m.Diffuse()
    wavy = m.BumpMap(material=rough, height=Bitmap(image=np.zeros((2, 2, 1), np.float32)))
    for shapes, words in (((rough, dull), 1), ((rough, wavy), 1 + NORMAL_MAP_WORDS), ((dull,), 0)):
        made = lower(scene(*(Sphere(material=one) for one in shapes), lights=lamps))
        assert made.features.lights.tree and made.features.lights.gloss == words
        for material, row in zip(shapes, rows(made)["front"] & 0xFFFFFF, strict=True):
            leaf = rough if material is wavy else material
            assert not words or made.tables["materials"][row - words] == gloss_word(leaf)
    few = lower(scene(Sphere(material=rough), lights=lamps[:2]))
    assert not few.features.lights.tree and few.features.lights.gloss == 0


def test_gloss_is_that_of_the_material() -> None:
    image = Bitmap(image=np.full((2, 2, 1), 0.7, np.float32))
    found = {
        m.RoughConductor(alpha_u=0.1, alpha_v=0.4): (0.2, 1.0),
        m.CoatedConductor(alpha_u=0.3, alpha_v=0.3): (0.3, 1.0),
        m.RoughPlastic(alpha=0.2, diffuse_reflectance=0.36): (0.2, 0.1),
        m.Principled(roughness=0.5, metallic=1.0): (0.25, 1.0),
        m.Principled(roughness=image, base_color=0.46): (0.25, 0.08),
        m.Phong(exponent=49.5, specular=0.3, diffuse=0.1): (0.1, 0.75),
    }
    for material, (alpha, share) in found.items():
        word = gloss_word(material)
        assert (word >> 16) / 65535 == pytest.approx(alpha, abs=2e-5), material
        assert (word & 0xFFFF) / 65535 == pytest.approx(share, abs=2e-5), material
    glass = m.RoughDielectric(alpha=0.1), m.Principled(spec_trans=0.5)
    for material in (m.Diffuse(), m.Plastic(), m.Conductor(), *glass):
        assert gloss_word(material) == 0
