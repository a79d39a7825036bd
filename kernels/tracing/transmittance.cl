/* The transmittance between two points, 0 to 1, through surfaces that transmit a part of light unchanged: masks and
 * null boundaries. Surfaces are traced in turn, and their transmittances multiplied. */
#include "shapes/shape.cl"
#include "generated/textures.cl"
#include "generated/mixture.cl"
#include "generated/shapes.cl"
#include "shapes/surface.cl"
#include "tracing/passage.cl"
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
