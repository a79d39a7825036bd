"""Programs that are linked to the loop: no more than there must be, and nothing but the stages is
seen outside of its program.

`Source.with_private` finds definitions by how they are written; this test finds them by braces.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import clpt
from clpt.device import Source
from clpt.render.flow import flags, programs, vertices
from clpt.render.flow.scene_to_tables import lower
from clpt.render.records import Features
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Path as PathTracer
from clpt.scene.integrators import Vcm
from clpt.scene.shapes import Curves

ROOT = Path(__file__).resolve().parents[3]
SCENES = [
    "scenes/cornell_box/scene.json",
    "scenes/oil_film/scene.json",
    "scenes/fluorescent_paint/scene.json",
    "scenes/rainbow/scene.json",
    "scenes/bulb/scene.json",
    "tests/scenes/instances.xml",
    "tests/scenes/light_tracing.xml",
    "tests/scenes/textures.xml",
    "tests/scenes/principled.xml",
    "tests/scenes/thrown_images.xml",
    "curves",
]
HAIR = clpt.Scene(camera=Perspective(), shapes=[Curves(points=[[i, 0, 0, 0.1] for i in range(4)])])
WAYS = [("brute", 8, False), ("wide8", 8, True), ("compact", 1, False), ("binary", 16, False)]
COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
DIRECTIVE = re.compile(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", re.MULTILINE)


def definitions(source: Source) -> Iterator[tuple[str, str]]:
    """What stands before the braces of each function and constant, and its name."""
    depth, begin, head = 0, 0, ""
    text = DIRECTIVE.sub("", COMMENT.sub("", source.text))
    for match in re.finditer(r"[{};]", text):
        if match[0] == "{":
            head = head if depth else text[begin : match.start()].strip()
            depth += 1
        elif match[0] == "}":
            depth -= 1
            ends = depth == 0 and not head.endswith("=") and not head.startswith("typedef")
            if ends and "(" in head:
                yield head, re.split(r"\W", head.split("(")[0].strip())[-1]
        if match[0] != "{" and depth == 0:
            if match[0] == ";" and head.endswith("="):
                yield head, re.search(r"(\w+)\s*(\[[^=]*)?=$", head)[1]
            if match[0] == ";" or "(" in head:
                begin, head = match.end(), ""
    assert depth == 0


def features_of(name: str, integrator: PathTracer | Vcm | None = None) -> Features:
    scene = HAIR if name == "curves" else clpt.load(ROOT / name)
    return lower(dataclasses.replace(scene, integrator=integrator or scene.integrator)).features


@pytest.mark.parametrize("name", SCENES)
def test_only_stages_are_seen_outside(name: str) -> None:
    features = features_of(name)
    for layout, lanes, interleaved in WAYS:
        outside, look_ups = [], []
        made = programs.loop_sources(features, layout, lanes, interleaved)
        for program, source in made.items():
            private = dict(re.findall(r"^#define (\w+) (\w+)$", source.text, re.MULTILINE))
            found = list(definitions(source))
            assert len(found) > 10, "definitions are found at all"
            for head, own in found:
                if head.startswith("static "):
                    assert private[own] == f"in_{program}_{own}", head
                elif head.startswith("STAGE("):
                    outside.append(private["PART"])
                elif shared := re.match(r"COMMON\(\w+, (\w+)\)", head):
                    outside.append(f"loop_{shared[1]}")
                elif apart := re.match(r"APART\(\w+, loop_(\w+)_answer\)", head):
                    outside.append(f"loop_material_{apart[1]}")
                elif looked_up := re.match(r"APART\(\w+, (loop_\w+_texture_\w+)\)", head):
                    look_ups.append(looked_up[1])
                else:
                    assert head.startswith("kernel "), f"{program}: {head} is not private"
                    outside.append(own)
        others = "".join(one.text for name, one in made.items() if name != "textures")
        assert ("textures" in made) == any(f"{own}(" in others for own in look_ups)
        stages = made.keys() - {"loop", "common", "textures"}
        wanted = {"loop", *(f"loop_{name}" for name in stages)}
        wanted |= {f"loop_{one.name}" for one in vertices.shared(features, lanes)}
        assert sorted(outside) == sorted(wanted)


def test_definitions_are_found_by_their_braces() -> None:
    text = """
        /* real commented(real x) { } */
        #define MACRO(x) \\
            real in_macro(real x) { return x; }
        typedef struct { real x; } Pair;
        constant float table[2] = {1.0f, 2.0f};
        real declared(real x);
        static inline real one(real x) { if (x) { x = 1.0f; } return x; }
        Pair *two(void)
        {
            Pair p = {1.0f};
            return &p;
        }
    """
    assert [name for _, name in definitions(Source("text", text, ()))] == ["table", "one", "two"]


def test_kinds_of_paths_share_what_is_the_same() -> None:
    """Light paths and photons add what only they have."""
    name = "scenes/bulb/scene.json"
    alone = features_of(name, PathTracer(light_paths=0))
    camera = {"generate", "intersect", "shadow", "loop", "common"}
    beside = {"emit", "splat"}
    assert programs.loop_sources(alone, "wide8", 8).keys() == camera | shading(alone)
    both = features_of(name, PathTracer(light_paths=1))
    assert programs.loop_sources(both, "wide8", 8).keys() == camera | beside | shading(both)
    photons = features_of(name, Vcm())
    there = camera | beside | {"deposit"} | shading(photons)
    assert programs.loop_sources(photons, "wide8", 8).keys() == there


def shading(features: Features) -> set[str]:
    """The parts of a loop that shade."""
    found = vertices.vertices(features, 8)
    kinds = [kind for vertex in found if vertex.shared for kind in vertex.kinds]
    own = {f"material_{features.materials.leaves[kind].kind}" for kind in kinds}
    return own | {vertex.program for vertex in found}


def test_kinds_share_a_vertex_but_for_what_differs() -> None:
    """All kinds are shaded, each by one vertex; photons are merged by each kind's own."""
    diffuse_and_plastic, dielectric = (0, 2), (1,)
    features = features_of("scenes/three_spheres/scene.json")
    found = vertices.vertices(features, 8)
    assert [vertex.kinds for vertex in found] == [diffuse_and_plastic, dielectric]
    assert [vertex.kinds for vertex in vertices.vertices(features, 1)] == [(0,), (1,), (2,)]
    made = programs.loop_sources(features, "wide8", 8)
    vertex = made["shade_diffuse_and_others"]
    assert (
        "materials/kinds/plastic.cl" not in vertex.files and "transport/vertex.cl" in vertex.files
    )
    part = made["material_plastic"]
    assert "materials/kinds/plastic.cl" in part.files and "transport/vertex.cl" not in part.files
    merged = features_of("scenes/three_spheres/scene.json", Vcm())
    assert not any(vertex.shared for vertex in vertices.vertices(merged, 8))


