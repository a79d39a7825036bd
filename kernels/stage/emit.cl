/* Ends paths that are finished and begins those that come next, for integrators that start at lights: the twin of
 * stage/generate.cl. The work list only counts paths here: stage/splat.cl adds the light of a path to
 * the pixel where the camera sees it. */
#include "stage/stage.cl"
#include "generated/begin_args.cl"
#include "generated/sampler.cl"
#include "cameras/camera.cl"
#include "generated/camera.cl"
#include "film/connect.cl"
#include "generated/connect.cl"
#include "film/film.cl"
#include "film/work_list.cl"
#include "shapes/shape.cl"
#include "lights/light.cl"
#include "generated/lights.cl"
#include "generated/emission.cl"
#include "generated/shapes.cl"
#include "shapes/surface.cl"
#include "transport/path_state.cl#end"
#include "transport/light_path.cl#next"
#include "lights/light.cl#next_event"
#include "transport/light_path.cl"
#include "generated/light_medium.cl"
#include "generated/merging.cl"
#include "generated/motion.cl"
#include "generated/join_light.cl"
#include "generated/light_path_endless.cl"
#include "generated/emit_steps.cl"

/* The first ray of a light path, and its wavelengths; sets the scene's time. */
inline LightRay first_light_ray(Scene *scene, Sampler sampler, integer sample, Wavelengths *lambdas)
{
    vec2 u = sampler_pair(sampler, (natural)(DIMENSION_WAVELENGTH));
    real moment = sampler_pair(sampler, (natural)(DIMENSION_LIGHT_TIME)).x;
    integer pass = merging_pass(*scene, sample);
    scene->time = motion_time(*scene, merging_moment(*scene, u.x, moment, pass));
    *lambdas = wavelengths_sample(*scene, merging_wavelength(*scene, u.x, pass));
    return light_emit(*scene, u.y, sampler_pair(sampler, (natural)(DIMENSION_FILM)),
                      sampler_pair(sampler, (natural)(DIMENSION_LENS)), *lambdas);
}

/* The mis_ratio of a light path that begins, see transport/mis_ratio.cl. */
inline real first_mis_ratio(Scene scene, LightRay r)
{
    return mis_ratio_aimed((real)(1.0f / scene.settings->light_paths), r);
}

/* Puts a ray from a light into the slots that `go` on, and, where the camera sees lights, a ray from there to the
 * camera into the shadow slab. Returns the bits of Path.state that follow. */
inline integer begin_light_path(Scene scene, Slab path, Slab shadow, uint at, mask ended, mask go, integer pixel_index,
                                integer sample)
{
    global const Settings *settings = scene.settings;
    Sampler sampler = light_path_sampler(settings, pixel_index, sample);
    Wavelengths lambdas;
    LightRay r = first_light_ray(&scene, sampler, sample, &lambdas);
    real strength = spectrum_max(r.power);
#if USES_GUIDE
    go = go & (light_path_number(settings, pixel_index, sample) < settings->guide_paths);
#endif
    mask alive = go & (strength > 0.0f) & mask_of(settings->max_depth > 1);
    integer lit = sel_i(go, r.row, (integer)(0));
    Surface s;
    s.p = r.o;
    s.n = r.n;
    s.size = r.size;
    store_path_o(path, at, go, sel3(r.away, r.o, surface_offset(s, r.d)));
    store_path_d(path, at, go, r.d);
    store_path_time(path, at, go, scene.time);
    store_path_cone(path, at, go, (integer)(0));
    store_path_lambdas(path, at, go, lambdas);
    store_path_beta(path, at, go, r.power);
    store_path_weight(path, at, go, 1.0f / max_r(strength, (real)(1e-37f)));
    store_path_nulls(path, at, go, (integer)(0));
    light_path_begins(path, at, go);
    store_path_null_distance(path, at, go, (real)(0.0f));
    store_path_medium(path, at, go, light_medium(scene, lit));
    store_path_bodies(path, at, go, light_bodies(scene, lit));
    store_path_around(path, at, go, light_around(scene, lit));
    store_path_ray_offset(path, at, go, (real)(0.0f));
    store_path_ratio(path, at, go, spectrum_of(1.0f));
    store_path_merge_ratio(path, at, go, (real)(0.0f));
    store_path_mis_ratio(path, at, go, first_mis_ratio(scene, r));
    light_kept(path, at, go, r);
    integer state = sel_i(alive, (integer)(PATH_ALIVE), (integer)(0));
    return state + light_joined(scene, shadow, at, ended, go, sampler, s, r, lambdas);
}

STAGE(emit)(SLAB_ARGS, SCENE_ARGS, BEGIN_ARGS STAGE_AT_ARG)
{
    STAGE_BEGIN
    PathEnd end = path_end(path, hit, at);
    if (path_end_of_half(end)) {
        light_path_endless(path, at, end, counters);
        NextSample next = next_light_path(scene, path, at, BEGIN_PASSED, end);
        mask go = end.ended & !next.done;
        integer state = begin_light_path(scene, path, shadow, at, end.ended, go, next.pixel_index, next.sample);
        store_path_state(path, at, end.ended, sel_i(next.done, (integer)(PATH_DONE), state + 1));
    }
}
