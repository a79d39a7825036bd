/* Paths of a group share their second vertices (Bekaert et al. 2002, "Accelerating path tracing by re-using paths").
 * The slots of a group begin their samples together, in pixels that are close to each other. Where a path goes from a
 * diffuse surface at x to a diffuse surface at y, all paths of the group take the light that leaves y, if their x sees
 * y. The balance heuristic weighs the paths by their densities of y. So nothing counts twice, and the mean of a pixel
 * stays as it is. Light that y itself emits is not shared:
 * next-event estimation finds it at x.
 *
 * Of a surface below a coat the diffuse lobe is shared. So at x a path goes on by one lobe, and at y all its light is
 * of one lobe: of that which the sample chooses. Transmittances of coats depend on the direction between x and y.
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

/* A word of the k-th slot of each slot's group; a work-item has one slot, a group, or two groups. */
inline real reuse_word(Slab path, uint word, uint at, uint k)
{
    global const float *slots = slab_at(path, word, at & ~(REUSE_GROUP - 1u));
    if (LANES <= REUSE_GROUP) return slots[k];
    return sel(LANE_INDEX < REUSE_GROUP, (real)(slots[k]), (real)(slots[REUSE_GROUP + k]));
}

inline vec3 reuse_point(Slab path, uint word, uint at, uint k)
{
    return v3(reuse_word(path, word, at, k), reuse_word(path, word + 1u, at, k), reuse_word(path, word + 2u, at, k));
}

inline vec3 reuse_normal(Slab path, uint word, uint at, uint k)
{
    return octahedral_unpack(as_natural(reuse_word(path, word, at, k)));
}

inline natural reuse_vertices(Slab path, uint at, uint k)
{
    return as_natural(reuse_word(path, PATH_REUSE_WORD, at, k)) & REUSE_VERTICES;
}

/* The throughput of a path at y, before the reflection there; beta: its throughput behind x. */
inline Spectrum reuse_throughput(Spectrum beta)
{
#define C(c) beta.c = max_r(beta.c, (real)(REUSE_LEAST));
    SPECTRUM_EACH(C)
#undef C
    return beta;
}

/* Step lobe: of materials below a coat a path shares the diffuse lobe alone. */
#include "transport/reuse.cl"
#include "materials/coat.cl"

#define COAT_LARGEST 3.99f /* index of a coat */
#define REUSE_OTHER 0.1f   /* if the coat's lobe has this probability or more, x shares nothing */

/* A coat as a word: its roughness, its distribution, its index in units of 2^-13; 0: there is none. */
inline natural coat_pack(real eta, real alpha)
{
    integer beckmann = sel_i(alpha < 0.0f, (integer)(0x8000), (integer)(0));
    integer rough = to_integer(min_r(fabs(alpha), (real)(1.0f)) * 32767.0f + 0.5f) | beckmann;
    integer index = to_integer(min_r(eta, (real)(COAT_LARGEST)) * 8192.0f + 0.5f);
    return as_natural(sel_i(eta > 0.0f, (index << 16) | rough, (integer)(0)));
}

typedef struct {
    DiffuseLobe lobe;
    mask base;   /* the sample is of this lobe */
    mask onward; /* the next direction is of one lobe, as at x */
    mask all;    /* and all light is, as at y */
    real passed; /* the coat's transmittance toward wo */
} ReuseLobe;

inline ReuseLobe reuse_lobe(Scattering scatter)
{
    ReuseLobe r;
    r.lobe = bsdf_diffuse_lobe(scatter.bsdf, scatter.wo);
    r.base = scatter.choice.y >= r.lobe.other;
    r.passed = coat_passes(max_r(scatter.wo.z, (real)(0.0f)), r.lobe.eta, r.lobe.alpha);
    r.onward = r.all = mask_of(0);
    return r;
}

inline mask reuse_lobe_suits(ReuseLobe r) { return (r.lobe.eta >= 0.0f) & (r.lobe.eta < COAT_LARGEST); }
inline mask reuse_lobe_is_base(ReuseLobe r) { return r.base; }
inline mask reuse_lobe_begins(ReuseLobe r) { return r.lobe.other < REUSE_OTHER; }
inline natural reuse_coat(ReuseLobe r) { return coat_pack(r.lobe.eta, r.lobe.alpha); }

/* f |cos| of the diffuse lobe over its probability, but for the coat's transmittance toward wo. */
inline Spectrum reuse_base(ReuseLobe r, real cosine)
{
    real f = coat_passes(cosine, r.lobe.eta, r.lobe.alpha) * cosine * INV_PI;
    return spectrum_scale(r.lobe.value, f / max_r(1.0f - r.lobe.other, (real)(1e-20f)));
}

