/* Emission of light paths, for integrators that trace paths from lights. The step `emission` of
 * kernels/lights/kinds/<kind>.cl has, for placed lights,
 *
 *   Spectrum <kind>_intensity(<Kind> l, Scene scene, vec3 d, Wavelengths lambdas);   all sent along d [W sr^-1 nm^-1]
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

/* A ray from a surface: diffuse from the front (a cosine density, so power = pi A L), or, where `along`, along the
 * normal alone, with `value` as radiant exitance (power = A E). d: its direction. */
inline LightRay surface_emit(SurfacePoint q, mask along, Spectrum value, vec3 d)
{
    LightRay r;
    r.o = q.p;
    r.n = q.n;
    r.size = sqrt(q.area);
    r.d = d;
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

/* Step emit: a ray from a light that `pick` chooses by its power. clpt/render/lights/cases.py generates
 * `lamp_emit`, for lights off all shapes, and `area_surface_point`, a point of a light on a shape with its texture
 * point. */
inline LightRay light_emit(Scene scene, real pick, vec2 u, vec2 v, Wavelengths lambdas)
{
    integer row = light_pick(scene, &pick, u.y);
    LightRow l = light_at(scene, row);
    LightView view = light_view(scene, row, l, v3(0.0f, 0.0f, 0.0f), v3(0.0f, 0.0f, 0.0f));
    integer chosen = aim_choose(scene, &v.x);
    LightRay r = lamp_emit(scene, l, view, u, v, lambdas);
    r = area_emit(scene, row, l, view, u, &v, lambdas, r);
    r = aim_ray(scene, row, l, view, chosen, v, lambdas, r);
    r.row = row;
    real share = 1.0f / max_r(l.pmf, (real)(1e-30f));
    r.power = spectrum_scale(r.power, share);
    r.seen = spectrum_scale(r.seen, share);
    return r;
}

/* Twin, in a scene without lights. */
inline LightRay light_emit(Scene scene, real pick, vec2 u, vec2 v, Wavelengths lambdas) { return light_ray_nothing(); }

/* Step areas: a ray from a light on a shape; `r`: the ray from any other light. */
inline LightRay area_emit(Scene scene, integer row, LightRow l, LightView view, vec2 u, vec2 *v, Wavelengths lambdas,
                          LightRay r)
{
    TexturePoint point = texture_point_nowhere();
    SurfacePoint q = surface_point_moved(view, area_surface_point(scene, row, l, u, &point));
    q = surface_point_turned(q, l, v);
    point.p = q.p;
    mask along = light_mode(l, EMISSION_ALONG);
    vec3 d = sel3(along, q.n, to_world(frame_of(q.n), cosine_hemisphere(*v)));
    Spectrum value = emission_load(scene, l.radiance, area_lookup(l, point, d), lambdas);
    LightRay s = area_ray_unseen(surface_emit(q, along, value, d), l);
    return light_ray_sel(l.shape >= 0, s, r);
}

/* Twin, where no shape emits. */
inline LightRay area_emit(Scene scene, integer row, LightRow l, LightView view, vec2 u, vec2 *v, Wavelengths lambdas,
                          LightRay r) { return r; }

/* Step two_sided: chooses the side of a light that emits from both, by *v, which is rescaled to a new random number. */
inline SurfacePoint surface_point_turned(SurfacePoint q, LightRow l, vec2 *v)
{
    mask both = light_mode(l, EMISSION_BOTH), back = both & (v->x >= 0.5f);
    q.n = sel3(back, neg3(q.n), q.n);
    q.area *= sel(both, (real)(2.0f), (real)(1.0f));
    v->x = sel(both, 2.0f * v->x - sel(back, (real)(1.0f), (real)(0.0f)), v->x);
    return q;
}
inline real area_sides_pdf(LightRow l) { return sel(light_mode(l, EMISSION_BOTH), (real)(0.5f), (real)(1.0f)); }

/* Twin, where all lights on shapes have a single side. */
inline SurfacePoint surface_point_turned(SurfacePoint q, LightRow l, vec2 *v) { return q; }
#define area_sides_pdf(l) ((real)(1.0f))

/* Step unseen: the camera does not see where a light path begins on a light that no ray sees, nor on a directed one. */
inline LightRay area_ray_unseen(LightRay r, LightRow l)
{
    r.seen = spectrum_sel(light_mode(l, EMISSION_UNSEEN | EMISSION_DIRECTED), spectrum_of(0.0f), r.seen);
    return r;
}

/* Twin, where rays see all lights on shapes, and these are even. */
inline LightRay area_ray_unseen(LightRay r, LightRow l) { return r; }

/* Step densities: densities of the light in a row for transport/mis_ratio.cl. The generated `emit_case` and `nee_case`
 * are the densities of a light's kind. */

/* The density with which light_emit sends a ray along -wi through a surface that is perpendicular to wi at distance t.
 * For a light on a shape it is divided by the cosine at the light [1/(m^2 sr)]; for a light at a point it is the
 * density of the direction over t^2 [1/m^2]. Areas are in units of Settings.mis_area_unit. */
inline real light_emit_pdf(Scene scene, integer row, vec3 wi, real t)
{
    LightRow l = light_at(scene, row);
    LightView view = light_view(scene, row, l, v3(0.0f, 0.0f, 0.0f), v3(0.0f, 0.0f, 0.0f));
    float disk = PI * emission_radius(scene.settings) * emission_radius(scene.settings);
    real pdf = emit_case(scene, l, view, light_view_direction(view, wi), t, disk);
    return pdf * l.pmf * scene.settings->mis_area_unit;
}

/* The density of next-event estimation at p for that point of the light [1/sr]; n: the normal there. For a delta light
 * it is the probability of the row. Where the tree asks for gloss, the probability of the row is left out: the step
 * `chosen` of transport/mis_ratio.cl knows it later. */
inline real light_nee_pdf(Scene scene, integer row, vec3 p, Receiver receiver, vec3 wi, real t, vec3 n)
{
    LightRow l = light_at(scene, row);
    LightView view = light_view_along(light_view(scene, row, l, p, receiver.hemisphere), wi, t, n);
    real pdf = with_openings(scene, l, p, receiver.hemisphere, wi, nee_case(scene, l, view));
    return GLOSS_BEFORE ? pdf : pdf * light_pmf(scene, row, l, p, receiver);
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
    mask kept = LANES == 1 ? ended : shine;
    store_shadow_t(shadow, at, ended, sel(shine, connect_camera(shadow, at, kept, s, c), (real)(-1.0f)));
    store_shadow_value(shadow, at, kept, spectrum_scale(r.seen, cosine * c.importance));
    return sel_i(shine, (integer)(PATH_SHADOW), (integer)(0));
}

/* Twin, where light paths do not show lights to the camera. */
inline integer light_joined(Scene scene, Slab shadow, uint at, mask ended, mask go, Sampler sampler, Surface s,
                            LightRay r, Wavelengths lambdas) { return (integer)(0); }
