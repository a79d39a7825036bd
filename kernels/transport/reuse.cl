/* Paths of a group share their second vertices (Bekaert et al. 2002, "Accelerating path tracing by re-using paths").
 * The slots of a group begin their samples together, in pixels that are close to each other. Where a path goes from a
 * diffuse surface at x to a diffuse surface at y, all paths of the group take the light that leaves y, if their x sees
 * y. The balance heuristic weighs the paths by their densities of y. So nothing counts twice, and the mean of a pixel
 * stays as it is. Light that y itself emits is not shared:
 * next-event estimation finds it at x.
 *
 * `intersect` and shading keep x and y, stage/reuse.cl finds the densities, and stage/generate.cl adds up the light
 * when all paths of the group have ended. Groups begin and end together where a work-item shades all of a group. In
 * single lanes, as on GPUs, nothing is shared. */

/* Step. */
#include "core/warp.cl"
#include "generated/slab_words.cl"

#define REUSE_FIRST 1    /* of Path.reuse: the path has an x */
#define REUSE_SECOND 2   /* and a y */
#define REUSE_VERTICES 3 /* the bits of these */
#define REUSE_WEIGHED 4  /* the densities of the path are known */
#define REUSE_LEAST 0.1f /* of the throughput at y, as other paths may have more of a colour there */

/* The first slot of the group of each slot. */
inline integer reuse_group(uint at) { return (LANE_INDEX + (int)at) & ~(REUSE_GROUP - 1); }

/* A word of any slots. */
inline real reuse_word(Slab path, uint word, integer slots)
{
    return gather(slab_at(path, word, 0u), slab_places(path, slots));
}

inline vec3 reuse_point(Slab path, uint word, integer slots)
{
    return v3(reuse_word(path, word, slots), reuse_word(path, word + 1u, slots), reuse_word(path, word + 2u, slots));
}

inline vec3 reuse_normal(Slab path, uint word, integer slots)
{
    return octahedral_unpack(as_natural(reuse_word(path, word, slots)));
}

inline natural reuse_vertices(Slab path, integer slots)
{
    return as_natural(reuse_word(path, PATH_REUSE_WORD, slots)) & REUSE_VERTICES;
}

/* The throughput of a path at y, before the reflection there; beta: its throughput behind x. */
inline Spectrum reuse_throughput(Spectrum beta)
{
#define C(c) beta.c = max_r(beta.c, (real)(REUSE_LEAST));
    SPECTRUM_EACH(C)
#undef C
    return beta;
}

/* Step vertex: what shading keeps. */
#include "transport/reuse.cl"

/* Whether paths share vertices on the surface, which no map may bend: then its frame depends on the direction. */
inline mask reuse_suits(Scene scene, Slab path, uint at, Vertex v)
{
    return mask_of(BSDF_REUSED) & (load_path_nulls(path, at) == 0) & !shading_frame_turns(scene, v.row);
}

/* Whether roulette leaves the paths alone: all paths of a group must go on from x. */
inline mask reuse_begins(Scene scene, Vertex v) { return mask_of(BSDF_REUSED) & (v.depth == 0); }

/* Keeps the normals at x, where paths go `on`. `intersect` keeps x itself, where the next ray begins. A path that goes
 * below the surface, as a shading normal lets it, shares nothing: it would not see what others meet above. */
inline void reuse_first(Scene scene, Slab path, uint at, mask on, Vertex v, Scattering scatter, vec3 onward)
{
    mask keeps = on & (v.depth == 0) & reuse_suits(scene, path, at, v) & (dot3(v.s.n, onward) > 0.0f);
    store_path_reuse(path, at, keeps, (integer)(REUSE_FIRST));
    store_path_reuse_n(path, at, keeps, octahedral_pack(v.s.n));
    store_path_reuse_ns(path, at, keeps, octahedral_pack(scatter.shading.frame.n));
}

/* Keeps y. From here on paths gather light apart from the light before. */
inline void reuse_second(Scene scene, Slab path, uint at, mask met, Vertex *v, Scattering scatter)
{
    mask keeps = met & (v->depth == 1) & (load_path_reuse(path, at) == REUSE_FIRST);
    keeps = keeps & reuse_suits(scene, path, at, *v) & (v->s.light < 0) & (scatter.wo.z > 0.0f);
    if (!any(keeps)) return;
    vec3 back = neg3(v->d), n = sel3(dot3(v->s.n, back) < 0.0f, neg3(v->s.n), v->s.n);
    store_path_reuse(path, at, keeps, (integer)(REUSE_SECOND));
    store_path_reuse_y(path, at, keeps, surface_offset(v->s, back));
    store_path_reuse_yn(path, at, keeps, octahedral_pack(n));
    store_path_reuse_yns(path, at, keeps, octahedral_pack(scatter.shading.frame.n));
    store_path_radiance(path, at, keeps, spectrum_of((real)(0.0f)));
    v->beta = spectrum_sel(keeps, reuse_throughput(v->beta), v->beta);
}

