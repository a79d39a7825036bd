"""Probes transport/mis_ratio.cl: a vertex of a path from each end, in a scene given as numbers.

A vertex here does what kernels/integrator/path.cl and particle_tracer.cl do with the weights.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from clpt.render.flow.choices import either
from clpt.render.lights import cases as lights
from tests.kernels.scene_harness import SceneProbe

LIGHT_PATHS = 3  # a sample
LAMPS = ("infinite", "on a shape", "at a point")  # rows of lights: a ray meets the first two

# The types and functions before transport/mis_ratio.cl in the renderer's text.
WORLD = """
typedef struct {
    global const Settings *settings;
    real importance, emission, found, area;
    mask seen, turns;
} World;
typedef struct { real mis_ratio, merge_ratio; integer light; } Carried;
typedef struct { vec3 p, n; } Surface;
typedef struct { Surface s; vec3 d; real t; integer state, depth, row; } Vertex;
typedef struct { vec3 d; mask seen; real importance; } CameraPoint;
typedef struct { integer shape; } Lamp;
typedef integer Bsdf;

/* A direction by its cosine to a surface whose normal is (0, 0, 1). */
inline vec3 slanted(real cosine) { return v3(sqrt(1.0f - cosine * cosine), (real)(0.0f), cosine); }

inline CameraPoint camera_point(World world)
{
    CameraPoint c = {v3(0.0f, 0.0f, 1.0f), world.seen, world.importance};
    return c;
}

inline Lamp lamp(integer row)
{
    Lamp l = {sel_i(row == 1, (integer)(0), (integer)(-1))};
    return l;
}

#define Scene World
#define Slab Carried
#define VERTEX_COSINE(n, d) fabs(dot3(n, d))
#define bsdf_pdf(m, wo, wi) ((real)(0.0f))
#define shading_frame_turns(scene, row) (scene).turns
#define camera_connect(scene, p, away, lens) camera_point(scene)
#define merging_pass(scene, sample) (sample)
#define merging_area(scene, pass) (scene).area
#define light_at(scene, row) lamp(row)
#define light_shows(scene, row, front) (front)
#define light_path_pdf(scene, row, p, wi, t, n) (scene).emission
#define light_emit_pdf(scene, row, wi, t) (scene).emission
#define light_nee_pdf(scene, row, p, receiver, wi, t, n) (scene).found
#define common_light_begins_pdf(scene, row, p, receiver, wi, t, n, there) \
    (*(there) = (scene).found, (scene).emission)
#define load_path_mis_ratio(path, at) (path).mis_ratio
#define load_path_merge_ratio(path, at) (path).merge_ratio
#define load_path_light(path, at) (path).light
#define load_path_sample(path, at) ((integer)(0))
#define load_path_null_distance(path, at) ((real)(0.0f))
#define store_path_merge_ratio(path, at, m, value)
#define load_path_sampled_hemisphere(path, at) v3(0.0f, 0.0f, 0.0f)
#include "lights/receiver.cl#none"
#include "transport/mis_ratio.cl"
#undef Scene
#undef Slab
"""

GIVEN = (
    *("mis_ratio", "merge_ratio", "sharp", "depth"),  # what the path carries
    *("arrives", "leaves", "p", "p_back", "delta", "ends", "gathers"),  # the vertex; cosines first
    *("importance", "seen", "emission", "found", "lamp", "area"),  # the two ends, and merging
    "photon",  # the mis_ratio of one that is here
)
VERTEX = f"""
    World world = {{scene.settings, importance, emission, found, area * gathers}};
    world.seen = seen > 0.5f;
    world.turns = ends > 0.5f;
    Carried path = {{mis_ratio, merge_ratio, to_integer(lamp_row)}};
    Surface s = {{v3(0.0f, 0.0f, 0.0f), v3(0.0f, 0.0f, 1.0f)}};
    integer state = sel_i(sharp > 0.5f, (integer)(PATH_SHARP), (integer)(0));
    Vertex v = {{s, slanted(-arrives), (real)(1.0f), state, to_integer(depth), (integer)(0)}};
    vec3 onward = slanted(leaves);
    mask is_delta = delta > 0.5f;
    real number = (real)({LIGHT_PATHS}.0f);
"""

FROM_CAMERA = ("mis_ratio", "merge_ratio", "sharp", "met", "chosen", "merged")
CAMERA = f"""{VERTEX}
    Sampler none = {{(natural)(0u), (natural)(0u)}};
    MisRatio here = mis_ratio_of_camera_path(world, path, 0, v, none);
    mask hit = lamp_row < 1.5f;

    LightSample ls;
    ls.wi = onward;
    ls.chance = found;
    ls.pdf = sel(hit, found, (real)(-1.0f));
    real begins = event_begins(world, s, ls);
    real third = mis_ratio_of_light_sample(world, here, s, ls, begins, p, p_back);
    real chosen = mis_weight_of_three(ls.pdf, p, third);

    mis_ratio = mis_ratio_to_light(here, s, onward, is_delta, p, p_back);
    real kept = sel(is_delta, (real)(-1.0f), p);
    third = after_diffuse_roulette(sel(depth > 0.5f, mis_ratio, (real)(0.0f)) * emission, kept);
    real met = mis_weight_of_three(kept, found, third);
    met = sel(hit, met, (real)(0.0f));

    real merged = 0.0f;