/* The light of next-event estimation at y. */
inline BsdfPair reuse_pair(ReuseLobe r, vec3 wo, vec3 wi, BsdfPair pair)
{
    if (!any(r.all)) return pair;
    mask front = (wo.z > 0.0f) & (wi.z > 0.0f), base = r.all & r.base & front, other = r.all & !r.base & front;
    real cosine = max_r(wi.z, (real)(0.0f)), share = 1.0f - r.lobe.other, over = max_r(r.lobe.other, (real)(1e-20f));
    Spectrum f = reuse_base(r, cosine);
#define C(c) \
    pair.f.c = sel(other, max_r(pair.f.c - f.c * share * r.passed, (real)(0.0f)) / over, sel(base, f.c, pair.f.c));
    SPECTRUM_EACH(C)
#undef C
    real p = cosine_hemisphere_pdf(cosine);
    pair.pdf = sel(other, max_r(pair.pdf - share * p, (real)(0.0f)) / over, sel(base, p, pair.pdf));
    return pair;
}

/* The sample at x and at y. */
inline BsdfSample reuse_sample(ReuseLobe r, vec3 wo, BsdfSample s)
{
    mask rough = (s.lobe & LOBE_DELTA) == 0, split = (r.onward | r.all) & (s.pdf > 0.0f) & rough;
    if (!any(split)) return s;
    mask base = split & r.base, other = split & !r.base;
    real cosine = max_r(s.wi.z, (real)(1e-20f)), share = 1.0f - r.lobe.other;
    real p = cosine_hemisphere_pdf(cosine), left = max_r(s.pdf - share * p, (real)(0.0f));
    Spectrum f = reuse_base(r, cosine);
    real toward = sel(r.all, (real)(1.0f), r.passed) / p, over = 1.0f / max_r(left, (real)(1e-20f));
    real most = 1.0f / max_r(r.lobe.other, (real)(1e-20f)); /* weights of facets are 1 at most, before rounding */
#define C(c)                                                                                                    \
    real CAT(of_other_, c) = clamp_r((s.weight.c * s.pdf - f.c * share * r.passed) * over, (real)(0.0f), most); \
    s.weight.c = sel(other, CAT(of_other_, c), sel(base, f.c * toward, s.weight.c));
    SPECTRUM_EACH(C)
#undef C
    s.pdf = sel(r.all & split, sel(base, p, left * most), s.pdf);
    return s;
}

/* The weight of the sample at x, but for the coat's transmittance toward y. */
inline Spectrum reuse_weight(ReuseLobe r, BsdfSample s)
{
    return spectrum_scale(r.lobe.value, r.passed / max_r(1.0f - r.lobe.other, (real)(1e-20f)));
}

/* Twin, without coats. */
typedef struct {
    mask onward, all;
} ReuseLobe;
inline ReuseLobe reuse_lobe(Scattering scatter)
{
    ReuseLobe r = {mask_of(0), mask_of(0)};
    return r;
}
inline mask reuse_lobe_suits(ReuseLobe r) { return mask_of(1); }
inline mask reuse_lobe_is_base(ReuseLobe r) { return mask_of(1); }
inline mask reuse_lobe_begins(ReuseLobe r) { return mask_of(1); }
inline natural reuse_coat(ReuseLobe r) { return 0u; }
inline BsdfPair reuse_pair(ReuseLobe r, vec3 wo, vec3 wi, BsdfPair pair) { return pair; }
inline BsdfSample reuse_sample(ReuseLobe r, vec3 wo, BsdfSample s) { return s; }
inline Spectrum reuse_weight(ReuseLobe r, BsdfSample s) { return s.weight; }

/* Step vertex: what shading keeps. */
#include "transport/reuse.cl"

/* Whether paths share vertices on the surface, which no map may bend: then its frame depends on the direction. */
inline mask reuse_suits(Scene scene, Slab path, uint at, Vertex v, ReuseLobe r)
{
    mask alone = (load_path_nulls(path, at) == 0) & !shading_frame_turns(scene, v.row);
    return mask_of(BSDF_REUSED) & alone & reuse_lobe_suits(r);
}

/* Whether roulette leaves the paths alone: all paths of a group must go on from x. */
inline mask reuse_begins(Scene scene, Vertex v) { return mask_of(BSDF_REUSED) & (v.depth == 0); }

/* Keeps the normals at x, where paths go `on`. `intersect` keeps x itself, where the next ray begins. A path that goes
 * below the surface, as a shading normal lets it, shares nothing: it would not see what others meet above. */
inline void reuse_first(Slab path, uint at, mask on, Vertex v, Scattering scatter, vec3 onward, ReuseLobe r,
                        BsdfSample bs)
{
    mask keeps = on & r.onward & (dot3(v.s.n, onward) > 0.0f) & reuse_lobe_is_base(r);
    store_path_reuse(path, at, keeps, (integer)(REUSE_FIRST));
    store_path_reuse_n(path, at, keeps, octahedral_pack(v.s.n));
    store_path_reuse_ns(path, at, keeps, octahedral_pack(scatter.shading.frame.n));
    store_path_reuse_beta(path, at, keeps, spectrum_mul(v.beta, reuse_weight(r, bs)));
    store_path_reuse_coat(path, at, keeps, reuse_coat(r));
}