/* Twin, where nothing is shared. */
inline mask reuse_begins(Scene scene, Vertex v) { return mask_of(0); }
inline void reuse_first(Scene scene, Slab path, uint at, mask on, Vertex v, Scattering scatter, vec3 onward) {}
inline void reuse_second(Scene scene, Slab path, uint at, mask met, Vertex *v, Scattering scatter) {}

/* Step meets: what `intersect` keeps of rays that leave x. */
#include "transport/reuse.cl"

inline void reuse_meets(Slab path, uint at, mask active, integer state, vec3 o)
{
    mask second = active & ((state & PATH_DEPTH) == 1) & (load_path_reuse(path, at) == REUSE_FIRST);
    second = second & (load_path_nulls(path, at) == 0);
    if (!any(second)) return;
    store_path_reuse_x(path, at, second, o);
    store_path_reuse_beta(path, at, second, load_path_beta(path, at));
    store_path_reuse_before(path, at, second, load_path_radiance(path, at));
}

/* Twin, where nothing is shared. */
inline void reuse_meets(Slab path, uint at, mask active, integer state, vec3 o) {}

/* Step end: groups begin and end together. */
#include "transport/reuse.cl"

/* The lanes of groups that have a mask in all lanes; a group is eight lanes, or half of sixteen. */
inline mask reuse_all(mask m)
{
    integer group = LANE_INDEX / REUSE_GROUP;
    mask first = group == 0;
    return sel_i(first, mask_of(!any(first & !m)), mask_of(!any(!first & !m)));
}

/* The ends of paths, where all paths of the group have ended. */
inline PathEnd reuse_end(PathEnd e)
{
    e.ended = e.ended & reuse_all(e.ended | ((e.state & PATH_DONE) != 0));
    return e;
}

/* The light of samples that have ended; radiance: what their own paths have gathered last. */
inline Spectrum reuse_gather(Slab path, uint at, mask ended, Spectrum radiance)
{
    natural vertices = as_natural(load_path_reuse(path, at)) & REUSE_VERTICES;
    mask second = vertices == REUSE_SECOND, takes = ended & (vertices != 0u);
    if (!any(takes)) return radiance;
    Spectrum beta = load_path_reuse_beta(path, at), leaves = reuse_throughput(beta);
#define C(c) leaves.c = radiance.c / leaves.c;
    SPECTRUM_EACH(C)
#undef C
    store_path_radiance(path, at, ended & second, leaves); /* of y, for any path of the group */
    Spectrum sum = spectrum_sel(ended & second, load_path_reuse_before(path, at), radiance);
    integer group = reuse_group(at);
    for (int k = 0; k < REUSE_GROUP; k++) {
        mask brings = takes & (reuse_vertices(path, group + k) == REUSE_SECOND);
        if (!any(brings)) continue;
        real all = 0.0f;
        for (int i = 0; i < REUSE_GROUP; i++) {
            real density = reuse_word(path, PATH_REUSE_DENSITY0_WORD + (uint)k, group + i);
            all += sel(reuse_vertices(path, group + i) != 0u, density, (real)(0.0f));
        }
        real share = slab_read(path, PATH_REUSE_DENSITY0_WORD + (uint)k, at) / max_r(all, (real)(1e-30f));
        uint word = PATH_RADIANCE_WORD;
#define C(c) leaves.c = share * reuse_word(path, word++, group + k);
        SPECTRUM_EACH(C)
#undef C
        sum = spectrum_sel(brings, spectrum_add(sum, spectrum_mul(beta, leaves)), sum);
    }
    return sum;
}

/* The sampler that chooses wavelengths: a group has the same. own: that of the pixel. */
inline Sampler reuse_sampler(Scene scene, Slab path, uint at, Sampler own, integer sample)
{
    natural key = as_natural(reuse_word(path, PATH_PIXEL_KEY_WORD, reuse_group(at)));
    return pixel_sampler(scene.settings, key, sample);
}

/* Twin, where nothing is shared. */
inline PathEnd reuse_end(PathEnd e) { return e; }
inline Spectrum reuse_gather(Slab path, uint at, mask ended, Spectrum radiance) { return radiance; }
inline Sampler reuse_sampler(Scene scene, Slab path, uint at, Sampler own, integer sample) { return own; }

/* Step due: whether a slot waits for densities, as a loop asks before it calls the stage: its path has a first vertex,
 * and a second vertex, if it has any, is shaded. */
#include "transport/reuse.cl"

inline int slot_reuses(Slab path, Slab hit, uint slot)
{
    uint reuse = slot_word(path, PATH_REUSE_WORD, slot);
    if (reuse == 0u || (reuse & REUSE_WEIGHED)) return 0;
    return (slot_word(path, PATH_STATE_WORD, slot) & PATH_DEPTH) > 1u || (int)slot_word(hit, HIT_PRIM_WORD, slot) < 0;
}

/* Twin, where nothing is shared. */
