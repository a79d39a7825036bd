/* One vertex of a path that comes from a light: it is joined to the camera, and goes on.
 *
 * f is asked for as radiance flows, from the light to the camera, and light that is carried takes it with the
 * geometric cosine of the side where it leaves (Veach 1997, 5.3.2): what bsdf_sample gives for the opposite flow
 * lacks, where light is refracted, eta^2, and where normals are smoothed, the quotient
 * |wo . ns| |wi . n| / (|wo . n| |wi . ns|), wo being the side where the light came from.
 *
 * As the light paths of `path` they are weighed against those from the camera (lighting/rivals.cl). */
#include "interface/camera.cl"
#include "generated/camera.cl"
#include "film/connect.cl"
#include "generated/connect.cl"
#include "lighting/light_path.cl"
#include "generated/rivals.cl"

inline void light_path_vertex(Scene scene, Slab path, Slab shadow, uint at, mask active, Vertex v)
{
    global const Settings *settings = scene.settings;
    Surface s = v.s;
    Spectrum beta = v.beta, ratio = load_path_ratio(path, at);
    integer state = v.state, depth = v.depth;

    Sampler sampler = light_path_sampler(settings, load_path_pixel_index(path, at), load_path_sample(path, at));
    Scattering scatter = vertex_scattering(scene, path, at, active, v, sampler);
    Bsdf m = scatter.bsdf;
    Frame frame = scatter.shading.frame;
    vec3 wo = scatter.wo;
    real arrives = 1.0f / max_r(VERTEX_COSINE(s.n, v.d), (real)(1e-6f));
#if WEIGHS_LIGHT_PATHS && !BSDF_IS_NULL
    Rival rival = rival_of_emission(scene, path, at, v, vertex_hemisphere(frame, wo));
#endif

#if !BSDF_DELTA && JOINS_CAMERA
    /* To the camera. */
    vec2 lens = sampler_pair(sampler, scatter.dimension + DIMENSION_LIGHT);
    CameraPoint c = camera_connect(scene, s.p, mask_of(0), lens);
    vec3 to = to_local(frame, neg3(c.d));
    Spectrum f = bsdf_eval(m, to, wo);
    mask shine = active & c.seen & (spectrum_max(f) > 0.0f);
    real carries = VERTEX_COSINE(s.n, c.d) * arrives * c.importance * shading_frame_share(scatter.shading, neg3(v.d));
#if WEIGHS_LIGHT_PATHS
    carries *= 1.0f / (1.0f + rival_of_joint(scene, rival, s, c, rival_pdf(m, to, wo), rival_pdf(m, wo, to)));
    mask hidden = mask_of(settings->hide_lights != 0) & (s.light >= 0);
#if BSDF_IS_PHASE
    shine = shine & (!rival.first | !rival.met);
#else
    shine = shine & !rival.first;
#endif
    shine = shine & !hidden & !rival_ends(scene, v);
#endif
    Spectrum value = spectrum_scale(spectrum_mul(beta, f), carries);
    value = vertex_beyond(scene, v, neg3(c.d), c.t, v.lambdas, value);
    connect_camera(shadow, at, active, shine, s, c, value);
#if SHADOW_MEDIA
#if USES_BODIES
    store_shadow_through(shadow, at, shine, bodies_beyond(v.bodies, dot3(s.n, c.d) > 0.0f));
#else
    store_shadow_through(shadow, at, shine, vertex_medium(v, neg3(c.d)));
#endif
#endif
    state += sel_i(shine, (integer)(PATH_SHADOW), (integer)(0));
#endif

    /* The next direction. */
    vec2 uv = sampler_pair(sampler, scatter.dimension + DIMENSION_BSDF);
    BsdfSample bs = hero_sample(m, wo, v3(uv.x, uv.y, scatter.choice.y), &ratio);
    mask null = vertex_is_null(bs.lobe), next = active & (bs.pdf > 0.0f) & vertex_continues(scene, v, null);
    vec3 onward = normalize3(to_world(frame, bs.wi));
    real leaves = VERTEX_COSINE(s.n, onward) * arrives;
#if BSDF_IS_PHASE
    real adjoint = 1.0f;
#else
    real adjoint = bs.eta * bs.eta * leaves * fabs(wo.z) / max_r(fabs(bs.wi.z), (real)(1e-6f));
#endif
    Spectrum carried = spectrum_scale(bs.weight, adjoint);
#if BSDF_CHROMATIC && !BSDF_IS_PHASE /* eta differs between the wavelengths */
    mask spread = next & ((bs.lobe & LOBE_DELTA) == 0);
    Spectrum exact = spectrum_scale(bsdf_eval(m, bs.wi, wo), leaves / sel(spread, bs.pdf, (real)(1.0f)));
    carried = spectrum_sel(spread, exact, carried);
#endif
    beta = spectrum_scale(spectrum_mul(beta, carried), shading_frame_share(scatter.shading, neg3(v.d)));

#if !BSDF_IS_NULL /* Russian roulette, on what is left of what the light gave. */
    mask play = !null & (depth >= settings->rr_depth);
    real strength = spectrum_max(beta) * load_path_weight(path, at);
    next = next & (strength > 0.0f);
    if (any(next & play)) {
        vec2 u = sampler_pair(sampler, scatter.dimension + DIMENSION_ROULETTE);
        next = roulette(next, play, strength, u.x, &beta);
    }
#endif

#if WEIGHS_LIGHT_PATHS && !BSDF_IS_NULL
    next = next & !rival_ends(scene, v);
    mask delta = (bs.lobe & LOBE_DELTA) != 0;
    real p = rival_pdf(m, wo, bs.wi), p_back = rival_pdf(m, bs.wi, wo);
    store_path_rival(path, at, next & !null, rival_to_camera(rival, s, onward, delta, p, p_back));
#if MERGES
    store_path_pending(path, at, next & !null, rival_merged(rival, s, onward, delta, p, p_back));
    state = state | sel_i(rival_sharp(delta, p, p_back) & !null, (integer)(PATH_SHARP), (integer)(0));
#endif
#endif
#if BSDF_IS_PANE
    path_scattered(path, at, next & !null);
#endif
    vertex_leave(path, at, next, null, v, onward, beta);
    store_path_ratio(path, at, next, ratio);
    vertex_end(path, at, active, next, null, state);
}

#if !SHADES_BOTH
void integrator_vertex(Scene scene, Slab path, Slab hit, Slab shadow, uint at, mask active)
{
    Vertex v = vertex_load(scene, path, hit, at, active);
    light_path_vertex(scene, path, shadow, at, active, v);
}
#endif
