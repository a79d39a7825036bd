/* Lamps' light along rays that leave a sealed medium, see media/escape.cl. */
#include "generated/textures.cl"
#include "generated/shapes.cl"
#include "shapes/surface.cl"
#include "generated/medium.cl"
#include "generated/lights.cl"
#include "materials/bsdf.cl"
#include "generated/smooth_boundary.cl"

/* Whether a ray in the shadow slab is of this kind. */
inline mask escape_waits(real t) { return t > 2.0f * FAR; }

/* `passes`, or for rays of this kind the lamps' light to o along d. The first surface must be a smooth boundary from
 * inside, which refracts the ray; the next surface may emit. */
inline Spectrum escape_light(TRACE_ARGS, Scene scene, Slab path, uint at, vec3 o, vec3 d, real t, mask active,
                             Spectrum passes)
{
    active = active & escape_waits(t);
    if (!any(active)) return passes;
    Spectrum light = spectrum_of(0.0f);
    TraceHit h = trace_closest(TRACE_PASSED, scene, o, d, (real)(FAR), active);
    mask out = active & (h.prim >= 0), front;
    Surface s = surface_at(scene, h, out, o, d, &front);
    integer word = shape_row_row(scene.shapes, sel_i(out, h.shape, (integer)(0)) * SHAPE_ROW_WORDS).back;
    out = out & !front & (MATERIAL_KIND(word) == SMOOTH_BOUNDARY);
    if (any(out)) {
        Wavelengths lambdas = load_path_lambdas(path, at);
        integer medium = sel_i(out, load_path_medium(path, at), (integer)(0)); /* the path is still inside */
        Spectrum value = medium_transmittance(scene, medium, h.t, lambdas);
        integer row = sel_i(out, MATERIAL_ROW(word), (integer)(0));
        Dielectric m = dielectric_load(scene, row, surface_texture_point(s), lambdas);
        Frame frame = surface_frame(s);
        BsdfSample bent = dielectric_sample(m, to_frame(frame, neg3(d)), v3(0.0f, 0.0f, 0.99999994f));
        vec3 onward = normalize3(to_world(frame, bent.wi));
        out = out & (bent.pdf > 0.0f) & ((bent.lobe & LOBE_TRANSMIT) != 0) & (dot3(s.n, onward) > 0.0f);
        value = spectrum_mul(value, spectrum_scale(bent.weight, bent.pdf));
        o = surface_offset(s, onward);
        h = trace_closest(TRACE_PASSED, scene, o, onward, (real)(FAR), out);
        out = out & (h.prim >= 0);
        s = surface_at(scene, h, out, o, onward, &front);
        out = out & (s.light >= 0) & light_shows(scene, sel_i(out, s.light, (integer)(0)), front);
        if (any(out)) {
            LightRow lamp = light_at(scene, sel_i(out, s.light, (integer)(0)));
            TexturePoint point = area_lookup(lamp, surface_texture_point(s), neg3(onward));
            Spectrum le = emission_load(scene, lamp.radiance, point, lambdas);
            light = spectrum_sel(out, spectrum_mul(value, le), light);
        }
    }
    return spectrum_sel(active, light, passes);
}

/* Twin, where no ray leaves a sealed medium toward a lamp. */
inline mask escape_waits(real t) { return mask_of(0); }
inline Spectrum escape_light(TRACE_ARGS, Scene scene, Slab path, uint at, vec3 o, vec3 d, real t, mask active,
                             Spectrum passes) { return passes; }