/* Keeps y. From here on paths gather light apart from the light before. */
inline ReuseLobe reuse_second(Scene scene, Slab path, uint at, mask met, Vertex *v, Scattering scatter)
{
    ReuseLobe r = reuse_lobe(scatter);
    mask suits = met & reuse_suits(scene, path, at, *v, r);
    r.onward = suits & (v->depth == 0) & reuse_lobe_begins(r);
    mask keeps = suits & (v->depth == 1) & (load_path_reuse(path, at) == REUSE_FIRST);
    keeps = keeps & (v->s.light < 0) & (scatter.wo.z > 0.0f);
    r.all = keeps;
    keeps = keeps & reuse_lobe_is_base(r);
    if (!any(keeps)) return r;
    vec3 back = neg3(v->d), n = sel3(dot3(v->s.n, back) < 0.0f, neg3(v->s.n), v->s.n);
    store_path_reuse(path, at, keeps, (integer)(REUSE_SECOND));
    store_path_reuse_y(path, at, keeps, surface_offset(v->s, back));
    store_path_reuse_yn(path, at, keeps, octahedral_pack(n));
    store_path_reuse_yns(path, at, keeps, octahedral_pack(scatter.shading.frame.n));
    store_path_reuse_y_coat(path, at, keeps, reuse_coat(r));
    store_path_radiance(path, at, keeps, spectrum_of((real)(0.0f)));
    v->beta = spectrum_sel(keeps, reuse_throughput(load_path_reuse_beta(path, at)), v->beta);
    return r;
}

/* Twin, where nothing is shared. */
inline mask reuse_begins(Scene scene, Vertex v) { return mask_of(0); }
inline void reuse_first(Slab path, uint at, mask on, Vertex v, Scattering scatter, vec3 onward, ReuseLobe r,
                        BsdfSample bs) {}
inline ReuseLobe reuse_second(Scene scene, Slab path, uint at, mask met, Vertex *v, Scattering scatter)
{
    return reuse_lobe(scatter);
}

/* Step meets: what `intersect` keeps of rays that leave x. */
#include "transport/reuse.cl"

inline void reuse_meets(Slab path, uint at, mask active, integer state, vec3 o)
{
    mask second = active & ((state & PATH_DEPTH) == 1) & (load_path_reuse(path, at) == REUSE_FIRST);
    second = second & (load_path_nulls(path, at) == 0);
    if (!any(second)) return;
    store_path_reuse_x(path, at, second, o);
    store_path_reuse_before(path, at, second, load_path_radiance(path, at));
}

/* Twin, where nothing is shared. */
inline void reuse_meets(Slab path, uint at, mask active, integer state, vec3 o) {}

/* Step passed: transmittances of coats. */
#include "transport/reuse.cl"
#include "materials/coat.cl"

inline real coat_word_passes(real cos_i, natural word)
{
    integer bits = as_integer(word);
    real alpha = to_real(bits & 0x7fff) * (1.0f / 32767.0f);
    alpha = sel((bits & 0x8000) != 0, -alpha, alpha);
    return coat_passes(max_r(cos_i, (real)(0.0f)), to_real(bits >> 16) * (1.0f / 8192.0f), alpha);
}

/* Of the coats at x of each slot and at y of the k-th of its group. */
inline real reuse_passed(Slab path, uint at, uint k)
{
    vec3 to = normalize3(sub3(reuse_point(path, PATH_REUSE_Y_WORD, at, k), load_path_reuse_x(path, at)));
    real departs = dot3(octahedral_unpack(load_path_reuse_ns(path, at)), to);
    real arrives = -dot3(reuse_normal(path, PATH_REUSE_YNS_WORD, at, k), to);
    real passed = coat_word_passes(departs, load_path_reuse_coat(path, at));
    return passed * coat_word_passes(arrives, as_natural(reuse_word(path, PATH_REUSE_Y_COAT_WORD, at, k)));
}

/* Twin, without coats. */
inline real reuse_passed(Slab path, uint at, uint k) { return 1.0f; }

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
    for (uint k = 0; k < REUSE_GROUP; k++) {
        mask brings = takes & (reuse_vertices(path, at, k) == REUSE_SECOND);
        if (!any(brings)) continue;
        real all = 0.0f;
        for (uint i = 0; i < REUSE_GROUP; i++) {
            real density = reuse_word(path, PATH_REUSE_DENSITY0_WORD + k, at, i);
            all += sel(reuse_vertices(path, at, i) != 0u, density, (real)(0.0f));
        }
        real share = slab_read(path, PATH_REUSE_DENSITY0_WORD + k, at) / max_r(all, (real)(1e-30f));
        share *= reuse_passed(path, at, k);
        uint word = PATH_RADIANCE_WORD;
#define C(c) leaves.c = share * reuse_word(path, word++, at, k);
        SPECTRUM_EACH(C)
#undef C
        sum = spectrum_sel(brings, spectrum_add(sum, spectrum_mul(beta, leaves)), sum);
    }
    return sum;
}

/* The sampler that chooses wavelengths: a group has the same. own: that of the pixel. */
inline Sampler reuse_sampler(Scene scene, Slab path, uint at, Sampler own, integer sample)
{
    natural key = as_natural(reuse_word(path, PATH_PIXEL_KEY_WORD, at, 0u));
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
