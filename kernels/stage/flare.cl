/* Begins light paths that are ghosts of the camera's lens, and no more: each is a ray from a point of the lens's front
 * to a light, chosen as next-event estimation chooses it, and what its light adds to the film if nothing is between.
 * The twin of stage/emit.cl; stage/splat.cl tests the rays. */
#include "stage/stage.cl"
#include "generated/begin_args.cl"
#include "generated/sampler.cl"
#include "cameras/camera.cl"
#include "generated/camera.cl"
#include "generated/connect.cl"
#include "film/film.cl"
#include "film/work_list.cl"
#include "shapes/shape.cl"
#include "core/rounding.cl"
#include "lights/light.cl"
#include "generated/lights.cl"
#include "generated/medium.cl"
#include "generated/motion.cl"
#include "transport/path_state.cl#end"
#include "transport/light_path.cl#next"
#include "transport/light_path.cl#sampler"
#include "generated/front_motion.cl"

/* Puts a ray to a light into the shadow slab of the slots that `go` on. Returns the bits of Path.state that follow. */
inline integer begin_ghost(Scene scene, Slab path, Slab shadow, uint at, mask ended, mask go, integer pixel_index,
                           integer sample)
{
    global const Settings *settings = scene.settings;
    global const LensCamera *camera = (global const LensCamera *)scene.camera;
    Sampler sampler = light_path_sampler(settings, pixel_index, sample);
    vec2 u = sampler_pair(sampler, (natural)(DIMENSION_WAVELENGTH));
    vec2 other = sampler_pair(sampler, (natural)(DIMENSION_LIGHT_TIME));
    Wavelengths lambdas = wavelengths_sample(scene, u.x);
    store_path_lambdas(path, at, go, lambdas);
    store_path_nulls(path, at, go, (integer)(0));
    scene.time = motion_time(scene, other.x);
    store_path_time(path, at, go, scene.time);
    LensFront f = lens_front(scene, camera, sampler_pair(sampler, (natural)(DIMENSION_FILM)));
    CameraRay front = {matrix_point(camera->to_world, f.p.x, f.p.y, f.p.z),
                       matrix_vector(camera->to_world, f.n.x, f.n.y, f.n.z), (real)(FAR)};
    front = front_moved(scene, front);
    vec2 place = sampler_pair(sampler, (natural)(DIMENSION_LENS));
    LightSample ls = light_sample(scene, front.o, receiver_dull(front.d), u.y, place, lambdas);
    real grows = 1.0f; /* a solid angle where the camera was lowered, over that in the world */
    vec3 to = front_lowered(scene, ls.wi, &grows);
    global const float *m = camera->to_world; /* rigid, so that its transpose leads back */
    vec3 d = v3(-(m[0] * to.x + m[4] * to.y + m[8] * to.z), -(m[1] * to.x + m[5] * to.y + m[9] * to.z),
                -(m[2] * to.x + m[6] * to.y + m[10] * to.z));
    Spectrum share;
    CameraPoint c = lens_ghost_land(scene, camera, f, d, other.y, lambdas, &share);
    mask away = ls.t >= FAR, shine = go & c.seen & (ls.pdf != 0.0f) & mask_of(settings->hide_lights == 0);
    shine = shine & light_shows(scene, ls.row, mask_of(1));
    shine = shine & !(away & mask_of(settings->alpha != 0)); /* the film sees no sky */
    real w = c.importance * grows / sel(shine, fabs(ls.pdf), (real)(1.0f));
    Spectrum value = spectrum_scale(spectrum_mul(ls.radiance, spectrum_mul(camera_start(), share)), w);
    store_shadow_through(shadow, at, shine, camera_through(scene));
#if USES_ABSORPTION
    value = medium_dims(scene, medium_left((integer)(settings->camera_medium)), ls.t, lambdas, value);
#endif
    store_shadow_o(shadow, at, shine, front.o);
    store_shadow_d(shadow, at, shine, ls.wi);
    store_shadow_t(shadow, at, ended, sel(shine, ls.t * SHADOW_SHORTER, (real)(-1.0f)));
    store_shadow_value(shadow, at, shine, value);
    store_shadow_film(shadow, at, shine, c.film);
    return sel_i(shine, (integer)(PATH_SHADOW), (integer)(0));
}

STAGE(flare)(SLAB_ARGS, SCENE_ARGS, BEGIN_ARGS STAGE_AT_ARG)
{
    STAGE_BEGIN
    PathEnd end = path_end(path, hit, at);
    if (any(end.ended)) {
        NextSample next = next_light_path(scene, path, at, BEGIN_PASSED, end);
        mask go = end.ended & !next.done;
        integer state = begin_ghost(scene, path, shadow, at, end.ended, go, next.pixel_index, next.sample);
        store_path_state(path, at, end.ended, sel_i(next.done, (integer)(PATH_DONE), state + 1));
    }
}
