/* The functions of materials/thin_film.cl, a wavelength after the other: four stacks at once need too many registers of
 * a GPU. Each turn reads a layer at a single wavelength. */
#include "materials/film_stack.cl"

inline Boundary thin_film(Layers layers, mask outward, real cos_i, Spectrum from, Spectrum eta, Spectrum k)
{
    real c_i = clamp_r(fabs(cos_i), (real)(1e-4f), (real)(1.0f));
    Boundary b = {spectrum_of(0.0f), spectrum_of(0.0f), 0.0f};
    Spectrum lambdas = layers.lambdas;
#define C(c)                                                                                       \
    {                                                                                              \
        real before = SPECTRUM_AT(from, c), absorbs = SPECTRUM_AT(k, c);                           \
        Stack stack = stack_on(SPECTRUM_AT(eta, c), absorbs, before, c_i);                         \
        layers.lambdas = spectrum_of(SPECTRUM_AT(lambdas, c));                                     \
        for (int i = 0; i < layers.count; ++i) {                                                   \
            Layer layer = layer_at(layers, outward ? i : layers.count - 1 - i);                    \
            real thickness = layer.thickness * clamp_r(layer.profile, (real)(0.0f), (real)(1.0f)); \
            Admittance medium = admittance_of(layer.eta.x, layer.k.x, before, c_i);                \
            stack = stack_layer(stack, medium, thickness, layers.lambdas.x);                       \
            absorbs += layer.k.x;                                                                  \
        }                                                                                          \
        stack = stack_cross(stack, admittance_of(before, (real)(0.0f), before, c_i));              \
        real r = min_r(0.5f * (complex_norm(stack.s.r) + complex_norm(stack.p.r)), (real)(1.0f));  \
        real t = min_r(0.5f * (stack.s.t + stack.p.t), (real)(1.0f));                              \
        r = sel(absorbs > 0.0f, r, 1.0f - t);                                                      \
        SPECTRUM_PUT(b.r, c, r);                                                                   \
        SPECTRUM_PUT(b.t, c, min_r(t, 1.0f - r));                                                  \
    }
    SPECTRUM_IN_TURN(C)
#undef C
    return b;
}
