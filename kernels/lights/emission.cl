/* Light as it leaves a light, for integrators that start there. The step `emission` of kernels/lights/kinds/<kind>.cl
 * has, for lights at a point,
 *
 *   Spectrum <kind>_intensity(<Kind> l, Scene scene, vec3 d, Wavelengths lambdas);   sent along d [W sr^-1 nm^-1]
 *   LightRay <kind>_emit(<Kind> l, Scene scene, vec2 u, vec2 v, Wavelengths lambdas);
 *   real     <kind>_emit_pdf(<Kind> l, vec3 d);       density of a direction d [1/sr]; 0: the light has no MIS
 *                                                     weights, and is left to paths from the camera
 *
 * and that of kernels/shapes/kinds/<kind>.cl for shapes, whose rays `surface_emit` begins,
 *
 *   SurfacePoint <kind>_point(<Kind> s, vec2 u);      a point of its surface, evenly over the area
 *
 * u: a point of the unit square for the position; v: for the direction. Light from infinity needs no more than the
 * <kind>_sample of lights/light.cl, see `distant_emit`. LightRay and SurfacePoint are Records in
 * clpt/render/records. */
#include "generated/light_ray.cl"
#include "generated/surface_point.cl"

/* Chooses the side of a light that emits from both sides, by *v, which is rescaled to a new random number. */
inline SurfacePoint surface_point_turned(SurfacePoint q, mask both, vec2 *v)
{
    mask back = both & (v->x >= 0.5f);
    q.n = sel3(back, neg3(q.n), q.n);
    q.area *= sel(both, (real)(2.0f), (real)(1.0f));
    v->x = sel(both, 2.0f * v->x - sel(back, (real)(1.0f), (real)(0.0f)), v->x);
    return q;
}

/* A ray from a surface: diffuse from the front (a cosine density, so power = pi A L), or, where `along`, along the
 * normal alone, with `value` as radiant exitance (power = A E). */
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

/* A ray from a light at a point, without power. */
inline LightRay light_ray_along(vec3 o, vec3 d)
{
    LightRay r = light_ray_nothing();
    r.o = o;
    r.d = d;
    r.n = d;
    return r;
}

/* Radius of the disk where light from infinity starts [m]. */
inline float emission_radius(global const Settings *settings) { return settings->scene_radius * 1.001f; }

/* A ray from infinity: in the direction of a light sample, from a point of the disk across it that covers the scene's
 * sphere. */
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

/* Step kept: the light of a path that is weighed, for its first vertex, see transport/mis_ratio.cl. */
inline void light_kept(Slab path, uint at, mask go, LightRay r)
{
    store_path_light(path, at, go, r.row);
    store_path_sampled_hemisphere(path, at, go, r.n);
}

/* Twin, where light paths are not weighed. */
inline void light_kept(Slab path, uint at, mask go, LightRay r) {}

/* Step join: puts rays from points of lights to the camera, which sees lights, into the shadow slab. Returns the bits
 * of Path.state that follow. */
inline integer light_joined(Scene scene, Slab shadow, uint at, mask ended, mask go, Sampler sampler, Surface s,
                            LightRay r, Wavelengths lambdas)
{
    global const Settings *settings = scene.settings;
    vec2 lens = sampler_pair(sampler, (natural)(DIMENSION_VERTEX + DIMENSION_LIGHT));
    CameraPoint c = camera_connect(scene, sel3(r.away, neg3(r.d), r.o), r.away, lens);
    real cosine = sel(r.away, (real)(1.0f), -dot3(r.n, c.d));
    mask seen = go & c.seen & (cosine > 0.0f) & (spectrum_max(r.seen) > 0.0f);
    mask shine = seen & mask_of(settings->hide_lights == 0);
    integer lit = sel_i(go, r.row, (integer)(0)), medium = sel_i(go, light_medium(scene, lit), (integer)(0));
    /* A ray from infinity is traced from the camera. */
    store_shadow_through(shadow, at, shine, sel_i(r.away, camera_through(scene), light_through(scene, lit)));
    r.seen = medium_dims(scene, medium, c.t, lambdas, r.seen);
    connect_camera(shadow, at, ended, shine, s, c, spectrum_scale(r.seen, cosine * c.importance));
    return sel_i(shine, (integer)(PATH_SHADOW), (integer)(0));
}

/* Twin, where light paths do not show lights to the camera. */
inline integer light_joined(Scene scene, Slab shadow, uint at, mask ended, mask go, Sampler sampler, Surface s,
                            LightRay r, Wavelengths lambdas) { return (integer)(0); }
