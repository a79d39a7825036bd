/* At a smooth boundary: a path that comes out may have been sent, and one that goes in keeps where the boundary is, and
 * a lamp, see media/escape.cl. */
#include "media/escape.cl"

inline integer path_escapes(Scene scene, Slab path, Slab shadow, uint at, mask next, Vertex v, Scattering scatter,
                            BsdfSample bs, vec3 onward)
{
    mask outward = dot3(v.s.n, onward) > 0.0f, bent = (bs.lobe & LOBE_TRANSMIT) != 0;
    mask out = !v.front & bent & outward & (v.depth > 0);
    real sent = load_path_escape(path, at); /* below 0 behind the boundary, so that only one is passed */
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
