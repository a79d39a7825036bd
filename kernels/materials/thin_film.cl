/* What a boundary with thin films does to light: see materials/film_stack.cl. */
#include "materials/film_stack.cl"

/* The shares of unpolarised light that come back and go through. Light comes at cosine cos_i from a
 * medium of index `from`; where `outward`, it comes from the base's side and meets the last layer first.
 * eta + i k is the medium that it would enter. layer_at(layers, i) reads a layer, 0 outermost.
 *
 * Where nothing absorbs, what comes back is what does not go through: where films guide light the wave between them
 * is large, and the error of the share that comes back is by its square larger, of the other share by itself. */
inline Boundary thin_film(Layers layers, mask outward, real cos_i, Spectrum from, Spectrum eta, Spectrum k)
{
    real c_i = clamp_r(fabs(cos_i), (real)(1e-4f), (real)(1.0f));
#define C(c) Stack CAT(stack_, c) = stack_on(eta.c, k.c, from.c, c_i);
    SPECTRUM_EACH(C)
#undef C
    Spectrum absorbs = k; /* more than 0 where anything does */
    for (int i = 0; any(i < layers.count); ++i) {
        mask there = i < layers.count;
        integer next = sel_i(outward, (integer)(i), layers.count - 1 - i);
        Layer layer = layer_at(layers, sel_i(there, next, (integer)(0)));
        real thickness = layer.thickness * clamp_r(layer.profile, (real)(0.0f), (real)(1.0f));
#define C(c)                                                                                \
        {                                                                                   \
            Admittance medium = admittance_of(layer.eta.c, layer.k.c, from.c, c_i);         \
            Stack grown = stack_layer(CAT(stack_, c), medium, thickness, layers.lambdas.c); \
            CAT(stack_, c) = stack_sel(there, grown, CAT(stack_, c));                       \
            absorbs.c = sel(there, absorbs.c + layer.k.c, absorbs.c);                       \
        }
        SPECTRUM_EACH(C)
#undef C
    }
    Boundary b;
#define C(c)                                                                                      \
    {                                                                                             \
        Admittance outer = admittance_of(from.c, (real)(0.0f), from.c, c_i);                      \
        Stack whole = stack_cross(CAT(stack_, c), outer);                                         \
        real r = min_r(0.5f * (complex_norm(whole.s.r) + complex_norm(whole.p.r)), (real)(1.0f)); \
        real t = min_r(0.5f * (whole.s.t + whole.p.t), (real)(1.0f));                             \
        b.r.c = sel(absorbs.c > 0.0f, r, 1.0f - t);                                               \
        b.t.c = min_r(t, 1.0f - b.r.c);                                                           \
    }
    SPECTRUM_EACH(C)
#undef C
    return b;
}
