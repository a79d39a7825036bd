"""The generated text of every kind builds, at every lane width and in both modes."""

from __future__ import annotations

import dataclasses
import re

import pytest

from clpt import device, spectra
from clpt import scene as sc
from clpt.render.flow import programs
from clpt.render.flow.scene_to_tables import Lowered, lower
from clpt.render.materials import cases as parameters
from clpt.scene import Film, Scene, roles, textures
from clpt.scene import materials as m
from clpt.scene.cameras import Perspective
from clpt.scene.lights import Area, Constant, Point
from clpt.scene.params import device_params
from clpt.scene.shapes import Cube, Rectangle, Sphere
from clpt.spectra import Fluorophore, Tabulated
from tests.front_end import CLANG, errors

GREY = Tabulated((400.0, 700.0), (0.2, 0.8))


def lowered(materials: list[m.Material], mode: str, **changes: object) -> Lowered:
    """A scene with squares and a ball of these materials, a lamp and a sky."""
    shapes: list = [Rectangle(material=material) for material in materials]
    shapes += [Sphere(material=materials[0]), Cube(emission=Area(radiance=GREY))]
    lights = [Point(), Constant()]
    film = Film(width=4, height=4, mode=mode)
    return lower(Scene(camera=Perspective(), shapes=shapes, lights=lights, film=film, **changes))


def textured(cls: type[m.Material]) -> m.Material:
    """A material whose parameters come from everywhere that they may come from."""
    board = textures.Checkerboard(color0=0.3, color1=GREY)
    given: dict = {}
    for name, param in device_params(cls).items():
        if param.textured:
            given[name] = board
        elif param.role is roles.RERADIATION:
            given[name] = Fluorophore(GREY, GREY, 0.1)
        elif param.role in roles.SPECTRA:
            given[name] = GREY
    return cls(**given)


def plain(cls: type[m.Material]) -> m.Material:
    return cls()


def build(*sources: device.Source) -> None:
    """Give programs that are not run to clang's front end, or else to the device's compiler."""
    if CLANG is None:
        device.build_all(device.choose(), {str(i): source for i, source in enumerate(sources)})
    else:
        assert errors(source.text for source in sources) == [""] * len(sources)


@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("cls", m.LEAVES, ids=lambda c: c.kind)
def test_loaders_of_materials_build(cls: type[m.Material], mode: str) -> None:
    """The loader of a kind with constants, tables and textures, eight lanes wide."""
    features = lowered([textured(cls), plain(cls)], mode).features
    texts = programs.sources(features, "wide8", 8, queued=False)
    build(texts[f"shade_{cls.kind}"])


@pytest.mark.parametrize("lanes", [1, 8, 16])
@pytest.mark.parametrize("queued", [False, True])
def test_stages_build(lanes: int, queued: bool) -> None:
    """Every stage of a scene with mixtures, analytic shapes, textures and lights."""
    mask = m.Mask(material=textured(m.Diffuse), opacity=textures.Checkerboard())
    features = lowered([mask, m.Diffuse()], "spectral").features
    texts = programs.sources(features, "binary", lanes, queued=queued)
    texts |= programs.film_sources(features, "binary")
    assert {"mix", "shade_diffuse", "shade_null"} <= set(texts)
    assert ("append" in texts) == (queued and lanes == 1)
    build(*texts.values())


@pytest.mark.parametrize("lanes", [1, 8, 16])
def test_stages_of_a_spectral_film_build(lanes: int) -> None:
    """And no other film has anything of it in its text."""
    film = Film(width=4, height=4, bands=3)
    plain_ = lowered([m.Diffuse()], "spectral").features
    banded = lower(Scene(camera=Perspective(), lights=[Constant()], film=film)).features
    texts = programs.sources(banded, "brute", lanes, queued=False)
    texts |= programs.film_sources(banded, "brute")
    build(texts["generate"], texts["accumulate"])
    others = programs.sources(plain_, "brute", lanes, queued=False)
    others |= programs.film_sources(plain_, "brute")
    assert "wavelengths_weigh" in texts["generate"].text
    assert not any("wavelengths_weigh" in source.text for source in others.values())


def test_text_holds_only_what_the_scene_has() -> None:
    texts = programs.sources(lowered([m.Diffuse()], "rgb").features, "wide8", 8, queued=False)
    assert set(texts) == {"generate", "intersect", "shadow", "shade_diffuse"}
    shade = texts["shade_diffuse"].text
    assert not any(f"{kind}_row(" in shade for kind in ("bitmap", "checkerboard", "cylinder"))
    assert "rough_conductor" not in shade


