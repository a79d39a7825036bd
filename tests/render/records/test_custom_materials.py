"""Material kinds that the package does not know: as good as its own, and faults are told."""

from __future__ import annotations

import dataclasses
import inspect
import json
import pickle
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import device, transforms
from clpt.formats import native
from clpt.render.flow import programs
from clpt.render.flow.scene_to_tables import lower
from clpt.render.records import materials
from clpt.scene import Film, Scene, cameras, lights, shapes, textures
from clpt.scene import materials as m
from clpt.scene.params import reflectance

DIFFUSE = (device.kernels_folder() / "materials" / "kinds" / "diffuse.cl").read_text(
    encoding="utf-8"
)
FLAWED = """
#include "materials/microfacet.cl"
BsdfSample flawed_sample(Flawed m, vec3 wo, vec3 u) { return nonsense; }
Spectrum flawed_eval(Flawed m, vec3 wo, vec3 wi) { return spectrum_of(0.0f); }
real flawed_pdf(Flawed m, vec3 wo, vec3 wi) { return 0.0f; }
Spectrum flawed_albedo(Flawed m) { return spectrum_of(0.0f); }
"""


@dataclass(frozen=True, kw_only=True, eq=False)
class Paint(m.Material):
    """What Diffuse is, under another name."""

    absorbs = True

    reflectance: Any = reflectance(0.5, "albedo")
    source = DIFFUSE.replace("diffuse_", "paint_").replace("(Diffuse ", "(Paint ")


@dataclass(frozen=True, kw_only=True, eq=False)
class Flawed(m.Material):
    """Its text does not compile."""

    source = FLAWED


def glass() -> type[m.Material]:
    """What RoughDielectric is, with all it has: two indices, thin films, an inside that absorbs."""
    text = (device.kernels_folder() / "materials" / "kinds" / "rough_dielectric.cl").read_text(
        encoding="utf-8"
    )
    text = text.replace("rough_dielectric_", "glass_").replace("RoughDielectric", "Glass")
    return type("Glass", (m.RoughDielectric,), {"source": text, "disperses": True})


def scene(cls: type[m.Material], mode: str = "rgb") -> Scene:
    """A lit corner with a material of this class bare, and with every composite around it."""
    board = textures.Checkerboard(color0=0.9, color1=(0.2, 0.3, 0.7))
    bare, figured = cls(reflectance=(0.8, 0.4, 0.2)), cls(reflectance=board)
    dressed = m.Blend(
        first=m.TwoSided(front=figured),
        second=m.TwoSided(front=m.Mask(material=bare, opacity=0.5)),
        weight=board,
    )
    floor = shapes.Rectangle(material=m.BumpMap(material=bare, height=board))
    return Scene(
        camera=cameras.Perspective(to_world=transforms.look_at([0, -3, 2], [0, 0, 0.3], [0, 0, 1])),
        shapes=[floor, shapes.Sphere(center=(0, 0, 0.5), radius=0.5, material=dressed)],
        lights=[lights.Constant()],
        film=Film(width=16, height=16, mode=mode),
    )


def texts(cls: type[m.Material], mode: str) -> dict[str, str]:
    """The scene's programs by name, without what tells where a line is from."""
    features = lower(scene(cls, mode)).features
    made = programs.sources(features, "wide8", 8, queued=False)
    return {
        name: re.sub(r"^#line .*\n", "", source.text, flags=re.M) for name, source in made.items()
    }


@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_its_programs_are_those_of_ours(mode: str) -> None:
    """With textures, and within two-sided, mask, blend and bump map: all but name and number."""
    ours, theirs = texts(m.Diffuse, mode)["shade_diffuse"], texts(Paint, mode)["shade_paint"]
    assert "spectrum_texture_reflectance(" in theirs
    theirs = theirs.replace("Paint", "Diffuse").replace("paint", "diffuse")
    number = re.compile(r"(BSDF_KIND|BSDF_COUNT|MATERIAL_KIND\(word\) ==) \d+")
    assert number.sub("", theirs) == number.sub("", ours)


@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_glass_from_outside_disperses_and_absorbs(mode: str) -> None:
    made = []
    for cls in (m.RoughDielectric, glass()):
        one = cls(int_ior="bk7", absorption=2.0, layers=[m.Layer(thickness=300.0)])
        balls = [shapes.Sphere(material=one), shapes.Sphere(material=m.Diffuse())]
        features = lower(dataclasses.replace(scene(m.Diffuse, mode), shapes=balls)).features
        assert features.media.absorption and (features.dispersion or mode == "rgb")
        text = programs.sources(features, "wide8", 8, queued=False)[f"shade_{cls.kind}"].text
        made.append(re.sub(r"^#line .*\n|BSDF_KIND \d+", "", text, flags=re.MULTILINE))
    theirs = made[1].replace("Glass", "RoughDielectric").replace("glass_", "rough_dielectric_")
    assert theirs == made[0]


@pytest.mark.slow
def test_it_renders_within_composites_as_one_of_ours() -> None:
    ours, theirs = (clpt.render(scene(cls), spp=4) for cls in (m.Diffuse, Paint))
    assert ours.max() > 0.1
    np.testing.assert_allclose(theirs, ours, rtol=1e-5, atol=1e-6)


