/* Ends what is finished and begins what comes next, for integrators that start at lights: the twin of
 * generate.cl. A slot walks the places of the film as there, but they only count paths: what a path
 * leaves on the film is added where the camera sees it, by splat.cl. */
#include "core/base.cl"
#include "interface/stage.cl"
#include "generated/sampler.cl"
#include "interface/camera.cl"
#include "generated/camera.cl"
#include "film/connect.cl"
#include "generated/connect.cl"
#include "film/film.cl"
#include "interface/shape.cl"
#include "interface/light.cl"
#include "generated/lights.cl"
#include "generated/emission.cl"
#include "generated/shapes.cl"
#include "path/surface.cl"
#include "lighting/next_event.cl"
#include "lighting/light_path.cl"

STAGE(emit)(SLAB_ARGS, SCENE_ARGS, BEGIN_ARGS STAGE_AT_ARG)
{
    SLABS
    SCENE
    STAGE_AT
    int first = samples.x, end = samples.y;
    integer state = load_path_state(path, at), depth = state & PATH_DEPTH;
    mask began = (state & PATH_FRESH) == 0;
    mask missed = began & ((state & PATH_ALIVE) != 0) & (load_hit_prim(hit, at) < 0);
    mask ended = ((state & PATH_DONE) == 0) & (((state & PATH_ALIVE) == 0) | missed);
    if (any(ended)) {
        mask deposit = ended & began;
        count(counters, COUNTER_SAMPLES, deposit, (integer)(1));
        count(counters, COUNTER_CLOSEST, deposit, depth - 1 + sel_i(missed, (integer)(1), (integer)(0)));
        count(counters, COUNTER_SHADOW, deposit, state >> 16);

        /* The next sample of the place, or the next place. */
        int planes = settings->planes, per_plane = settings->per_plane;
        integer slot = LANE_INDEX + (int)at, plane = divide(slot, per_plane);
        integer pixel_index = load_path_pixel_index(path, at), start = plane_sample(plane, planes, first);
        integer sample = load_path_sample(path, at) + planes;
        mask turn = ended & (!began | (sample >= work_list_end(settings, work_list, pixel_index, end)));
        integer next = work_list_next(settings, work_list, turn, began, pixel_index, slot - plane * per_plane, start, end);
        mask done = turn & (next >= settings->padded_pixels);
        pixel_index = sel_i(turn & !done, next, pixel_index);
        sample = sel_i(turn & !done, start, sample);
        mask go = ended & !done;
        store_path_pixel_index(path, at, go, pixel_index);
        store_path_sample(path, at, go, sample);
        count(counters, COUNTER_DONE, done, (integer)(1));

        /* The light's ray. */
        Sampler sampler = light_path_sampler(settings, pixel_index, sample);
        vec2 u = sampler_pair(sampler, (natural)(DIMENSION_WAVELENGTH));
        Wavelengths lambdas = wavelengths_sample(scene, u.x);
        LightRay r = light_emit(scene, u.y, sampler_pair(sampler, (natural)(DIMENSION_FILM)),
                                sampler_pair(sampler, (natural)(DIMENSION_LENS)), lambdas);
        real strength = spectrum_max(r.power);
        mask alive = go & (strength > 0.0f) & mask_of(settings->max_depth > 1);
        Surface s;
        s.p = r.o;
        s.n = r.n;
        store_path_o(path, at, go, sel3(r.away, r.o, surface_offset(s, r.d)));
        store_path_d(path, at, go, r.d);
        store_path_lambdas(path, at, go, lambdas);
        store_path_beta(path, at, go, r.power);
        store_path_weight(path, at, go, 1.0f / max_r(strength, (real)(1e-30f)));
#if USES_ABSORPTION
        store_path_medium(path, at, go, (integer)(0));
#endif
#if USES_DISPERSION
        store_path_ratio(path, at, go, spectrum_of(1.0f));
#endif
        integer shone = 0;
#if USES_VISIBLE_LIGHTS
        /* The light itself, as the camera sees it. */
        vec2 lens = sampler_pair(sampler, (natural)(DIMENSION_VERTEX + DIMENSION_LIGHT));
        CameraPoint c = camera_connect(scene, sel3(r.away, neg3(r.d), r.o), r.away, lens);
        real cosine = sel(r.away, (real)(1.0f), -dot3(r.n, c.d));
        mask shine = go & (c.pixel >= 0) & (cosine > 0.0f) & (spectrum_max(r.seen) > 0.0f) & mask_of(settings->hide_lights == 0);
        connect_camera(shadow, at, ended, shine, s, c, spectrum_scale(r.seen, cosine * c.importance));
        shone = sel_i(shine, (integer)(PATH_SHADOW), (integer)(0));
#endif
        integer begun = sel_i(alive, (integer)(PATH_ALIVE), (integer)(0)) + shone + 1;
        store_path_state(path, at, ended, sel_i(done, (integer)(PATH_DONE), begun));
    }
}
