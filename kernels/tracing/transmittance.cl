/* The transmittance between two points, 0 to 1: `trace_transmittance`. */

/* The transmittance of a surface: a number or, with FREE_PANES, a number for each wavelength. */
#if FREE_PANES
#define Passage Spectrum
#define passage_of(x) spectrum_of(x)
#define passage_sel(m, a, b) spectrum_sel(m, a, b)
#define passage_mul(a, b) spectrum_mul(a, b)
#define passage_scale(a, x) spectrum_scale(a, x)
#define passage_most(a) spectrum_max(a)
#define passage_dims(light, a) spectrum_mul(light, a)
#define passage_adds(light, a, sum) spectrum_add(spectrum_mul(light, a), sum)
#define passage_mix(a, b, w) spectrum_add(a, spectrum_scale(spectrum_sub(b, a), w))
#else
#define Passage real
#define passage_of(x) ((real)(x))
#define passage_sel(m, a, b) sel(m, a, b)
#define passage_mul(a, b) ((a) * (b))
#define passage_scale(a, x) ((a) * (x))
#define passage_most(a) (a)
#define passage_dims(light, a) spectrum_scale(light, a)
#define passage_adds(light, a, sum) spectrum_madd(light, a, sum)
#define passage_mix(a, b, w) ((a) + (w) * ((b) - (a)))
#endif

/* The body of the transmittance of a surface whose material may be a mixture; below: that of the parts of mixtures.
 * Functions cannot call themselves, so there is a function for each level of nesting. */
#define MIXTURE_TRANSMITTANCE(below)                                                                                  \
    Passage value = below(scene, word, point, lambdas, c);                                                            \
    mask m = MATERIAL_KIND(word) == MATERIAL_MIXTURE;                                                                 \
    if (any(m)) {                                                                                                     \
        integer row = sel_i(m, MATERIAL_ROW(word), (integer)(0));                                                     \
        real w = mixture_weight(scene, row, point, lambdas);                                                          \
        Passage first = below(scene, gather_i(scene.mixtures, row + 2), point, lambdas, c);                           \
        Passage second = below(scene, gather_i(scene.mixtures, row + 3), point, lambdas, c);                          \
        value = passage_sel(m, passage_mix(first, second, w), value);                                                 \
    }                                                                                                                 \
    return value;

/* Step opaque: 0 or 1, in scenes where every surface blocks light. */
inline real trace_transmittance(TRACE_ARGS, Scene scene, vec3 o, vec3 d, real t, Wavelengths lambdas, mask active)
{
    return sel(trace_occluded(TRACE_PASSED, scene, o, d, t, active), (real)(0.0f), (real)(1.0f));
}

/* Step surfaces: through surfaces that transmit a part of light unchanged: masks and null boundaries. Surfaces are
 * traced in turn, and their transmittances multiplied. */
#include "shapes/shape.cl"
#include "generated/textures.cl"
#include "generated/mixture.cl"
#include "generated/shapes.cl"
#include "shapes/surface.cl"
#include "generated/null_transmittance.cl"

inline Passage trace_transmittance(TRACE_ARGS, Scene scene, vec3 o, vec3 d, real t, Wavelengths lambdas, mask active)
{
    Passage transmittance = passage_of(1.0f);
    int surfaces = 0;
    while (any(active)) {
        TraceHit h = trace_closest(TRACE_PASSED, scene, o, d, t, active);
        active = active & (h.prim >= 0) & (t > 0.0f);
        if (any(active)) {
            ShapeRow shape = shape_row_row(scene.shapes, sel_i(active, h.shape, (integer)(0)) * SHAPE_ROW_WORDS);
            mask front;
            Surface s = surface_at(scene, h, active, o, d, &front);
            integer word = sel_i(active, sel_i(front, shape.front, shape.back), (integer)(0));
            Passage own = null_transmittance(scene, word, surface_texture_point(s), lambdas, fabs(dot3(s.ns, d)));
            own = passage_scale(own, (real)(surfaces < MOST_NULL_SURFACES ? 1.0f : 0.0f));
            transmittance = passage_sel(active, passage_mul(transmittance, own), transmittance);
            active = active & (passage_most(own) > 0.0f);
            /* Continue exactly along d: off the line, the ray would miss its end and a sphere shade itself. */
            real on = h.t * (1.0f + SURFACE_ROUNDING) + surface_ray_offset(s, d);
            o = sel3(active, madd3(d, on, o), o);
            t = sel(active, t - on, t);
            surfaces++;
        }
    }
    return transmittance;
}

