/* Next-event estimation: a point of a light is chosen, and a ray toward it waits in the shadow slab. */
typedef struct {
    mask shine; /* light of the point reaches the next vertex; before the BSDF is evaluated, it may */
    LightSample ls;
    real begins; /* density of a light path from the point, if light paths have MIS weights */
    vec3 wi;     /* toward the point, in shading.frame */
    real index;  /* of the side of wi, over that of wo */
    real more;   /* slope there, less that on the side of wo */
    Spectrum value;
} NextEvent;

/* Step. */
#include "generated/index_across.cl"

/* Samples the point on a light. */
inline NextEvent next_event_seek(Scene scene, mask next, Vertex v, Scattering scatter)
{
    NextEvent e;
    Receiver receiver = vertex_receiver(scene, v, scatter, neg3(v.d));
    vec2 point = sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_LIGHT);
    e.shine = next & !vertex_sealed(v);
    e.ls = light_sample_nothing();
    if (!(BSDF_ABSORBS || BSDF_IS_SEALED) || any(e.shine))
        e.ls = common_light_sample(scene, v.s.p, receiver, scatter.choice.x, point, scatter.lambdas);
    e.begins = event_begins(scene, v.s, e.ls);
    e.wi = to_frame(scatter.shading.frame, e.ls.wi);
    return e;
}

/* Evaluates the BSDF and the MIS weight of the point's light. */
inline NextEvent next_event_weigh(Scene scene, NextEvent e, Vertex v, Scattering scatter, MisRatio mis_ratio,
                                  Guided guided, Spectrum ratio, ReuseLobe lobe SHADE_ARGS)
{
    BsdfPair pair = reuse_pair(lobe, scatter.wo, e.wi, bsdf_pair(scatter.bsdf, scatter.wo, e.wi, ratio));
    Spectrum f = spectrum_scale(pair.f, shading_frame_share(scatter.shading, e.ls.wi));
    real p = guided_pdf(guided, e.ls.wi, pair.pdf MERGE_PASSED);
    real w = event_weight(scene, mis_ratio, v.s, e.ls, e.begins, pair, p);
    e.index = index_across(scatter.bsdf, scatter.wo, e.wi);
    e.more = slope_across(scene, v.row, scatter.lambdas, scatter.wo, e.wi);
    e.shine = e.shine & (e.ls.pdf != 0.0f) & (spectrum_max(f) > 0.0f);
    w = w / sel(e.shine, fabs(e.ls.pdf), (real)(1.0f));
    e.value = spectrum_scale(spectrum_mul(spectrum_mul(v.beta, f), e.ls.radiance), w);
    e.value = vertex_beyond(scene, v, e.ls.wi, e.ls.t, scatter.lambdas, e.value);
    return e;
}

/* Stores the shadow ray. On a CPU path_vertex calls it after it has sampled the next direction: if the store stood
 * before the sampling, compilers would read tables of materials twice. Returns the bits to add to Path.state. */
inline integer next_event_keep(Scene scene, Slab path, Slab shadow, uint at, mask active, Vertex v, NextEvent e)
{
    mask kept = LANES == 1 ? active : e.shine; /* on a GPU a condition would cost registers */
    store_shadow_t(shadow, at, active, sel(e.shine, shadow_aim(shadow, at, kept, v.s, e.ls.wi, e.ls.t), (real)(-1.0f)));
    store_shadow_value(shadow, at, kept, e.value);
    light_layers_chosen(path, at, e.shine, e.ls.row);
    store_shadow_into(shadow, at, e.shine, volume_medium(scene, sel_i(e.shine, e.ls.row, (integer)(0))));
    store_shadow_through(shadow, at, e.shine, vertex_through(v, e.ls.wi));
    real index = e.index * (1.0f - e.more / (1.0f - load_path_slope(path, at)));
    length_to_light(path, shadow, at, e.shine, v.t, e.ls.t, index);
    return sel_i(e.shine, (integer)(PATH_SHADOW), (integer)(0));
}

/* Twin, without lights, and at materials that send light in a single direction. */
inline NextEvent next_event_seek(Scene scene, mask next, Vertex v, Scattering scatter)
{
    NextEvent e;
    e.wi = scatter.wo;
    return e;
}
inline NextEvent next_event_weigh(Scene scene, NextEvent e, Vertex v, Scattering scatter, MisRatio mis_ratio,
                                  Guided guided, Spectrum ratio, ReuseLobe lobe SHADE_ARGS) { return e; }
inline integer next_event_keep(Scene scene, Slab path, Slab shadow, uint at, mask active, Vertex v, NextEvent e)
{
    return (integer)(0);
}