def test_a_fault_names_the_line_in_the_users_file() -> None:
    broken = dataclasses.replace(scene(m.Diffuse), shapes=[shapes.Cube(material=Flawed())])
    made = programs.sources(lower(broken).features, "wide8", 8, queued=False)
    with pytest.raises(clpt.KernelBuildError) as raised:
        device.build(device.choose(), made["shade_flawed"])
    lines = Path(__file__).read_text(encoding="utf-8").splitlines()
    assert Path(raised.value.file) == Path(__file__)
    assert "nonsense" in lines[raised.value.line - 1]


def test_a_row_of_the_whole_text_is_found_in_the_users_file() -> None:
    """NVIDIA's compiler tells no more of a fault."""
    broken = dataclasses.replace(scene(m.Diffuse), shapes=[shapes.Cube(material=Flawed())])
    made = programs.sources(lower(broken).features, "wide8", 8, queued=False)["shade_flawed"]
    rows = made.text.splitlines()
    file, line = made.location(1 + next(i for i, row in enumerate(rows) if "nonsense" in row))
    assert file is not None and line is not None and Path(file) == Path(__file__)
    assert "nonsense" in Path(file).read_text(encoding="utf-8").splitlines()[line - 1]


def test_its_functions_and_constants_are_its_own() -> None:
    """Where stages are linked to one program two kinds may have helpers of one name."""
    helped = """
        constant float table[2] = {0.5f, 1.0f};
        real helper(real x)
        {
            return x * table[0];
        }
    """
    text = device.Source("own", materials.text(type("Own", (Paint,), {"source": helped})).text, ())
    private = text.with_private("own").text
    assert "\nstatic constant float table[2]" in private
    assert "\nstatic real helper(real x)" in private and "static return" not in private


def test_a_file_is_found_beside_the_class(tmp_path: Path) -> None:
    """And text that stands nowhere is told by the name of its class."""
    kind = type("Filed", (m.Material,), {"source": Path("test_custom_materials.py")})
    assert materials.text(kind).text == inspect.getsource(inspect.getmodule(Paint))
    assert Path(materials.text(kind).file).samefile(__file__)
    assert materials.text(Paint).file == "test_custom_materials.py:source"
    nowhere = type("Nowhere", (Paint,), {"source": "int x() {}", "__module__": "nowhere"})
    assert materials.text(nowhere).file == "Nowhere.source"
    for source in (tmp_path / "none.cl", "velvet.cl"):
        with pytest.raises(clpt.SceneError, match=r"cannot be read|pathlib"):
            materials.text(type("Gone", (m.Material,), {"source": source}))


@pytest.mark.parametrize(
    ("name", "source", "fault"),
    [
        ("Plain", None, "has no `source`"),
        ("Diffuse", "int x() {}", "clpt has 'Diffuse'|clpt has 'diffuse'"),
        ("Mask", "int x() {}", "clpt has 'mask'"),
        ("Mixture", "int x() {}", "clpt has 'mixture'"),
        ("Surface", "int x() {}", "clpt has 'Surface'"),
        ("Hero", "int x() {}", "clpt has 'hero_"),
        ("Path", "int x() {}", "clpt has 'Path'|clpt has 'path'"),
        ("Äther", "int x() {}", "no name in OpenCL"),
        (
            "Half",
            "int half_pdf, half_eval() {}",
            "has no half_albedo, half_sample",
        ),
    ],
)
def test_names_that_cannot_be(name: str, source: str | None, fault: str) -> None:
    cls = type(name, (m.Material,), {"source": source})
    with pytest.raises(clpt.SceneError, match=fault):
        lower(Scene(camera=cameras.Perspective(), shapes=[shapes.Cube(material=cls(), name="box")]))


def test_materials_are_told_apart_by_identity() -> None:
    equal = dataclass(frozen=True, kw_only=True)(type("Equal", (Paint,), {}))
    with pytest.raises(clpt.SceneError, match="eq=False"):
        materials.check(equal)


def test_two_of_one_name_are_refused_in_one_scene() -> None:
    other = type("Paint", (Paint,), {"source": Paint.source})
    both = [shapes.Cube(material=Paint()), shapes.Cube(material=other())]
    with pytest.raises(clpt.SceneError, match="two classes are called 'Paint'"):
        lower(Scene(camera=cameras.Perspective(), shapes=both))
    for one in both:  # in scenes of their own they are fine
        lower(Scene(camera=cameras.Perspective(), shapes=[one]))


def test_scenes_are_written_read_and_pickled(tmp_path: Path) -> None:
    path = tmp_path / "scene.json"
    native.save(scene(Paint), path)
    again = clpt.load(path, kinds=[Paint])
    shape = next(one for one in again.shapes if isinstance(one.material, m.BumpMap))
    assert isinstance(shape.material.material, Paint)
    assert json.loads(path.read_text())["shapes"]
    assert isinstance(pickle.loads(pickle.dumps(again)).shapes[0].material.material, Paint)
    with pytest.raises(clpt.UnknownKindError, match="paint"):
        clpt.load(path)
    with pytest.raises(clpt.SceneError, match="two kinds of materials 'paint'"):
        clpt.load(path, kinds=[Paint, Paint])
    path.with_suffix(".xml").write_text("<scene/>")
    with pytest.raises(clpt.SceneError, match=r"only a scene\.json"):
        clpt.load(path.with_suffix(".xml"), kinds=[Paint])