def test_only_materials_of_lights_look_for_light() -> None:
    """Those of surfaces that shine: masks and what is in them among them."""
    glow = Area(radiance=1.0)
    shapes = [
        Rectangle(material=m.Mask(material=m.Plastic()), emission=glow),
        Sphere(material=m.Diffuse()),
        Cube(material=m.TwoSided(front=m.Conductor())),
    ]
    film = Film(width=4, height=4, mode="rgb")
    features = lower(Scene(camera=Perspective(), shapes=shapes, film=film)).features
    assert sorted(features.materials.shining) == ["null", "plastic"]
    texts = programs.sources(features, "wide8", 8, queued=False)
    for kind in features.materials.kinds:
        kept = texts[f"shade_{kind}"].text
        assert ("light_shows(scene, v.s.light" in kept) == (kind in features.materials.shining), (
            kind
        )


@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_only_what_absorbs_is_asked_for_a_medium(mode: str) -> None:
    """Glass that absorbs nothing is shaded by the text that stood there before."""
    for absorption, there in ((0.0, False), (1.0, True), (GREY, True)):
        glass = m.Dielectric(absorption=absorption)
        features = lowered([glass, m.RoughDielectric(), m.Diffuse()], mode).features
        texts = programs.sources(features, "wide8", 8, queued=False)
        for name in ("generate", "shade_dielectric", "shade_rough_dielectric", "shade_diffuse"):
            text = texts[name].text
            assert ("inline Spectrum medium_transmittance(" in text) == there
        assert ("inline integer medium_beyond(" in texts["shade_diffuse"].text) == there
        build(texts["shade_rough_dielectric"])


def test_only_what_fluoresces_shifts_wavelengths() -> None:
    """A scene without such a material, and RGB mode, are shaded as if there were none."""
    for materials, mode in (
        ([m.Diffuse()], "spectral"),
        ([m.Diffuse(), m.Fluorescent()], "rgb"),
        ([m.Diffuse(), m.Fluorescent()], "spectral"),
    ):
        texts = programs.sources(lowered(materials, mode).features, "wide8", 8, queued=False)
        there = len(materials) > 1 and mode == "spectral"
        for name, source in texts.items():
            shifts = there and name == "shade_fluorescent"
            assert ("inline Wavelengths reradiation_shift(" in source.text) == shifts


def test_a_material_more_does_not_change_the_others() -> None:
    one = lowered([m.Diffuse(), m.Null()], "rgb").features
    leaves = dataclasses.replace(one.materials, leaves=(m.Diffuse, m.Null))
    two = dataclasses.replace(one, materials=leaves)
    texts = programs.sources(one, "wide8", 8, queued=False)
    again = programs.sources(two, "wide8", 8, queued=False)
    assert {name: s.text for name, s in texts.items()} == {
        name: s.text for name, s in again.items()
    }


@pytest.mark.parametrize("category", sc.KINDS)
def test_structs_of_every_kind(category: str) -> None:
    """A member per device parameter, in their order."""
    for cls in sc.KINDS[category]:
        text = parameters.struct_text(cls)
        names = list(device_params(cls)) or ["unused"]
        assert text.rstrip().endswith(f"}} {cls.__name__};")
        places = [re.search(rf" {name}(\[\d+\])?;", text).start() for name in names]
        assert places == sorted(places)


def test_index_by_name_is_a_spectrum() -> None:
    """A glass's name is looked up where the scene is lowered."""
    for glass in (m.Dielectric(int_ior="bk7"), m.Principled(eta="bk7", spec_trans=1.0)):
        assert lowered([glass], "spectral").features.dispersion
    assert spectra.glass("bk7")


def test_gpus_are_told_with_how_few_registers_to_run() -> None:
    """By a number with the text and, of those that need few, in the text; a CPU's has neither."""
    features = lowered([m.Diffuse(), m.Dielectric()], "rgb").features
    own = programs.sources(features, "wide8", 1, queued=True)
    limits = {name: text.registers for name, text in own.items()}
    assert limits["generate"] == (80, 96, 112) and limits["append"] == ()
    few = {name for name, text in own.items() if "amdgpu_waves_per_eu" in text.text}
    assert {"generate", "shade_diffuse"} <= few and not {"intersect", "shade_dielectric"} & few
    for text in programs.sources(features, "wide8", 8, queued=False).values():
        assert text.registers == () and "amdgpu" not in text.text
