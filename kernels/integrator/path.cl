/* A vertex of a path from the camera: the light that is met, next-event estimation, and the direction to go on. Light
 * is found by meeting and by choosing it, with weights of the power heuristic (Veach 1997, 9.2.4), against paths from
 * lights (transport/mis_ratio.cl). Steps that a scene or a material does not have do nothing. */
#include "lights/light.cl#met"
#include "generated/ghosts.cl"
#include "generated/light_layers.cl"
#include "generated/layers.cl"
#include "generated/mis_ratio.cl"
#include "generated/guide.cl"
#include "generated/path_steps.cl"
#include "generated/scout.cl"

inline void path_vertex(Scene scene, Slab path, Slab shadow, uint at, mask active, Vertex v SHADE_ARGS)
{
    Spectrum ratio = load_path_ratio(path, at);
    mask hidden = add_emission(scene, path, at, active, v SHADE_PASSED), met = active & !hidden;
    mask next = BSDF_IS_PANE ? met : met & vertex_continues(scene, v, vertex_is_null((integer)(0)));

    Sampler sampler = pixel_sampler(scene.settings, load_path_pixel_key(path, at), load_path_sample(path, at));
    Scattering scatter = vertex_scattering(scene, path, at, met, v, sampler);
    if (VERTEX_COUNTS)
        v.state = layers_record(scene, path, at, met, v, scatter, v.state LAYER_PASSED);
#if BSDF_ABSORBS /* as most surfaces of lights do */
    next = next & (spectrum_max(bsdf_albedo(scatter.bsdf)) > 0.0f);
#endif
    MisRatio mis_ratio = mis_ratio_of_camera_path(scene, path, at, v, sampler);
    merge_at_vertex(scene, path, at, met, &v, &scatter, mis_ratio, ratio SHADE_PASSED);
    Guided guided = guide_at(scene, v.s, v.d MERGE_PASSED);

    NextEvent event = next_event_seek(scene, next, v, scatter);
    bsdf_ask(scene, scatter, event.wi, 0);
    ReuseLobe lobe = reuse_second(scene, path, at, met, &v, scatter);
    event = next_event_weigh(scene, event, v, scatter, mis_ratio, guided, ratio, lobe SHADE_PASSED);
    if (LANES == 1) { /* a GPU has too few registers to hold the event and wo longer: wo is computed anew */
        v.state += next_event_keep(scene, path, shadow, at, active, v, event);
        scatter.wo = to_frame(scatter.shading.frame, neg3(load_path_d(path, at)));
    }
    BsdfSample bs = reuse_sample(lobe, scatter.wo, onward_sample(scatter, guided, &ratio MERGE_PASSED));
    if (LANES > 1) v.state += next_event_keep(scene, path, shadow, at, active, v, event);

    mask null = vertex_is_null(bs.lobe);
    next = next & (bs.pdf > 0.0f);
    if (BSDF_IS_PANE) { /* the lobe tells whether it scatters */
        next = next & vertex_continues(scene, v, null);
        v.state = layers_record(scene, path, at, met & !null, v, scatter, v.state LAYER_PASSED);
    }
    vec3 onward = normalize3(to_world(scatter.shading.frame, bs.wi));
    Spectrum beta = spectrum_scale(spectrum_mul(v.beta, bs.weight), shading_frame_share(scatter.shading, onward));
    real eta = load_path_eta(path, at) * bs.eta;
    mask on = path_roulette(scene, path, at, next, null, v, scatter, guided, eta, &beta);

    vertex_leave(path, at, on, null, v, onward, beta);
    reuse_first(path, at, on, v, scatter, onward, lobe, bs);
    store_path_cone(path, at, on, cone_scattered(v.cone, bs.pdf, (bs.lobe & LOBE_DELTA) != 0));
    path_scatters(scene, path, at, on, null, &v, scatter, mis_ratio, bs, onward);
    store_path_eta(path, at, on, eta);
    real slope = load_path_slope(path, at) + slope_across(scene, v.row, scatter.lambdas, scatter.wo, bs.wi);
    store_path_slope(path, at, on, slope);
    vertex_end(path, at, met, on, null, v.state + path_escapes(scene, path, shadow, at, next, v, scatter, bs, onward));
    store_path_ratio(path, at, on, ratio);
}

/* Step vertex: a program shades paths from the camera alone. The host includes this step or the next. */
inline void integrator_vertex(Scene scene, Slab path, Slab hit, Slab shadow, uint at, mask active SHADE_ARGS)
{
    Vertex v = vertex_load(scene, path, hit, at, active);
    path_vertex(scene, path, shadow, at, scout_vertex(scene, path, at, active, v LAYER_PASSED), v SHADE_PASSED);
}

/* Step both: a program shades paths from lights (which: 0) and from the camera (which: 1). They share vertex_load,
 * which takes long to compile. */
inline void integrator_vertex(Scene scene, Slab path, Slab hit, Slab shadow, uint at, mask active SHADE_ARGS,
                              uint which)
{
    Vertex v = vertex_load(scene, path, hit, at, active);
    if (which == 0) light_path_vertex(scene, path, shadow, at, active, v);
    else path_vertex(scene, path, shadow, at, scout_vertex(scene, path, at, active, v LAYER_PASSED), v SHADE_PASSED);
}
