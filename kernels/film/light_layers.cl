/* Light beside the picture, by the surfaces that it has met and by its lights: sums over all samples like the film's,
 * LIGHT_LAYERS pictures of nine streams of words (core/fixed.cl). Each part of a path's light is added when it is
 * found. The sums of all groups, of direct with indirect light, and of all times, are the picture. Where paths start at
 * lights too, as many pictures of their light follow, which are divided by the number of light paths. */
#include "generated/light_layer_args.cl"

/* Step. */
#include "core/fixed.cl"
#include "generated/seen_wavelengths.cl"
#define LIGHT_PICTURE_WORDS 9

/* Keeps the light that next-event estimation has chosen. */
inline void light_layers_chosen(Slab path, uint at, mask m, integer row)
{
#if LIGHT_LAYER_GROUPS
    store_path_light(path, at, m, row);
#endif
}

inline void light_layer_sum(Scene scene, mask m, integer pixel_index, integer picture, vec3 value,
                            global uint *light_layers)
{
    size_t stream = scene.settings->padded_pixels;
    Fixed sums[3] = {fixed_of(value.x), fixed_of(value.y), fixed_of(value.z)};
    const int *adds = (const int *)&m, *pixels = (const int *)&pixel_index, *pictures = (const int *)&picture;
    const uint *words = (const uint *)sums;
    for (int i = 0; i < LANES; i++) {
        if (!adds[i]) continue;
        global uint *at = light_layers + pictures[i] * LIGHT_PICTURE_WORDS * stream + pixels[i];
        for (int k = 0; k < LIGHT_PICTURE_WORDS; k += 3) {
            const uint *w = words + k * LANES + i;
            sums_add(at + k * stream, stream, w[0], w[LANES], w[2 * LANES]);
        }
    }
}

/* The bin of an optical length [m]; the last is that of all lengths outside of the range. */
inline integer time_bin(global const Settings *settings, real length)
{
    real at = (length - settings->time_first) * settings->time_rate;
    mask inside = (at >= 0.0f) & (at < (float)settings->time_bins);
    return sel_i(inside, to_integer(sel(inside, at, (real)(0.0f))), (integer)(settings->time_bins));
}

/* Adds light from the light in row `row` of `lights`, after as many surfaces and an optical length [m], to the layers
 * from picture `first` on. */
inline void light_layers_sum(Scene scene, mask m, integer pixel_index, integer surfaces, integer row, real length,
                             int first, vec3 v, global uint *light_layers)
{
    m = m & (fabs(v.x) + fabs(v.y) + fabs(v.z) < FIXED_LARGEST); /* false for a value that is not finite */
    if (!any(m)) return;
    v = sel3(m, v, v3(0.0f, 0.0f, 0.0f));
    mask direct = surfaces <= 1;
    int of_direct = scene.settings->layer_direct, of_indirect = scene.settings->layer_indirect;
    int of_groups = scene.settings->layer_groups, of_times = scene.settings->layer_times;
    if (of_direct) light_layer_sum(scene, m & direct, pixel_index, (integer)(first + of_direct - 1), v, light_layers);
    if (of_indirect)
        light_layer_sum(scene, m & !direct, pixel_index, (integer)(first + of_indirect - 1), v, light_layers);
    if (of_groups) {
        integer number = scene.settings->light_groups + sel_i(m, row, (integer)(0));
        integer group = to_integer(gather(scene.distributions, number));
        light_layer_sum(scene, m, pixel_index, first + of_groups - 1 + group, v, light_layers);
    }
    if (of_times)
        light_layer_sum(scene, m, pixel_index, of_times - 1 + time_bin(scene.settings, length), v, light_layers);
}

/* Adds light that arrives at the camera from the light in row `row` of `lights`, after as many surfaces and an optical
 * length [m]. */
inline void light_layers_add(Scene scene, Slab path, uint at, mask m, integer surfaces, integer row, real length,
                             Spectrum light LIGHT_LAYER_ARGS)
{
    Wavelengths lambdas = seen_wavelengths(scene, path, at, load_path_lambdas(path, at));
    vec3 v = scale3(film_value(scene, light, lambdas), load_path_weight(path, at) * scene.settings->film_scale);
    light_layers_sum(scene, m, load_path_pixel_index(path, at), surfaces, row, length, 0, v, light_layers);
}

/* Twin, where there are none. */
inline void light_layers_add(Scene scene, Slab path, uint at, mask m, integer surfaces, integer row, real length,
                             Spectrum light LIGHT_LAYER_ARGS) {}
inline void light_layers_chosen(Slab path, uint at, mask m, integer row) {}