/* Step media: through media, and through surfaces that transmit a part of light unchanged. Surfaces are traced in turn;
 * each may be a boundary between media. key: of the random numbers in media on grids; into: the medium at the end, 0
 * for any. */
#include "shapes/shape.cl"
#include "generated/textures.cl"
#include "generated/mixture.cl"
#include "generated/shapes.cl"
#include "shapes/surface.cl"
#include "generated/medium.cl"
#include "generated/null_transmittance.cl"

#include "generated/way_steps.cl"

/* The transmittance of `way` metres along d in a medium. */
inline Spectrum way_transmittance(Scene scene, integer medium, vec3 o, vec3 d, real way, natural key, mask active,
                                  Wavelengths lambdas)
{
    Spectrum dims = medium_transmittance(scene, sel_i(active, medium, (integer)(0)), way, lambdas);
    return grid_shadow_transmittance(scene, medium, o, d, way, key, active, lambdas, dims);
}

inline Spectrum trace_transmittance(TRACE_ARGS, Scene scene, vec3 o, vec3 d, real t, integer medium,
                                    Wavelengths lambdas, mask active, natural key, integer into)
{
    Spectrum passes = spectrum_sel(active, spectrum_of(1.0f), spectrum_of(0.0f));
    int surfaces = 0;
    integer bodies = medium;
    medium = shadow_medium(scene, bodies, active, medium);
    integer last = medium;
    while (any(active)) {
        TraceHit h = trace_closest(TRACE_PASSED, scene, o, d, t, active);
        mask met = active & (h.prim >= 0) & (t > 0.0f);
        real way = sel(met, h.t, max_r(t, (real)(0.0f)));
        natural own_key = hash_natural(key + 1u + (uint)surfaces);
        passes = spectrum_mul(passes, way_transmittance(scene, medium, o, d, way, own_key, active, lambdas));
        active = met;
        if (any(active)) {
            integer row = sel_i(active, h.shape, (integer)(0));
            ShapeRow shape = shape_row_row(scene.shapes, row * SHAPE_ROW_WORDS);
            mask front;
            Surface s = surface_at(scene, h, active, o, d, &front);
            integer word = sel_i(active, sel_i(front, shape.front, shape.back), (integer)(0));
            Passage own = null_transmittance(scene, word, surface_texture_point(s), lambdas, fabs(dot3(s.ns, d)));
            own = passage_scale(own, (real)(surfaces < MOST_NULL_SURFACES ? 1.0f : 0.0f));
            own = shadow_passage(scene, row, &bodies, front, surfaces, own);
            passes = spectrum_sel(active, passage_dims(passes, own), passes);
            active = active & (passage_most(own) > 0.0f);
            medium = shadow_medium_beyond(scene, row, bodies, active, front, medium);
            last = sel_i(active, medium, last);
            /* Continue exactly along d: off the line, the ray would miss its end and a sphere shade itself. */
            real on = h.t * (1.0f + SURFACE_ROUNDING) + surface_ray_offset(s, d);
            o = sel3(active, madd3(d, on, o), o);
            t = sel(active, t - on, t);
            surfaces++;
        }
    }
    return spectrum_sel((into == 0) | (into == last), passes, spectrum_of(0.0f));
}
