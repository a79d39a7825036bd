/* Ends what is finished and begins what comes next: a path that missed gathers the light from
 * infinity, a path that ended is put on the film, and its slot starts the next sample of its list. */
#include "core/base.cl"
#include "interface/stage.cl"
#include "generated/sampler.cl"
#include "interface/camera.cl"
#include "generated/camera.cl"
#include "film/filter.cl"
#include "film/film.cl"
#include "generated/bands.cl"
#include "interface/shape.cl"
#include "interface/light.cl"
#include "generated/lights.cl"
#include "generated/medium.cl"

STAGE(generate)(SLAB_ARGS, SCENE_ARGS, BEGIN_ARGS STAGE_AT_ARG)
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
        Spectrum radiance = load_path_radiance(path, at);
        Wavelengths lambdas = load_path_lambdas(path, at);
#if USES_INFINITE
        mask sky = missed & ((depth > 0) | mask_of(settings->hide_lights == 0));
        if (any(sky)) {
            real pdf = load_path_pdf(path, at);
            vec3 d = sel3(sky, load_path_d(path, at), v3(0.0f, 0.0f, 1.0f)); /* a slot without a pixel has none */
            Spectrum arrives = infinite_gather(scene, load_path_sampled_hemisphere(path, at), d, pdf, lambdas);
#if USES_ABSORPTION
            integer medium = sel_i(sky, load_path_medium(path, at), (integer)(0));
            arrives = spectrum_mul(arrives, medium_transmittance(scene, medium, (real)(FAR), lambdas));
#endif
            radiance = spectrum_sel(sky, spectrum_add(radiance, spectrum_mul(load_path_beta(path, at), arrives)), radiance);
        }
#endif
        /* Deposit. */
        integer pixel_index = load_path_pixel_index(path, at), sample = load_path_sample(path, at);
        Exposure e = {load_path_sum(path, at), load_path_compensation(path, at), load_path_samples(path, at)};
        mask deposit = ended & began;
#if USES_FLUORESCENCE /* the film sees the camera's wavelengths, not those by which the light came */
        Sampler began_with = pixel_sampler(settings, pixel_index, sample);
        lambdas = wavelengths_sample(scene, sampler_pair(began_with, (natural)(DIMENSION_WAVELENGTH)).x);
#endif
        vec3 value = film_value(scene, radiance, lambdas);
        real weight = load_path_weight(path, at);
        mask sane = deposit & (fabs(value.x) + fabs(value.y) + fabs(value.z) < 1e30f); /* false for NaN */
        weight = sel(sane, weight, (real)(0.0f));
        value = sel3(sane, value, v3(0.0f, 0.0f, 0.0f));
        sum_add(&e.sum.x, &e.compensation.x, value.x * weight);
        sum_add(&e.sum.y, &e.compensation.y, value.y * weight);
        sum_add(&e.sum.z, &e.compensation.z, value.z * weight);
        e.samples += 1.0f;
#if USES_BANDS
        integer own = divide(LANE_INDEX + (int)at, settings->per_plane);
        bands_add(scene, bands, sane, own, pixel_index, radiance, lambdas, weight);
#endif
        count(counters, COUNTER_SAMPLES, deposit, (integer)(1));
        count(counters, COUNTER_CLOSEST, deposit, depth + sel_i(missed, (integer)(1), (integer)(0)));
        count(counters, COUNTER_SHADOW, deposit, state >> 16);
        count(counters, COUNTER_REJECTED, deposit & !sane, (integer)(1));

        /* The next sample of the place, or the next place. */
        int planes = settings->planes, per_plane = settings->per_plane;
        integer slot = LANE_INDEX + (int)at, plane = divide(slot, per_plane);
        integer start = plane_sample(plane, planes, first);
        sample += planes;
        mask turn = ended & (!began | (sample >= work_list_end(settings, work_list, pixel_index, end)));
        mask done = (integer)(0);
        if (any(turn)) {
            film_store(settings, film, turn & began, plane, pixel_index, e);
            integer next = work_list_next(settings, work_list, turn, began, pixel_index, slot - plane * per_plane, start, end);
            done = turn & (next >= settings->padded_pixels);
            mask begin = turn & !done;
            pixel_index = sel_i(begin, next, pixel_index);
            sample = sel_i(begin, start, sample);
            if (any(begin)) {
                Exposure next_pixel = film_load(settings, film, begin, plane, pixel_index);
                e.sum = sel3(begin, next_pixel.sum, e.sum);
                e.compensation = sel3(begin, next_pixel.compensation, e.compensation);
                e.samples = sel(begin, next_pixel.samples, e.samples);
            }
            store_path_pixel_index(path, at, begin, pixel_index);
            count(counters, COUNTER_DONE, done, (integer)(1));
        }
        mask go = ended & !done;
        store_path_sample(path, at, go, sample);
        store_path_sum(path, at, go, e.sum);
        store_path_compensation(path, at, go, e.compensation);
        store_path_samples(path, at, go, e.samples);

        /* The camera's ray. */
        vec2 pixel = pixel_of_index(settings, pixel_index);
        Sampler sampler = pixel_sampler(settings, pixel_index, sample);
        vec2 offset;
        filter_sample(scene, sampler_pair(sampler, (natural)(DIMENSION_FILM)), &offset, &weight);
        vec2 position = film_position(settings, pixel, offset);
        lambdas = wavelengths_sample(scene, sampler_pair(sampler, (natural)(DIMENSION_WAVELENGTH)).x);
        CameraRay ray = camera_ray(scene, position, sampler_pair(sampler, (natural)(DIMENSION_LENS)), lambdas);
        store_path_weight(path, at, go, weight);
        store_path_o(path, at, go, ray.o);
        store_path_d(path, at, go, ray.d);
        store_path_lambdas(path, at, go, lambdas);
        store_path_beta(path, at, go, camera_start());
        store_path_radiance(path, at, go, spectrum_of(0.0f));
        store_path_pdf(path, at, go, -ray.far);
        store_path_eta(path, at, go, (real)(1.0f));
#if USES_ABSORPTION
        store_path_medium(path, at, go, (integer)(0));
#endif
#if USES_DISPERSION
        store_path_ratio(path, at, go, camera_start());
#endif
        store_path_state(path, at, ended, sel_i(done, (integer)(PATH_DONE), (integer)(PATH_ALIVE)));
    }
}
