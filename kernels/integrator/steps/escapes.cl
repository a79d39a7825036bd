/* Rays that leave a sealed medium toward a lamp, see media/escape.cl. `path_escapes` returns the bits to add to
 * Path.state. next: the paths that go on along `onward`, before roulette; Path.ratio is still the ratio before the
 * vertex. */

/* Step. */
/* At a collision in a sealed medium: a ray that may leave it. */
#include "media/escape.cl"

inline integer path_escapes(Scene scene, Slab path, Slab shadow, uint at, mask next, Vertex v, Scattering scatter,
                            BsdfSample bs, vec3 onward)
{
    EscapeCone e = {load_path_escape_axis(path, at), load_path_escape_width(path, at), (real)(1.0f)};
    real depth = load_path_escape_depth(path, at) - dot3(load_path_escape_plane(path, at), v.s.p);
    mask near = next & (e.one_minus_cos > 0.0f) & (depth < ESCAPE_DEEPEST);
    near = near & (v.depth + 2 < scene.settings->max_depth);
    mask sent = mask_of(0);
    real own = 0.0f;
    if (any(near)) {
        real chance = exp_r(-ESCAPE_SHARE * max_r(depth, (real)(0.0f)));
        own = escape_density(e, chance, onward) / max_r(bs.pdf, (real)(1e-30f));
        own = sel(near, own, (real)(0.0f));
        sent = near & (sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_CHOICE).x < chance);
        if (any(sent)) {
            vec2 pair = sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_LIGHT);
            vec3 d = to_world(frame_of(e.axis), uniform_cone(pair, e.one_minus_cos));
            vec3 wi = to_frame(scatter.shading.frame, d);
            real pdf = hero_pdf(scatter.bsdf, scatter.wo, wi, load_path_ratio(path, at));
            pdf += chance / max_r(2.0f * PI * e.one_minus_cos, (real)(1e-30f));
            Spectrum f = spectrum_scale(bsdf_eval(scatter.bsdf, scatter.wo, wi), 1.0f / pdf);
            store_shadow_o(shadow, at, sent, v.s.p);
            store_shadow_d(shadow, at, sent, d);
            store_shadow_t(shadow, at, sent, (real)(ESCAPE_FAR));
            store_shadow_value(shadow, at, sent, spectrum_mul(v.beta, f));
        }
    }
    store_path_escape(path, at, next, own);
    return sel_i(sent, (integer)(PATH_SHADOW), (integer)(0));
}

/* Twin, where no medium is sealed by a smooth boundary. */
inline integer path_escapes(Scene scene, Slab path, Slab shadow, uint at, mask next, Vertex v, Scattering scatter,
                            BsdfSample bs, vec3 onward) { return (integer)(0); }

/* Step end: at other surfaces, where no path leaves a sealed medium. */
inline integer path_escapes(Scene scene, Slab path, Slab shadow, uint at, mask next, Vertex v, Scattering scatter,
                            BsdfSample bs, vec3 onward)
{
    store_path_escape(path, at, next, (real)(0.0f));
    store_path_escape_width(path, at, next, (real)(0.0f));
    return 0;
}

/* Step out: at a smooth boundary. A path that leaves the medium gets the MIS ratio of escape rays from its last
 * collision; a path that enters stores the plane of the boundary and the cone around a lamp. */
#include "media/escape.cl"

inline integer path_escapes(Scene scene, Slab path, Slab shadow, uint at, mask next, Vertex v, Scattering scatter,
                            BsdfSample bs, vec3 onward)
{
    mask outward = dot3(v.s.n, onward) > 0.0f, bent = (bs.lobe & LOBE_TRANSMIT) != 0;
    mask out = !v.front & bent & outward & (v.depth > 0);
    real sent = load_path_escape(path, at); /* stored as -sent behind this boundary: a second boundary makes it 0 */
    store_path_escape(path, at, next, sel(out, -max_r(sent, (real)(0.0f)), (real)(0.0f)));
    integer name = sel_i(next & !outward, v.media.inside, (integer)(0));
    mask sealed = (name & MEDIUM_SEALED) != 0;
    real width = 0.0f;
    if (any(sealed)) {
        Medium m = medium_load(scene, sel_i(sealed, name, (integer)(0)), v.lambdas);
        real u = sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_LIGHT).x;
        EscapeCone e = escape_cone(scene, v.s.p, v.s.n, scatter.bsdf.ext_ior.x / scatter.bsdf.int_ior.x, u);
        vec3 plane = scale3(v.s.n, spectrum_mean(m.sigma_t) / e.up);
        width = sel(sealed, e.one_minus_cos, width);
        store_path_escape_axis(path, at, sealed, e.axis);
        store_path_escape_plane(path, at, sealed, plane);
        store_path_escape_depth(path, at, sealed, dot3(plane, v.s.p));
    }
    store_path_escape_width(path, at, next, width);
    return 0;
}
