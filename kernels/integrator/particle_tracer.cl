/* A vertex of a path from a light: it is connected to the camera, and the path goes on. Steps that a scene or a
 * material does not have do nothing.
 *
 * The path carries importance-weighted power, so it needs the adjoint BSDF (Veach 1997, 5.3.2): f for radiance that
 * flows from the light to the camera, times the geometric cosine of the ray that leaves. bsdf_sample has the weight for
 * radiance that flows the other way. adjoint_weight multiplies this weight by eta^2 at a refraction and, at smoothed
 * normals, by |wo . ns| |wi . n| / (|wo . n| |wi . ns|), with wo on the side of the light.
 *
 * The integrator `path` weighs these paths against paths from the camera (transport/mis_ratio.cl). */
#include "cameras/camera.cl"
#include "generated/camera.cl"
#include "film/connect.cl"
#include "generated/connect.cl"
#include "transport/light_path.cl"
#include "generated/mis_ratio.cl"
#include "generated/light_path_steps.cl"

/* The weight of a sampled direction for a path from a light; leaves: the cosine of the next ray over the cosine of the
 * incident ray. */
inline Spectrum adjoint_weight(Vertex v, Scattering scatter, BsdfSample bs, mask next, real leaves)
{
    real over = max_r(fabs(bs.wi.z), (real)(1e-6f));
    real adjoint = BSDF_IS_PHASE ? (real)(1.0f) : bs.eta * bs.eta * leaves * fabs(scatter.wo.z) / over;
    Spectrum carried = spectrum_scale(bs.weight, adjoint);
#if BSDF_CHROMATIC && !BSDF_IS_PHASE /* eta differs between the wavelengths */
    mask spread = next & ((bs.lobe & LOBE_DELTA) == 0);
    Spectrum f = bsdf_eval(scatter.bsdf, bs.wi, scatter.wo);
    Spectrum exact = spectrum_scale(f, leaves / sel(spread, bs.pdf, (real)(1.0f)));
    carried = spectrum_sel(spread, exact, carried);
#endif
    return carried;
}

inline void light_path_vertex(Scene scene, Slab path, Slab shadow, uint at, mask active, Vertex v)
{
    Spectrum ratio = load_path_ratio(path, at);
    integer pixel_index = load_path_pixel_index(path, at);
    Sampler sampler = light_path_sampler(scene.settings, pixel_index, load_path_sample(path, at));
    Scattering scatter = vertex_scattering(scene, path, at, active, v, sampler);
    real arrives = 1.0f / max_r(VERTEX_COSINE(v.s.n, v.d), (real)(1e-6f));
    MisRatio mis_ratio = mis_ratio_of_light_path(scene, path, at, v, vertex_receiver(scene, v, scatter, neg3(v.d)));
    if (BSDF_IS_PHASE) {
        Receiver receiver = vertex_receiver(scene, v, scatter, neg3(v.d));
        mis_ratio = mis_ratio_chosen(scene, path, at, v, mis_ratio, receiver);
    }

    CameraJoint joint = join_camera_seek(scene, v, scatter);
    bsdf_ask(scene, scatter, joint.to, 1);
    v.state += join_camera(scene, shadow, at, active, v, scatter, mis_ratio, joint, arrives);

    vec2 uv = sampler_pair(sampler, scatter.dimension + DIMENSION_BSDF);
    BsdfSample bs = hero_sample(scatter.bsdf, scatter.wo, v3(uv.x, uv.y, scatter.choice.y), &ratio);
    mask null = vertex_is_null(bs.lobe), next = active & (bs.pdf > 0.0f) & vertex_continues(scene, v, null);
    vec3 onward = normalize3(to_world(scatter.shading.frame, bs.wi));
    Spectrum carried = adjoint_weight(v, scatter, bs, next, VERTEX_COSINE(v.s.n, onward) * arrives);
    Spectrum beta = spectrum_mul(v.beta, carried);
    beta = spectrum_scale(beta, shading_frame_share(scatter.shading, neg3(v.d)));
    next = light_path_roulette(scene, path, at, next, null, v, scatter, &beta);

    if (!BSDF_IS_PHASE) {
        Receiver receiver = vertex_receiver(scene, v, scatter, onward);
        mis_ratio = mis_ratio_chosen(scene, path, at, v, mis_ratio, receiver);
    }
    next = dull_goes_on(next, null, scatter, bs, &mis_ratio, &beta);
    next = keep_mis_ratio_to_camera(scene, path, at, next, null, mis_ratio, &v, onward, bs);
    if (BSDF_IS_PANE) path_scattered(path, at, next & !null);
    vertex_leave(path, at, next, null, v, onward, beta);
    store_path_ratio(path, at, next, ratio);
    vertex_end(path, at, active, next, null, v.state);
}

/* Step vertex: a program shades light paths alone. */
inline void integrator_vertex(Scene scene, Slab path, Slab hit, Slab shadow, uint at, mask active)
{
    Vertex v = vertex_load(scene, path, hit, at, active);
    light_path_vertex(scene, path, shadow, at, active, v);
}
