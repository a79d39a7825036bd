"""Flags: what kernels ask for is said in the table, and nothing is said that no kernel asks for."""

from __future__ import annotations

import re

from clpt.device import kernels_folder
from clpt.render.flow import flags, programs
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene, lights, materials, shapes
from clpt.scene.cameras import Perspective
from clpt.spectra import Tabulated

# Of a program, not of a scene: how it is built, and what generated files define.
OTHERS = {
    "LANES",
    "QUEUED",
    "SHADES_BOTH",
    "SHADES_SEVERAL",
    "PART",
    "NOT_INLINED",
    "USES_MAPPINGS",
    "SLAB_BLOCK",
    "TEXELS_AT_RANDOM",
}
OPENCL = {"FP_FAST_FMAF"}  # what compilers define
TABLES = flags.SCENE | flags.MATERIAL.keys()
CONDITION = re.compile(r"^\s*#\s*(?:if|ifdef|ifndef|elif)\b(.*)", re.MULTILINE)


def kernels() -> str:
    """All kernel files without their comments."""
    files = sorted(kernels_folder().rglob("*.cl"))
    text = "\n".join(path.read_text(encoding="utf-8") for path in files)
    return re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)


def test_what_kernels_ask_for_is_a_flag() -> None:
    """A flag that is misspelt, or that a table forgets, would be 0 without a word."""
    text = kernels()
    asked = {name for line in CONDITION.findall(text) for name in re.findall(r"\b[A-Z]\w*", line)}
    defined = set(re.findall(r"#\s*define (\w+)", text))
    assert asked - defined - OTHERS - OPENCL <= TABLES


def test_every_flag_is_asked_for() -> None:
    assert set(re.findall(r"\b[A-Z]\w*", kernels())) >= TABLES


def test_only_flags_that_kernels_calculate_with_are_in_the_text() -> None:
    film, sky = Film(width=4, height=4), lights.Constant()
    scene = Scene(camera=Perspective(), shapes=[shapes.Sphere()], lights=[sky], film=film)
    texts = programs.sources(lower(scene).features, "wide8", 1, queued=False)
    head = texts["shade_diffuse"].text.split("#line", 1)[0]
    assert "USES_ANALYTIC" not in head and "USES_INSTANCES" not in head
    assert "#define BSDF_TRANSMITS 0\n" in head


def test_features_are_told_apart_by_their_values() -> None:
    """So that they can be the key of what is kept."""

    def features(ior: object) -> object:
        glass = shapes.Sphere(material=materials.Dielectric(int_ior=ior))
        film = Film(width=4, height=4, mode="spectral")
        return lower(Scene(camera=Perspective(), shapes=[glass], film=film)).features

    tabulated = Tabulated((400.0, 700.0), (1.6, 1.5))
    assert len({features(1.5), features(1.6), features(tabulated)}) == 2