#if MERGES
    merged = photon_weight(photon, here.arrives, number, area, p, p_back);
    mask gathers_here = merging_here(state, v.depth) & !mis_specular(mask_of(0), p, p_back);
    merged = sel(gathers_here, merged, (real)(0.0f));
    merge_ratio = merge_ratio_to_light(here, s, onward, is_delta, p, p_back);
    sharp = sel(mis_specular(is_delta, p, p_back), sharp, (real)(0.0f));
#endif
"""

FROM_LIGHT = ("mis_ratio", "merge_ratio", "sharp", "joined", "photon")
LIGHT = f"""{VERTEX}
    Receiver receiver = {{v3(0.0f, 0.0f, 0.0f)}};
    MisRatio here = mis_ratio_of_light_path(world, path, 0, v, receiver);
    real joined = 0.0f;
#if JOINS_CAMERA
    CameraPoint c = camera_point(world);
    c.d = neg3(onward);
    joined = 1.0f / (1.0f + mis_square_of_connection(world, here, s, c, p_back, p));
    joined = sel(c.seen & !here.first & !ends_light_paths(world, v), joined, (real)(0.0f));
#endif
#if MERGES
    photon = sel(sharp > 0.5f, photon_mis_ratio(mis_ratio, dot3(s.n, v.d)), (real)(-1.0f));
    merge_ratio = merge_ratio_to_camera(here, s, onward, is_delta, p, p_back);
    sharp = sel(mis_specular(is_delta, p, p_back), (real)(1.0f), sharp);
#endif
#ifdef DIFFUSE_SHARE
    mask plays = here.first & !is_delta & is_diffuse_pdf(p_back);
    here.arrives /= sel(plays, (real)(DIFFUSE_SHARE), (real)(1.0f));
#endif
    mis_ratio = mis_ratio_to_camera(here, s, onward, is_delta, p, p_back);
"""


class VertexProbe:
    """A vertex of paths, from the camera or from the light; others: features of the scene.

    Called with every name of GIVEN, each (n,). Returns those of FROM_CAMERA or FROM_LIGHT, each
    (n,): `mis_ratio`, `merge_ratio` and `sharp` are carried on; `met`, `chosen`, `joined`, `merged`
    are weights, 0 where the program leaves that way out; `photon`: the mis_ratio of the
    photon that the light path leaves here, -1 without a photon.
    """

    def __init__(self, from_light: bool, joined: bool, merged: bool, dull: bool):
        self.results = FROM_LIGHT if from_light else FROM_CAMERA
        names = ["lamp_row" if name == "lamp" else name for name in GIVEN]
        reads = "".join(f"    real {name} = x[{i}];\n" for i, name in enumerate(names))
        writes = "".join(f"    r[{i}] = {name};\n" for i, name in enumerate(self.results))
        flags = {"JOINS_CAMERA": joined, "MERGES": merged}
        flags |= {"WEIGHS_LIGHT_PATHS": True, "BSDF_MERGES": merged}
        flags |= {"BSDF_ENDS_LIGHT_PATHS": False, "BSDF_IS_PHASE": False}
        self.probe = SceneProbe(
            reads + (LIGHT if from_light else CAMERA) + writes,
            len(GIVEN),
            len(self.results),
            files=(
                "lights/light.cl",
                "transport/photons/area.cl",
                "transport/photons/weight.cl",
                "world.cl",
            ),
            lanes=1,
            virtual={
                **lights.virtual_files(),
                "generated/diffuse_roulette.cl": either(dull, "transport/roulette.cl#diffuse"),
                "generated/mis_ratio_steps.cl": (
                    *either(merged, "transport/mis_ratio.cl#merging"),
                    *either(joined, "transport/mis_ratio.cl#camera"),
                    "materials/bsdf.cl#mis_pdf#none",
                ),
                "generated/mis_merging_area.cl": ("transport/mis_ratio.cl#area",),
                "world.cl": WORLD,
            },
            defines={name: int(holds) for name, holds in flags.items()},
            settings={"light_paths": LIGHT_PATHS, "infinite_count": 1, "mis_area_unit": 1.0},
        )

    def __call__(self, **given: NDArray[np.floating]) -> dict[str, NDArray[np.float32]]:
        """Run it."""
        return dict(zip(self.results, self.probe(*(given[name] for name in GIVEN)), strict=True))


@cache
def vertex_probe(from_light: bool, joined: bool, merged: bool, dull: bool) -> VertexProbe:
    """A probe of such features, compiled once."""
    return VertexProbe(from_light, joined, merged, dull)
