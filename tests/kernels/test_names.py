"""No two kernel files define a name, unless a program has one of them at most."""

from __future__ import annotations

import re
from collections import defaultdict
from fnmatch import fnmatch
from pathlib import Path

from clpt.device.source import TWIN, kernels_folder, sections
from clpt.render.flow import flags, programs
from clpt.scene import KINDS

ALTERNATIVES = (  # files, of each row of which a program has one at most
    ("bvh/*.cl#keyed",),
    ("transport/mis_ratio.cl#area*",),
    ("materials/bsdf.cl#*mis_pdf",),
    ("media/grid_flight.cl#collision*",),
    ("bvh/query.cl#*",),
    ("bvh/shapes.cl#*",),
    ("bvh/mask8.cl*",),
    ("bvh/wide8_stack.cl*",),
    ("core/spectrum.cl#*",),
    ("core/grid.cl#*",),
    ("film/exposure.cl#*",),
    ("integrator/*.cl#*",),
    ("materials/boundary.cl#?*",),
    ("materials/film_stack.cl#?*",),
    ("materials/shading_frame.cl*", "media/phase.cl#frame"),
    ("lights/receiver.cl#kept*",),
    ("lights/light.cl#by_power", "lights/light_tree.cl"),
    ("cameras/first_ray.cl", "cameras/first_ray.cl#weighted"),
    ("media/bodies.cl#vertex", "media/vertex_media.cl*"),
    ("media/vertex_ways.cl#bodies", "media/vertex_ways.cl#media"),
    ("media/vertex_ways.cl#dims", "media/vertex_ways.cl#media#none"),
    ("transport/guiding/guide.cl", "transport/guiding/guided_vertex.cl#none"),
    ("transport/guiding/guide.cl#at_*",),
    ("materials/bsdf.cl#*pair*",),
    ("samplers/pixel_sampler.cl*",),
    ("transport/shadow_ray.cl*",),
    ("samplers/kinds/independent.cl", "core/sobol.cl"),
    ("integrator/steps/escapes.cl*",),
    ("integrator/steps/met_emission.cl#weight*",),
    ("spectra/wavelengths.cl#density", "spectra/wavelengths.cl#visible", "spectra/rgb.cl#read"),
    ("spectra/rgb.cl*", "spectra/spectral.cl*"),
    ("shapes/analytic.cl#*hit",),
    ("shapes/triangle.cl#*_rows",),
    ("textures/cone.cl#first", "textures/cone.cl#unrelated"),
    ("tracing/instances.cl#*",),
    ("tracing/shape_rows.cl#*",),
    ("tracing/trace.cl#*", "tracing/curves.cl#interleaved"),
    ("tracing/transmittance.cl#*",),
)
DEFAULTS = ("FEW_LIGHTS", "FILM_GROUP", "FILM_WORDS")  # flags that files define where none is set
COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)
INCLUDE = re.compile(r'^#include "([^"]+)"', re.MULTILINE)
DEFINITION = re.compile(
    r"^(?:\w+ )+\*?(?P<function>\w+)\([^;{}]*\)\s*\{"
    r"|^[ \t]*#[ \t]*define[ \t]+(?P<macro>\w+)"
    r"|^(?:typedef[^;{]*\{[^}]*)?\}[ \t]*(?P<type>\w+);",
    re.MULTILINE,
)


def defined(text: str) -> dict[str, set[str]]:
    """What a file defines, and leaves defined, by what it is: function, macro or type."""
    text = COMMENT.sub("", text)
    found: dict[str, set[str]] = {"function": set(), "macro": set(), "type": set()}
    for match in DEFINITION.finditer(text):
        found[str(match.lastgroup)].add(match[str(match.lastgroup)])
    found["macro"] -= set(re.findall(r"#[ \t]*undef[ \t]+(\w+)", text))
    return found


def files() -> dict[str, str]:
    """The texts of all sections of kernel files by their names."""
    root = kernels_folder()
    names = sorted(path.relative_to(root).as_posix() for path in root.rglob("*.cl"))
    return {f"{n}{end}": part.text for n in names for end, part in sections(root, n).items()}


def meet(first: str, second: str, texts: dict[str, str]) -> bool:
    """Whether one program may have both files."""
    if second == f"{first}{TWIN}":
        return False
    if second in INCLUDE.findall(texts[first]) or first in INCLUDE.findall(texts[second]):
        return True
    return not any(
        all(
            any(fnmatch(of, pattern) for pattern in row for of in (name, name.removesuffix(TWIN)))
            for name in (first, second)
        )
        for row in ALTERNATIVES
    )


def test_it_sees_what_a_file_defines() -> None:
    text = """
#define A 1 /* #define B */
typedef struct { real x; } Short;
typedef struct {
    real x;
} Long;
#undef C
inline real f(real x) { return x; }
LightSample g(Scene scene,
              vec3 p)
{
    h(scene);
}
"""
    found = defined(text)
    assert found == {"function": {"f", "g"}, "macro": {"A"}, "type": {"Short", "Long"}}


def test_each_name_has_one_file() -> None:
    where, texts = defaultdict(list), files()
    for file, text in texts.items():
        for name in set().union(*defined(text).values()):
            where[name].append(file)
    twice = {
        name: (a, b)
        for name, owners in where.items()
        for i, a in enumerate(owners)
        for b in owners[i + 1 :]
        if meet(a, b, texts)
    }
    assert not twice


def test_no_name_is_a_function_and_a_macro() -> None:
    """The loop's parts give their functions names of their own by macros."""
    both = {file: defined(text) for file, text in files().items()}
    assert not {
        f: d["function"] & d["macro"] for f, d in both.items() if d["function"] & d["macro"]
    }


def test_flags_have_names_of_their_own() -> None:
    """None is what a kernel file, or a generated text, calls something else."""
    own = {name for text in files().values() for name in set().union(*defined(text).values())}
    hosts = Path(programs.__file__).parents[1].rglob("*.py")
    texts = [path.read_text("utf-8") for path in hosts]
    generated = {name for text in texts for name in re.findall(r"#define ([A-Z]\w*)[ (]", text)}
    generated |= {f"{cls.kind.upper()}_WORDS" for row in KINDS.values() for cls in row}
    assert "LAYER_WORDS" in generated  # of a thin film
    chosen = flags.SCENE | flags.MATERIAL.keys()
    assert chosen & (own | generated) == set(DEFAULTS)