def test_kinds_of_materials_share_what_is_long() -> None:
    """A part of its own, which none of their flags reach; with one kind there is none."""
    for name, names in {
        "scenes/cornell_box/scene.json": [],
        "scenes/three_spheres/scene.json": ["surface_load", "light_sample", "light_begins_pdf"],
        "scenes/bulb/scene.json": ["surface_load", "light_sample", "light_begins_pdf"],
    }.items():
        features = features_of(name)
        made = programs.loop_sources(features, "wide8", 8)
        assert [one.name for one in vertices.shared(features, 8)] == names
        assert ("common" in made) == bool(names)
        for one in names:
            inline = re.compile(rf"^#define {one} in_", re.MULTILINE)
            shading = [made[program] for program in made if program.startswith("shade_")]
            assert not any(inline.search(source.text) for source in shading)
        if names:
            asked = set(re.findall(r"\b[A-Z]\w*", COMMENT.sub("", made["common"].text)))
            assert not asked & flags.MATERIAL.keys()


@pytest.mark.parametrize("integrator", [PathTracer(light_paths=1), Vcm()])
def test_rays_of_all_paths_are_traced_by_one_text(integrator: PathTracer | Vcm) -> None:
    """Also where stages are programs of their own, so that it is built once; a mixture's too."""
    for name in ("scenes/bulb/scene.json", "tests/scenes/plastic.xml"):
        passes = features_of(name, integrator).passes
        lights, camera = (programs.sources(own, "wide8", 8, queued=False) for own in passes)
        same = {program for program in lights.keys() & camera if lights[program] == camera[program]}
        assert same == {"intersect", *({"mix"} & camera.keys())}
