/* Light as it leaves a light, for integrators that start there: kernels/lights/emission/<kind>.cl has, for
 * lights at a point,
 *
 *   Spectrum <kind>_intensity(<Kind> l, Scene scene, vec3 d, Wavelengths lambdas);   sent along d [W sr^-1 nm^-1]
 *   LightRay <kind>_emit(<Kind> l, Scene scene, vec2 u, vec2 v, Wavelengths lambdas);
 *   real     <kind>_emit_pdf(<Kind> l, vec3 d);       with which it chooses a direction d [1/sr]; 0: it cannot be
 *                                                     weighed, and is left to paths from the camera
 *
 * and for shapes, from which `surface_emit` makes a ray,
 *
 *   SurfacePoint <kind>_point(<Kind> s, vec2 u);      a point of its surface, evenly over the area
 *
 * u: a point of the unit square for the position; v: for the direction. Light from infinity needs no more
 * than the <kind>_sample of lights/light.cl, see `distant_emit`. LightRay and SurfacePoint are Records in
 * clpt/render/records.
 */
#include "generated/light_ray.cl"
#include "generated/surface_point.cl"

/* A point of a light that emits from both sides: it leaves one of them, as *v says, for the two. */
inline SurfacePoint surface_point_turned(SurfacePoint q, mask both, vec2 *v)
{
    mask back = both & (v->x >= 0.5f);
    q.n = sel3(back, neg3(q.n), q.n);
    q.area *= sel(both, (real)(2.0f), (real)(1.0f));
    v->x = sel(both, 2.0f * v->x - sel(back, (real)(1.0f), (real)(0.0f)), v->x);
    return q;
}

/* From a surface: evenly in all directions of the front (a cosine density, so power = pi A L), or, where
 * `along`, along the normal only, the value being what flows through an area (power = A E). */
inline LightRay surface_emit(SurfacePoint q, mask along, Spectrum value, vec2 v)
{
    LightRay r;
    r.o = q.p;
    r.n = q.n;
    r.size = sqrt(q.area);
    r.d = sel3(along, q.n, to_world(frame_of(q.n), cosine_hemisphere(v)));
    r.power = spectrum_scale(value, q.area * sel(along, (real)(1.0f), (real)(PI)));
    r.seen = spectrum_sel(along, spectrum_of(0.0f), spectrum_scale(value, q.area));
    r.away = 0;
    return r;
}

/* Of the disk from which light from infinity starts [m]. */
inline float emission_radius(global const Settings *settings) { return settings->scene_radius * 1.001f; }

/* From infinity: the direction as a light sample has it, and a point of the disk across it that covers
 * the scene's sphere. */
inline LightRay distant_emit(Scene scene, LightSample s, vec2 v)
{
    global const Settings *settings = scene.settings;
    float radius = emission_radius(settings);
    vec2 q = concentric_disk(v);
    LightRay r;
    r.d = neg3(s.wi);
    Frame f = frame_of(r.d);
    vec3 center = v3((real)(settings->center[0]), (real)(settings->center[1]), (real)(settings->center[2]));
    r.o = add3(center, to_world(f, v3(q.x * radius, q.y * radius, (real)(-radius))));
    r.n = r.d;
    r.size = 0.0f;
    r.seen = spectrum_sel(s.pdf > 0.0f, spectrum_scale(s.radiance, 1.0f / max_r(s.pdf, (real)(1e-30f))),
                          spectrum_of(0.0f));
    r.power = spectrum_scale(spectrum_sel(s.pdf > 0.0f, r.seen, s.radiance), PI * radius * radius);
    r.away = mask_of(1);
    return r;
}
